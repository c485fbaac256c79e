"""Stems from photos: find them, fit them, explain them away."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...core.intervals import HALF_WIDTH_SE
from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from .deduplicate import APART_M, known_rows, looked_at_twice, merge, not_swallowed, plausible, without_open_diameter
from .evidence.ivy import without_covered
from .fit.edge_adjustment import NO_STEMS
from .fit.photo_fit import PhotoFit
from .images.crops import GroundGrid, PhotoStack, load_stack
from .images.vertical_rectification import PlumbGrid, make_map, plumb_grid
from .low_confidence import settled_by_network
from .network.inference import network_maps
from .options import PhotoStemOptions
from .propose.edge_voting import Detector, Seed, lean_grid
from .propose.network_seeds import network_seeds
from .propose.space_carving import carved_seeds, hidden_ground, searched
from .stem_fit import Fitter
from .targeted_fit import GivenStems, fits_of_given
from .tile_calibration import MORE_PLACES, Look, away_from, first_look, look_of, random_places, with_chance
from .tiles import split
from .upper_stem import carried_down

#: Seeds this far below what chance reaches are still fitted (log likelihood units), and how many at most.
REACH_BELOW = 22.0
MOST_SEEDS = 90
#: A lean costs seeds this much (log likelihood units per (m/m)^2).
LEAN_COST = 60.0
#: Local maxima this close are looked at for second stems within the next distance of a found one, and at most so many.
BESIDE_M, COMPANION_M, MOST_COMPANIONS = 0.2, 0.6, 40
#: The first search takes leans up to this, degrees; the rest is for the second (:mod:`.propose.space_carving`).
UPRIGHT_MOST_DEG = 10.0
#: Share of the seen stems that are certain by their edges, from which the network is not asked for more (``auto``).
ENOUGH_CERTAIN = 0.75


@dataclass(frozen=True)
class Searched:
    """fits: the stems, best first. looks: what was learnt of each piece of ground (:func:`.tiles.split`), ``None``
    where too few photos see it."""

    fits: list[PhotoFit]
    looks: list[Look | None]


def stems_from_photos(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    area: Area,
    options: PhotoStemOptions | None = None,
    reporter: Reporter | None = None,
) -> list[PhotoFit]:
    """The stems of :func:`search_photos`."""
    return search_photos(views, ground, area, options, reporter).fits


def search_photos(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    area: Area,
    options: PhotoStemOptions | None = None,
    reporter: Reporter | None = None,
    given: GivenStems | None = None,
) -> Searched:
    """Find and fit the stems of an area straight in the photos.

    views: registered photos (oblique ones are used). ground: function of local x, y (N,) -> local z (N,), NaN where
    unknown. area: circles; stems up to ``options.margin_m`` outside are found too. Refused stems stay in the list with
    flag "reject" and reasons. given: stems that are known to stand there; each that the search does not find by itself
    is looked for at its place, and stays in the list with its reason where it cannot be measured.

    Raises:
        InputError: no ground in the area, or a photo of another size than its camera.
    """
    options, reporter = options or PhotoStemOptions(), reporter or Reporter()
    if options.threads:
        import numba

        numba.set_num_threads(min(options.threads, numba.config.NUMBA_NUM_THREADS))
    found: list[PhotoFit] = []
    looks: list[Look | None] = []
    tiles = split(area, options.margin_m)
    for index, (tile, box) in enumerate(tiles):
        with reporter.stage(
            f"stems in the photos ({index + 1} of {len(tiles)})", index / len(tiles), (index + 1) / len(tiles)
        ):
            fits, look = _tile(views, ground, area, tile, box, options, reporter, given)
            found += fits
            looks.append(look)
    return Searched([without_open_diameter(fit) for fit in merge(found)], looks)


def certain_stems(fits: list[PhotoFit], area: Area, min_dbh_cm: float) -> tuple[int, int]:
    """How many stems in an area are ``ok``, and how many are seen, one entry a stem; those whose whole interval lies
    below ``min_dbh_cm`` count as certain."""
    places = np.array([fit.axis.p for fit in fits]).reshape(-1, 2)
    within = merge([fit for fit, inside in zip(fits, area.contains(places, 0.0), strict=True) if inside])
    thin = [fit.dbh_cm + HALF_WIDTH_SE * fit.se_cm < min_dbh_cm for fit in within]
    return sum(fit.flag == "ok" or small for fit, small in zip(within, thin, strict=True)), len(within)


def _tile(
    views: list[View],
    ground: Callable,
    area: Area,
    tile: Area,
    box: tuple,
    options: PhotoStemOptions,
    reporter: Reporter,
    given: GivenStems | None,
) -> tuple[list[PhotoFit], Look | None]:
    rng = np.random.default_rng(options.seed)
    grid, stack = photos_of(views, ground, tile, options, reporter)
    if len(stack) < 3:
        reporter.warn(f"Only {len(stack)} oblique photos see the plot; no stem can be measured in them.")
        return [], None
    reporter.progress(0.1)
    plumbs = grids_of(stack, grid, tile, options)
    detector = _detector(stack, grid, plumbs, area, box, options)
    seeds, beside, gate = _edge_seeds(detector, area, options, rng)
    reporter.progress(0.5)
    places = random_places(tile, rng)
    fitter = first_look(stack, grid, tile, seeds, gate, places, options, reporter)
    reporter.progress(0.55)
    with reporter.stage("fit stems", 0.55, 0.7):
        by_edges = fits = _fitted(fitter, [], seeds, beside, gate, reporter)
        if options.stem_network == "auto":
            options = replace(options, stem_network=_asked(fits, tile, options.min_dbh_cm, reporter))
            fitter = replace(fitter, options=options)
    if options.stem_network == "full":
        shown = network_maps(stack, plumbs)
        seen = network_seeds(shown, grid, area, box, options, rng)
        fitter = with_chance(replace(fitter, shown=shown), away_from(seen, random_places(tile, rng, MORE_PLACES)))
        with reporter.stage("fit stems", 0.7, 0.85):
            fits = not_swallowed(_fitted(fitter, seen, seeds, beside, gate, reporter), by_edges)
    if options.max_lean_deg > UPRIGHT_MOST_DEG:
        fits += _carved(fitter, area, box, fits, reporter)
    if given is not None:
        fits += fits_of_given(fitter, given.within(area, box, options.margin_m), fits, reporter)
    if options.stem_network == "low-confidence":
        with reporter.stage("stems of low confidence", 0.9, 0.95):
            fits = settled_by_network(fits, fitter, plumbs, tile, reporter)
    with reporter.stage("stems seen farther up", 0.95, 1.0):
        fits = carried_down(fits, fitter, reporter)
    if options.stem_network != "off":
        fits = without_covered(fits, stack, plumbs)
    return with_photos(fits, stack), look_of(fitter, gate, places)


def _edge_seeds(
    detector: Detector, area: Area, options: PhotoStemOptions, rng: np.random.Generator
) -> tuple[list[Seed], list[Seed], float]:
    """Where edges say stems are, clearest first; the same more densely; the score that chance hardly reaches."""
    total, chance = detector.accumulate(rng)
    leans = lean_grid(min(options.max_lean_deg, UPRIGHT_MOST_DEG))
    lines = detector.lines(total, leans, LEAN_COST)
    seeds, beside = (detector.peaks(lines, leans, apart) for apart in (APART_M, BESIDE_M))
    decoys = detector.seeds(chance, leans, APART_M, LEAN_COST)
    gate = max(8.0, decoys[0].score + 3.0 if decoys else 0.0)
    near = area.contains(np.array([(seed.x, seed.y) for seed in seeds]).reshape(-1, 2), options.margin_m + 0.1)
    return [seed for seed, keep in zip(seeds, near, strict=True) if keep], beside, gate


def _fitted(
    fitter: Fitter, seen: list[Seed], seeds: list[Seed], beside: list[Seed], gate: float, reporter: Reporter
) -> list[PhotoFit]:
    """Stems at what the network sees, at the seeds of the search for edges, and second ones beside them."""
    fits = _pursue(fitter, seen, 1.0, reporter)
    fits += _pursue(fitter, seeds, gate, reporter, known_rows(fits))
    return fits + _companions(fitter, beside, seeds, gate, fits, reporter)


def _asked(fits: list[PhotoFit], tile: Area, min_dbh_cm: float, reporter: Reporter) -> str:
    """What the network is asked on a piece of ground whose edges gave these fits (``auto``)."""
    certain, seen = certain_stems(fits, tile, min_dbh_cm)
    if certain >= ENOUGH_CERTAIN * seen:
        return "low-confidence"
    reporter.info(f"{certain} of {seen} stems are certain by their edges: the network is asked for stems as well.")
    return "full"


def with_photos(fits: list[PhotoFit], stack: PhotoStack) -> list[PhotoFit]:
    """The fits with the names of the photos that they were looked at in."""
    names = tuple(view.name for view in stack.views)
    return [replace(fit, photos=names) for fit in fits]


def photos_of(
    views: list[View], ground: Callable, tile: Area, options: PhotoStemOptions, reporter: Reporter
) -> tuple[GroundGrid, PhotoStack]:
    """The ground and the photos of a tile, as its stems are looked for in them."""
    grid = GroundGrid.sample(ground, tile, options.margin_m + 2.0)
    return grid, load_stack(views, tile, grid, options.max_views, options.margin_m + 1.0, reporter)


def _carved(fitter: Fitter, area: Area, box: tuple, fits: list[PhotoFit], reporter: Reporter) -> list[PhotoFit]:
    """Stems that the search for edges missed, above all leaning ones (:mod:`.propose.space_carving`)."""
    if fitter.backdrop is None:
        return []
    known, (x0, y0, rows, columns) = known_rows(fits), searched(box)
    layers = hidden_ground(fitter.stack, fitter.ground, fitter.backdrop, x0, y0, rows, columns)
    seeds = carved_seeds(layers, (x0, y0), fitter.ground, fitter.outline, area, fitter.options, known, fitter.chance)
    refused = [fit for fit in fits if not fit.measured]
    return looked_at_twice(_pursue(fitter, seeds, 1.0, reporter, known), refused)


def _companions(
    fitter: Fitter, beside: list[Seed], tried: list[Seed], gate: float, fits: list[PhotoFit], reporter: Reporter
) -> list[PhotoFit]:
    """Second stems close to found ones (limbs of low forks, twins), which the first round's spacing passed over."""
    known = known_rows(fits)
    done = np.array([(seed.x, seed.y) for seed in tried]).reshape(-1, 2)
    close = []
    for seed in beside:
        gap = np.hypot(known[:, 0] - seed.x, known[:, 1] - seed.y)
        again = (np.hypot(done[:, 0] - seed.x, done[:, 1] - seed.y) < 0.02).any()
        if seed.score > gate and not again and (gap < COMPANION_M).any():
            close.append(seed)
    return _pursue(fitter, close[:MOST_COMPANIONS], gate, reporter, known)


