"""Dry run, models, batches, companion layers, and what happens to files that QGIS has open."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from qgis_helpers import refused, stems_cloud


def tree(folder: Path) -> dict[str, tuple[int, float]]:
    """Every file below a folder with its size and time."""
    return {str(p.relative_to(folder)): (p.stat().st_size, p.stat().st_mtime) for p in folder.rglob("*") if p.is_file()}


def results(done) -> dict:
    return json.loads(done.stdout[done.stdout.index("{") :])["results"]


def test_a_dry_run_of_photos_reports_and_changes_nothing(qgis, simulated_plot, tmp_path):
    before = tree(simulated_plot)
    values = {
        "PHOTOS": simulated_plot / "images",
        "GEOTAGS": simulated_plot,
        "CRS": "EPSG:6344",
        "PLOTS": simulated_plot / "plots.csv",
        "WORKSPACE": tmp_path / "not yet" / "work",
        "OUTPUT": tmp_path / "not yet" / "trees.gpkg",
        "DRY_RUN": "true",
    }
    arguments = [f"{name}={value}" for name, value in values.items()]
    done = qgis("run", "treedgs:photostodbh", "--json", "--", *arguments)
    assert done.returncode == 0, done.stdout
    found = results(done)
    assert found["STATUS"].startswith("ready: about") and found["PREDICTED_S"] > 5 and "OUTPUT" not in found
    assert found["N_PHOTOS"] == len(list((simulated_plot / "images").glob("*.JPG")))
    assert 50 < found["FIX_PCT"] <= 100 and 50 < found["OVERLAP_PCT"] <= 100
    assert found["NEEDED_MEMORY_GB"] > 0.5 and found["NEEDED_DISK_GB"] > 0
    assert list(tmp_path.iterdir()) == [] and tree(simulated_plot) == before


def test_a_dry_run_finds_what_would_end_the_job(qgis, simulated_plot, tmp_path):
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,radius_m\nfar,100000,3000000,10\n")
    (tmp_path / "a file").write_text("in the way")
    done = qgis.run(
        "photostodbh",
        PHOTOS=simulated_plot / "images",
        GEOTAGS=simulated_plot,
        CRS="EPSG:6344",
        PLOTS=tmp_path / "plots.csv",
        WORKSPACE=tmp_path / "a file" / "work",
        OUTPUT=tmp_path / "trees.gpkg",
        DRY_RUN="true",
    )
    refused(done, "cannot be written", "(and 1 more, above)", "from the nearest photo")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a file", "plots.csv"]


def test_a_dry_run_of_a_cloud(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz")
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT=tmp_path / "t.gpkg", DRY_RUN="true")
    assert done.returncode == 0 and "points a square metre" in done.stdout and "Nothing was written" in done.stdout
    assert [p.name for p in tmp_path.iterdir()] == ["cloud.laz"]


def test_a_dry_run_loads_no_layer(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.python(
        """
from qgis.core import QgsProject
processing.runAndLoadResults("treedgs:pointcloudtodbh",
                             {"INPUT": sys.argv[1], "OUTPUT": "TEMPORARY_OUTPUT", "DRY_RUN": True})
