"""What a run searched for stems: where enough photos look from the side, or points lie near the ground."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.ndimage import binary_dilation, binary_erosion, distance_transform_edt
from shapely.geometry.base import BaseGeometry

from ..core.plots import Plot
from ..inventory.searched import covered
from ..pointcloud.cloud import extent, slices
from ..reconstruction.area import Area
from ..reconstruction.cameras import View

if TYPE_CHECKING:
    from ..terrain.dtm import Dtm
    from .context import Site

#: A place counts as seen when this many photos look at it from the side, as where stems are looked for without plots.
ENOUGH_VIEWS = 6
#: Sine of the angle from straight down that is "from the side".
SIDE_SIN = 0.3
#: A stem shows in the lowest metres; where no point lies in them none is found.
LOW_M = 5.0
#: Side of a cell, metres; most cells of a run, which make them larger.
CELL_M, MOST_CELLS = 0.5, 20_000
#: Shadows and gaps between a cloud's points up to twice this wide were searched: a stem in them shows beside them.
BRIDGE_M = 2.0
#: Points a cell from which their rim is that of the ground that they show.
_DENSE = 8
#: Days of data that can be meant, s since 1970 (1990 to 2100); the beginning of GPS time.
_FIRST_S, _LAST_S, _GPS_EPOCH_S = 631_152_000.0, 4_102_444_800.0, 315_964_800.0
#: Points whose heights are looked up at once.
_CHUNK = 1_000_000


def photos_looking(views: list[View], points: np.ndarray) -> tuple[np.ndarray, list[float]]:
    """``((N,) how many photos see each point from the side, cm a pixel of each photo that sees any)``.

    points: (N, 3) in the views' frame.
    """
    count, sizes = np.zeros(len(points), int), []
    for view in views:
        pixels, depth = view.project(points)
        inside = view.contains(pixels) & (depth > 0)
        offset = points - view.centre
        side = np.hypot(offset[:, 0], offset[:, 1]) >= SIDE_SIN * np.linalg.norm(offset, axis=1)
        count += inside & side
        if inside.any():
            sizes.append(100 * float(np.median(depth[inside])) / view.camera.fx)
    return count, sizes


def seen_in_photos(site: Site | None, plots: list[Plot]) -> BaseGeometry:
    """The area that enough photos see from the side, project coordinates; without plots that of the search."""
    if site is None:
        return shapely.MultiPolygon()
    if not plots:
        corners = np.column_stack([site.area.centres, np.full(len(site.area.radii_m), site.frame.origin[2])])
        centres = site.frame.to_project(corners.reshape(-1, 3))[:, :2]
        return Area.circles(centres, site.area.radii_m).shape() if len(centres) else shapely.MultiPolygon()
    cell = max(CELL_M, float(np.sqrt(sum(4 * plot.radius_m**2 for plot in plots) / MOST_CELLS)))
    return shapely.union_all([_seen_of_plot(site, plot, cell) for plot in plots])


def _seen_of_plot(site: Site, plot: Plot, cell_m: float) -> BaseGeometry:
    n = int(np.ceil(2 * plot.radius_m / cell_m)) + 1
    corner = plot.x - n * cell_m / 2, plot.y - n * cell_m / 2
    x, y = (start + cell_m * (np.arange(n) + 0.5) for start in corner)
    xy = np.column_stack([axis.ravel() for axis in np.meshgrid(x, y)])
    points = over_ground(site, xy)
    if points is None:
        return shapely.MultiPolygon()
    count, _ = photos_looking(site.views, points)
    return covered((count >= ENOUGH_VIEWS).reshape(n, n), corner, cell_m)


def day_of(utc_s: np.ndarray) -> datetime.date | None:
    """The middle day of moments, s since 1970 (NaN: not known); ``None`` where none is one of this age."""
    known = utc_s[np.isfinite(utc_s)]
    if not len(known) or not _FIRST_S < (middle := float(np.median(known))) < _LAST_S:
        return None
    return datetime.datetime.fromtimestamp(middle, datetime.timezone.utc).date()


def day_scanned(path: Path, gps_time: np.ndarray | None) -> datetime.date | None:
    """The day of a LAS file's points, where they hold the full GPS time (not that of a week)."""
    if gps_time is None or path.suffix.lower() not in (".las", ".laz"):
        return None
    import laspy

    with laspy.open(path) as file:
        if int(file.header.global_encoding.gps_time_type) != 1:
            return None
    # Adjusted standard GPS time: s since 6 January 1980, less 1e9 (LAS 1.4, global encoding).
    return day_of(np.asarray(gps_time[:: max(len(gps_time) // 10_000, 1)], float) + 1e9 + _GPS_EPOCH_S)


def over_ground(site: Site, xy: np.ndarray) -> np.ndarray | None:
    """(N, 3) local places at breast height over project coordinates (N, 2); ``None`` without any ground."""
    ground = site.dtm.height(xy[:, 0], xy[:, 1])
    if not np.isfinite(ground).any():
        return None
    ground = np.where(np.isfinite(ground), ground, np.nanmedian(ground))
    return site.frame.to_local(np.column_stack([xy, ground + 1.3]))


def seen_in_cloud(xyz: np.ndarray, dtm: Dtm) -> BaseGeometry:
    """The area in which points lie within :data:`LOW_M` of the ground. xyz: (N, 3) project coordinates."""
    if not len(xyz):
        return shapely.MultiPolygon()
    reach = int(np.ceil(BRIDGE_M / CELL_M))
    first, last = (np.floor(corner[:2] / CELL_M).astype(np.int64) for corner in extent(xyz))
    first -= reach + 1
    shape = tuple((last - first)[::-1] + reach + 2)

    def cell_of(part: np.ndarray) -> np.ndarray:
        index = np.floor(part[:, :2] / CELL_M).astype(np.int64) - first
        return index[:, 1] * shape[1] + index[:, 0]

    points, low = np.zeros(np.prod(shape), np.int64), np.zeros(np.prod(shape), np.int64)
    for piece in slices(len(xyz), _CHUNK):
        part = xyz[piece]
        cell = cell_of(part)
        with np.errstate(invalid="ignore"):
            is_low = part[:, 2] - dtm.height(part[:, 0], part[:, 1]) < LOW_M
        points += np.bincount(cell, minlength=len(points))
        low += np.bincount(cell[is_low], minlength=len(low))
    if not low.any():
        return shapely.MultiPolygon()
    any_, near = points.reshape(shape) > 0, low.reshape(shape) > 0
    ground = _bridged(near, reach)
    if low.sum() < _DENSE * near.sum():
        # Half of the spacing of few low points is searched ground too.
        ground = binary_dilation(ground, np.ones((3, 3)))
    whole = _bridged(any_, reach) & ground
    # The rim goes where the outermost points lie, not where their cells end.
    rim = any_ & whole & ~binary_erosion(whole, np.ones((3, 3)))
    corner = first * CELL_M
    inner = covered(whole & ~rim, (float(corner[0]), float(corner[1])), CELL_M)
    pieces = (xyz[piece, :2] for piece in slices(len(xyz), _CHUNK))
    outer = np.concatenate([part[rim.ravel()[cell_of(part)]] for part in pieces])
    return shapely.union_all([inner, *_boxes(outer, cell_of(outer), np.floor(outer / CELL_M) * CELL_M)])


def _bridged(mask: np.ndarray, reach: int) -> np.ndarray:
    """The True cells, and gaps between them of up to twice ``reach`` cells."""
    grown = distance_transform_edt(~mask) <= reach
    return mask | (distance_transform_edt(grown) > reach)


def _boxes(xy: np.ndarray, cell: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """The part of each cell that its points fill: their extent and, as n points of an even spread leave it, a further
    (n - 1)th of it on each side. xy: (N, 2). cell: (N,) numbers. corner: (N, 2) of the cells."""
    order = np.argsort(cell, kind="stable")
    starts = np.flatnonzero(np.diff(cell[order], prepend=-1))
    xy, corner = xy[order], corner[order][starts]
    low, high = np.minimum.reduceat(xy, starts), np.maximum.reduceat(xy, starts)
    count = np.diff(starts, append=len(xy))[:, None]
    more = np.where(count > 1, (high - low) / np.maximum(count - 1, 1), CELL_M / 4)
    return shapely.box(*np.maximum(low - more, corner).T, *np.minimum(high + more, corner + CELL_M).T)
