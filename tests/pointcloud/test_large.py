"""Large clouds, of which a part is held: the verbs write the whole file, with the same ground, stems and labels."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest
from synthetic_cloud import plot_cloud

from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.run.cloud_steps import run_segment_stems as segment
from treedgs_geo.run.cloud_steps import run_terrain as terrain
from treedgs_geo.terrain import thinned
from treedgs_geo.terrain.dtm import read_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_geo.verbs.segment_stems import SegmentStemsSettings
from treedgs_geo.verbs.terrain import TerrainSettings

UTM = pyproj.CRS.from_epsg(32615)


def test_verbs_on_a_large_file(tmp_path, monkeypatch):
    """The same result files of all and of a part of the points; noise is left out; fields of the input are kept."""
    rng = np.random.default_rng(5)
    xyz = plot_cloud(rng, [(3, 3, 20.0), (8, 5, 30.0)]) + (611300.0, 3718400.0, 0.0)
    noise = np.array([[611305.0, 3718404.0, 60.0]]) + rng.normal(0, 0.02, (40, 3))
    xyz = np.vstack([xyz, noise])
    classes = np.r_[np.ones(len(xyz) - 40, np.uint8), np.full(40, 7, np.uint8)]
    write_cloud(tmp_path / "in.laz", PointCloud(xyz, UTM, {"classification": classes, "mark": np.arange(len(xyz))}))
    for name in ("whole", "large"):
        (tmp_path / name).mkdir()
        if name == "large":
            monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", 1000)
        ground = terrain(
            TerrainSettings(
                input=tmp_path / "in.laz",
                output=tmp_path / name / "dtm.tif",
                ground_points=tmp_path / name / "ground.laz",
            ),
            Reporter(),
        )
        assert ground["n_points"] == len(xyz) - 40 if name == "whole" else 1000 < ground["n_points"] < len(xyz)
        stems = segment(
            SegmentStemsSettings(input=tmp_path / "in.laz", output=tmp_path / name / "stems.laz", keep_all=True),
            Reporter(),
        )
        assert stems["n_stems"] == 2
    one, other = (read_dtm(tmp_path / name / "dtm.tif") for name in ("whole", "large"))
    np.testing.assert_allclose(one.heights, other.heights, atol=0.03)
    assert one.crs.to_epsg() == other.crs.to_epsg() == 32615 and np.nanmin(one.heights) > 95
    a, b = (laspy.read(tmp_path / name / "stems.laz") for name in ("whole", "large"))
    np.testing.assert_array_equal(a["mark"], b["mark"])
    assert (np.asarray(a["tree_id"]) != np.asarray(b["tree_id"])).mean() < 0.01
    c, d = (laspy.read(tmp_path / name / "ground.laz") for name in ("whole", "large"))
    assert (np.asarray(c.classification) != np.asarray(d.classification)).mean() < 0.01
    assert (np.asarray(d.classification)[-40:] == 7).all()
    whole = (tmp_path / "in.laz").read_bytes()
    assert main(["segment-stems", "--input", str(tmp_path / "in.laz"), "--output", str(tmp_path / "in.laz")]) == 2
    assert (tmp_path / "in.laz").read_bytes() == whole


def test_a_large_text_cloud(tmp_path, monkeypatch):
    monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", 1000)
    xyz = plot_cloud(np.random.default_rng(6), [(3, 3, 20.0)])
    np.savetxt(tmp_path / "in.txt", xyz, fmt="%.4f")
    stems = segment(SegmentStemsSettings(input=tmp_path / "in.txt", output=tmp_path / "s.laz", crs="local"), Reporter())
    assert stems["n_stems"] == 1 and stems["n_stem_points"] == len(laspy.read(tmp_path / "s.laz"))


def test_a_foreign_dtm_is_refused_for_large_clouds_too(tmp_path, monkeypatch):
    from treedgs_geo.terrain.dtm import write_dtm

    monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", 1000)
    xyz = plot_cloud(np.random.default_rng(6), [(3, 3, 20.0)]) + (611300.0, 3718400.0, 0.0)
    write_cloud(tmp_path / "in.laz", PointCloud(xyz, UTM))
    write_dtm(tmp_path / "dtm.tif", dtm_from_cloud(xyz + (0, 0, 27.0), crs=UTM))
    with pytest.raises(InputError, match="vertical datum"):
        segment(
            SegmentStemsSettings(input=tmp_path / "in.laz", dtm=tmp_path / "dtm.tif", output=tmp_path / "s.laz"),
            Reporter(),
        )
    write_dtm(tmp_path / "far.tif", dtm_from_cloud(xyz + (500, 0, 0), crs=UTM))
    with pytest.raises(InputError, match="covers the plot"):
        segment(
            SegmentStemsSettings(input=tmp_path / "in.laz", dtm=tmp_path / "far.tif", output=tmp_path / "s.laz"),
            Reporter(),
        )