print("LAYERS", len(QgsProject.instance().mapLayers()))
""",
        tmp_path / "cloud.laz",
    )
    assert "LAYERS 0" in done.stdout and "not correctly generated" not in done.stdout, done.stdout + done.stderr


def test_a_terrain_model_of_another_place_is_refused_before_anything_starts(qgis, simulated_plot, tmp_path):
    import numpy as np
    import pyproj
    from affine import Affine

    from treedgs_geo.terrain.dtm import Dtm, write_dtm

    elsewhere = Dtm(np.full((20, 20), 100.0), Affine(1, 0, 900000, 0, -1, 200000), pyproj.CRS("EPSG:32617"))
    write_dtm(tmp_path / "dtm.tif", elsewhere)
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.run(
        "pointcloudtodbh",
        {"TREEDGS_PYTHON": "/nonexistent"},
        INPUT=tmp_path / "cloud.laz",
        DTM=tmp_path / "dtm.tif",
        OUTPUT=tmp_path / "t.gpkg",
    )
    refused(done, "dtm.tif covers x 900000 to 900020", "cloud.laz lies at x 500")
    done = qgis.run(
        "photostodbh",
        {"TREEDGS_PYTHON": "/nonexistent"},
        PHOTOS=simulated_plot / "images",
        DTM=tmp_path / "dtm.tif",
        CRS="EPSG:6344",
        WORKSPACE=tmp_path / "w",
        OUTPUT=tmp_path / "t.gpkg",
    )
    refused(done, "give the terrain model of this place")


def test_a_model_runs_from_cloud_to_stand_table(qgis, tmp_path):
    folder = tmp_path / "modèle d'été"
    folder.mkdir()
    stems_cloud(folder / "cloud.laz")
    (folder / "plots.csv").write_text("plot_id,easting,northing,epsg,radius_m\nA,500006,3450004,32617,7\n")
    values = {
        "INPUT": folder / "cloud.laz",
        "PLOTS": folder / "plots.csv",
        "SPECIES": "PITA",
        "measure:Trees": folder / "trees.gpkg",
        "table:Tables": folder / "stand",
    }
    done = qgis.run("cloudtostandtable", None, **values)
    assert done.returncode == 0, done.stdout
    assert (folder / "stand" / "report.html").stat().st_size > 5000
    import geopandas

    assert len(geopandas.read_file(folder / "trees.gpkg", layer="trees")) == 3


def test_a_model_whose_second_step_is_refused_leaves_no_empty_folder(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz")
    # On the cloud, between its stems: nothing is left to count.
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,epsg,radius_m\nbare,500006,3450006.6,32617,1\n")
    values = {
        "INPUT": tmp_path / "cloud.laz",
        "PLOTS": tmp_path / "plots.csv",
        "SPECIES": "PITA",
        "measure:Trees": tmp_path / "trees.gpkg",
        "table:Tables": tmp_path / "stand",
    }
    refused(qgis.run("cloudtostandtable", None, **values), "No tree with a DBH stands in the plots (1)")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cloud.laz", "plots.csv", "trees.gpkg"]


def test_a_model_refuses_before_anything_starts(qgis, simulated_plot, tmp_path):
    """A mistyped name, which QGIS itself would pass over; a geographic CRS; a missing file; a bad choice; no photos."""
    values = {
        "PHOTOS": simulated_plot / "images",
        "CRS": "EPSG:6344",
        "PLOTS": simulated_plot / "plots.csv",
        "SPECIES": "PITA",
        "WORKSPACE": tmp_path / "work",
        "measure:Trees": tmp_path / "t.gpkg",
        "table:Tables": tmp_path / "stand",
    }
    for changed, words in (
        ({"SPECIE": "PITA"}, "Parameter SPECIE is unknown to treedgs:photostostandtable; did you mean SPECIES?"),
        ({"CRS": "EPSG:4326"}, "EPSG:32615 (WGS 84 / UTM zone 15N)"),
        ({"PLOTS": tmp_path / "gone.csv"}, "gone.csv does not exist"),
        ({"PRESET": "quickest"}, "PRESET: found 'quickest', expected one of fast, balanced"),
        ({"PHOTOS": tmp_path}, "holds 0 photos, expected at least 3"),
        ({"PHOTOS": ""}, "PHOTOS is required"),
    ):
        done = qgis.run("photostostandtable", {"TREEDGS_PYTHON": "/nonexistent"}, **{**values, **changed})
        refused(done, words)
        assert list(tmp_path.iterdir()) == []


def test_the_models_name_parameters_that_exist(qgis):
    done = qgis.python("""
for name in ("photostostandtable", "cloudtostandtable", "photostoaccuracy"):
    made = provider.algorithm(name).create({})
    good, problems = made.validate()
    assert good, (name, problems)
    for child in made.childAlgorithms().values():
        known = {d.name() for d in child.algorithm().parameterDefinitions()}
        assert set(child.parameterSources()) <= known, (name, set(child.parameterSources()) - known)
        for definition in child.algorithm().parameterDefinitions():
            for source in child.parameterSources().get(definition.name(), []):
                if source.staticValue() is not None:
                    assert source.staticValue() == definition.defaultValue(), ("run make models", definition.name())
    print("OUTPUTS", name, sorted(d.name() for d in made.destinationParameterDefinitions()))
