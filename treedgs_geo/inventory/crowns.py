"""The layer ``crowns`` of a tree file: the crown of each tree whose top the canopy shows, seen from above."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from shapely.geometry import Polygon

from ..stems.quality.crowns import crown_cells
from ..stems.quality.tree import Tree
from .searched import covered

#: Name of the layer, and its columns.
CROWNS = "crowns"
CROWN_COLUMNS = ("tree_id", "crown_m2", "height_m", "qc_flag")
#: Smaller than this is no crown, m2: a gap between others.
_MIN_M2 = 1.0

#: ``tree_id`` -> (K, 4) x, y (project coordinates), height above the ground at the foot (m) and diameter (cm), from the
#: foot up: what is known of a stem's course.
StemCurves = Mapping[int, np.ndarray]


def along(curve: np.ndarray, height_m: float) -> np.ndarray:
    """(2,) where a stem is at a height, project coordinates: beyond its (K, 4) curve straight on."""
    end = curve[0] if height_m < curve[0, 2] else curve[-1]
    if curve[0, 2] <= height_m <= curve[-1, 2]:
        return np.array([np.interp(height_m, curve[:, 2], curve[:, axis]) for axis in (0, 1)])
    span = curve[:, 2] - curve[:, 2].mean()
    slope = span @ curve[:, :2] / max(float(span @ span), 1e-9)
    return end[:2] + slope * (height_m - end[2])


def crown_table(
    trees: Sequence[Tree],
    curves: StemCurves,
    canopies: Iterable[tuple[np.ndarray, np.ndarray, np.ndarray]],
    crs: pyproj.CRS | str,
) -> gpd.GeoDataFrame:
    """Crowns as polygons: ``tree_id, crown_m2, height_m, qc_flag``, one a tree with a height whose top is a tip of the
    canopy.

    canopies: x (C,), y (R,) of the cell centres, rising, project coordinates, and heights above the ground (R, C), NaN
    where nothing stands. Of the crowns that a tree has in several, which overlap, the largest counts.
    """
    counted = [tree for tree in trees if tree.height_m is not None]
    tops = np.array(
        [
            [*(along(curves[t.tree_id], t.height_m or 0.0) if t.tree_id in curves else (t.x, t.y)), t.height_m]
            for t in counted
        ],
        float,
    ).reshape(-1, 3)
    found: dict[int, Polygon] = {}
    for x, y, height in canopies:
        cell = float(x[1] - x[0])
        cells = crown_cells(x, y, height, tops)
        corner = float(x[0]) - cell / 2, float(y[0]) - cell / 2
        for number in np.unique(cells[cells > 0]).tolist():
            # Rounded by a cell: what hangs on by a corner is no crown, and the steps of the grid are none of its own.
            smooth = covered(cells == number, corner, cell).buffer(cell).buffer(-2 * cell).buffer(cell)
            part = max(getattr(smooth, "geoms", [smooth]), key=lambda shape: shape.area)
            if part.area < max(_MIN_M2, found[number].area if number in found else 0.0):
                continue
            found[number] = Polygon(part.exterior)
    rows = [
        (counted[k - 1].tree_id, round(found[k].area, 2), counted[k - 1].height_m, counted[k - 1].qc_flag)
        for k in sorted(found)
    ]
    table = pd.DataFrame(rows, columns=list(CROWN_COLUMNS))
    return gpd.GeoDataFrame(table, geometry=gpd.GeoSeries([found[k] for k in sorted(found)], crs=crs), crs=crs)
