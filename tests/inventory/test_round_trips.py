"""GeoPackage -> shapefile -> CSV -> GeoPackage: the documented fields come back, missing stays missing."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import pytest

from treedgs_geo.inventory.measured import read_measured
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.stems.quality.tree import TREE_FIELDS, Tree

CRS = pyproj.CRS("EPSG:6344")


def _forest(count: int = 80) -> list[Tree]:
    rng = np.random.default_rng(2)
    trees = []
    for k in range(1, count + 1):
        seen = rng.random() < 0.8
        trees.append(
            Tree(
                k,
                611300 + rng.uniform(0, 99),
                3718400 + rng.uniform(0, 99),
                None if rng.random() < 0.1 else float(rng.uniform(-5, 900)),
                plot_id=None if k % 7 == 0 else f"Plöt {k % 3}",
                dbh_cm=float(rng.uniform(5, 90)) if seen else None,
                dbh_se_cm=float(rng.uniform(0.1, 3)) if seen else None,
                height_m=float(rng.uniform(3, 40)),
                n_views=int(rng.integers(0, 60)),
                n_pts=None if k % 5 else int(rng.integers(0, 2**31 - 1)),
                lean_deg=float(rng.uniform(0, 25)),
                opac_mean=None if k % 2 else float(rng.uniform(0, 1)),
                method="photos",
                qc_flag="ok" if seen else "reject",
                qc_reason="" if seen else "few_views",
                run_id="r1",
            )
        )
    return trees


def _same(one: pd.DataFrame, other: pd.DataFrame) -> None:
    for name in TREE_FIELDS:
        a, b = one[name], other[name]
        if pd.api.types.is_numeric_dtype(a):
            left, right = (pd.to_numeric(c).to_numpy(float, na_value=np.nan) for c in (a, b))
            np.testing.assert_array_equal(np.isnan(left), np.isnan(right), err_msg=name)
            np.testing.assert_allclose(left, right, rtol=0, atol=1e-9, err_msg=name)
        else:
            left, right = (["" if pd.isna(v) else str(v) for v in c] for c in (a, b))
            assert left == right, name


def test_a_layer_through_every_format_and_back(tmp_path):
    first = read_trees(write_trees(tmp_path / "a.gpkg", _forest(), CRS))
    first.to_file(tmp_path / "b.shp", engine="pyogrio", encoding="UTF-8")
    second = read_trees(tmp_path / "b.shp")
    _same(first, second)
    assert second.crs == CRS
    np.testing.assert_allclose(
        second.geometry.get_coordinates(include_z=True), first.geometry.get_coordinates(include_z=True), atol=1e-9
    )
    pd.DataFrame(second.drop(columns="geometry")).to_csv(tmp_path / "c.csv", index=False)
    third = pd.read_csv(tmp_path / "c.csv", dtype={"plot_id": str, "qc_reason": str, "run_id": str})
    _same(first, third)
    back = gpd.GeoDataFrame(
        third, geometry=gpd.points_from_xy(third["x"], third["y"], third["z_ground"].fillna(0)), crs=CRS
    )
    back.to_file(tmp_path / "d.gpkg", layer="trees", engine="pyogrio")
    fourth = read_trees(tmp_path / "d.gpkg")
    _same(first, fourth)
    np.testing.assert_allclose(fourth.geometry.get_coordinates(), first.geometry.get_coordinates(), atol=5e-4)


@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".geojson", ".csv"])
def test_written_layers_are_taken_by_match_plots_alike(tmp_path, suffix):
    crs = None if suffix != ".csv" else CRS
    table = read_measured(write_trees(tmp_path / f"t{suffix}", _forest(), CRS), crs)
    wanted = read_measured(write_trees(tmp_path / "w.gpkg", _forest(), CRS), None)
    assert table["tree_id"].tolist() == wanted["tree_id"].tolist() and table.crs == CRS
    for name in ("x", "y", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm"):
        np.testing.assert_allclose(
            pd.to_numeric(table[name]).to_numpy(float, na_value=np.nan),
            pd.to_numeric(wanted[name]).to_numpy(float, na_value=np.nan),
            atol=1e-3,
        )
