"""Stems from photos: find them, fit them, explain them away."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..core.intervals import HALF_WIDTH_SE
from ..core.progress import Reporter
from ..reconstruction.area import Area
from ..reconstruction.cameras import View
from ..trees.limits import judge
from .backdrop import Silhouette, make_backdrop
from .carving import carved_seeds, hidden_ground, searched
from .covered import without_covered
from .detect import Detector, Seed, lean_grid
from .fine import NO_STEMS
from .fit import Fitter, PhotoFit, Prior, build_null
from .network_seeds import network_seeds
from .options import PhotoStemOptions
from .plumb import make_map
from .stack import GroundGrid, PhotoStack, load_stack
from .stem_net import network_maps
from .strips import StemAxis
from .sun import sun_azimuths
from .tiles import split
from .verdict import GAIN_MERGED

#: Seeds this far below what chance reaches are still fitted (log likelihood units), and how many at most.
REACH_BELOW = 22.0
MOST_SEEDS = 90
#: Seeds are this far apart (m), and a lean costs them this much (log likelihood units per (m/m)^2).
APART_M, LEAN_COST = 0.4, 60.0
#: Explanations of one stem from two seeds whose edge scores are closer than this are rivals (log likelihood units).
RIVAL_LLR = 30.0
#: Two looks at one stem: as far apart in lean (tangent) and in diameter (share), at most.
SAME_LEAN, SAME_DBH = 0.09, 0.04
#: Local maxima this close are looked at for second stems within the next distance of a found one, and at most so many.
BESIDE_M, COMPANION_M, MOST_COMPANIONS = 0.2, 0.6, 40
#: The first search takes leans up to this, degrees; the rest is for the second (:mod:`.carving`).
UPRIGHT_MOST_DEG = 10.0
#: Stems fitted quickly at first, to learn the sun's direction and the stand's diameters.
FIRST_LOOK = 30
#: Random places at which the silhouettes of no stem are measured, where the network says where stems are; how far from
#: these; and how many are needed.
MORE_PLACES, STEM_FREE_M, LEAST_PLACES = 32, 0.7, 8
#: Share of the seen stems that are certain by their edges, from which the network is not asked for more (``auto``), and
#: the part of the work that finding this out is.
ENOUGH_CERTAIN, FIRST_PART = 0.75, 0.4
#: The ground is looked at this far beyond the searched area: photos see it behind the stems at its rim.
BACKDROP_MARGIN_M = 3.0


def stems_from_photos(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    area: Area,
    options: PhotoStemOptions | None = None,
    reporter: Reporter | None = None,
) -> list[PhotoFit]:
    """Find and fit the stems of an area straight in the photos.

    views: registered photos (oblique ones are used). ground: function of local x, y (N,) -> local z (N,), NaN where
    unknown. area: circles; stems up to ``options.margin_m`` outside are found too. Refused stems stay in the list with
    flag "reject" and reasons.

    Raises:
        InputError: no ground in the area, or a photo of another size than its camera.
    """
    options, reporter = options or PhotoStemOptions(), reporter or Reporter()
    if options.threads:
        import numba

        numba.set_num_threads(min(options.threads, numba.config.NUMBA_NUM_THREADS))
    if options.stem_network != "auto":
        return _stems(views, ground, area, options, reporter)
    with reporter.stage("fit stems", 0.0, FIRST_PART):
        fits = _stems(views, ground, area, replace(options, stem_network="ivy"), reporter)
    certain, seen = certain_stems(fits, area)
    if certain >= ENOUGH_CERTAIN * seen:
        return fits
    reporter.info(f"{certain} of {seen} stems are certain by their edges: the network is asked for stems as well.")
    with reporter.stage("fit stems", FIRST_PART, 1.0):
        return _stems(views, ground, area, replace(options, stem_network="full"), reporter)


def certain_stems(fits: list[PhotoFit], area: Area) -> tuple[int, int]:
    """How many stems in an area are ``ok``, and how many are seen; too small ones count as certain."""
    places = np.array([fit.axis.p for fit in fits]).reshape(-1, 2)
    within = [fit for fit, inside in zip(fits, area.contains(places, 0.0), strict=True) if inside]
    return sum(fit.flag == "ok" or fit.reasons == ("too_small",) for fit in within), len(within)


def _stems(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    area: Area,
    options: PhotoStemOptions,
    reporter: Reporter,
) -> list[PhotoFit]:
    found: list[PhotoFit] = []
    tiles = split(area, options.margin_m)
    for index, (tile, box) in enumerate(tiles):
        with reporter.stage(
            f"stems in the photos ({index + 1} of {len(tiles)})", index / len(tiles), (index + 1) / len(tiles)
        ):
            found += _tile(views, ground, area, tile, box, options, reporter)
    return [without_open_diameter(fit) for fit in merge(found)]


def without_open_diameter(fit: PhotoFit) -> PhotoFit:
    """Refused, if its explanations leave the diameter open. To be asked at the end: a place that is explained, however
    unsure its diameter, is not to be explained again by another seed."""
    if not fit.measured or np.isnan(fit.lo_cm):
        return fit
    found = judge("photos", {"open_se_cm": fit.se_cm}, fit.dbh_cm)
    return replace(fit, flag="reject", reasons=(*fit.reasons, *found.reasons)) if found.refused else fit


def _tile(
    views: list[View],
    ground: Callable,
    area: Area,
    tile: Area,
    box: tuple,
    options: PhotoStemOptions,
    reporter: Reporter,
) -> list[PhotoFit]:
    rng = np.random.default_rng(options.seed)
    grid, stack = photos_of(views, ground, tile, options, reporter)
    if len(stack) < 3:
        reporter.warn(f"Only {len(stack)} oblique photos see the plot; no stem can be measured in them.")
        return []
    reporter.progress(0.1)
    detector = _detector(stack, grid, area, tile, box, options)
    total, chance = detector.accumulate(rng)
    reporter.progress(0.5)
    leans = lean_grid(min(options.max_lean_deg, UPRIGHT_MOST_DEG))
    lines = detector.lines(total, leans, LEAN_COST)
    seeds, beside = (detector.peaks(lines, leans, apart) for apart in (APART_M, BESIDE_M))
    decoys = detector.seeds(chance, leans, APART_M, LEAN_COST)
    del total, chance, lines
    gate = max(8.0, decoys[0].score + 3.0 if decoys else 0.0)
    near = area.contains(np.array([(seed.x, seed.y) for seed in seeds]).reshape(-1, 2), options.margin_m + 0.1)
    seeds = [seed for seed, keep in zip(seeds, near, strict=True) if keep]
    shown = network_maps(stack, detector.maps) if options.stem_network == "full" else None
    seen = [] if shown is None else network_seeds(shown, grid, area, box, options, rng)
    fitter = _first_look(stack, grid, tile, seeds, gate, rng, options)
    if shown is not None:
        fitter = _with_chance(replace(fitter, shown=shown), away_from(seen, _random_places(tile, rng, MORE_PLACES)))
    reporter.progress(0.6)
    with reporter.stage("fit stems", 0.6, 0.85):
        fits = _pursue(fitter, seen, 1.0, reporter)
        fits += _pursue(fitter, seeds, gate, reporter, known_rows(fits))
        fits += _companions(fitter, beside, seeds, gate, fits, reporter)
    if options.max_lean_deg > UPRIGHT_MOST_DEG:
        fits += _carved(fitter, area, box, fits, reporter)
    if options.stem_network != "off":
        fits = without_covered(fits, stack, detector.maps)
    names = tuple(view.name for view in stack.views)
    return [replace(fit, photos=names) for fit in fits]


def photos_of(
    views: list[View], ground: Callable, tile: Area, options: PhotoStemOptions, reporter: Reporter
) -> tuple[GroundGrid, PhotoStack]:
    """The ground and the photos of a tile, as its stems are looked for in them."""
    grid = GroundGrid.sample(ground, tile, options.margin_m + 2.0)
    return grid, load_stack(views, tile, grid, options.max_views, options.margin_m + 1.0, reporter)


def _carved(fitter: Fitter, area: Area, box: tuple, fits: list[PhotoFit], reporter: Reporter) -> list[PhotoFit]:
    """Stems that the search for edges missed, above all leaning ones (:mod:`.carving`)."""
    if fitter.backdrop is None:
        return []
    known, (x0, y0, rows, columns) = known_rows(fits), searched(box)
    layers = hidden_ground(fitter.stack, fitter.ground, fitter.backdrop, x0, y0, rows, columns)
    seeds = carved_seeds(layers, (x0, y0), fitter.ground, fitter.outline, area, fitter.options, known, fitter.chance)
    refused = [fit for fit in fits if not fit.measured]
    return looked_at_twice(_pursue(fitter, seeds, 1.0, reporter, known), refused)


def looked_at_twice(found: list[PhotoFit], refused: list[PhotoFit]) -> list[PhotoFit]:
    """What the second search found, less what the first look had refused as the same stem (place and lean) with another
    diameter: neither is to be trusted. With the same diameter it is flagged (``ambiguous``)."""
    kept = []
    for fit in found:
        before = [
            other
            for other in refused
            if np.hypot(*(fit.axis.p - other.axis.p)) < APART_M and np.hypot(*(fit.axis.s - other.axis.s)) < SAME_LEAN
        ]
        if any(abs(fit.dbh_cm - other.dbh_cm) > max(1.0, SAME_DBH * fit.dbh_cm) for other in before):
            continue
        unclear = bool(before) and fit.flag == "ok"
        kept.append(replace(fit, flag="check", reasons=(*fit.reasons, "ambiguous")) if unclear else fit)
    return kept


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


def known_rows(fits: list[PhotoFit]) -> np.ndarray:
    """(K, 10) of the measured stems, for :func:`.strips.hide_known`."""
    return np.array([fit.row for fit in fits if fit.measured]).reshape(-1, 10)


def _first_look(
    stack: PhotoStack,
    grid: GroundGrid,
    tile: Area,
    seeds: list[Seed],
    gate: float,
    rng: np.random.Generator,
    options: PhotoStemOptions,
) -> Fitter:
    """Fit the clearest stems once to learn where the sun stood and how thick the stand's stems are."""
    places = _random_places(tile, rng)
    unknown = np.full(max(view.flight for view in stack.views) + 1, np.nan)
    fitter = Fitter(stack, grid, options, build_null(stack, grid, places, options, unknown), unknown)
    clear = [
        fit
        for fit in (fitter.fit(seed, quick=True) for seed in seeds[:FIRST_LOOK] if seed.score > gate)
        if fit and fit.llr > 40
    ]
    sun = sun_azimuths(stack, [(fit.axis, fit.r0, fit.seen) for fit in clear])
    prior = Prior()
    radii = np.array([fit.r0 for fit in clear])
    if len(radii) >= 6:
        prior = Prior(r=float(np.median(radii)), r_sd=float(max(2.0 * radii.std(), 0.06)))
    null = build_null(stack, grid, places, options, sun) if np.isfinite(sun).any() else fitter.null
    backdrop = make_backdrop(stack, grid, tile.bounds(options.margin_m + BACKDROP_MARGIN_M))
    fitter = Fitter(stack, grid, options, null, sun, prior, backdrop)
    return _with_chance(fitter, places)


