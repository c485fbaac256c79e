"""What lies in a temporary folder of QGIS says so; a workspace never does by itself."""

from __future__ import annotations

from qgis_helpers import stems_cloud

LOAD = """
from qgis.core import QgsProject, QgsProcessingFeedback
class Heard(QgsProcessingFeedback):
    def pushWarning(self, warning):
        print("WARNED", warning)
heard = Heard()
processing.runAndLoadResults(
    "treedgs:pointcloudtodbh", {"INPUT": sys.argv[1], "OUTPUT": sys.argv[2], "SHEETS": "none"}, feedback=heard
)
print("LAYERS", sorted(layer.name() for layer in QgsProject.instance().mapLayers().values()))
"""
VALUES = """
from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback
parameters = __import__("treedgs.treedgs_qgis.parameters", fromlist=["x"])
for name in ("photostodbh", "reconstruct"):
    for value in ("TEMPORARY_OUTPUT", None, "", sys.argv[1]):
        made = QgsApplication.processingRegistry().createAlgorithmById(f"treedgs:{name}")
        given = {"PHOTOS": sys.argv[1], "CRS": "EPSG:32617", "OUTPUT": sys.argv[1] + "/t.gpkg", "WORKSPACE": value}
        context, heard = QgsProcessingContext(), QgsProcessingFeedback()
        values = parameters.engine_values(made, made.declaration, given, context, heard)
        print("WORKSPACE", name, values.get("workspace"))
"""


def test_a_temporary_result_is_called_so(qgis, tmp_path):
    stems_cloud(tmp_path / "cloud.laz", (0.15,))
    done = qgis.python(LOAD, tmp_path / "cloud.laz", "TEMPORARY_OUTPUT")
    said = done.stdout + done.stderr
    assert "WARNED OUTPUT: lies in a temporary folder" in said and "'Trees (temporary)'" in said, said
    done = qgis.python(LOAD, tmp_path / "cloud.laz", tmp_path / "t.gpkg")
    said = done.stdout + done.stderr
    assert "temporary folder" not in said and "'Trees'" in said, said


def test_a_workspace_is_no_temporary_folder(qgis, tmp_path):
    done = qgis.python(VALUES, tmp_path)
    said = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("WORKSPACE")]
    for name in ("photostodbh", "reconstruct"):
        assert [word for verb, word in said if verb == name] == ["None", "None", "None", str(tmp_path)], done.stderr