""")
    assert done.returncode == 0, done.stderr
    assert "OUTPUTS photostoaccuracy ['measure:Trees', 'pair:Pairs', 'score:Accuracy']" in done.stdout


def test_a_batch_of_three_with_a_bad_one_finishes_two(qgis, tmp_path):
    """What the batch dialog does: one algorithm, one context, rows one after the other."""
    for name in ("one", "three"):
        stems_cloud(tmp_path / f"{name}.laz", (0.15,))
    (tmp_path / "two.laz").write_bytes((tmp_path / "one.laz").read_bytes()[:5000])
    done = qgis.python(
        """
from qgis.core import QgsProcessingContext, QgsProcessingFeedback
from processing.gui.AlgorithmExecutor import execute
algorithm, context, feedback = provider.algorithm("pointcloudtodbh").create({}), QgsProcessingContext(), \
    QgsProcessingFeedback(False)
for name in ("one", "two", "three"):
    values = {"INPUT": f"{sys.argv[1]}/{name}.laz", "OUTPUT": f"{sys.argv[1]}/{name}.gpkg"}
    good, why = algorithm.checkParameterValues(values, context)
    assert good, why
    done, results = execute(algorithm, values, context, feedback, catch_exceptions=True)
    print("ROW", name, done, results.get("N_MEASURED"))
print("LOG", feedback.textLog())
""",
        tmp_path,
    )
    assert "ROW one True 1" in done.stdout and "ROW three True 1" in done.stdout, done.stdout + done.stderr
    assert "ROW two False" in done.stdout and "two.laz" in done.stdout.partition("LOG")[2]
    assert (tmp_path / "three.gpkg").exists() and not (tmp_path / "two.gpkg").exists()


def test_sections_come_with_the_trees_and_a_rejected_tree_is_nowhere_green(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz")
    done = qgis.python(
        """
from qgis.core import QgsMapRendererSequentialJob, QgsMapSettings, QgsProject
from qgis.PyQt.QtCore import QSize
processing.runAndLoadResults("treedgs:pointcloudtodbh", {"INPUT": sys.argv[1], "OUTPUT": sys.argv[2]})
layers = {layer.name(): layer for layer in QgsProject.instance().mapLayers().values()}
print("NAMES", sorted(layers), [layer.renderer().type() for _, layer in sorted(layers.items())])
heights = {feature["height_m"] for feature in layers["Stem sections"].getFeatures()}
slices = layers["Stem sections"]
print("HEIGHTS", len(heights), slices.mapTipTemplate() != "", slices.hasScaleBasedVisibility())
order = QgsProject.instance().layerTreeRoot().layerOrder()
print("ORDER", [layer.name() for layer in order])
trees = layers["Trees"]
def green():
    settings = QgsMapSettings()
    settings.setLayers(order)
    settings.setDestinationCrs(trees.crs())
    settings.setOutputSize(QSize(300, 300))
    settings.setExtent(trees.extent().buffered(1))
    job = QgsMapRendererSequentialJob(settings)
    job.start()
    job.waitForFinished()
    colours = [job.renderedImage().pixelColor(x, y) for x in range(300) for y in range(300)]
    return sum(c.green() > max(c.red(), c.blue()) + 40 for c in colours)