def _pursue(
    fitter: Fitter, seeds: list[Seed], gate: float, reporter: Reporter, known: np.ndarray = NO_STEMS
) -> list[PhotoFit]:
    """Fit the seeds, strongest first; what a fitted stem explains is hidden from the later ones."""
    fits: list[PhotoFit] = []
    waiting = [seed for seed in seeds if seed.score > gate - REACH_BELOW][:MOST_SEEDS]
    for tried, seed in enumerate(waiting):
        reporter.progress(tried / len(waiting))
        if (np.hypot(known[:, 0] - seed.x, known[:, 1] - seed.y) < known[:, 8] + 0.08).any():
            continue
        fit = fitter.fit(seed, known)
        if fit is None and seed.sure:
            fit = fitter.refused(seed)
        if fit is None or not (seed.sure or plausible(fit, gate)):
            continue
        fits.append(fit)
        if fit.measured:
            known = np.vstack([known, fit.row])
    return fits


def grids_of(stack: PhotoStack, grid: GroundGrid, tile: Area, options: PhotoStemOptions) -> list[PlumbGrid]:
    """Of each photo: the grid of its map over the piece of ground."""
    outline = np.vstack([tile.outline(options.margin_m + 1.0), tile.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    return [plumb_grid(stack, view, points) for view in range(len(stack))]


def _detector(
    stack: PhotoStack, grid: GroundGrid, plumbs: list[PlumbGrid], area: Area, box: tuple, options: PhotoStemOptions
) -> Detector:
    maps = (make_map(stack, view, grid, plumb) for view, plumb in enumerate(plumbs))
    # Leaning stems need the cells around the area too, to carry their upper layers.
    edge = 0.5
    x0, y0 = box[0] - edge, box[1] - edge
    columns = int((box[2] - box[0] + 2 * edge) / options.cell_m) + 1
    rows = int((box[3] - box[1] + 2 * edge) / options.cell_m) + 1
    gx, gy = np.meshgrid(x0 + options.cell_m * np.arange(columns), y0 + options.cell_m * np.arange(rows))
    mask = area.contains(np.column_stack([gx.ravel(), gy.ravel()]), options.margin_m + edge).reshape(gx.shape)
    radii = np.arange(0.04, options.max_dbh_cm / 200 + 0.01, 0.025)
    return Detector(maps, radii, grid, x0, y0, options.cell_m, mask, options.bh_m)
