"""Layers beside the tree points: each stem's circle at true scale, and measured slices of it."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from shapely.geometry import Point

from ..core.geopackage import save_style

#: Names of the layers in ``trees.gpkg``.
CIRCLES, SLICES = "circles", "slices"
#: Quarter-circle segments: 0.1 mm off the circle at 1 m diameter.
_SEGMENTS = 16
#: Columns of ``slices``.
SLICE_COLUMNS = ("tree_id", "height_m", "d_cm", "rms_cm", "n_pts", "arc_deg")


def circle_table(trees: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Polygons of the diameter at breast height, one a measured tree: ``tree_id, dbh_cm, dbh_se_cm, qc_flag``."""
    measured = trees[trees["dbh_cm"].notna()]
    table = pd.DataFrame({name: measured[name] for name in ("tree_id", "dbh_cm", "dbh_se_cm", "qc_flag")})
    shapes = [
        Point(x, y).buffer(dbh / 200, _SEGMENTS)
        for x, y, dbh in zip(measured["x"], measured["y"], measured["dbh_cm"], strict=True)
    ]
    return gpd.GeoDataFrame(table, geometry=gpd.GeoSeries(shapes, index=table.index, crs=trees.crs), crs=trees.crs)


def slice_table(slices: list[dict], crs: pyproj.CRS) -> gpd.GeoDataFrame:
    """Polygons of measured slices. slices: dicts of :data:`SLICE_COLUMNS` and the centre ``x, y`` (project metres)."""
    table = pd.DataFrame([{k: row[k] for k in SLICE_COLUMNS} for row in slices], columns=list(SLICE_COLUMNS))
    shapes = [Point(row["x"], row["y"]).buffer(row["d_cm"] / 200, _SEGMENTS) for row in slices]
    return gpd.GeoDataFrame(table, geometry=gpd.GeoSeries(shapes, crs=crs), crs=crs)


def add_layers(geopackage: Path, trees: gpd.GeoDataFrame, slices: list[dict] | None = None) -> None:
    """Append ``circles`` (and ``slices`` where there are any) to a tree layer's GeoPackage, styled."""
    tables = {CIRCLES: circle_table(trees)}
    if slices:
        tables[SLICES] = slice_table(slices, trees.crs)
    for name, table in tables.items():
        if not len(table):
            continue
        table.to_file(geopackage, layer=name, driver="GPKG", engine="pyogrio", mode="a", geometry_type="Polygon")
        save_style(geopackage, name)


def stem_slices(
    xyz: np.ndarray, tree_id: np.ndarray, trees: list, spacing_m: float = 0.5, thickness_m: float = 0.2
) -> list[dict]:
    """Circles fitted to horizontal slices of each measured stem, for looking at; the DBH does not come from them.

    xyz: (N, 3) project metres. tree_id: (N,) integers. trees: :class:`~treedgs_geo.stems.quality.tree.Tree` records
    with a DBH and a ground height. Slices from 0.5 to 4.5 m above ground; one without a believable circle is left out.
    """
    from ..stems.geometry.circles import geometric_circle

    order = np.argsort(tree_id, kind="stable")
    ids, starts = np.unique(tree_id[order], return_index=True)
    groups = dict(zip(ids.tolist(), np.split(order, starts[1:]), strict=True))
    found = []
    for tree in trees:
        if tree.dbh_cm is None or tree.z_ground is None or tree.tree_id not in groups:
            continue
        points = xyz[groups[tree.tree_id]] - [tree.x, tree.y, tree.z_ground]
        radius = tree.dbh_cm / 200
        for height in np.arange(0.5, 4.51, spacing_m):
            here = points[np.abs(points[:, 2] - height) <= thickness_m / 2, :2]
            if len(here) < 24:
                # Drone LiDAR: as thick as the slices are apart.
                here = points[np.abs(points[:, 2] - height) <= spacing_m / 2, :2]
            if len(here) < 12:
                continue
            middle = np.median(here, axis=0)
            near = here[np.abs(np.hypot(*(here - middle).T) - radius) < max(0.5 * radius, 0.05)]
            if len(near) < 12:
                continue
            fitted = geometric_circle(near, np.ones(len(near)), np.array([*middle, radius]), 0.01)
            if fitted is None:
                continue
            x, y, r = fitted[0]
            residual = np.hypot(near[:, 0] - x, near[:, 1] - y) - r
            rms = float(np.sqrt(np.mean(residual**2)))
            angle = np.floor((np.arctan2(near[:, 1] - y, near[:, 0] - x) + np.pi) / (2 * np.pi) * 24).astype(int) % 24
            arc = 15.0 * len(np.unique(angle))
            if not 0.5 * radius < r < 2 * radius or arc < 120 or rms > max(0.25 * r, 0.03):
                continue
            found.append(
                {
                    "tree_id": int(tree.tree_id),
                    "height_m": round(float(height), 2),
                    "d_cm": round(200 * float(r), 2),
                    "rms_cm": round(100 * rms, 2),
                    "n_pts": len(near),
                    "arc_deg": arc,
                    "x": float(x + tree.x),
                    "y": float(y + tree.y),
                }
            )
    return found
