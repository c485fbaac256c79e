"""Plots and trees as map layers: GeoPackage and shapefiles, always metric; names of at most 10 characters."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from ...core.files import ensure_writable
from ...core.geopackage import atomic_geopackage
from ...core.layer_files import add_layer, write_shapefile
from .stem_volume import CURVES
from .survey import Stand

PLOTS, TREES = "stand_plots", "stand_trees"
#: The columns by which a layer of that name is known as ours.
OWN_LAYERS = {
    PLOTS: frozenset({"plot_id", "expansion", "ba_m2_ha", "trees_ha"}),
    TREES: frozenset({"plot_id", "tree_id", "counts_as", "tph"}),
}
#: What is known of a plot, and fields whose names are shorter.
_PLOT_FIELDS = (
    "plot_id", "shape", "edge", "area_ha", "expansion", "n_trees", "n_missing", "n_dead", "trees_ha", "ba_m2_ha",
    "qmd_cm", "lorey_m", "dominant_m", "volume_m3_ha", "biomass_t_ha",
)  # fmt: skip
_SHORT = {"volume_m3_ha": "vol_m3_ha", "biomass_t_ha": "bio_t_ha"}


def plot_layer(stand: Stand) -> gpd.GeoDataFrame:
    """One polygon a plot with its figures; plots without a place have no geometry."""
    table = stand.plot_rows[list(_PLOT_FIELDS)].rename(columns=_SHORT)
    return gpd.GeoDataFrame(table, geometry=[plot.outline for plot in stand.plots], crs=stand.crs)


def tree_layer(stand: Stand) -> gpd.GeoDataFrame:
    """One point a tree and plot, also those that do not count (``counts_as``); ``tph``: trees a hectare it stands for.

    Rows of stand-ins are folded into the tree that stands in: ``tph`` holds them, ``weight`` does not.
    """
    v, listed = stand.values, stand.listed()
    tree, plot = listed["tree"].to_numpy(int), listed["plot"].to_numpy(int)
    counted = (listed["kind"] == "measured").to_numpy()
    per_ha = stand.rows.groupby(["plot", "tree"])["per_ha"].sum()
    place = stand.trees[["x", "y"]].to_numpy(float)[tree]
    known = np.isfinite(place).all(axis=1)
    table = pd.DataFrame(
        {
            "plot_id": np.array([p.plot_id for p in stand.plots], object)[plot],
            "tree_id": stand.trees["tree_id"].astype(str).to_numpy(object)[tree],
            "species": stand.trees["species"].to_numpy(object)[tree],
            "counts_as": listed["kind"].to_numpy(object),
            "dbh_cm": v.dbh[tree],
            "dbh_se_cm": v.se[tree],
            "height_m": v.height[tree],
            "height_src": [text or None for text in v.height_source[tree]],
            "weight": listed["weight"].to_numpy(float),
            "tph": np.where(counted, per_ha.reindex(pd.MultiIndex.from_arrays([plot, tree])).fillna(0.0), 0.0),
            "ba_m2": v.value["ba"][tree],
            "volume_m3": v.value["volume"][tree],
            "biomass_kg": v.value["biomass"][tree],
            **{name: stand.trees[name].to_numpy(float)[tree] for name in CURVES if name in stand.trees},
            "qc_flag": stand.trees["qc_flag"].to_numpy(object)[tree],
            "qc_reason": [text or None for text in stand.trees["qc_reason"].fillna("").to_numpy(object)[tree]],
            "note": [text or None for text in stand.trees["note"].fillna("").to_numpy(object)[tree]],
        }
    )
    points = np.where(known, shapely.points(np.where(known[:, None], place, 0.0)), None)
    return gpd.GeoDataFrame(table, geometry=points, crs=stand.crs)


def write_geopackage(path: Path, stand: Stand) -> Path:
    """Both layers, styled where a style exists; other layers of an existing file stay."""
    with atomic_geopackage(path, OWN_LAYERS) as temporary:
        add_layer(temporary, PLOTS, plot_layer(stand), "Unknown")
        add_layer(temporary, TREES, tree_layer(stand), "Point")
    return Path(path)


def write_shapefiles(folder: Path, stand: Stand) -> list[Path]:
    """``stand_plots.shp`` and ``stand_trees.shp``; nothing for a layer that has no place on the map."""
    written = []
    for name, layer in ((PLOTS, plot_layer(stand)), (TREES, tree_layer(stand))):
        layer = layer[layer.geometry.notna()]
        if not len(layer):
            continue
        target = Path(folder) / f"{name}.shp"
        ensure_writable(target)
        write_shapefile(target, layer)
        written.append(target)
    return written
