"""Algorithms run by real ``qgis_process``: refusals, results, cancel, a killed engine, and what QGIS' process holds."""

from __future__ import annotations

import json
import os
import re
import signal
from pathlib import Path

import pytest
from qgis_driver import PATIENCE_S, ROOT, STUBBORN, load, outlived
from qgis_helpers import refused, stems_cloud, wait_for


def photo(path: Path, lon: float, lat: float) -> None:
    """A small JPEG with a GPS position."""
    from PIL import Image

    def dms(value: float) -> tuple[float, float, float]:
        value = abs(value)
        return int(value), int(value % 1 * 60), value * 60 % 1 * 60

    exif = Image.Exif()
    exif.get_ifd(0x8825).update({1: "N" if lat >= 0 else "S", 2: dms(lat), 3: "E" if lon >= 0 else "W", 4: dms(lon)})
    Image.new("RGB", (32, 24), "green").save(path, exif=exif)


@pytest.fixture
def photos(tmp_path) -> Path:
    folder = tmp_path / "fotos de José"
    folder.mkdir()
    for index in range(4):
        photo(folder / f"DJI_{index:04}.JPG", -81.5, 31.2)
    return folder


def test_an_unknown_parameter_name_is_refused(qgis, photos, tmp_path):
    done = qgis.run(
        "photostodbh",
        PHOTOS=photos,
        CRS="EPSG:32617",
        WORKSPACE=tmp_path / "w",
        PRESETT="fast",
        OUTPUT=tmp_path / "t.gpkg",
    )
    refused(done, "Parameter PRESETT is unknown to treedgs:photostodbh; did you mean PRESET?")
    assert not (tmp_path / "t.gpkg").exists()


def test_a_geographic_crs_is_refused_with_the_utm_zone(qgis, photos, tmp_path):
    done = qgis.run("photostodbh", PHOTOS=photos, CRS="EPSG:4326", WORKSPACE=tmp_path / "w", OUTPUT=tmp_path / "t.gpkg")
    refused(done, "EPSG:4326", "geographic", "EPSG:32617 (WGS 84 / UTM zone 17N)")
    assert not (tmp_path / "w").exists()


def test_a_crs_in_feet_is_refused(qgis, photos, tmp_path):
    done = qgis.run("photostodbh", PHOTOS=photos, CRS="EPSG:2236", WORKSPACE=tmp_path / "w", OUTPUT=tmp_path / "t.gpkg")
    refused(done, "EPSG:2236", "not in metres")


def test_too_few_photos_are_refused(qgis, tmp_path):
    (tmp_path / "vide").mkdir()
    done = qgis.run(
        "photostodbh", PHOTOS=tmp_path / "vide", CRS="EPSG:32617", WORKSPACE=tmp_path / "w", OUTPUT=tmp_path / "t.gpkg"
    )
    refused(done, "vide holds 0 photos, expected at least 3")


def test_a_missing_file_and_a_bad_number_are_refused(qgis, photos, tmp_path):
    refused(
        qgis.run("pointcloudtodbh", INPUT=tmp_path / "gone.laz", OUTPUT=tmp_path / "t.gpkg"), "gone.laz does not exist"
    )
    done = qgis.run(
        "photostodbh", PHOTOS=photos, CRS="EPSG:32617", BH_M=9, WORKSPACE=tmp_path / "w", OUTPUT=tmp_path / "t.gpkg"
    )
    refused(done, "BH_M: found 9, expected 0.5 to 2.5 in m.")


def test_a_file_that_is_no_cloud_is_refused(qgis, tmp_path):
    (tmp_path / "notes.laz").write_text("these are my notes")
    refused(
        qgis.run("pointcloudtodbh", INPUT=tmp_path / "notes.laz", OUTPUT=tmp_path / "t.gpkg"), "not a LAS or LAZ file"
    )


