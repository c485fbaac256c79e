"""Inputs chosen from the project: what the engine gets is the file, or a copy of what the layer shows."""

from __future__ import annotations

import json

import geopandas
import numpy as np
import pytest
import rasterio
from qgis_driver import ROOT
from shapely.geometry import Point, box

from treedgs_geo.stems.quality.tree import Tree

PREPARE = """
import json, os
from qgis.core import QgsProcessingContext, QgsProcessingFeedback, QgsProject, QgsRasterLayer, QgsVectorLayer
from treedgs.treedgs_qgis.parameters import engine_values
folder, project = sys.argv[1], QgsProject.instance()
context, feedback = QgsProcessingContext(), QgsProcessingFeedback(False)
context.setProject(project)
def add(layer, kind=QgsVectorLayer):
    assert layer.isValid(), layer.source()
    return project.addMapLayer(layer)
def look(algorithm, **given):
    made = provider.algorithm(algorithm).create({})
    needed = {"OUTPUT": folder + "/out"} if made.parameterDefinition("OUTPUT") else {}
    good, why = made.checkParameterValues({**needed, **given}, context)
    if not good:
        return why
    return engine_values(made, made.declaration, given, context, feedback)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A tree layer of ours, plots as polygons, as CSV and as one of two tables, a terrain model."""
    import numpy as np
    import pyproj
    import rasterio
    from rasterio.transform import from_origin

    from treedgs_geo.inventory.tree_layer import write_trees

    place = tmp_path_factory.mktemp("Projekt é")
    crs = pyproj.CRS.from_epsg(32617)
    trees = [
        Tree(
            tree_id=n,
            x=500000.0 + 2 * n,
            y=3450000.0,
            z_ground=100.0,
            dbh_cm=20.0 + n,
            dbh_se_cm=0.4,
            dbh_lo_cm=19.0 + n,
            dbh_hi_cm=21.0 + n,
            bh_m=1.37,
            qc_flag="ok",
        )
        for n in (1, 2, 3)
    ]
    write_trees(place / "trees.gpkg", trees, crs)
    plots = geopandas.GeoDataFrame({"plot_id": ["A"]}, geometry=[box(499990, 3449990, 500020, 3450010)], crs=crs)
    plots.to_file(place / "two.gpkg", layer="other")
    plots.to_file(place / "two.gpkg", layer="mine")
    (place / "plots.csv").write_text("plot_id,easting,northing,radius_m\nA,500004,3450000,10\n")
    geopandas.GeoDataFrame({"tree_id": [7]}, geometry=[Point(500001, 3450001)], crs=crs).to_file(place / "one.gpkg")
    with rasterio.open(
        place / "dtm.tif",
        "w",
        driver="GTiff",
        width=4,
        height=4,
        count=1,
        dtype="float32",
        crs=crs,
        transform=from_origin(499990, 3450010, 10, 10),
    ) as raster:
        raster.write(np.full((1, 4, 4), 100, "float32"))
    (place / "broken.gpkg").write_text("no layer")
    return place


def answers(done) -> list:
    assert "Traceback" not in done.stderr, done.stderr
    return [json.loads(line[7:]) for line in done.stdout.splitlines() if line.startswith("ANSWER ")]


def test_layers_of_the_project_are_the_files_they_lie_in(qgis, folder):
    done = qgis.python(PREPARE + """
trees = add(QgsVectorLayer(folder + "/trees.gpkg|layername=trees", "Trees", "ogr"))
from qgis.PyQt.QtCore import QUrl
table = bytes(QUrl.fromLocalFile(folder + "/plots.csv").toEncoded()).decode() + "?delimiter=,&geomType=none"
plots = add(QgsVectorLayer(table, "Plots", "delimitedtext"))
dtm = add(QgsRasterLayer(folder + "/dtm.tif", "DTM"))
for given in (trees, trees.id(), "Trees", trees.source(), folder + "/trees.gpkg"):
    print("ANSWER", json.dumps(look("standtable", TREES=given, PLOTS=plots)))
print("ANSWER", json.dumps(look("reconstruct", PHOTOS=folder, WORKSPACE=folder, CRS="EPSG:32617", DTM=dtm)))
""", folder)  # fmt: skip
    *tables, terrain = answers(done)
    assert not any(isinstance(found, str) for found in (*tables, terrain)), (tables, terrain)
    assert len(tables) == 5
    for found in tables:
        assert (found["trees"], found["plots"]) == (f"{folder}/trees.gpkg", f"{folder}/plots.csv"), found
    assert terrain["dtm"] == f"{folder}/dtm.tif"


