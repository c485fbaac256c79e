"""Given stems in the photos of a search that is over: its photos and what it learnt of them are made ready again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from .deduplicate import known_rows, without_open_diameter
from .evidence.ivy import without_covered
from .fit.photo_fit import PhotoFit
from .low_confidence import settled_by_network
from .network.inference import network_maps
from .options import PhotoStemOptions
from .route import grids_of, photos_of, with_photos
from .targeted_fit import GivenStems, fit_at
from .tile_calibration import Look
from .tiles import split
from .upper_stem import carried_down

#: Stems farther from a piece of ground than this hide nothing there, m.
_NEAR_M = 40.0


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
    """One fit a given stem, in their order: a stem, or refused; ``None`` where too few photos see the ground.

    views, ground, area, options, looks: those of the search (:func:`.route.search_photos`). known: fits of the stems
    that are there already. Places outside the pieces of ground are ``None`` as well.
    """
    pieces = split(area, options.margin_m)
    if len(pieces) != len(looks):
        raise ValueError(f"{len(looks)} looks for {len(pieces)} pieces of ground")
    found: list[PhotoFit | None] = [None] * len(given.xy)
    left = np.ones(len(given.xy), bool)
    for (piece, box), look in zip(pieces, looks, strict=True):
        x, y = given.xy.T
        inside = left & (x >= box[0]) & (x <= box[2]) & (y >= box[1]) & (y <= box[3])
        left &= ~inside
        own = np.flatnonzero(inside)
        if look is None or not len(own):
            continue
        fits = _of_piece(views, ground, piece, options, look, replace(given, xy=given.xy[own]), known, reporter)
        known = [*known, *(fit for fit in fits if fit.measured)]
        for k, fit in zip(own, fits, strict=True):
            found[int(k)] = fit
    return found


def _of_piece(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    piece: Area,
    options: PhotoStemOptions,
    look: Look,
    given: GivenStems,
    known: list[PhotoFit],
    reporter: Reporter,
) -> list[PhotoFit]:
    grid, stack = photos_of(views, ground, piece, options, reporter)
    options = replace(options, stem_network=look.network)
    plumbs = grids_of(stack, grid, piece, options)
    shown = network_maps(stack, plumbs) if look.network == "full" else None
    fitter = look.fitter(stack, grid, piece, options, shown)
    near = known_rows([fit for fit in known if np.hypot(*(given.xy - fit.axis.p).T).min() < _NEAR_M])
    fits = []
    for done, place in enumerate(given.xy):
        reporter.progress(done / len(given.xy))
        fit = fit_at(fitter, place, given.reach_m, near)
        fits.append(fit)
        near = np.vstack([near, fit.row]) if fit.measured else near
    if look.network == "low-confidence":
        fits = settled_by_network(fits, fitter, plumbs, piece, reporter, known)
    fits = carried_down(fits, fitter, reporter)
    if look.network != "off":
        fits = without_covered(fits, stack, plumbs)
    return [without_open_diameter(fit) for fit in with_photos(fits, stack)]