def _with_chance(fitter: Fitter, places: np.ndarray) -> Fitter:
    """The same, with the contrast that chance reaches at (N, 2) places."""
    if fitter.backdrop is None:
        return fitter
    chance = chance_contrast(fitter.outline, fitter.ground, places, fitter.null.radii, fitter.options.bh_m)
    return replace(fitter, chance=chance)


def away_from(seeds: list[Seed], places: np.ndarray) -> np.ndarray:
    """Those of (N, 2) places that lie away from all seeds; all, if there are few of these."""
    if not seeds:
        return places
    gap = np.min([np.hypot(places[:, 0] - seed.x, places[:, 1] - seed.y) for seed in seeds], axis=0)
    return places[gap > STEM_FREE_M] if (gap > STEM_FREE_M).sum() >= LEAST_PLACES else places


def chance_contrast(
    outline_of: Callable[[StemAxis], Silhouette], ground: GroundGrid, places: np.ndarray, radii: np.ndarray, bh_m: float
) -> float:
    """Silhouette contrast that a place without a stem hardly reaches: twice the median of the best at (N, 2) random
    places (a few of which may well hold a stem)."""
    best = []
    for place in places:
        foot = float(ground.at(place[:1], place[1:])[0])
        outline = outline_of(StemAxis(place, np.zeros(2), np.zeros(2), foot, bh_m))
        best.append(max((outline.contrast(shape) for shape in outline.peaks(radii, most=1)), default=0.0))
    return 2.0 * max(float(np.median(best)), 1e-6)


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


