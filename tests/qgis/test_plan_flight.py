"""plan-flight in real QGIS: plots as a polygon layer, and the plan's layers in their styles."""

import json

import geopandas as gpd

from tests.planning.published_formats import validate_kmz

#: What the layers look like once QGIS has read their styles from the file.
LOOK = """
import json, sys
from qgis.core import QgsApplication, QgsVectorLayer
application = QgsApplication([], False)
application.initQgis()
found = {}
for name in ("plan_photos", "plan_plots", "plan_line", "plan_footprints"):
    layer = QgsVectorLayer(sys.argv[1] + "|layername=" + name, name, "ogr")
    assert layer.isValid()
    message, ok = layer.loadDefaultStyle()
    found[name] = [ok, layer.renderer().type(), layer.featureCount(), layer.labelsEnabled()]
print("SAVED")
print("LOOK", json.dumps(found))
"""


def test_a_plan_from_a_polygon_layer(qgis, tmp_path):
    from tests.inventory.stand_helpers import edit_in_qgis

    plots = gpd.GeoDataFrame(
        {"plot_id": ["A"]}, geometry=gpd.points_from_xy([611337.0], [3718451.0]).buffer(9.0), crs="EPSG:6344"
    )
    plots.to_file(tmp_path / "plots.gpkg", layer="plots")
    stand = {"STEMS_PER_HA": 600, "DBH_MEAN_CM": 28, "DBH_SD_CM": 6, "TREE_HEIGHT_M": 20, "CROWN_BASE_M": 10}
    done = qgis.run(
        "planflight", None, PLOTS=tmp_path / "plots.gpkg", **stand, PATTERN="orbits", OUTPUT=tmp_path / "plan"
    )
    assert done.returncode == 0, done.stdout
    kept = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert len(validate_kmz(tmp_path / "plan" / "plan.kmz")) == kept["photos"]
    said = edit_in_qgis(LOOK, tmp_path / "plan" / "plan.gpkg", {})
    look = json.loads(next(line for line in said.splitlines() if line.startswith("LOOK"))[5:])
    assert all(entry[0] for entry in look.values())
    assert look["plan_photos"][1:] == ["categorizedSymbol", kept["photos"], True]
    assert look["plan_plots"][1] == "graduatedSymbol" and look["plan_footprints"][2] == kept["photos"]


def test_what_is_missing_is_said_in_qgis_words(qgis, tmp_path):
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,epsg,radius_m\nA,611337,3718451,6344,9\n")
    done = qgis.run("planflight", None, PLOTS=tmp_path / "plots.csv", STEMS_PER_HA=600, OUTPUT=tmp_path / "plan")
    assert done.returncode != 0
    assert "DBH_MEAN_CM" in done.stdout and not (tmp_path / "plan").exists()