def test_a_cloud_without_a_crs_is_reported_what_to_give(qgis, tmp_path):
    """In the names of QGIS, ready to be copied into the command; 'local' too."""
    import laspy
    import numpy as np

    stems_cloud(tmp_path / "with.laz", (0.15,))
    placed = laspy.read(tmp_path / "with.laz")
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, np.floor(placed.header.mins)
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = np.asarray(placed.x), np.asarray(placed.y), np.asarray(placed.z)
    cloud.write(tmp_path / "scan.laz")
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "scan.laz", OUTPUT=tmp_path / "t.gpkg")
    refused(done, "scan.laz: holds no CRS", "CRS=EPSG:CODE", "CRS=local")
    assert "--crs" not in done.stdout
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "scan.laz", CRS="local", OUTPUT=tmp_path / "t.gpkg")
    assert done.returncode == 0 and (tmp_path / "t.gpkg").exists(), done.stdout


def test_help_speaks_of_parameters_as_qgis_names_them(qgis):
    done = qgis.python("""
for alg in provider.algorithms():
    for text in (alg.shortHelpString().partition("<code>")[0], *(d.help() for d in alg.parameterDefinitions())):
        for word in text.split():
            if word.startswith("--") and alg.name() != "setupengine":  # pip's own option
                print("OPTION", alg.name(), word)
print("LOOKED", len(provider.algorithms()))
""")
    assert "LOOKED" in done.stdout and "OPTION" not in done.stdout, done.stdout + done.stderr


def test_a_missing_engine_is_one_sentence(qgis, photos, tmp_path):
    done = qgis.run(
        "photostodbh",
        {"TREEDGS_PYTHON": "/nonexistent"},
        PHOTOS=photos,
        CRS="EPSG:32617",
        WORKSPACE=tmp_path / "w",
        OUTPUT=tmp_path / "t.gpkg",
    )
    refused(done, "TREEDGS_PYTHON names /nonexistent", "treedgs:setupengine")
    assert not (tmp_path / "t.gpkg").exists() and not (tmp_path / "w").exists()


def test_the_engines_sentence_arrives(qgis, fake_engine):
    python = fake_engine("say(t='error', message='IMG_1.JPG has no position; give --geotags.'); sys.exit(2)")
    done = qgis.run("checkengine", {"TREEDGS_PYTHON": python})
    refused(done, "IMG_1.JPG has no position; give GEOTAGS (")


def test_the_engine_is_checked(qgis):
    done = qgis("run", "treedgs:checkengine", "--json")
    assert done.returncode == 0, done.stdout
    answer = json.loads(done.stdout[done.stdout.index("{") :])
    assert answer["results"]["STATUS"] == "all steps work" and answer["results"]["N_LIBRARIES"] > 15


def test_ctrl_c_ends_everything(qgis, fake_engine, tmp_path):
    running = qgis.start("run", "treedgs:checkengine", TREEDGS_PYTHON=fake_engine(STUBBORN), PIDS=tmp_path / "pids")
    pids = [int(part) for part in wait_for(tmp_path / "pids").split()]
    running.send_signal(signal.SIGINT)
    left = outlived(pids)
    output, _ = running.communicate(timeout=PATIENCE_S)
    assert not left, output
    assert running.returncode == 1 and "run again to resume" in output, output


def test_a_killed_engine_is_explained(qgis, fake_engine, tmp_path):
    behaviour = 'open(os.environ["PIDS"], "w").write(str(os.getpid()))\ntime.sleep(60)'
    running = qgis.start("run", "treedgs:checkengine", TREEDGS_PYTHON=fake_engine(behaviour), PIDS=tmp_path / "pids")
    os.kill(int(wait_for(tmp_path / "pids")), signal.SIGKILL)
    output, _ = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 1 and "memory ran out" in output, output


