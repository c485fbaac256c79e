"""Stems at given places, in the photos of a search that is over: what it learnt is recalled, not learnt again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from .deduplicate import without_open_diameter
from .fit.photo_fit import PhotoFit
from .options import PhotoStemOptions
from .route import GIVEN, run_steps
from .search_steps import TileSearch, load_photos, recall
from .targeted_fit import GivenStems
from .tile_calibration import Look
from .tiles import split


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

    views, ground, area, options, looks: those of the search (:func:`.route.search_photos`). known: fits of the stems
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
        load_photos(search)
        recall(search, learnt)
        run_steps(GIVEN, search, 0.1)
        known = [*known, *(fit for fit in search.fits if fit.measured)]
        for k, fit in zip(own, search.fits, strict=True):
            found[int(k)] = without_open_diameter(fit)
    return found
