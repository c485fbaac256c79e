"""What photos say of themselves and cannot mean: one place for all, altitudes without a sign, angles never written."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..core.progress import Reporter
from ..core.shown import shorten
from .photos import Photo

#: Photos that have to agree before something is a fault of the tags.
_LEAST = 3
#: A share of the photos at one place, to the last digit, that no flight has; or nearly all of them within this, metres.
_ONE_PLACE_SHARE, _NEARLY_ALL, _ONE_PLACE_M = 0.5, 0.95, 0.5
#: Places this far apart are of different flights, metres.
_GAP_M = 2000.0
#: Altitudes of both signs that differ by less than this, without their sign, and lie further than it from zero, metres.
_SIGN_SPREAD_M = 5.0
#: A gimbal this far from upright has passed straight down, degrees.
OVERHEAD_DEG = 90.0


def without_faults(photos: list[Photo], reporter: Reporter) -> list[Photo]:
    """The photos with tags that cannot be taken for what they say corrected where that is certain, else unknown (NaN);
    each kind is reported."""
    for check in (_one_place, _elsewhere, _signs, _no_altitude, _no_angles):
        photos = check(photos, reporter)
    if over := [photo.name for photo in photos if abs(photo.roll_deg) > OVERHEAD_DEG]:
        reporter.warn(
            f"{len(over)} of {len(photos)} photos have a gimbal roll near 180 degrees (tilted past straight down, as "
            f"in smart oblique capture); whether their pictures are stored turned, their matches decide: look in the "
            f"report whether they are placed ({shorten(over, 3)})."
        )
    return photos


def _changed(photos: list[Photo], chosen: np.ndarray, **values: Any) -> list[Photo]:
    return [replace(photo, **values) if use else photo for photo, use in zip(photos, chosen, strict=True)]


def _one_place(photos: list[Photo], reporter: Reporter) -> list[Photo]:
    places = np.array([(photo.lon_deg, photo.lat_deg) for photo in photos])
    known = np.isfinite(places).all(axis=1)
    if known.sum() < _LEAST:
        return photos
    found, count = np.unique(places[known], axis=0, return_counts=True)
    apart = (places - np.nanmedian(places, axis=0)) * 111200.0 * [np.cos(np.radians(np.nanmedian(places[:, 1]))), 1.0]
    near = np.hypot(*apart.T) < _ONE_PLACE_M
    chosen = (places == found[count.argmax()]).all(axis=1)
    if near.sum() >= _NEARLY_ALL * known.sum():
        chosen = near
    elif chosen.sum() < max(_LEAST, _ONE_PLACE_SHARE * known.sum()):
        return photos
    reporter.warn(
        f"{chosen.sum()} of {len(photos)} photos give one and the same GPS position, expected one for each: it was "
        "left aside, as photos from one place have no scale; give their geotags (MRK, .pos or a CSV)."
    )
    return _changed(photos, chosen, lon_deg=np.nan, lat_deg=np.nan)


def _elsewhere(photos: list[Photo], reporter: Reporter) -> list[Photo]:
    """Without the photos of other places: the place of the most remains, with all that joins it without a wide gap."""
    places = np.array([(photo.lon_deg, photo.lat_deg) for photo in photos])
    known = np.flatnonzero(np.isfinite(places).all(axis=1))
    if not len(known):
        return photos
    metres = places[known] * 111200.0 * [np.cos(np.radians(np.median(places[known, 1]))), 1.0]
    cells, cell = np.unique(np.floor(metres / _GAP_M), axis=0, return_inverse=True)
    groups = connected_components(cKDTree(cells).sparse_distance_matrix(cKDTree(cells), 1.5))[1][cell.ravel()]
    main = int(np.bincount(groups).argmax())
    middle = np.median(metres[groups == main], axis=0)
    for other in np.unique(groups[groups != main]):
        rows = known[groups == other]
        away = np.hypot(*(np.median(metres[groups == other], axis=0) - middle)) / 1000
        reporter.warn(
            f"Left out {len(rows)} of {len(photos)} photos, taken {away:.0f} km from the other "
            f"{(groups == main).sum()}: {shorten([photos[i].name for i in rows])}; give each place a run of its own."
        )
    dropped = set(known[groups != main].tolist())
    return [photo for i, photo in enumerate(photos) if i not in dropped]


def _signs(photos: list[Photo], reporter: Reporter) -> list[Photo]:
    """Altitudes whose sign flips from photo to photo: GPSAltitudeRef is wrong in some of them."""
    height = np.array([photo.height_m for photo in photos])
    known = np.isfinite(height)
    below, above = known & (height < 0), known & (height >= 0)
    size = np.abs(height)
    if min(below.sum(), above.sum()) == 0 or known.sum() < _LEAST:
        return photos
    usual = float(np.median(size[known]))
    flipped = below if below.sum() <= above.sum() else above
    if usual < _SIGN_SPREAD_M or np.abs(size[flipped] - np.median(size[~flipped & known])).max() > _SIGN_SPREAD_M:
        return photos
    reporter.warn(
        f"{flipped.sum()} of {len(photos)} photos have an altitude of {np.median(height[flipped]):.0f} m, the others "
        f"of {np.median(height[~flipped & known]):.0f} m: the sign (EXIF GPSAltitudeRef) was taken to be wrong in the "
        f"fewer ({shorten([p.name for p, use in zip(photos, flipped, strict=True) if use], 3)})."
    )
    return [replace(p, height_m=-p.height_m) if use else p for p, use in zip(photos, flipped, strict=True)]


def _no_altitude(photos: list[Photo], reporter: Reporter) -> list[Photo]:
    height = np.array([photo.height_m for photo in photos])
    if not (height == 0).sum() >= max(_LEAST, np.isfinite(height).sum()):
        return photos
    reporter.warn(
        f"All {int((height == 0).sum())} photos have the altitude 0 in their EXIF, expected the flying height: "
        "heights are taken as unknown, and those of the result cannot be compared with a terrain model; give "
        "geotags (MRK, .pos or a CSV)."
    )
    return _changed(photos, height == 0, height_m=np.nan)


def _no_angles(photos: list[Photo], reporter: Reporter) -> list[Photo]:
    """Exactly level, exactly north and exactly upright is what a program writes that knows no angles."""
    chosen = np.array([photo.yaw_deg == 0 and photo.pitch_deg == 0 and photo.roll_deg == 0 for photo in photos])
    if not chosen.any():
        return photos
    reporter.warn(
        f"{chosen.sum()} of {len(photos)} photos have the gimbal angles 0, 0, 0 (level, to the north), as is written "
        "where they are unknown: they were left aside, the photos alone say where they look "
        f"({shorten([p.name for p, use in zip(photos, chosen, strict=True) if use], 3)})."
    )
    return _changed(photos, chosen, yaw_deg=np.nan, pitch_deg=np.nan, roll_deg=np.nan)
