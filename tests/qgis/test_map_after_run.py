"""The map after a run, in the graphical QGIS: layers in order, the plot in view, the report one click away."""

from __future__ import annotations

import numpy as np
import pyproj
import rasterio
from rasterio.transform import from_origin
from synthetic_cloud import plot_cloud

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud


def test_a_run_leaves_a_map_that_one_reads(qgis, tmp_path):
    stems = [(3.0, 3.0, 28.0), (8.0, 4.0, 36.0), (5.5, 8.5, 24.0), (11.0, 10.5, 30.0)]
    xyz = plot_cloud(np.random.default_rng(3), stems) + [500000.0, 3450000.0, 100.0]
    write_cloud(tmp_path / "cloud.laz", PointCloud(xyz, pyproj.CRS.from_epsg(32617)))
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,radius_m\nA,500006,3450006,4.5\n")
    (tmp_path / "tmp").mkdir()
    (tmp_path / "flight" / "images").mkdir(parents=True)
    (tmp_path / "flight" / "work").mkdir()
    (tmp_path / "flight" / "work" / "report.html").touch()
    grid = from_origin(499900, 3450100, 10, 10)
    shape = {"width": 20, "height": 20, "count": 1, "dtype": "float32", "crs": "EPSG:32617", "transform": grid}
    with rasterio.open(tmp_path / "flight" / "dtm.tif", "w", driver="GTiff", **shape) as terrain:
        terrain.write(np.full((1, 20, 20), 100, "float32"))
    # Elsewhere than the results, which are temporary to QGIS otherwise, and named in another way.
    seen = qgis.windows("map_inside.py", tmp_path / "seen.json", TREEDGS_MAP=tmp_path, TMPDIR=tmp_path / "tmp")
    assert seen["trees"] == ["Trees", "Stem sections", "Stems at true scale", "Crowns", "Plots searched"]
    assert seen["columns"][:6] == ["tree_id", "plot_id", "dbh_cm", "dbh_se_cm", "height_m", "qc_flag"]
    assert seen["opacity"] == [100, 65], "a tree outside the plots is pale"
    assert seen["active"] == "Trees"
    assert seen["filled_in"] == [True, str(tmp_path / "stand")]
    assert seen["in_view"] == [True] * 3, "after a run, when the sample is shown again, and once it was left"
    assert seen["opened"] == [str(tmp_path / "run.html"), str(tmp_path / "work" / "report.html")]
    assert seen["stand"] == ["Trees of the stand table", "Stand by plot"]
    assert seen["stand 2"] == ["Trees of the stand table (stand 2)", "Stand by plot (stand 2)", *seen["stand"]]
    title = "Stand table and report"
    assert seen["viewer"] == [[title, str(tmp_path / name / "report.html")] for name in ("stand", "stand 2")]
    layers, words, dialog = seen["sample"]
    assert layers[:5] == seen["trees"] and len(layers) == 7, "the trees of the sample flight, its plots and terrain"
    assert "The sample flight was measured before." in words and f">{tmp_path}</a>" in words and dialog is None
    assert seen["refused"].startswith("'Taped trees (table)': ") and "TAPED.csv" in seen["refused"], "labels in windows"
