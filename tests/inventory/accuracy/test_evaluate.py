"""``evaluate``: the figures against hand-computed ones, what does not count, the files, and stale layers refused."""

from __future__ import annotations

import json
import xml.etree.ElementTree

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import pytest
from shapely.geometry import LineString
from shared_data import needs_shared

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.tables import accuracy_of, bootstrap, evidence_from_pairs, metrics_of
from treedgs_geo.inventory.pairs_layer import PAIRS, Matched, write_pairs
from treedgs_geo.verbs.evaluate import EvaluateSettings, run

CRS = pyproj.CRS.from_epsg(32615)


def pair(plot, k, field_cm, dbh_cm, status="auto", half=1.0):
    """A pair whose measured tree stands at (10 k, 0)."""
    known = dbh_cm is not None
    return {
        "plot_id": plot,
        "field_id": str(k),
        "tree_id": k,
        "field_cm": field_cm,
        "dbh_cm": dbh_cm,
        "delta_cm": dbh_cm - field_cm if known else None,
        "dbh_lo_cm": dbh_cm - half if known else None,
        "dbh_hi_cm": dbh_cm + half if known else None,
        "qc_flag": "ok" if known else "reject",
        "dist_m": 0.1,
        "margin": 5.0,
        "pair_status": status,
        "line": ((10.0 * k, 0.1), (10.0 * k, 0.0)),
    }


@pytest.fixture
def layer(tmp_path):
    """Plot a: 4 field trees (one refused, one not found, one rejected); b: 2 and a false tree; c: to a hand check."""
    pairs = [
        pair("a", 1, 20.0, 21.0),
        pair("a", 2, 30.0, None),
        pair("a", 4, 25.0, 40.0, "rejected"),
        pair("b", 5, 40.0, 37.0, "ok"),
        pair("b", 6, 20.0, 20.5, "moved"),
    ]
    field = pd.DataFrame(
        {
            "plot_id": list("aaaabbc"),
            "field_id": ["1", "2", "3", "4", "5", "6", "7"],
            "dbh_cm": [20.0, 30.0, 22.0, 25.0, 40.0, 20.0, 33.0],
            "x": 0.0,
            "y": 0.0,
        }
    )
    x = [10.0, 20.0, 40.0, 50.0, 60.0, 65.0, 66.0]
    measured = gpd.GeoDataFrame(
        {
            "tree_id": [1, 2, 4, 5, 6, 8, 9],
            "plot_id": list("aaabbbb"),
            "dbh_cm": [21.0, np.nan, 40.0, 37.0, 20.5, 15.0, 16.0],
            "paired": ["yes", "yes", "no", "yes", "yes", "no", "no"],
            "in_plot": ["in", "in", "edge", "in", "in", "in", "out"],
        },
        geometry=gpd.points_from_xy(x, np.zeros(7)),
        crs=CRS,
    )
    plots = [
        {"plot_id": name, "status": status, "radius_m": 9.0, "x": 0.0, "y": 0.0}
        for name, status in (("a", "auto"), ("b", "ok"), ("c", "check"))
    ]
    return write_pairs(tmp_path / "pairs.gpkg", Matched(pairs, [], field, measured, plots, []), CRS)


def test_figures_by_hand(layer):
    metrics = metrics_of(evidence_from_pairs(layer))
    assert (metrics["n"], metrics["n_reference"], metrics["n_false"], metrics["n_plots"]) == (3, 5, 1, 2)
    assert metrics["success_rate"] == 0.6 and metrics["coverage_90"] == pytest.approx(2 / 3, abs=1e-4)
    assert metrics["rmse_cm"] == pytest.approx(np.sqrt((1 + 9 + 0.25) / 3), abs=1e-4)
    assert metrics["rrmse_pct"] == pytest.approx(100 * np.sqrt(10.25 / 3) / (80 / 3), abs=1e-3)
    assert metrics["me_cm"] == pytest.approx(-0.5) and metrics["mae_cm"] == pytest.approx(1.5)
    assert metrics["per_plot"]["a"]["n"] == 1 and metrics["per_plot"]["a"]["success_rate"] == pytest.approx(
        1 / 3, abs=1e-4
    )
    assert metrics["pooled"] == {name: metrics[name] for name in metrics["pooled"]}
    assert metrics["bootstrap"]["by"] == "plot" and "2 plots" in metrics["bootstrap"]["note"]
    said = " ".join(metrics["notes"])
    assert "1 of 3 plots" in said and "c." in said and "1 field trees whose pair was rejected" in said
    assert evidence_from_pairs(layer, min_dbh_cm=15.5).n_false == {}


