"""One click: the stems of a plot in QGIS' own 3D view, or the page that shows them where QGIS has none to open."""

from __future__ import annotations

import json

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio.transform import from_origin

from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree

GROUND_M, TOP_M = 120.0, 150.0


def write_points(folder):
    """A cloud of two points in the form that every QGIS with point clouds reads (EPT), the upper one at TOP_M."""
    low, high = [500000, 3450000, GROUND_M], [500030, 3450030, TOP_M]
    for name in ("ept-data", "ept-hierarchy"):
        (folder / name).mkdir(parents=True)
    np.array([low, high], "<i4").tofile(folder / "ept-data" / "0-0-0-0.bin")
    (folder / "ept-hierarchy" / "0-0-0-0.json").write_text('{"0-0-0-0": 2}')
    form = {"type": "signed", "size": 4, "scale": 1, "offset": 0, "mean": 0, "stddev": 1, "variance": 1, "count": 2}
    axes = [form | {"name": "XYZ"[i], "minimum": low[i], "maximum": high[i]} for i in range(3)]
    srs = {"wkt": pyproj.CRS("EPSG:32617").to_wkt("WKT1_GDAL")}
    about = {"bounds": low + high, "boundsConforming": low + high, "schema": axes, "srs": srs, "version": "1.0.0"}
    about |= {"points": 2, "span": 128, "dataType": "binary", "hierarchyType": "json"}
    (folder / "ept.json").write_text(json.dumps(about))


def test_one_click_shows_the_plot_in_3d(qgis, tmp_path):
    trees = [
        Tree(i, 500000.0 + 4 * i, 3450000.0 + 3 * i, z_ground=GROUND_M, dbh_cm=40.0, qc_flag="ok", height_m=tall)
        for i, tall in enumerate((18.0, None, 20.0), 1)
    ]
    work = tmp_path / "work"
    work.mkdir()
    (work / "run.json").write_text("{}")
    (work / "report_3d.html").touch()
    grid = from_origin(499950, 3450050, 1, 1)
    shape = {"width": 100, "height": 100, "count": 1, "dtype": "float32", "crs": "EPSG:32617", "transform": grid}
    with rasterio.open(work / "dtm.tif", "w", driver="GTiff", **shape) as terrain:
        terrain.write(np.full((1, 100, 100), GROUND_M, "float32"))
    write_trees(tmp_path / "photos.gpkg", trees, "EPSG:32617", sheets=work / "sheets")
    write_trees(tmp_path / "cloud.gpkg", trees, "EPSG:32617")
    write_points(tmp_path / "points")
    seen = qgis.windows("view_inside.py", tmp_path / "seen.json", TREEDGS_VIEW=tmp_path, LIBGL_ALWAYS_SOFTWARE=1)
    assert "add trees.gpkg" in seen["said"][0]
    if not seen["views"]:  # before 3.36
        assert seen["pages"] == [str(work / "report_3d.html")] * 4
        assert all("Configure ▸ Terrain" in said for said in seen["said"][3:5])
        return
    assert seen["pages"] == []
    assert seen["photos"] == ["Stems at true scale", "points", "photos", "Ground"]
    assert seen["cloud"] == ["Stems at true scale", "cloud"]
    kept = [[f"EPSG:{crs}", "flat"] for crs in [32617] * 4 + [4326] * 2]
    assert [view["project"] for _, view in seen["views"]] == kept
    for name, view in seen["views"]:
        ground = GROUND_M if name == "photos" else 0.0
        assert view["green"] > 500 and view["inside"] and 60 < view["pitch"] < 85
        assert view["at"] == pytest.approx([500008, 3450006, ground + 10], abs=0.5)
        assert view["heights"] == pytest.approx([ground, TOP_M if name == "photos" else ground], abs=0.1)