def test_what_is_no_file_of_its_own_is_copied(qgis, folder):
    done = qgis.python(PREPARE + """
memory = QgsVectorLayer("Point?crs=EPSG:32617&field=tree_id:int", "In memory", "memory")
source = QgsVectorLayer(folder + "/one.gpkg", "one", "ogr")
memory.dataProvider().addFeatures(list(source.getFeatures()))
add(memory)
some = add(QgsVectorLayer(folder + "/trees.gpkg|layername=trees", "Some", "ogr"))
some.setSubsetString("tree_id < 3")
mine = add(QgsVectorLayer(folder + "/two.gpkg|layername=mine", "Mine", "ogr"))
mine.selectAll()
from qgis.PyQt.QtCore import QUrl
table = bytes(QUrl.fromLocalFile(folder + "/plots.csv").toEncoded()).decode()
text = add(QgsVectorLayer(table + "?delimiter=,&xField=easting&yField=northing&crs=EPSG:32617", "T", "delimitedtext"))
for name, given in (("TREES", memory), ("TREES", some), ("PLOTS", mine), ("PLOTS", text)):
    found = look("standtable", **{name: given})
    print("ANSWER", json.dumps(found if isinstance(found, str) else found[name.lower()]))
import shutil
for n, answer in enumerate((memory, some)):
    shutil.copy(look("standtable", TREES=answer)["trees"], folder + f"/copy{n}.gpkg")
print("LOG", feedback.textLog())
""", folder)  # fmt: skip
    found = answers(done)
    assert [path.rpartition("/")[2] for path in found] == ["trees.gpkg", "trees.gpkg", "plots.gpkg", "plots.gpkg"]
    assert not any(path.startswith(str(folder)) for path in found), "copies, not the files"
    assert len(geopandas.read_file(folder / "copy0.gpkg", layer="trees")) == 1
    assert sorted(geopandas.read_file(folder / "copy1.gpkg", layer="trees")["tree_id"]) == [1, 2]
    assert "PLOTS: all 1 features of 'Mine' are used, not only the 1 selected." in done.stdout
    assert "a copy of the layer 'Some' as it shows it (features: 2)" in done.stdout


def test_layers_that_would_give_wrong_numbers_are_refused(qgis, folder):
    done = qgis.python(PREPARE + """
edited = add(QgsVectorLayer(folder + "/trees.gpkg|layername=trees", "Edited", "ogr"))
edited.startEditing()
edited.changeAttributeValue(next(edited.getFeatures()).id(), edited.fields().indexOf("dbh_cm"), 99.0)
pairs = add(QgsVectorLayer("LineString?crs=EPSG:32617&field=pair_status:string", "Pairs in memory", "memory"))
for name, given in (("TREES", edited), ("PAIRS", pairs), ("TREES", folder + "/broken.gpkg"), ("TREES", "no layer"),
                    ("TREES", folder + "/gone.gpkg")):
    print("ANSWER", json.dumps(look("standtable", **{name: given})))
edited.rollBack()
""", folder)  # fmt: skip
    edited, pairs, broken, unknown, gone = answers(done)
    assert edited == "TREES: the layer 'Edited' has edits that are not saved; save or drop them first."
    assert pairs.startswith("PAIRS: the layer 'Pairs in memory' is filtered, or a copy")
    assert broken == f"TREES: {folder}/broken.gpkg cannot be read as a layer; give a file that QGIS opens."
    assert "no layer does not exist" in unknown and "gone.gpkg does not exist" in gone


def test_a_stand_table_of_a_layer_in_memory(qgis, folder, tmp_path):
    """The whole way, in the engine."""
    done = qgis.python(PREPARE + """
source = QgsVectorLayer(folder + "/trees.gpkg|layername=trees", "trees", "ogr")
from qgis.core import QgsFeatureRequest
memory = add(source.materialize(QgsFeatureRequest().setFilterExpression("tree_id <> 2")))
found = processing.run("treedgs:standtable", {"TREES": memory, "PLOTS": folder + "/plots.csv", "OUTPUT": sys.argv[2]})
print("ANSWER", json.dumps([found["N_TREES"], found["N_PLOTS"]]))
""", folder, tmp_path / "out")  # fmt: skip
    assert answers(done) == [[2, 1]], done.stdout + done.stderr


