"""Pairs edited by hand in real QGIS: they survive match-plots, feed evaluate, and name the trees of the stand table."""

from __future__ import annotations

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import pytest
from inventory.stand_helpers import Ears, edit_in_qgis, figures, report
from shared_data import needs_shared

from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.pairs_layer import FIELD, PAIR_COLUMNS, PAIRS, PLOTS
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs import evaluate, match_plots

#: What a person does: opens the layer with its style, starts editing, changes attributes and a line's end, saves.
QGIS_EDIT = """
import json, sys
from qgis.core import QgsApplication, QgsGeometry, QgsPointXY, QgsVectorLayer
app = QgsApplication([], False)
app.initQgis()
path, edits = sys.argv[1], json.loads(sys.argv[2])
layer = QgsVectorLayer(path + "|layername=pairs", "pairs", "ogr")
assert layer.isValid() and layer.loadDefaultStyle()[1], "no style"
print("RENDERER", layer.renderer().type(), layer.renderer().classAttribute())
assert layer.startEditing()
status = layer.fields().indexOf("pair_status")
for feature in list(layer.getFeatures()):
    what = edits.get(feature["field_id"])
    if isinstance(what, str):
        assert layer.changeAttributeValue(feature.id(), status, what)
    elif what:
        line = feature.geometry().asPolyline()
        assert layer.changeGeometry(feature.id(), QgsGeometry.fromPolylineXY([line[0], QgsPointXY(*what)]))
assert layer.commitChanges(), layer.commitErrors()
del layer
app.exitQgis()
print("SAVED")
"""

pytestmark = pytest.mark.qgis


@pytest.fixture
def paired(tmp_path):
    """``plot_a``: true stems with known DBH errors as measured trees, the crew's tally, paired."""
    folder = needs_shared("plot_a")
    truth = pd.read_csv(folder / "truth" / "trees.csv")
    rng = np.random.default_rng(1)
    trees = [
        Tree(k + 1, r.E_bh, r.N_bh, dbh_cm=r.dbh_cm + rng.normal(0, 0.5), dbh_se_cm=0.5, method="photos")
        for k, r in truth.iterrows()
    ]
    write_trees(tmp_path / "trees.gpkg", trees, pyproj.CRS.from_epsg(6344))

    def match():
        settings = match_plots.MatchPlotsSettings(
            trees=tmp_path / "trees.gpkg",
            field=folder / "field_trees.csv",
            plots=folder / "plots.csv",
            output=tmp_path / "pairs.gpkg",
        )
        return match_plots.run(settings, Ears())

    match()
    return tmp_path, folder, match


def score(folder):
    """``evaluate``'s metrics."""
    settings = evaluate.EvaluateSettings(pairs=folder / "pairs.gpkg", output=folder / "evaluation")
    evaluate.run(settings, Ears())
    return json.loads((folder / "evaluation" / "metrics.json").read_text())


def test_pairs_edited_in_qgis_feed_evaluate_and_survive(paired):
    folder, data, match = paired
    path = folder / "pairs.gpkg"
    before = gpd.read_file(path, layer=PAIRS).set_index("field_id")
    first = score(folder)
    assert set(PAIR_COLUMNS) <= {*before.columns, "field_id"} and set(before.pair_status) == {"auto"}
    confirmed, dragged, rejected = "1", "3", "7"
    # The other tree is one that no field tree is paired with: a stem outside the plot, or the rejected one's.
    other = before.loc[rejected].geometry.coords[-1]
    said = edit_in_qgis(QGIS_EDIT, path, {confirmed: "ok", rejected: "rejected", dragged: list(other[:2])})
    assert "graduatedSymbol" in said and "delta_cm" in said  # coloured by the difference of the DBHs
    edited = gpd.read_file(path, layer=PAIRS).set_index("field_id")
    assert edited.pair_status[[confirmed, rejected]].tolist() == ["ok", "rejected"]
    with pytest.raises(InputError, match="run match-plots again"):
        score(folder)  # the DBH beside the dragged line is still the old tree's
    with pytest.raises(InputError, match="no longer ends at tree"):
        figures(folder, plots=data / "plots.csv", boundary=None, pairs=path, species=None)
    for _ in range(2):
        match()
        after = gpd.read_file(path, layer=PAIRS).set_index("field_id")
        assert after.pair_status[[confirmed, dragged, rejected]].tolist() == ["ok", "moved", "rejected"]
        assert after.tree_id[dragged] == before.tree_id[rejected] and after.dbh_cm[dragged] == before.dbh_cm[rejected]
        rest = before.index.drop([dragged, rejected])
        assert (after.tree_id[rest] == before.tree_id[rest]).all()
    second = score(folder)
    assert second["n_reference"] == first["n_reference"] - 1  # the rejected one does not count
    assert any("rejected by a person" in note for note in second["notes"])
    table = pd.read_csv(folder / "evaluation" / "trees.csv", dtype={"tree_id": str}).set_index("tree_id")
    assert rejected not in table.index
    assert table.error_cm[dragged] == pytest.approx(before.dbh_cm[rejected] - before.field_cm[dragged], abs=0.02)
    kept = before.loc[rest]
    errors = np.append((kept.dbh_cm - kept.field_cm).to_numpy(), table.error_cm[dragged])
    assert second["rmse_cm"] == pytest.approx(np.sqrt(np.nanmean(errors**2)), abs=0.01)


def test_the_stand_table_learns_species_status_and_heights_from_the_pairs(paired):
    folder, data, match = paired
    more = {"plots": data / "plots.csv", "boundary": None, "pairs": folder / "pairs.gpkg", "species": None}
    result, ears, out = report(folder, **more, field=data / "field_trees.csv")
    tally = pd.read_csv(data / "field_trees.csv", dtype={"tree_id": str}).set_index("tree_id")
    pairs = gpd.read_file(folder / "pairs.gpkg", layer=PAIRS)
    trees = pd.read_csv(out / "stand_trees.csv", dtype={"tree_id": str}).set_index("tree_id")
    n_dead = int((tally.status == "dead").sum())
    assert n_dead and (trees.counts_as == "dead").sum() == n_dead
    for pair in pairs.itertuples():
        if str(pair.tree_id) in trees.index:  # the plot's line may leave one outside
            row = trees.loc[str(pair.tree_id)]
            assert row.species == "PITA" and row.height_m == pytest.approx(tally.height_m[pair.field_id])
            assert (row.counts_as == "dead") == (tally.status[pair.field_id] == "dead")
    assert result["volume_m3_ha"] > 100 and any("co-registered" in text for text in ears.infos)
    plots = gpd.read_file(folder / "pairs.gpkg", layer=PLOTS)
    drawn = gpd.read_file(out / "stand.gpkg", layer="stand_plots").geometry.centroid
    assert [drawn.x[0], drawn.y[0]] == pytest.approx([plots.x[0], plots.y[0]], abs=1e-3)
    # Without the pairs nobody knows the dead tree: the plot holds one live tree more.
    bare, reported = figures(folder, plots=data / "plots.csv", boundary=None)
    assert len(bare.rows) >= result["n_trees"] and any("No volume for the stand" in w for w in reported.warnings)
    assert set(gpd.read_file(folder / "pairs.gpkg", layer=FIELD).columns) >= {"species", "status", "field_id"}
