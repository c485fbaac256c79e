"""The tree layer: documented fields, NULL for missing, styled, the same in every format."""

from __future__ import annotations

import math
import sqlite3

import pandas as pd
import pyproj
import pytest

from treedgs_geo.core.errors import OutputError
from treedgs_geo.core.plots import Plot
from treedgs_geo.inventory.report import write_report
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import SHORT_NAMES, read_trees
from treedgs_geo.stems.quality.tree import TREE_FIELDS, Tree

CRS = pyproj.CRS("EPSG:6344")


def _trees() -> list[Tree]:
    return [
        Tree(
            1,
            611337.123,
            3718451.456,
            38.012,
            plot_id="a",
            dbh_cm=30.11,
            dbh_se_cm=0.4,
            n_views=7,
            method="photos",
            height_m=21.4,
            height_se_m=0.4,
        ),
        Tree(
            2, 611339.0, 3718450.0, None, qc_flag="reject", qc_reason="few_views,lean", dbh_cm=12.0, height_why="no_top"
        ),
    ]


@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".geojson"])
def test_every_format_keeps_names_values_and_nulls(tmp_path, suffix):
    path = write_trees(tmp_path / f"trees{suffix}", _trees(), CRS)
    table = read_trees(path)
    assert list(table.columns[:-1]) == list(TREE_FIELDS)
    assert max(len(SHORT_NAMES.get(name, name)) for name in TREE_FIELDS) <= 10  # what a shapefile holds
    assert table.crs == CRS and bool(table.geometry.has_z.all())
    good, bad = table.iloc[0], table.iloc[1]
    assert good["dbh_cm"] == 30.11 and good["n_views"] == 7
    assert math.isclose(good["dbh_lo_cm"], 30.11 - 1.645 * 0.4, abs_tol=0.006)
    assert math.isclose(good["ba_m2"], math.pi / 4 * 0.3011**2, abs_tol=1e-6)
    assert pd.isna(bad["dbh_cm"]) and pd.isna(bad["z_ground"]) and pd.isna(bad["ba_m2"])
    assert bad["qc_reason"] == "few_views,lean"
    assert (good["height_m"], good["height_se_m"]) == (21.4, 0.4) and pd.isna(good["height_why"])
    assert pd.isna(bad["height_se_m"]) and bad["height_why"] == "no_top"


def test_csv_carries_coordinates(tmp_path):
    table = pd.read_csv(write_trees(tmp_path / "trees.csv", _trees(), CRS))
    assert table.loc[0, "x"] == 611337.123 and table["dbh_cm"].isna().tolist() == [False, True]


def test_geopackage_carries_its_style(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", _trees(), CRS)
    with sqlite3.connect(path) as connection:
        ((qml, default),) = connection.execute(
            "SELECT styleQML, useAsDefault FROM layer_styles WHERE f_table_name='trees'"
        )
    assert qml.lstrip().startswith("<") and "qgis" in qml and default == 1


def test_empty_layer_keeps_its_schema(tmp_path):
    table = read_trees(write_trees(tmp_path / "trees.gpkg", [], CRS))
    assert len(table) == 0 and list(table.columns[:-1]) == list(TREE_FIELDS)


def test_unknown_format_is_refused(tmp_path):
    with pytest.raises(OutputError, match="rename the output"):
        write_trees(tmp_path / "trees.xyz", _trees(), CRS)
    assert list(tmp_path.iterdir()) == []


def test_a_rejection_needs_a_documented_reason():
    with pytest.raises(ValueError, match="undocumented"):
        Tree(1, 0, 0, qc_reason="bad luck")
    with pytest.raises(ValueError, match="without a reason"):
        Tree(1, 0, 0, qc_flag="reject").finish()


def test_report_names_each_tree_and_reason(tmp_path):
    trees = read_trees(write_trees(tmp_path / "trees.gpkg", _trees(), CRS))
    page = write_report(
        tmp_path / "report.html",
        trees,
        [Plot("a", 611338, 3718451, 5)],
        {"photos": 12},
        ["2 photos are blurred"],
        {"geotag": {"seconds": 1.0, "peak_memory_mb": 90}},
    ).read_text()
    for words in (
        "30.1",
        "too few photos see the stem",
        "2 photos are blurred",
        "data:image/png;base64",
        "1 stems have a DBH",
        "1 more were found and refused",
        "Stems that were not found are in no list",
        "id='tree-1'",
    ):
        assert words in page
    assert "http" not in page and page.count("data:image/png;base64") == 1 and "<svg id='map'" in page


def test_a_report_without_stems_says_so_and_draws_nothing(tmp_path):
    """Photos from straight above: the reason, the run and its cost, no empty charts."""
    trees = read_trees(write_trees(tmp_path / "trees.gpkg", [], CRS))
    stages = {"geotag": {"seconds": 1.0, "peak_memory_mb": 90}}
    page = write_report(tmp_path / "r.html", trees, [], {"photos": 18}, ["No stem is measurable."], stages).read_text()
    assert "No stem was found" in page and "No stem is measurable." in page and "geotag" in page
    assert "<img" not in page and "<h2>Trees" not in page
