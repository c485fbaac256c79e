"""Layers beside the tree points: each stem's circle at true scale, the measured sections of its curve, the crowns, and
what refused stems were read as."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from shapely.geometry import Polygon

from ..core.layer_files import add_layer, read_if_there
from ..stems.quality.crowns import crown_cells
from ..stems.quality.tree import Tree
from .searched import SEARCHED, covered

#: Names of the layers in ``trees.gpkg``.
CIRCLES, SECTIONS = "circles", "sections"
#: The layer of the crown of each tree whose top the canopy shows, seen from above, and its columns.
CROWNS = "crowns"
CROWN_COLUMNS = ("tree_id", "crown_m2", "height_m", "qc_flag")
#: Quarter-circle segments: 0.1 mm off the circle at 1 m diameter.
_SEGMENTS = 16
#: Columns of ``circles``.
_CIRCLE_COLUMNS = ("tree_id", "dbh_cm", "dbh_se_cm", "qc_flag", "height_m")
#: Columns of ``sections``.
SECTION_COLUMNS = ("tree_id", "height_m", "d_cm", "d_se_cm", "rms_cm", "n_pts", "arc_deg")


def _discs(table: pd.DataFrame, columns: Sequence[str], diameter: str, crs: pyproj.CRS) -> gpd.GeoDataFrame:
    """Polygons of a diameter (cm) round ``x, y`` (project metres), with these columns."""
    shapes = gpd.GeoSeries.from_xy(table["x"], table["y"], crs=crs).buffer(table[diameter] / 200, _SEGMENTS)
    return gpd.GeoDataFrame(table[list(columns)], geometry=shapes, crs=crs)


#: Name of the table of what refused stems were read as, and its columns. Such a reading is no DBH: it may be off by far
#: more than its error says. It tells a thin stem from a thick one all the same, for whoever has to count them.
READINGS = "readings"
READING_COLUMNS = ("tree_id", "read_cm", "read_se_cm")


def readings_table(rows: list[tuple[int, float, float]]) -> pd.DataFrame:
    """rows: number, diameter and its standard error, cm."""
    return pd.DataFrame(rows, columns=list(READING_COLUMNS)).round(2).astype({"tree_id": "int64"})


def read_readings(path: Path) -> pd.DataFrame | None:
    """The table of a tree file; ``None`` where it has none."""
    table = read_if_there(path, READINGS, READING_COLUMNS)
    return None if table is None else table[list(READING_COLUMNS)]


def with_readings(trees: pd.DataFrame, path: Path) -> pd.DataFrame:
    """A tree list with ``read_cm`` and ``read_se_cm`` (NaN: not read)."""
    table = read_readings(path)
    if table is None:
        return trees.assign(read_cm=np.nan, read_se_cm=np.nan)
    found = table.drop_duplicates("tree_id").set_index("tree_id").reindex(pd.to_numeric(trees["tree_id"]))
    return trees.assign(**{name: found[name].to_numpy(float) for name in READING_COLUMNS[1:]})


def add_layers(
    geopackage: Path,
    trees: gpd.GeoDataFrame,
    sections: list[dict] | None = None,
    searched: gpd.GeoDataFrame | None = None,
    readings: pd.DataFrame | None = None,
    crowns: gpd.GeoDataFrame | None = None,
) -> None:
    """Append ``circles``, one a measured tree (and ``sections``, ``searched``, ``readings`` and ``crowns`` where there
    are any) to a tree layer's GeoPackage. sections: dicts of :data:`SECTION_COLUMNS` and the centre ``x, y``, project
    metres."""
    circles = _discs(trees[trees["dbh_cm"].notna()], _CIRCLE_COLUMNS, "dbh_cm", trees.crs)
    measured = _discs(pd.DataFrame(sections), SECTION_COLUMNS, "d_cm", trees.crs) if sections else None
    more = {SECTIONS: measured, SEARCHED: searched, READINGS: readings, CROWNS: crowns}
    add_tables(geopackage, {CIRCLES: circles, **more})


def add_tables(geopackage: Path, tables: Mapping[str, pd.DataFrame | None]) -> None:
    """Append those that hold anything to a tree layer's GeoPackage, by their names."""
    shapes = {CIRCLES: "Polygon", SECTIONS: "Polygon", SEARCHED: "MultiPolygon", READINGS: None, CROWNS: "Polygon"}
    for name, table in tables.items():
        if table is not None and len(table):
            add_layer(geopackage, name, table, shapes[name])


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