def plausible(fit: PhotoFit, gate: float) -> bool:
    """Is this a stem at all? What the search itself did not find has to be seen the more clearly in the fit."""
    if fit.contrast > 1.0 and fit.llr >= 12:
        return fit.seed_score >= gate or fit.measured
    if fit.seed_score >= gate:
        return fit.llr >= 30
    return fit.llr >= 60 and fit.measured


def _detector(
    stack: PhotoStack, grid: GroundGrid, area: Area, tile: Area, box: tuple, options: PhotoStemOptions
) -> Detector:
    outline = np.vstack([tile.outline(options.margin_m + 1.0), tile.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    maps = [make_map(stack, view, grid, points) for view in range(len(stack))]
    # Leaning stems need the cells around the area too, to carry their upper layers.
    edge = 0.5
    x0, y0 = box[0] - edge, box[1] - edge
    columns = int((box[2] - box[0] + 2 * edge) / options.cell_m) + 1
    rows = int((box[3] - box[1] + 2 * edge) / options.cell_m) + 1
    gx, gy = np.meshgrid(x0 + options.cell_m * np.arange(columns), y0 + options.cell_m * np.arange(rows))
    mask = area.contains(np.column_stack([gx.ravel(), gy.ravel()]), options.margin_m + edge).reshape(gx.shape)
    radii = np.arange(0.04, options.max_dbh_cm / 200 + 0.01, 0.025)
    return Detector(maps, [], radii, grid, x0, y0, options.cell_m, mask, options.bh_m)


def _random_places(tile: Area, rng: np.random.Generator, n: int = 16) -> np.ndarray:
    k = rng.integers(len(tile.radii_m), size=n)
    angle, far = rng.uniform(0, 2 * np.pi, n), np.sqrt(rng.uniform(size=n))
    return tile.centres[k] + (tile.radii_m[k] * far)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def merge(fits: list[PhotoFit]) -> list[PhotoFit]:
    """One entry a stem: measured ones first, best first; what overlaps a better one is dropped. One that is nearly as
    good and reads another diameter widens the error of the better one by half of the difference."""
    kept: list[PhotoFit] = []
    for fit in sorted(fits, key=lambda f: (not f.measured, -single_llr(f))):
        near = [n for n, k in enumerate(kept) if np.hypot(*(fit.axis.p - k.axis.p)) < 0.7 * (fit.r0 + k.r0) + 0.05]
        if not near:
            kept.append(fit)
            continue
        best = kept[near[0]]
        apart = abs(fit.dbh_cm - best.dbh_cm)
        rival = fit.measured and single_llr(fit) > single_llr(best) - RIVAL_LLR
        if rival and apart > max(1.0, SAME_DBH * best.dbh_cm):
            se = float(np.hypot(best.se_cm, 0.5 * apart))
            low, high = best.dbh_cm - HALF_WIDTH_SE * se, best.dbh_cm + HALF_WIDTH_SE * se
            reasons = tuple(dict.fromkeys([*best.reasons, "ambiguous"]))
            kept[near[0]] = replace(best, flag="check", reasons=reasons, se_cm=se, lo_cm=max(low, 0.0), hi_cm=high)
    return kept


def single_llr(fit: PhotoFit) -> float:
    """Edge score of the best single stem at the place: two stems explain any place better than one."""
    return fit.llr - fit.gain if fit.gain > GAIN_MERGED else fit.llr
