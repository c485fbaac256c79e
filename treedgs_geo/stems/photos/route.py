"""Stems from photos, step by step: :data:`SEARCH` is what happens to a piece of ground, in this order.

A seed becomes a fit in :mod:`.stem_fit` (search, adjustment, selection among explanations) and :mod:`.measurement`
(:data:`.measurement.EVIDENCE`, error, quality control). What several steps say of one stem adds up in
:class:`treedgs_geo.stems.quality.assessment.Assessment`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from . import search_steps as steps
from .deduplicate import merge
from .evidence.opacity_test import without_seen_through
from .fit.photo_fit import PhotoFit
from .options import PhotoStemOptions
from .search_steps import TileSearch
from .targeted_fit import GivenStems
from .tile_calibration import Look
from .tiles import split
from .tuned import MIN_PHOTOS


def always(_: TileSearch) -> bool:
    """Needed in every search."""
    return True


class Step(NamedTuple):
    """run: adds to the search. until: share of the work that is then done. needed: whether this search takes it.
    name: of the stage, as it is reported; empty: none of its own."""

    run: Callable[[TileSearch], None]
    until: float
    needed: Callable[[TileSearch], bool] = always
    name: str = ""


#: What follows for stems that were found, and for those at given places.
_FOR_ALL = (
    Step(steps.measure_upper_stems, 0.98, always, "stems seen farther up"),
    Step(steps.mark_ivy, 1.0, lambda search: search.network is not None),
    Step(steps.name_photos, 1.0),
)
#: A piece of ground, from its photos to its stems.
SEARCH = (
    Step(steps.see_ground, 0.1),
    Step(steps.propose_by_network, 0.5, steps.asks_network, "stems that the network sees"),
    Step(steps.propose_by_edges, 0.5, lambda search: not search.proposals.seeds),
    Step(steps.calibrate, 0.6),
    Step(steps.fit_stems, 0.9, always, "fit stems"),
    Step(steps.fit_given, 0.95, lambda search: search.given is not None),
    *_FOR_ALL,
)
#: Stems at given places of a piece that was searched before.
GIVEN = (Step(steps.fit_given, 0.9), *_FOR_ALL)


@dataclass(frozen=True)
class Searched:
    """Stems of an area, and what was learnt on the way."""

    #: The stems, best first.
    fits: list[PhotoFit]
    #: Of each piece of ground (:func:`.tiles.split`), ``None`` where too few photos see it.
    looks: list[Look | None]


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
        name = f"stems in the photos ({index + 1} of {len(tiles)})"
        with reporter.stage(name, index / len(tiles), (index + 1) / len(tiles)):
            here = None if given is None else given.within(area, box, options.margin_m)
            search = TileSearch(views, ground, area, tile, box, options, reporter, here)
            steps.load_photos(search)
            if len(search.stack) < MIN_PHOTOS:
                reporter.warn(f"Only {len(search.stack)} oblique photos see the plot; no stem can be measured in them.")
                looks.append(None)
                continue
            run_steps(SEARCH, search, 0.1)
            found += search.fits
            looks.append(search.calibration())
    return Searched(without_seen_through(merge(found), views), looks)


def fits_again(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    area: Area,
    options: PhotoStemOptions,
    looks: list[Look | None],
    given: GivenStems,
    known: list[PhotoFit],
    reporter: Reporter,
) -> list[PhotoFit | None]:
    """Stems at given places of an area that was searched before: one fit a place, in their order, measured or refused;
    ``None`` where too few photos see the ground or the place lies outside.

    views, ground, area, options, looks: those of the search (:func:`search_photos`). known: fits of the stems
    that are there already.
    """
    pieces = split(area, options.margin_m)
    if len(pieces) != len(looks):
        raise ValueError(f"{len(looks)} looks for {len(pieces)} pieces of ground")
    found: list[PhotoFit | None] = [None] * len(given.xy)
    left = np.ones(len(given.xy), bool)
    for (tile, box), learnt in zip(pieces, looks, strict=True):
        x, y = given.xy.T
        inside = left & (x >= box[0]) & (x <= box[2]) & (y >= box[1]) & (y <= box[3])
        left &= ~inside
        own = np.flatnonzero(inside)
        if learnt is None or not len(own):
            continue
        here = replace(given, xy=given.xy[own])
        search = TileSearch(views, ground, area, tile, box, options, reporter, here, known)
        steps.load_photos(search)
        steps.recall(search, learnt)
        run_steps(GIVEN, search, 0.1)
        known = [*known, *(fit for fit in search.fits if fit.measured)]
        for k, fit in zip(own, search.fits, strict=True):
            found[int(k)] = fit
    return found


def run_steps(order: tuple[Step, ...], search: TileSearch, done: float) -> None:
    """The steps that are needed. done: share of the work that is done before."""
    for step in order:
        search.reporter.progress(done)
        if step.needed(search) and step.name:
            with search.reporter.stage(step.name, done, step.until):
                step.run(search)
        elif step.needed(search):
            step.run(search)
        done = step.until
