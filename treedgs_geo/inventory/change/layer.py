"""The layer ``change``: one point a tree of either date, with what became of it."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ...core.geopackage import atomic_geopackage, save_style

LAYER = "change"
OWN_LAYERS = {LAYER: frozenset({"before_id", "after_id", "fate", "growth_cm"})}
_DECIMALS = {"dbh1_cm": 2, "dbh2_cm": 2, "ba_growth": 5, "x": 3, "y": 3, "dist_m": 3}


def change_table(trees: pd.DataFrame, plots: list[str], crs: pyproj.CRS | None) -> gpd.GeoDataFrame:
    """Columns of at most 10 characters, missing NULL."""
    made = pd.DataFrame(
        {
            "plot_id": np.array(plots, object)[trees["plot"].to_numpy(int)],
            "before_id": pd.array(trees["before_id"], dtype="Int64"),
            "after_id": pd.array(trees["after_id"], dtype="Int64"),
            "fate": trees["fate"].to_numpy(object),
            "dbh1_cm": trees["dbh1_cm"],
            "dbh2_cm": trees["dbh2_cm"],
            "growth_cm": trees["growth_cm"].round(2),
            "growth_se": trees["growth_se"].round(2),
            "grow_lo": trees["grow_lo"].round(2),
            "grow_hi": trees["grow_hi"].round(2),
            "grow_cm_a": trees["growth_cm_a"].round(3),
            "ba_growth": trees["ba_growth_m2"],
            "dist_m": trees["dist_m"],
            "x": trees["x"],
            "y": trees["y"],
        }
    ).round(_DECIMALS)
    return gpd.GeoDataFrame(made, geometry=gpd.points_from_xy(made["x"], made["y"]), crs=crs)


def write_layer(path: Path, table: gpd.GeoDataFrame) -> Path:
    """Write it, styled; other layers of an existing file stay."""
    with atomic_geopackage(path, OWN_LAYERS) as temporary:
        table.to_file(
            temporary, layer=LAYER, driver="GPKG", engine="pyogrio", geometry_type="Point",
            dataset_options={"VERSION": "1.2"},
        )  # fmt: skip
        save_style(temporary, LAYER)
    return Path(path)
