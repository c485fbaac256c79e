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
from .images.crops import GroundGrid, PhotoStack, load_stack
from .images.vertical_rectification import PlumbGrid, plumb_grid
from .network.inference import NetworkMaps, network_maps
from .options import PhotoStemOptions
from .propose.edge_voting import EdgeSeeds, Seed, edge_seeds
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
    edges: EdgeSeeds = field(init=False)
    #: (N, 2) random places at which chance is measured.
    places: np.ndarray = field(init=False)
    fitter: Fitter = field(init=False)
    #: What the network sees, and where lines of it are seeds.
    network: NetworkMaps | None = None
    network_seeds: list[Seed] = field(default_factory=list)
    fits: list[PhotoFit] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.options.seed)

    def calibration(self) -> Look:
        """What was learnt of the piece, for stems that are asked for later."""
        return look_of(self.fitter, self.places)


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
    """Sun, and diameters of the stand."""
    search.places = random_places(search.tile, search.rng)
    search.fitter = first_look(
        search.stack, search.grid, search.tile, search.edges, search.places, search.options, search.reporter
    )


def ask_network(search: TileSearch) -> None:
    """Where the network sees stems, and their silhouettes."""
    seen = _show_to_network(search)
    search.network_seeds = network_seeds(seen, search.grid, search.area, search.box, search.options, search.rng)


def measure_chance(search: TileSearch) -> None:
    """What chance reaches here."""
    places = search.places
    if search.network is not None:
        places = away_from(search.network_seeds, random_places(search.tile, search.rng, MORE_PLACES))
    search.fitter = with_chance(search.fitter, places)


def fit_stems(search: TileSearch) -> None:
    """Stems where edges propose them, and where the network sees others."""
    search.fits = fits_of_proposals(search.fitter, search.edges, search.network_seeds, search.reporter)


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
    """In place of votes and calibration: what an earlier search of the piece learnt."""
    search.plumbs = grids_of(search.stack, search.grid, search.tile, search.options)
    search.fitter = learnt.fitter(search.stack, search.grid, search.tile, search.options)
    if learnt.network:
        _show_to_network(search)


def _show_to_network(search: TileSearch) -> NetworkMaps:
    """The search and its fitter know what the network sees."""
    search.network = network_maps(search.stack, search.plumbs)
    search.fitter = replace(search.fitter, shown=search.network.bark)
    return search.network


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


def fits_of_proposals(fitter: Fitter, edges: EdgeSeeds, by_network: list[Seed], reporter: Reporter) -> list[PhotoFit]:
    """Stems at what edges propose, then where the network sees others (to it two that touch are one), and second ones
    beside them (limbs of low forks, twins), which the first round's spacing passed over."""
    fits = fits_of_seeds(fitter, edges.seeds, edges.threshold, reporter)
    fits += fits_of_seeds(fitter, by_network, 1.0, reporter, known_rows(fits))
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
    return grid, load_stack(
        views, tile, grid, options.max_views, options.margin_m + 1.0, reporter, options.finest_gsd_m
    )


def grids_of(stack: PhotoStack, grid: GroundGrid, tile: Area, options: PhotoStemOptions) -> list[PlumbGrid]:
    """Of each photo: the grid of its map over the piece of ground."""
    outline = np.vstack([tile.outline(options.margin_m + 1.0), tile.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    return [plumb_grid(stack, view, points) for view in range(len(stack))]
