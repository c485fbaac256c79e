"""The steps of a search of one piece of ground; :mod:`.route` has their order and says when each is needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from .deduplicate import known_rows, plausible
from .evidence.ivy import without_covered
from .fit.edge_adjustment import NO_STEMS
from .fit.photo_fit import PhotoFit
from .images.background import Backdrop, make_backdrop
from .images.crops import GroundGrid, PhotoStack, load_stack
from .images.vertical_rectification import PlumbGrid, plumb_grid
from .network.inference import NetworkMaps, network_maps
from .options import PhotoStemOptions
from .propose.edge_voting import NO_PROPOSALS, Proposals, Seed, edge_seeds
from .propose.network_seeds import network_seeds
from .stem_fit import Fitter
from .targeted_fit import GivenStems, fits_of_given
from .tile_calibration import Look, away_from, first_look, look_of, random_places, with_chance
from .tuned import MAX_SEEDS, MORE_PLACES, REACH_BELOW, SECOND_M
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

    rng: np.random.Generator = field(init=False)
    grid: GroundGrid = field(init=False)
    stack: PhotoStack = field(init=False)
    #: One a photo.
    plumbs: list[PlumbGrid] = field(init=False)
    #: The ground, as it looks without stems; ``None`` where photos do not show it behind them.
    backdrop: Backdrop | None = field(init=False)
    #: (N, 2) random places at which chance is measured.
    places: np.ndarray = field(init=False)
    fitter: Fitter = field(init=False)
    #: What the network sees.
    network: NetworkMaps | None = None
    proposals: Proposals = NO_PROPOSALS
    fits: list[PhotoFit] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.options.seed)

    def calibration(self) -> Look:
        """What was learnt of the piece, for stems that are asked for later."""
        return look_of(self.fitter, self.places)


def asks_network(search: TileSearch) -> bool:
    """Whether the network tells where stems are: it knows them before the ground."""
    return search.options.stem_network != "off" and search.backdrop is not None


def load_photos(search: TileSearch) -> None:
    """The ground, and the photos that show it."""
    search.grid, search.stack = photos_of(search.views, search.ground, search.tile, search.options, search.reporter)


def see_ground(search: TileSearch) -> None:
    """How the ground looks behind the stems: photos see it at the rim of the searched area."""
    search.plumbs = grids_of(search.stack, search.grid, search.tile, search.options)
    search.backdrop = make_backdrop(search.stack, search.grid, search.tile.bounds(search.options.margin_m + 3.0))


def propose_by_network(search: TileSearch) -> None:
    """The network sees stems."""
    search.network = network_maps(search.stack, search.plumbs)
    search.proposals = network_seeds(search.network, search.grid, search.area, search.box, search.options, search.rng)


def propose_by_edges(search: TileSearch) -> None:
    """Edges of all photos vote for stems."""
    search.proposals = edge_seeds(
        search.stack, search.grid, search.plumbs, search.area, search.box, search.options, search.rng
    )


def calibrate(search: TileSearch) -> None:
    """Sun, diameters of the stand, and what chance reaches."""
    search.places = random_places(search.tile, search.rng)
    look = first_look(search.stack, search.grid, search.proposals, search.places, search.options, search.reporter)
    search.fitter = _fitter(search, look)
    places = search.places
    if search.network is not None:
        places = away_from(search.proposals.seeds, random_places(search.tile, search.rng, MORE_PLACES))
    search.fitter = with_chance(search.fitter, places)


def _fitter(search: TileSearch, look: Look) -> Fitter:
    shown = None if search.network is None else search.network.bark
    return look.fitter(search.stack, search.grid, search.options, search.backdrop, shown)


def fit_stems(search: TileSearch) -> None:
    """Stems where they are proposed."""
    search.fits = fits_of_proposals(search.fitter, search.proposals, search.reporter)


def fit_given(search: TileSearch) -> None:
    """Stems that are known to stand there and were not found."""
    assert search.given is not None
    search.fits += fits_of_given(search.fitter, search.given, search.fits, search.reporter, search.earlier)


def measure_upper_stems(search: TileSearch) -> None:
    """What nothing shows at breast height is measured farther up."""
    search.fits = carried_down(search.fits, search.fitter, search.reporter)


def mark_ivy(search: TileSearch) -> None:
    """Stems under ivy are flagged."""
    assert search.network is not None
    search.fits = without_covered(search.fits, search.network.bark, search.network.either)


def name_photos(search: TileSearch) -> None:
    """The fits know the photos that they were looked at in."""
    names = tuple(view.name for view in search.stack.views)
    search.fits = [replace(fit, photos=names) for fit in search.fits]


def recall(search: TileSearch, learnt: Look) -> None:
    """In place of proposals and calibration: what an earlier search of the piece learnt."""
    see_ground(search)
    if learnt.network:
        search.network = network_maps(search.stack, search.plumbs)
    search.fitter = _fitter(search, learnt)


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


def fits_of_proposals(fitter: Fitter, proposals: Proposals, reporter: Reporter) -> list[PhotoFit]:
    """Stems at what is proposed, and second ones beside them (limbs of low forks, twins), which the first round's
    spacing passed over."""
    fits = fits_of_seeds(fitter, proposals.seeds, proposals.threshold, reporter)
    known = known_rows(fits)
    near = [s for s in proposals.beside if (np.hypot(known[:, 0] - s.x, known[:, 1] - s.y) < SECOND_M).any()]
    return fits + fits_of_seeds(fitter, near, proposals.threshold, reporter, known)


def photos_of(
    views: list[View], ground: Callable, tile: Area, options: PhotoStemOptions, reporter: Reporter
) -> tuple[GroundGrid, PhotoStack]:
    """The ground and the photos of a tile, as its stems are looked for in them."""
    grid = GroundGrid.sample(ground, tile, options.margin_m + 2.0)
    return grid, load_stack(
        views, tile, grid, options.max_views, options.margin_m + 1.0, reporter, options.finest_gsd_m
    )


def grids_of(stack: PhotoStack, grid: GroundGrid, tile: Area, options: PhotoStemOptions) -> list[PlumbGrid]:
    """Of each photo: the grid of its map over the piece of ground."""
    outline = np.vstack([tile.outline(options.margin_m + 1.0), tile.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    return [plumb_grid(stack, view, points) for view in range(len(stack))]