def test_no_engine_module_is_in_qgis_after_a_run(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.python(
        """
before = list(sys.path)
result = processing.run("treedgs:checkengine", {})
files = {"INPUT": sys.argv[1] + "/cloud.laz", "OUTPUT": sys.argv[1] + "/t.gpkg"}
trees = processing.run("treedgs:pointcloudtodbh", files)
assert trees["N_MEASURED"] == 1
heavy = {"torch", "pycolmap", "open3d", "rasterio", "pyproj", "laspy", "numba", "cv2", "geopandas", "treedgs_geo"}
print("RESULT", result["STATUS"], sorted(heavy & set(sys.modules)), sys.path == before)
""",
        tmp_path,
    )
    assert "RESULT all steps work [] True" in done.stdout, done.stdout + done.stderr


def test_styled_trees_open_styled(qgis, tmp_path):
    """The style travels inside the GeoPackage and draws: full symbols, hollow ones, labels, map tips."""
    import pyproj

    from treedgs_geo.inventory.tree_layer import write_trees
    from treedgs_geo.stems.quality.tree import Tree

    layer, picture = tmp_path / "árboles con espacio.gpkg", tmp_path / "map.png"
    write_trees(
        layer,
        [
            Tree(tree_id=1, x=500000.0, y=3450000.0, z_ground=20.0, dbh_cm=31.4, dbh_se_cm=0.4),
            Tree(
                tree_id=2,
                x=500008.0,
                y=3450000.0,
                z_ground=20.0,
                dbh_cm=44.0,
                dbh_se_cm=2.0,
                qc_flag="check",
                qc_reason="disagree",
            ),
            Tree(tree_id=3, x=500004.0, y=3450006.0, z_ground=20.0, qc_flag="reject", qc_reason="few_views"),
        ],
        pyproj.CRS("EPSG:32617"),
    )
    done = qgis.python(
        """
from qgis.core import *
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor
layer = QgsVectorLayer(sys.argv[1], "trees", "ogr")
assert layer.isValid() and layer.renderer().type() == "categorizedSymbol" and layer.labelsEnabled()
assert layer.crs().authid() == "EPSG:32617", layer.crs().authid()
assert layer.attributeAlias(layer.fields().indexOf("dbh_cm")) == "DBH [cm]"
context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
for feature in layer.getFeatures():
    context.setFeature(feature)
    print("TIP", QgsExpression.replaceExpressionText(layer.mapTipTemplate(), context))
settings = QgsMapSettings()
settings.setLayers([layer]); settings.setOutputSize(QSize(400, 300)); settings.setBackgroundColor(QColor("white"))
extent = layer.extent(); extent.scale(1.6); settings.setExtent(extent); settings.setDestinationCrs(layer.crs())
drawing = QgsExpressionContext()
drawing.appendScope(QgsExpressionContextUtils.globalScope())
drawing.appendScope(QgsExpressionContextUtils.mapSettingsScope(settings))
settings.setExpressionContext(drawing)
job = QgsMapRendererParallelJob(settings); job.start(); job.waitForFinished()
job.renderedImage().save(sys.argv[2])
""",
        layer,
        picture,
    )
    assert done.returncode == 0, done.stderr
    assert "DBH <b>31.4</b> ± 0.4 cm at 1.37 m" in done.stdout and "too few photos see the stem" in done.stdout
    from PIL import Image

    colours = dict((colour, count) for count, colour in Image.open(picture).convert("RGB").getcolors(maxcolors=100000))
    assert colours.get((46, 139, 61), 0) > 20, "the measured tree is a full green dot"
    assert colours.get((242, 161, 13), 0) > 20, "the flagged one a full amber dot"
    assert 0 < colours.get((198, 40, 40), 0) < 60, "the rejected one a red ring"


def test_a_cloud_becomes_styled_trees(qgis, tmp_path):
    import geopandas
    import numpy as np

    folder = tmp_path / "relevé d'août"
    folder.mkdir()
    truth = stems_cloud(folder / "nuage é.laz")
    done = qgis.run("pointcloudtodbh", INPUT=folder / "nuage é.laz", OUTPUT=folder / "arbres.gpkg")
    assert done.returncode == 0, done.stdout
    assert f"OUTPUT:\t{folder / 'arbres.gpkg'}" in done.stdout
    trees = geopandas.read_file(folder / "arbres.gpkg", layer="trees")
    assert trees.crs.to_epsg() == 32617
    for x, y, dbh_cm in truth:
        nearest = trees.loc[np.hypot(trees.x - x, trees.y - y).idxmin()]
        assert np.hypot(nearest.x - x, nearest.y - y) < 0.05
        assert abs(nearest.dbh_cm - dbh_cm) < 1.0, (nearest.dbh_cm, dbh_cm)
    styles = geopandas.read_file(folder / "arbres.gpkg", layer="layer_styles")
    assert set(styles["f_table_name"]) == {"trees", "circles", "sections", "searched"} and all(styles["useAsDefault"])


def test_an_unwritable_output_is_refused_and_leaves_nothing(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    (tmp_path / "a file").write_text("in the way")
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "cloud.laz", OUTPUT=tmp_path / "a file" / "trees.gpkg")
    refused(done, "cannot be written")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a file", "cloud.laz"]


def test_a_truncated_cloud_is_refused(qgis, tmp_path):
    stems_cloud(tmp_path / "whole.laz", (0.15,))
    data = (tmp_path / "whole.laz").read_bytes()
    (tmp_path / "cut.laz").write_bytes(data[: len(data) // 2])
    done = qgis.run("pointcloudtodbh", INPUT=tmp_path / "cut.laz", OUTPUT=tmp_path / "trees.gpkg")
    refused(done, "cut.laz")
    assert not (tmp_path / "trees.gpkg").exists()


def test_a_layer_that_processing_loads_is_styled(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.python(
        """
from qgis.core import QgsProject
processing.runAndLoadResults("treedgs:pointcloudtodbh", {"INPUT": sys.argv[1], "OUTPUT": "TEMPORARY_OUTPUT"})
(layer,) = QgsProject.instance().mapLayersByName("Trees (temporary)")
print("LAYER", layer.name(), layer.featureCount(), layer.renderer().type(), layer.crs().authid())
""",
        tmp_path / "cloud.laz",
    )
    assert "LAYER Trees (temporary) 1 categorizedSymbol EPSG:32617" in done.stdout, done.stdout + done.stderr


def test_setting_up_from_an_empty_folder_of_wheels_is_refused(qgis, tmp_path):
    (tmp_path / "roues").mkdir()
    done = qgis.run("setupengine", {"TREEDGS_HOME": tmp_path / "home"}, WHEELS=tmp_path / "roues")
    refused(done, "roues: holds no .whl files")
    assert not (tmp_path / "home").exists()


def test_progress_dots_do_not_cut_lines(qgis, tmp_path, capsys):
    """What the demo prints of a real run: whole lines; all that QGIS printed is in the log."""
    stems_cloud(tmp_path / "cloud.laz")
    log = tmp_path / "logs" / "qgis_process.log"
    values = {"INPUT": tmp_path / "cloud.laz", "OUTPUT": tmp_path / "trees.gpkg"}
    code = qgis.tools.run_algorithm("treedgs:pointcloudtodbh", values, qgis.setup, log)
    shown = capsys.readouterr().out
    assert code == 0 and "\n  3 stems found" in shown and "\nDone in " in shown, shown
    assert not re.search(r"\d\.\.|\.\.\d|- done", shown), shown
    assert "100 - done." in log.read_text() and "Engine: " in log.read_text()


@pytest.mark.parametrize(
    "printed, shown",
    [
        ("0...10..Reading", "Reading"),
        ("0...10...20", None),
        ("0...10...20...30 photos", "30 photos"),
        ("0...10...20...30  indented", "  indented"),
        ("10 trees", "10 trees"),
        ("", ""),
        ("0.5 m", "0.5 m"),
        ("...", "..."),
    ],
)
def test_only_progress_is_taken_out(printed, shown):
    tools = load("treedgs_tools_qgis_run", ROOT / "tools" / "qgis_run.py")
    assert tools.WithoutDots().line(printed) == shown
