"""Plots and trees as map layers: GeoPackage and shapefiles, always metric; names of at most 10 characters."""

from __future__ import annotations

import shutil
import tempfile
from importlib.resources import files
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
from shapely.geometry import Point

from ...core.files import atomic_path, ensure_writable
from ..tree_layer import save_style
from .survey import Stand

PLOTS, TREES = "stand_plots", "stand_trees"
#: Estimate of a plot -> field name.
_PLOT_FIELDS = {
    "plot_id": "plot_id",
    "shape": "shape",
    "edge": "edge",
    "area_ha": "area_ha",
    "expansion": "expansion",
    "n_trees": "n_trees",
    "n_missing": "n_missing",
    "n_dead": "n_dead",
    "trees_ha": "trees_ha",
    "ba_m2_ha": "ba_m2_ha",
    "qmd_cm": "qmd_cm",
    "lorey_m": "lorey_m",
    "dominant_m": "dominant_m",
    "volume_m3_ha": "vol_m3_ha",
    "biomass_t_ha": "bio_t_ha",
}


def plot_layer(stand: Stand) -> gpd.GeoDataFrame:
    """One polygon a plot with its figures; plots without a place have no geometry."""
    table = stand.plot_rows[list(_PLOT_FIELDS)].rename(columns=_PLOT_FIELDS)
    return gpd.GeoDataFrame(table, geometry=[plot.outline for plot in stand.plots], crs=stand.crs)


def tree_layer(stand: Stand) -> gpd.GeoDataFrame:
    """One point a tree and plot, also those that do not count (``counts_as``); ``tph``: trees a hectare it stands for.

    Rows of stand-ins are folded into the tree that stands in: ``tph`` holds them, ``weight`` does not.
    """
    v = stand.values
    per_ha = stand.rows.groupby(["plot", "tree"])["per_ha"].sum()
    rows = []
    for frame in (stand.rows[stand.rows["kind"] == "measured"], stand.missing, stand.dead):
        for row in frame.itertuples():
            k, plot = int(row.tree), int(row.plot)
            rows.append(
                {
                    "plot_id": stand.plots[plot].plot_id,
                    "tree_id": str(stand.trees["tree_id"].iloc[k]),
                    "species": stand.trees["species"].iloc[k],
                    "counts_as": row.kind,
                    "dbh_cm": v.dbh[k],
                    "dbh_se_cm": v.se[k],
                    "height_m": v.height[k],
                    "height_src": v.height_source[k] or None,
                    "weight": float(row.weight),
                    "tph": float(per_ha.get((plot, k), 0.0)) if row.kind == "measured" else 0.0,
                    "ba_m2": v.value["ba"][k],
                    "volume_m3": v.value["volume"][k],
                    "biomass_kg": v.value["biomass"][k],
                    "qc_flag": stand.trees["qc_flag"].iloc[k],
                    "qc_reason": stand.trees["qc_reason"].iloc[k] or None,
                    "geometry": _point(stand, k),
                }
            )
    return gpd.GeoDataFrame(pd.DataFrame(rows), geometry="geometry", crs=stand.crs)


def write_geopackage(path: Path, stand: Stand) -> Path:
    """Both layers, styled where a style exists."""
    with atomic_path(path) as temporary:
        for name, layer, kind in ((PLOTS, plot_layer(stand), "Unknown"), (TREES, tree_layer(stand), "Point")):
            more = {"mode": "a"} if temporary.exists() else {"dataset_options": {"VERSION": "1.2"}}
            layer.to_file(temporary, layer=name, driver="GPKG", engine="pyogrio", geometry_type=kind, **more)
            style = files("treedgs_geo.inventory") / "styles" / f"{name}.qml"
            if style.is_file():
                save_style(temporary, name, style.read_text(encoding="utf-8"))
    return Path(path)


def write_shapefiles(folder: Path, stand: Stand) -> list[Path]:
    """``plots.shp`` and ``trees.shp``; nothing for a layer that has no place on the map."""
    written = []
    for name, layer in (("plots", plot_layer(stand)), ("trees", tree_layer(stand))):
        layer = layer[layer.geometry.notna()]
        if not len(layer):
            continue
        target = Path(folder) / f"{name}.shp"
        ensure_writable(target)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".shp") as scratch:
            layer.to_file(Path(scratch) / target.name, driver="ESRI Shapefile", engine="pyogrio", encoding="UTF-8")
            for part in Path(scratch).iterdir():
                shutil.move(str(part), target.parent / part.name)
        written.append(target)
    return written


def _point(stand: Stand, k: int) -> Point | None:
    x, y = stand.trees["x"].iloc[k], stand.trees["y"].iloc[k]
    return Point(x, y) if np.isfinite(x) and np.isfinite(y) else None
