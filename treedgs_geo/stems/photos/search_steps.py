"""The steps of a search of one piece of ground; :mod:`.route` has their order and says when each is needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from .deduplicate import known_rows, looked_at_twice, not_swallowed, plausible
from .evidence.ivy import without_covered
from .fit.edge_adjustment import NO_STEMS
from .fit.photo_fit import PhotoFit
from .images.crops import GroundGrid, PhotoStack, load_stack
from .images.vertical_rectification import PlumbGrid, plumb_grid
from .low_confidence import settled_by_network
from .network.inference import OddsMaps, PhotoOdds, network_maps
from .options import PhotoStemOptions
from .propose.edge_voting import EdgeSeeds, Seed, edge_seeds
from .propose.network_seeds import network_seeds
from .propose.space_carving import carved_seeds, hidden_ground, searched
from .stem_fit import Fitter
from .targeted_fit import GivenStems, fits_of_given
from .tile_calibration import Look, away_from, first_look, look_of, random_places, with_chance
from .tuned import MAX_SEEDS, MORE_PLACES, REACH_BELOW, SAMPLED, SECOND_M
from .upper_stem import carried_down


@dataclass
class TileSearch:
    """A piece of ground while its stems are looked for: what every step reads, and adds to."""

    #: Registered photos; oblique ones are used.
    views: list[View]
    #: Local x, y (N,) -> local height of the ground (N,), m, NaN where unknown.
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray]
    #: Where stems are wanted, all pieces.
    area: Area
    #: This piece, and its box x0, y0, x1, y1, m.
    tile: Area
    box: tuple[float, float, float, float]
    options: PhotoStemOptions
    reporter: Reporter
    #: Stems that are known to stand in the piece.
    given: GivenStems | None = None
    #: Fits of stems that an earlier search found.
    earlier: list[PhotoFit] = field(default_factory=list)

    #: What the network is asked: as the options say, in the end ``off``, ``low-confidence`` or ``full``.
    network: str = ""
    rng: np.random.Generator = field(init=False)
    grid: GroundGrid = field(init=False)
    stack: PhotoStack = field(init=False)
    #: One a photo.
    plumbs: list[PlumbGrid] = field(init=False)
    edges: EdgeSeeds = field(init=False)
    #: (N, 2) random places at which chance is measured.
    places: np.ndarray = field(init=False)
    fitter: Fitter = field(init=False)
    fits: list[PhotoFit] = field(default_factory=list)
    #: What the network saw, by the photo's index.
    shown: dict[int, PhotoOdds] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.network, self.rng = self.options.stem_network, np.random.default_rng(self.options.seed)

    def calibration(self) -> Look:
        """What was learnt of the piece, for stems that are asked for later."""
        return look_of(self.fitter, self.network, self.places)


def load_photos(search: TileSearch) -> None:
    """The ground, and the photos that show it."""
    search.grid, search.stack = photos_of(search.views, search.ground, search.tile, search.options, search.reporter)


def propose_by_edges(search: TileSearch) -> None:
    """Edges of all photos vote for stems."""
    search.plumbs = grids_of(search.stack, search.grid, search.tile, search.options)
    search.edges = edge_seeds(
        search.stack, search.grid, search.plumbs, search.area, search.box, search.options, search.rng
    )


def calibrate(search: TileSearch) -> None:
    """Sun, diameters of the stand, and what chance reaches here."""
    search.places = random_places(search.tile, search.rng)
    search.fitter = first_look(
        search.stack, search.grid, search.tile, search.edges, search.places, search.options, search.reporter
    )


def fit_by_edges(search: TileSearch) -> None:
    """Stems by their edges; whether they missed some says what the network is asked."""
    search.fits = fits_of_edges(search.fitter, [], search.edges, search.reporter)
    if search.network == "auto":
        search.network = _asked(search)


def fit_with_network(search: TileSearch) -> None:
    """Stems where the network sees them, and their widths by its silhouettes."""
    by_edges, (bark, either) = search.fits, shown_to_network(search)
    search.shown.clear()  # the maps hold it now
    seen = network_seeds(either, search.grid, search.area, search.box, search.options, search.rng)
    free = away_from(seen, random_places(search.tile, search.rng, MORE_PLACES))
    search.fitter = with_chance(replace(search.fitter, shown=bark), free)
    search.fits = not_swallowed(fits_of_edges(search.fitter, seen, search.edges, search.reporter), by_edges)


def fit_by_carving(search: TileSearch) -> None:
    """Stems that the votes missed, above all leaning ones (:mod:`.propose.space_carving`)."""
    fitter, fits = search.fitter, search.fits
    if fitter.backdrop is None:
        return
    known, (x0, y0, rows, columns) = known_rows(fits), searched(search.box)
    layers = hidden_ground(fitter.stack, fitter.ground, fitter.backdrop, x0, y0, rows, columns)
    seeds = carved_seeds(
        layers, (x0, y0), fitter.ground, fitter.silhouette, search.area, fitter.options, known, fitter.chance
    )
    refused = [fit for fit in fits if not fit.measured]
    fits += looked_at_twice(fits_of_seeds(fitter, seeds, 1.0, search.reporter, known), refused)


def fit_given(search: TileSearch) -> None:
    """Stems that are known to stand there and were not found."""
    assert search.given is not None
    search.fits += fits_of_given(search.fitter, search.given, search.fits, search.reporter, search.earlier)


def settle_low_confidence(search: TileSearch) -> None:
    """The network is asked about each stem of low confidence."""
    search.fits = settled_by_network(
        search.fits, search.fitter, search.plumbs, search.tile, search.reporter, search.earlier
    )


def measure_upper_stems(search: TileSearch) -> None:
    """What nothing shows at breast height is measured farther up."""
    search.fits = carried_down(search.fits, search.fitter, search.reporter)


def mark_ivy(search: TileSearch) -> None:
    """Stems under ivy are flagged."""
    search.fits = without_covered(search.fits, search.stack, search.plumbs)


def name_photos(search: TileSearch) -> None:
    """The fits know the photos that they were looked at in."""
    names = tuple(view.name for view in search.stack.views)
    search.fits = [replace(fit, photos=names) for fit in search.fits]


def recall(search: TileSearch, learnt: Look) -> None:
    """In place of votes and calibration: what an earlier search of the piece learnt."""
    search.plumbs = grids_of(search.stack, search.grid, search.tile, search.options)
    search.network = learnt.network
    shown = shown_to_network(search)[0] if learnt.network == "full" else None
    search.fitter = learnt.fitter(search.stack, search.grid, search.tile, search.options, shown)


def shown_to_network(search: TileSearch, photos: int | None = None) -> tuple[OddsMaps, OddsMaps]:
    """What the network sees in so many photos, spread over all; ``None``: in all."""
    count = len(search.stack)
    views = np.unique(np.linspace(0, count - 1, min(photos or count, count)).round().astype(int)).tolist()
    return network_maps(search.stack, search.plumbs, views, search.shown)


def seen_in_sample(search: TileSearch) -> tuple[int, int, int]:
    """How many stems the network sees for certain in a sample of the photos where edges gave none; how many of those
    that edges gave it sees so, and of how many. Where the understory hides stems from most photos, those that edges
    find are certain and yet few."""
    either = shown_to_network(search, SAMPLED)[1]
    rng = np.random.default_rng(search.options.seed)
    seen = network_seeds(either, search.grid, search.tile, search.box, search.options, rng)
    known = np.array([fit.axis.p for fit in search.fits if fit.measured or "too_small" in fit.reasons]).reshape(-1, 2)
    sure = np.array([(seed.x, seed.y) for seed in seen if seed.sure]).reshape(-1, 2)
    near = np.linalg.norm(sure[:, None] - known, axis=2) <= SECOND_M
    return int((~near.any(axis=1)).sum()), int(near.any(axis=0).sum()), len(known)


def _asked(search: TileSearch) -> str:
    """What the network is asked on a piece of ground that was searched by edges; it learnt stems before the ground. A
    sample in which it does not see half of the stems that are known says nothing of those that are not; where the
    photos are hardly more than a sample, edges find few and all photos cost little."""
    if search.fitter.backdrop is None:
        return "low-confidence"
    missed, seen, known = seen_in_sample(search)
    if not missed and 2 * seen >= known and len(search.stack) >= 2 * SAMPLED:
        return "low-confidence"
    search.reporter.info(
        f"The network is asked for stems as well: in a sample of the photos it sees {missed} that edges did not give, "
        f"and {seen} of the {known} that they gave."
    )
    return "full"


def fits_of_seeds(
    fitter: Fitter, seeds: list[Seed], threshold: float, reporter: Reporter, known: np.ndarray = NO_STEMS
) -> list[PhotoFit]:
    """The seeds that are stems. threshold: score that chance hardly reaches. known: (K, 10) stems that stand there."""
    fits: list[PhotoFit] = []
    # In level photos decoys line up as stems do, and reach as high: the fit has to tell.
    reach = threshold - REACH_BELOW if fitter.backdrop is not None else -np.inf
    waiting = [seed for seed in seeds if seed.score > reach][:MAX_SEEDS]
    for tried, seed in enumerate(waiting):
        reporter.progress(tried / len(waiting))
        if (np.hypot(known[:, 0] - seed.x, known[:, 1] - seed.y) < known[:, 8] + 0.08).any():
            continue
        fit = fitter.fit(seed, known)
        if fit is None and seed.sure:
            fit = fitter.refused(seed)
        if fit is None or not (seed.sure or plausible(fit, threshold)):
            continue
        fits.append(fit)
        if fit.measured:
            known = np.vstack([known, fit.row])
            reporter.stem(fit.axis.p[0], fit.axis.p[1], fit.dbh_cm)
    return fits


def fits_of_edges(fitter: Fitter, seen: list[Seed], edges: EdgeSeeds, reporter: Reporter) -> list[PhotoFit]:
    """Stems at what the network sees, at what edges propose, and second ones beside them (limbs of low forks, twins),
    which the first round's spacing passed over."""
    fits = fits_of_seeds(fitter, seen, 1.0, reporter)
    fits += fits_of_seeds(fitter, edges.seeds, edges.threshold, reporter, known_rows(fits))
    known = known_rows(fits)
    done = np.array([(seed.x, seed.y) for seed in edges.seeds]).reshape(-1, 2)
    close = []
    for seed in edges.beside:
        gap = np.hypot(known[:, 0] - seed.x, known[:, 1] - seed.y)
        again = (np.hypot(done[:, 0] - seed.x, done[:, 1] - seed.y) < 0.02).any()
        if seed.score > edges.threshold and not again and (gap < SECOND_M).any():
            close.append(seed)
    return fits + fits_of_seeds(fitter, close, edges.threshold, reporter, known)


def photos_of(
    views: list[View], ground: Callable, tile: Area, options: PhotoStemOptions, reporter: Reporter
) -> tuple[GroundGrid, PhotoStack]:
    """The ground and the photos of a tile, as its stems are looked for in them."""
    grid = GroundGrid.sample(ground, tile, options.margin_m + 2.0)
    return grid, load_stack(views, tile, grid, options.max_views, options.margin_m + 1.0, reporter)


def grids_of(stack: PhotoStack, grid: GroundGrid, tile: Area, options: PhotoStemOptions) -> list[PlumbGrid]:
    """Of each photo: the grid of its map over the piece of ground."""
    outline = np.vstack([tile.outline(options.margin_m + 1.0), tile.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    return [plumb_grid(stack, view, points) for view in range(len(stack))]