seen = [green()]
index = trees.fields().indexOf("rev_flag")
assert trees.dataProvider().changeAttributeValues({f.id(): {index: "reject"} for f in trees.getFeatures()})
print("GREEN", seen[0] > 50, green())
""",
        tmp_path / "cloud.laz",
        tmp_path / "trees.gpkg",
    )
    assert "NAMES ['Plots searched', 'Stem sections', 'Stems at true scale', 'Trees']" in done.stdout, (
        done.stdout + done.stderr
    )
    assert "['singleSymbol', 'graduatedSymbol', 'singleSymbol', 'categorizedSymbol']" in done.stdout
    assert "HEIGHTS 17 True True" in done.stdout, done.stdout + done.stderr
    assert "ORDER ['Trees', 'Stem sections', 'Stems at true scale', 'Plots searched']" in done.stdout, (
        "the trees' colours are hidden"
    )
    assert "GREEN True 0" in done.stdout, done.stdout + done.stderr


def test_the_order_of_layers_is_kept_among_the_users_own(qgis, tmp_path):
    """Into a group of the user's choice, beside layers that are already there; and a second time."""
    stems_cloud(tmp_path / "cloud.laz")
    done = qgis.python(
        """
from qgis.core import QgsProject, QgsVectorLayer
from processing.core.ProcessingConfig import ProcessingConfig
project = QgsProject.instance()
project.addMapLayer(QgsVectorLayer("Point?crs=EPSG:32617", "Own", "memory"))
for number in range(2):
    out = f"{sys.argv[2]}/trees{number}.gpkg"
    processing.runAndLoadResults("treedgs:pointcloudtodbh", {"INPUT": sys.argv[1], "OUTPUT": out})
    project.addMapLayer(QgsVectorLayer("Point?crs=EPSG:32617", f"Own {number}", "memory"))
print("ORDER", [node.name() for node in project.layerTreeRoot().findLayers()])
ProcessingConfig.setSettingValue(ProcessingConfig.RESULTS_GROUP_NAME, "Results")
processing.runAndLoadResults("treedgs:pointcloudtodbh", {"INPUT": sys.argv[1], "OUTPUT": f"{sys.argv[2]}/trees2.gpkg"})
group = project.layerTreeRoot().findGroup("Results")
print("GROUP", [node.name() for node in group.findLayers()], len(project.mapLayers()))
ProcessingConfig.setSettingValue(ProcessingConfig.RESULTS_GROUP_NAME, "")
""",
        tmp_path / "cloud.laz",
        tmp_path,
    )
    four = ["Trees", "Stem sections", "Stems at true scale", "Plots searched"]
    second = [f"{name} (trees1.gpkg)" for name in four]
    assert f"ORDER {['Own 1', *second, 'Own 0', *four, 'Own']}" in done.stdout, done.stdout + done.stderr
    assert f"GROUP {[name.replace('1', '2') for name in second]} 15" in done.stdout, done.stdout + done.stderr