def test_the_ground_of_a_run_comes_beneath_its_trees(qgis, folder, tmp_path):
    """Wherever QGIS puts it: it loads by name, and names are those of the user's language."""
    (tmp_path / "run.json").write_text("{}")
    (tmp_path / "dtm.tif").write_bytes((folder / "dtm.tif").read_bytes())
    grid = rasterio.transform.from_origin(500000, 3450020, 1, 1)
    shape = {"width": 20, "height": 20, "count": 3, "dtype": "uint8", "crs": "EPSG:32617", "transform": grid}
    with rasterio.open(tmp_path / "ortho.tif", "w", driver="COG", **shape) as ortho:
        ortho.write(np.full((3, 20, 20), 120, np.uint8))
    done = qgis.python(
        """
from qgis.core import QgsProcessingContext, QgsProcessingFeedback, QgsProject, QgsRasterLayer, QgsVectorLayer
from treedgs.treedgs_qgis import loading
project, context = QgsProject.instance(), QgsProcessingContext()
context.setProject(project)
trees, ground = sys.argv[1] + "/trees.gpkg", sys.argv[2] + "/dtm.tif"
loading.load_folder({"OUTPUT": trees, "WORKSPACE": sys.argv[2]}, context)
print("LOADED", [details.name for details in context.layersToLoadOnCompletion().values()])
project.addMapLayer(QgsVectorLayer(trees, "Trees", "ogr"))
for source, name in ((sys.argv[2] + "/ortho.tif", "Orthophoto of the ground"), (ground, "Ground")):
    last = project.addMapLayer(QgsRasterLayer(source, name))
    assert last.isValid()
    details = context.layerToLoadOnCompletionDetails(source)
    details.postProcessor().postProcessLayer(last, context, QgsProcessingFeedback())
print("ORDER", [node.name() for node in project.layerTreeRoot().findLayers()])
""",
        folder,
        tmp_path,
    )
    assert "LOADED ['Ground', 'Orthophoto of the ground']" in done.stdout, done.stdout + done.stderr
    assert "ORDER ['Trees', 'Orthophoto of the ground', 'Ground']" in done.stdout, done.stdout + done.stderr


def test_rejected_trees_and_plots_are_cased_and_trees_to_tape_have_a_colour_of_their_own(qgis):
    done = qgis.python(
        """
import json
from qgis.core import QgsVectorLayer
def look(kind, name):
    layer = QgsVectorLayer(kind + "?crs=EPSG:32617", name, "memory")
    assert layer.loadNamedStyle(sys.argv[1] + "/" + name + ".qml")[1]
    return layer.renderer().clone()
trees, tapes = look("PointZ", "trees").categories(), look("Point", "tapes").categories()
plots = look("Polygon", "searched")
casings = [next(c for c in trees if c.value() == "out").symbol(), plots.symbol()]
print("SEEN" + json.dumps({
    "casings": [[part.strokeColor().name() for part in symbol.symbolLayers()] for symbol in casings],
    "trees": [c.symbol().color().name() for c in trees], "to tape": tapes[0].symbol().color().name(),
}))
""",
        ROOT / "treedgs_geo" / "core" / "styles",
    )
    seen = json.loads(done.stdout.partition("SEEN")[2])
    assert all(casing[0] == "#ffffff" != casing[1] for casing in seen["casings"])
    assert seen["to tape"] not in seen["trees"]


def test_a_dbh_keeps_its_label_among_other_layers_and_a_rejected_tree_shows_its_number(qgis):
    done = qgis.python(
        """
import json
from qgis.core import (
    QgsFeature, QgsGeometry, QgsMapRendererSequentialJob, QgsMapSettings, QgsPointXY, QgsRectangle, QgsVectorLayer
)
from qgis.PyQt.QtCore import QSize
def layer(name, **values):
    kinds = {key: "string" if isinstance(value, str) else "double" for key, value in values.items()}
    fields = "".join(f"&field={key}:{kind}" for key, kind in kinds.items())
    made = QgsVectorLayer(f"Point?crs=EPSG:32617&field=tree_id:integer{fields}", name, "memory")
    assert made.loadNamedStyle(sys.argv[1] + "/" + name + ".qml")[1]
    for number in range(1, 26):
        feature, refused = QgsFeature(made.fields()), number == 25 and name == "trees"
        feature.setAttributes([number, *(None if refused and key == "dbh_cm" else values[key] for key in values)])
        place = QgsPointXY(8, 2) if refused else QgsPointXY(number % 5, number // 5)
        feature.setGeometry(QgsGeometry.fromPointXY(place))
        made.dataProvider().addFeature(feature)
    return made
trees = layer("trees", dbh_cm=30.5, rev_dbh_cm=None, rev_flag="", qc_flag="ok", plot_id="")
others = [layer("tape_check", error_cm=1.5), layer("tapes", state=""), layer("field_trees", field_id="F1")]
settings = QgsMapSettings()
settings.setLayers([*others, trees])
settings.setDestinationCrs(trees.crs())
settings.setExtent(QgsRectangle(-1, -1, 9, 6))
settings.setOutputSize(QSize(400, 280))
job = QgsMapRendererSequentialJob(settings)
job.start()
job.waitForFinished()
placed = job.takeLabelingResults().labelsWithinRect(settings.extent())
print("SEEN" + json.dumps([[one.labelText for one in placed if one.layerID == own.id()] for own in (trees, *others)]))
""",
        ROOT / "treedgs_geo" / "core" / "styles",
    )
    trees, *others = json.loads(done.stdout.partition("SEEN")[2])
    assert sorted(trees) == ["25", *["30.5"] * 24]
    assert any(len(texts) < 25 for texts in others), "there is no room for all"
