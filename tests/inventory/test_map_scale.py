"""Trees, plots and boundaries on a map that stretches: no distance and no area is taken there."""

from __future__ import annotations

import geopandas as gpd
import pandas as pd
import pytest
from inventory.stand_helpers import EAST, NORTH, make_survey

from treedgs_geo.cli import main
from treedgs_geo.inventory.tree_reading import read_trees

WEB = "EPSG:3857"


@pytest.fixture
def survey(tmp_path):
    """The usual survey, its tree layer reprojected to Web Mercator as QGIS does."""
    folder = make_survey(tmp_path)
    gpd.GeoDataFrame(read_trees(folder / "trees.gpkg")).to_crs(WEB).to_file(folder / "web.gpkg", layer="trees")
    pd.DataFrame(
        [{"plot_id": "A", "tree_id": k, "azimuth_deg": 40 * k, "distance_m": 3 + k, "dbh_cm": 20 + k} for k in range(8)]
    ).to_csv(folder / "field.csv", index=False)
    return folder


def refused(capsys, *words):
    assert main([*map(str, words), "--log-format", "plain"]) == 2
    reported = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(reported) == 1 and "not made for measuring" in reported[0]
    assert "EPSG:32615 (WGS 84 / UTM zone 15N)" in reported[0]
    return reported[0]


def test_a_tree_layer_on_a_stretching_map_is_refused(survey, capsys):
    """Before: plots of 4 ares held the trees of 2.8: 20.4 m2/ha for 27.4, without a word."""
    plots, out = survey / "plots.csv", survey / "out"
    reported = refused(
        capsys, "stand-table", "--trees", survey / "web.gpkg", "--plots", plots, "--species", "PITA", "--output", out
    )
    assert "web.gpkg: " in reported and not out.exists()
    reported = refused(
        capsys,
        "match-plots",
        "--trees",
        survey / "web.gpkg",
        "--plots",
        plots,
        "--field",
        survey / "field.csv",
        "--output",
        survey / "out.gpkg",
    )
    assert "web.gpkg: " in reported and not (survey / "out.gpkg").exists()


def test_a_tally_is_not_expanded_by_an_area_of_such_a_map(survey, capsys):
    tally = pd.DataFrame([{"plot_id": "A", "tree_id": k, "dbh_cm": 20 + k} for k in range(8)])
    tally.to_csv(survey / "tally.csv", index=False)
    reported = refused(
        capsys,
        "stand-table",
        "--field",
        survey / "tally.csv",
        "--boundary",
        survey / "stand.gpkg",
        "--crs",
        WEB,
        "--species",
        "PITA",
        "--output",
        survey / "out",
    )
    assert "stand.gpkg: " in reported and not (survey / "out").exists()


def test_a_layer_whose_numbers_are_not_of_its_crs_is_refused(survey, capsys):
    trees = gpd.GeoDataFrame(read_trees(survey / "trees.gpkg"))
    trees["geometry"] = trees.translate(-EAST - 190, -NORTH + 30)
    trees.to_file(survey / "moved.gpkg", layer="trees")
    words = [
        "stand-table",
        "--trees",
        survey / "moved.gpkg",
        "--plots",
        survey / "plots.csv",
        "--species",
        "PITA",
        "--output",
        survey / "out",
        "--log-format",
        "plain",
    ]
    assert main([str(word) for word in words]) == 2
    assert "local metres by their size" in capsys.readouterr().err