def test_files_are_whole_and_self_contained(layer, tmp_path):
    folder = tmp_path / "out"
    result = run(EvaluateSettings(pairs=layer, output=folder), Reporter())
    written = {path.name for path in folder.iterdir()}
    charts = {f"{name}.{kind}" for name in ("errors", "scatter", "plots") for kind in ("svg", "png")}
    assert written == charts | {"metrics.json", "per_plot.csv", "trees.csv", "table.tex", "evaluation.html"}
    metrics = json.loads((folder / "metrics.json").read_text())
    for name in ("n", "success_rate", "rmse_cm", "rrmse_pct", "mae_cm", "me_cm"):
        assert metrics[name] == result[name]
    page = (folder / "evaluation.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 3 and "src=" not in page and "$" not in page.split("<svg")[0]
    for name in ("errors", "scatter", "plots"):
        xml.etree.ElementTree.parse(folder / f"{name}.svg")
        assert (folder / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    table = pd.read_csv(folder / "per_plot.csv")
    assert table.plot_id.tolist() == ["a", "b", "pooled"]
    tex = (folder / "table.tex").read_text()
    # heading, two plots, over plots, pooled
    assert tex.count(r"\\") == 5 and r"Success \%" in tex
    # The same input and seed write the same bytes.
    run(EvaluateSettings(pairs=layer, output=tmp_path / "again"), Reporter())
    for name in written - {"errors.png", "scatter.png", "plots.png"}:
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name


def test_an_edited_layer_is_refused_until_matched_again(layer):
    pairs = gpd.read_file(layer, layer=PAIRS)
    pairs.loc[0, "geometry"] = LineString([(10.0, 0.1), (65.0, 0.0)])
    pairs.to_file(layer, layer=PAIRS, driver="GPKG", mode="w")
    with pytest.raises(InputError, match="a/1 no longer ends at tree 1; run match-plots again"):
        evidence_from_pairs(layer)


def test_no_dbh_at_all_is_reported_not_divided_by(layer, tmp_path):
    pairs = gpd.read_file(layer, layer=PAIRS)
    pairs["dbh_cm"] = np.nan
    pairs.to_file(layer, layer=PAIRS, driver="GPKG", mode="w")
    result = run(EvaluateSettings(pairs=layer, output=tmp_path / "out"), Reporter())
    assert result["n"] == 0 and result["rmse_cm"] is None and result["success_rate"] == 0
    assert "None of the 5" in (tmp_path / "out" / "evaluation.html").read_text()


def test_two_methods_are_compared_on_the_trees_both_measured(layer, tmp_path):
    """The other method refuses the tree that this one gets most wrong: on common trees it gains nothing by that."""
    other = tmp_path / "other.gpkg"
    other.write_bytes(layer.read_bytes())
    pairs = gpd.read_file(other, layer=PAIRS)
    pairs.loc[pairs.field_id == "5", "dbh_cm"] = np.nan
    pairs.loc[pairs.field_id == "1", "dbh_cm"] = 22.0
    pairs.loc[pairs.field_id == "2", "dbh_cm"] = 31.0
    pairs.to_file(other, layer=PAIRS, driver="GPKG", mode="w")
    run(EvaluateSettings(pairs=layer, against=other, output=tmp_path / "out"), Reporter())
    found = json.loads((tmp_path / "out" / "metrics.json").read_text())["against"]
    assert (found["n_common"], found["n_only_this"], found["n_only_other"]) == (2, 1, 1)
    assert found["this"]["rmse_cm"] == pytest.approx(np.sqrt((1 + 0.25) / 2), abs=1e-4)
    assert found["other"]["rmse_cm"] == pytest.approx(np.sqrt((4 + 0.25) / 2), abs=1e-4)
    low, high = found["rmse_gain_interval_cm"]
    assert low <= found["rmse_gain_cm"] < 0 and high <= 0 and found["by"] == "plot"
    assert "Against other.gpkg" in (tmp_path / "out" / "evaluation.html").read_text()


def test_wrong_inputs_are_reported(layer, tmp_path):
    for wrong in ({}, {"pairs": layer, "trees": layer}, {"trees": layer}, {"pairs": layer, "truth": layer}):
        with pytest.raises(InputError, match="give either pairs"):
            run(EvaluateSettings(output=tmp_path / "out", **wrong), Reporter())
    (tmp_path / "no.gpkg").write_text("no")
    with pytest.raises(InputError, match="match-plots"):
        run(EvaluateSettings(pairs=tmp_path / "no.gpkg", output=tmp_path / "out"), Reporter())
    assert not (tmp_path / "out" / "metrics.json").exists()


def test_bootstrap_covers_and_resamples_plots():
    """90 intervals from plots that share a bias: by plot they cover the true mean, by tree they would not."""
    rng = np.random.default_rng(7)
    hits = trees_hit = 0
    for _ in range(90):
        bias = np.repeat(rng.normal(0, 2.0, 12), 20)
        table = pd.DataFrame({"plot_id": np.repeat(np.arange(12), 20), "reference_cm": 25.0})
        table["error_cm"] = bias + rng.normal(0, 1.0, 240)
        low, high = bootstrap(table, repeats=300)["me_cm"]
        hits += low <= 0 <= high
        half = 1.96 * table.error_cm.std() / np.sqrt(240)
        trees_hit += abs(table.error_cm.mean()) <= half
    assert hits >= 75 and trees_hit < 60


def test_bootstrap_with_one_plot_says_so():
    table = pd.DataFrame({"plot_id": "a", "reference_cm": [20.0, 30, 25], "error_cm": [1.0, -1, np.nan]})
    found = bootstrap(table)
    assert found["by"] == "tree" and "one plot" in found["note"] and found == bootstrap(table)
    assert found["success_rate"][0] < 2 / 3 < found["success_rate"][1]


def test_truth_of_a_rendered_plot(tmp_path):
    from treedgs_geo.inventory.tree_layer import write_trees
    from treedgs_geo.stems.quality.tree import Tree

    truth = needs_shared("plot_e") / "truth" / "trees.csv"
    table = pd.read_csv(truth)
    trees = [
        Tree(k, r.E_bh, r.N_bh, dbh_cm=r.dbh_cm + 0.5, dbh_se_cm=0.5, method="photos")
        for k, r in table.iterrows()
        if k != 3
    ]
    write_trees(tmp_path / "trees.gpkg", trees, pyproj.CRS.from_epsg(6344))
    settings = EvaluateSettings(trees=tmp_path / "trees.gpkg", truth=truth, output=tmp_path / "out")
    result = run(settings, Reporter())
    assert (result["n"], result["n_reference"], result["n_false"]) == (16, 17, 0)
    assert result["rmse_cm"] == pytest.approx(0.5, abs=0.01) and result["coverage_90"] == 1.0
    assert list(json.loads((tmp_path / "out" / "metrics.json").read_text())["per_plot"]) == ["plot_e"]


def test_accuracy_counts_intervals_only_where_there_is_one():
    table = pd.DataFrame(
        {"reference_cm": [20.0, 30.0, 10.0], "error_cm": [1.0, 2.0, np.nan], "inside_90": [True, None, None]}
    )
    assert accuracy_of(table).coverage_90 == 1.0 and accuracy_of(table).success_rate == pytest.approx(2 / 3)