def test_terrain_opens_as_a_hillshade(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.python(
        """
from qgis.core import QgsProject
processing.runAndLoadResults("treedgs:terrain", {"INPUT": sys.argv[1], "OUTPUT": sys.argv[2]})
layer, = QgsProject.instance().mapLayers().values()
print("LAYER", layer.name(), layer.renderer().type())
""",
        tmp_path / "cloud.laz",
        tmp_path / "dtm.tif",
    )
    assert "LAYER Terrain model hillshade" in done.stdout, done.stdout + done.stderr


def test_a_layer_that_qgis_shows_is_written_anew_and_stays_whole(qgis, tmp_path):
    """QGIS keeps a write-ahead log beside a GeoPackage it has open; a new file under that name would be ruined."""
    stems_cloud(tmp_path / "one.laz", (0.15,))
    stems_cloud(tmp_path / "three.laz")
    done = qgis.python(
        """
from qgis.core import QgsVectorLayer
run = lambda name: processing.run("treedgs:pointcloudtodbh",
                                  {"INPUT": f"{sys.argv[1]}/{name}.laz", "OUTPUT": sys.argv[1] + "/trees.gpkg"})
run("one")
shown = QgsVectorLayer(sys.argv[1] + "/trees.gpkg|layername=trees", "trees", "ogr")
import sqlite3
log = sqlite3.connect(sys.argv[1] + "/trees.gpkg")
log.execute("PRAGMA journal_mode=WAL"); log.execute("PRAGMA wal_autocheckpoint=0")
log.execute("UPDATE layer_styles SET description='mine'"); log.commit()
print("SIDE", os.path.exists(sys.argv[1] + "/trees.gpkg-wal"), shown.featureCount())
run("three")
shown.dataProvider().reloadData()
print("NOW", len(list(shown.getFeatures())))
""",
        tmp_path,
    )
    assert "SIDE True 1" in done.stdout and "NOW 3" in done.stdout, done.stdout + done.stderr
    with closing(sqlite3.connect(tmp_path / "trees.gpkg")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT count(*) FROM trees").fetchone() == (3,)


def test_an_open_edit_session_is_reported_before_the_work(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    assert qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT=tmp_path / "t.gpkg").returncode == 0
    before = (tmp_path / "t.gpkg").read_bytes()
    with closing(sqlite3.connect(tmp_path / "t.gpkg")) as editor:
        editor.execute("BEGIN IMMEDIATE")
        done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT=tmp_path / "t.gpkg", DRY_RUN="true")
        editor.rollback()
    refused(done, "t.gpkg", "save or drop the edits in QGIS")
    assert (tmp_path / "t.gpkg").read_bytes() == before


@pytest.fixture
def pairs_file(tmp_path):
    """Two automatic pairs in a plot."""
    import geopandas as gpd
    import pandas as pd
    import pyproj
    from shapely.geometry import Point

    from treedgs_geo.inventory.pairs_layer import PAIR_COLUMNS, PLOT_COLUMNS, Matched, write_pairs

    crs = pyproj.CRS("EPSG:32617")
    row = dict.fromkeys(PAIR_COLUMNS) | {
        "plot_id": "A", "field_id": "1", "tree_id": 1, "field_cm": 30.0, "dbh_cm": 31.0, "delta_cm": 1.0,
        "dist_m": 0.5, "pair_status": "auto", "line": ((0, 0), (0.5, 0)),
    }  # fmt: skip
    trees = pd.DataFrame(
        {"plot_id": ["A"], "field_id": ["1"], "dbh_cm": [30.0], "x": [0.0], "y": [0.0], "paired": ["yes"]}
    )
    measured = gpd.GeoDataFrame(
        {"tree_id": [1], "dbh_cm": [31.0], "paired": ["yes"], "in_plot": ["yes"]}, geometry=[Point(0.5, 0)], crs=crs
    )
    plot = dict.fromkeys(PLOT_COLUMNS) | {"plot_id": "A", "status": "auto", "radius_m": 5.0, "x": 0.0, "y": 0.0}
    both = [row, dict(row, field_id="2")]
    write_pairs(tmp_path / "pairs.gpkg", Matched(both, [], trees, measured, [plot], []), crs)
    return tmp_path / "pairs.gpkg"


def test_a_dragged_pair_becomes_a_persons(qgis, pairs_file):
    done = qgis.python(
        """
from qgis.core import *
layer = QgsVectorLayer(sys.argv[1] + "|layername=pairs", "pairs", "ogr")
status = layer.fields().indexOf("pair_status")
form = layer.editFormConfig()
print("FORM", form.readOnly(layer.fields().indexOf("tree_id")), form.readOnly(status),
      layer.editorWidgetSetup(status).type())
layer.startEditing()
first = next(layer.getFeatures())
layer.changeGeometry(first.id(), QgsGeometry.fromWkt("LINESTRING(0 0, 2 0)"))
drawn = QgsVectorLayerUtils.createFeature(layer, QgsGeometry.fromWkt("LINESTRING(1 1, 2 2)"))
layer.addFeature(drawn)
layer.commitChanges()
print("STATUS", [feature["pair_status"] for feature in layer.getFeatures()])
""",
        pairs_file,
    )
    assert "FORM True False ValueMap" in done.stdout, done.stdout + done.stderr
    assert "STATUS ['moved', 'auto', 'moved']" in done.stdout, done.stdout + done.stderr


def test_trees_are_snapped_to_unless_the_user_snaps_already(qgis, pairs_file):
    done = qgis.python(
        """
from qgis.core import *
from treedgs.treedgs_qgis.loading import snap_to_trees
project = QgsProject.instance()
for name in ("field_trees", "measured_trees", "pairs"):
    project.addMapLayer(QgsVectorLayer(f"{sys.argv[1]}|layername={name}", name, "ogr"))
snap_to_trees(project)
config = project.snappingConfig()
on = sorted(layer.name() for layer, one in config.individualLayerSettings().items() if one.enabled())
print("SNAP", config.enabled(), on)
config = QgsSnappingConfig(project); config.setEnabled(True); config.setTolerance(33)
project.setSnappingConfig(config)
snap_to_trees(project)
print("KEPT", project.snappingConfig().tolerance())
""",
        pairs_file,
    )
    assert "SNAP True ['field_trees', 'measured_trees']" in done.stdout, done.stdout + done.stderr
    assert "KEPT 33" in done.stdout
