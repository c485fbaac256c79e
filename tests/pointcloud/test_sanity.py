"""Clouds that cannot be a stand in metres: each fault its own sentence, in the run and in the dry run."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pyproj
import pytest
from pointcloud.odd_clouds import claim, stand, turned, write_las
from shared_data import needs_shared
from synthetic_cloud import plot_cloud, stem_points

from treedgs_geo.cli import main
from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import describe_cloud, read_cloud
from treedgs_geo.pointcloud.sanity import examine
from treedgs_geo.pointcloud.survey import SAMPLE_POINTS, sample, survey
from treedgs_geo.run.cloud_input import checked
from treedgs_geo.stems.quality.reasons import REASONS
from treedgs_geo.terrain import thinned


def kinds(xyz, **more):
    return [(finding.kind, finding.refuse) for finding in examine(xyz, "a.laz", **more)[1]]


def sentence(capsys, *arguments, code=2):
    assert main([*map(str, arguments), "--crs", "local", "--log-format", "plain"]) == code
    heard = capsys.readouterr().err
    assert "Traceback" not in heard
    return heard


PLOT = stand()


@pytest.mark.parametrize(
    ("xyz", "kind", "words"),
    [
        (PLOT * 1000, "tall", "millimetres (2"),
        (PLOT * 100, "tall", "centimetres (2"),
        (PLOT * (1, 1, 100), "tall", "130 m"),
        (turned(PLOT, 1), "axis", "across the y axis"),
        (turned(PLOT, 0), "axis", "across the x axis"),
        (PLOT * (1, -1, -1), "axis", "downward z"),
        (PLOT * (1e-5, 1e-5, 1) + (-93.5, 33.6, 0), "degrees", "looks like degrees"),
        (
            np.vstack(
                [stem_points(np.random.default_rng(0), 25.0, 900, low=1.2, high=1.4, xy=(x, 2.0)) for x in (1, 4, 9)]
            ),
            "thin",
            "only 0.2",
        ),
        (PLOT * (1000, 1000, 1), "extent", "12 km x 12 km"),
    ],
)
def test_each_fault_ends_run_and_dry_run_with_its_own_sentence(tmp_path, capsys, xyz, kind, words):
    assert kinds(PLOT) == []
    assert kinds(xyz, scale=np.full(3, 0.01))[0] == (kind, True)
    write_las(tmp_path / "odd.laz", xyz, (1e-7, 1e-7, 0.001) if kind == "degrees" else (0.01, 0.01, 0.01))
    for more in ([], ["--dry-run"]):
        heard = sentence(
            capsys, "pointcloud-to-dbh", "--input", tmp_path / "odd.laz", "--output", tmp_path / "out" / "t.gpkg", *more
        )
        assert words in heard and str(tmp_path / "odd.laz") in heard
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("verb", ["segment-stems", "terrain"])
def test_the_other_verbs_say_the_same_at_once_and_thinned(tmp_path, capsys, monkeypatch, verb, large):
    if large:
        monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", 1000)
    write_las(tmp_path / "mm.laz", PLOT * 1000, (1, 1, 1))
    output = tmp_path / "out" / ("s.laz" if verb == "segment-stems" else "d.tif")
    assert "millimetres" in sentence(capsys, verb, "--input", tmp_path / "mm.laz", "--output", output)
    assert not (tmp_path / "out").exists()


def test_units_of_heights_that_could_be_trees(tmp_path, capsys):
    """22 m in feet: 72 m is remarked at once; what was measured is slender as no stand is, so no tree stays ok."""
    assert kinds(PLOT * (1, 1, 3.2808)) == [("tall", False)]
    assert kinds(stand(tall_m=27.0) * (1, 1, 3.2808)) == [("tall", False)]
    assert kinds(PLOT * (1, 1, 2)) == []


def test_birds_and_noise_in_the_air_are_no_tall_trees():
    rng = np.random.default_rng(2)
    many = np.vstack([PLOT + rng.normal(0, 0.01, PLOT.shape) for _ in range(5)])
    for share in (0.0005, 0.008):
        count = int(share * len(many))
        assert count >= 50
        air = np.column_stack([rng.uniform(0, 12, (count, 2)), rng.uniform(20, 95, count)])
        assert kinds(np.vstack([many, air])) == []
    assert kinds(np.vstack([PLOT, [[1e300, -1e300, 0]]])) == [("strays", False)]


def test_stems_in_a_cloud_with_heights_in_feet_are_all_marked(tmp_path, capsys):
    """Trees of 15 m, 49 m in feet: height alone could be right, the ratio to the diameters is not."""
    rng = np.random.default_rng(8)
    places = [(2.5, 2.5), (6.0, 3.0), (9.5, 2.5), (3.0, 8.0), (6.5, 6.5), (9.5, 9.0)]
    xyz = plot_cloud(rng, []) - (0, 0, 100)
    for x, y in places:
        foot = 0.05 * x + 0.1 * np.sin(y / 3)
        bark = stem_points(rng, 20.0, 2500, high=9.0, xy=(x, y), taper_cm_m=0.8)
        crown = np.column_stack([rng.normal(x, 0.5, 400), rng.normal(y, 0.5, 400), rng.uniform(8, 15, 400)])
        xyz = np.vstack([xyz, bark + (0, 0, foot), crown + (0, 0, foot)])
    flags = {}
    for name, factor in (("metres", 1.0), ("feet", 3.2808)):
        write_las(tmp_path / f"{name}.laz", xyz * (1, 1, factor))
        heard = sentence(
            capsys,
            "pointcloud-to-dbh",
            "--input",
            tmp_path / f"{name}.laz",
            "--output",
            tmp_path / f"{name}.csv",
            code=0,
        )
        assert ("probably in feet" in heard) == (name == "feet")
        rows = list(csv.DictReader((tmp_path / f"{name}.csv").open()))
        assert len(rows) >= 5
        flags[name] = [(row["qc_flag"], row["qc_reason"]) for row in rows]
    assert any(flag == "ok" for flag, _ in flags["metres"])
    assert all(flag != "ok" and "odd_heights" in reason for flag, reason in flags["feet"])
    assert "odd_heights" in REASONS


def test_a_header_in_feet_is_not_set_aside_in_silence(tmp_path, capsys):
    """``--crs local`` is metres whatever the header says; a header in metres of a map has nothing to say there."""
    for code, said in ((2271, True), (32617, False)):
        path = tmp_path / f"{code}.laz"
        write_las(path, PLOT)
        las = laspy.read(path)
        las.header.add_crs(pyproj.CRS.from_epsg(code))
        las.write(path)
        heard = sentence(capsys, "terrain", "--input", path, "--output", path.with_suffix(".tif"), code=0)
        assert ("US survey foot" in heard) == said


def test_units_in_the_geotiff_keys_are_read(tmp_path):
    from laspy.vlrs.known import GeoKeyDirectoryVlr, GeoKeyEntryStruct

    for keys, words in (
        ({3072: 26915, 4099: 9003}, "heights are in US survey feet"),
        ({3072: 26915, 3076: 9002}, "x and y are in feet"),
        ({3072: 26915, 4096: 6360}, "heights are in US survey foot"),
        ({3072: 26915, 3076: 9001, 4096: 5703, 4099: 9001}, ""),
    ):
        path = tmp_path / "keys.las"
        header = laspy.LasHeader(version="1.2", point_format=0)
        header.scales, header.offsets = [0.001] * 3, [500000, 4000000, 0]
        directory = GeoKeyDirectoryVlr()
        directory.geo_keys = [
            GeoKeyEntryStruct(id=key, tiff_tag_location=0, count=1, value_offset=value)
            for key, value in {1024: 1, **keys}.items()
        ]
        directory.geo_keys_header.number_of_keys = len(directory.geo_keys)
        header.vlrs.append(directory)
        data = laspy.LasData(header)
        data.x, data.y, data.z = (PLOT + (500000, 4000000, 0)).T
        data.write(str(path))
        if words:
            with pytest.raises(CRSError, match=words):
                read_cloud(path)
        else:
            assert read_cloud(path).crs.to_epsg() == 26915


@pytest.mark.parametrize(
    "stray",
    [[[1e6, 0, 0]], [[1e6, -1e6, 5e4]], [[5, 5, 1e5]], [[3000, 5, 1]], [[2e6, 0, 0], [-2e6, 1e6, 0], [5, 5, -4000]]],
)
def test_points_far_off_are_counted_and_left_out(tmp_path, capsys, monkeypatch, stray):
    xyz = np.vstack([np.array(stray, float), PLOT])
    extent, findings = examine(xyz, "a.laz")
    assert [finding.kind for finding in findings] == ["strays"] and not findings[0].refuse
    assert 1 <= extent.n_strays <= len(stray) <= extent.n_strays_most
    np.testing.assert_array_equal(np.flatnonzero(~extent.holds(xyz)), np.arange(len(stray)))
    write_las(tmp_path / "far.laz", xyz, (0.01, 0.01, 0.01))
    write_las(tmp_path / "good.laz", PLOT)
    counts = {}
    for name, limit in (("good", 10**7), ("far", 10**7), ("far", 1000)):
        monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", limit)
        heard = sentence(capsys, "terrain", "--input", tmp_path / f"{name}.laz", "--output", tmp_path / "d.tif", code=0)
        assert ("away from all others" in heard) == (name == "far")
        import rasterio

        with rasterio.open(tmp_path / "d.tif") as raster:
            counts[name, limit] = raster.shape
    assert max(max(shape) for shape in counts.values()) < 130, "the grid is that of the plot"


@pytest.mark.parametrize("suffix", [".laz", ".txt"])
def test_strays_are_in_no_output_by_either_road(tmp_path, capsys, monkeypatch, suffix):
    xyz = np.vstack([[[1e6, 0, 0]], PLOT, [[0, -5e5, 0]]])
    path = tmp_path / f"far{suffix}"
    if suffix == ".txt":
        np.savetxt(path, xyz, fmt="%.3f")
    else:
        write_las(path, xyz)
    for limit in (10**7, 1000):
        monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", limit)
        heard = sentence(capsys, "segment-stems", "--input", path, "--keep-all", "--output", tmp_path / "s.laz", code=0)
        assert heard.count("away from all others") == 1
        sentence(
            capsys,
            "terrain",
            "--input",
            path,
            "--ground-points",
            tmp_path / "g.laz",
            "--output",
            tmp_path / "d.tif",
            code=0,
        )
        for name in ("s.laz", "g.laz"):
            out = laspy.read(tmp_path / name).xyz
            assert len(out) == len(PLOT) and np.abs(out - PLOT).max() < 0.002


def test_two_groups_far_apart_are_not_strays():
    """Many points far off are no strays: what cannot be gridded is refused, what can is worked on as before."""
    xyz = np.vstack([PLOT, PLOT[::3] + (3e6, 0, 0)])
    extent, findings = examine(xyz, "a.laz")
    assert findings[0].refuse and "3,000 km away" in findings[0].sentence and extent.n_strays == 0
    near = np.vstack([PLOT, PLOT[::3] + (90, 0, 0)])
    assert kinds(near) == []


def test_a_large_survey_keeps_a_sample_and_the_whole_extent():
    rng = np.random.default_rng(0)
    xyz = rng.uniform([0, 0, 0], [300, 200, 30], (1_200_000, 3))
    extent = survey(xyz)
    assert extent.n_points == 1_200_000 and SAMPLE_POINTS / 2 <= len(sample(xyz, extent)) <= SAMPLE_POINTS
    assert extent.n_strays == 0 and (extent.high - extent.low > [299, 199, 29.9]).all()


@pytest.mark.parametrize(
    ("suffix", "version", "point_format"),
    [(".las", "1.2", 1), (".las", "1.4", 6), (".laz", "1.2", 1), (".laz", "1.4", 6), (".laz", "1.4", 7)],
)
def test_a_header_that_claims_fewer_points_than_the_file_holds(tmp_path, suffix, version, point_format):
    xyz = np.tile(PLOT, (5, 1))[:130_000]
    path = tmp_path / f"less{suffix}"
    write_las(path, xyz, version=version, point_format=point_format)
    count = describe_cloud(path).n_points
    assert count == len(xyz)
    for fewer in (1000, count // 2):
        claim(path, fewer)
        with pytest.raises(InputError, match=rf"promises {fewer:,} points, the file holds"):
            read_cloud(path, crs="local")
    claim(path, count)
    assert len(read_cloud(path, crs="local")) == count


def test_memory_stays_that_of_the_plot_with_a_point_a_thousand_kilometres_off(tmp_path):
    """A child with the address space of a small job: without the check the grids ask for terabytes."""
    write_las(tmp_path / "far.laz", np.vstack([PLOT, [[1e6, 0, 0]]]))
    # Not ru_maxrss: that of a child begins with what its parent held before exec.
    code = (
        "import re, sys; from treedgs_geo.cli import main; "
        f"code = main(['pointcloud-to-dbh', '--input', r'{tmp_path / 'far.laz'}', '--output', "
        f"r'{tmp_path / 't.csv'}', '--crs', 'local', '--log-format', 'quiet']); "
        "print(int(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read())[1]) // 1024); sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[-1]) < 1500 and (tmp_path / "t.csv").is_file()


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        ("als_chablais3", "las_chablais3.laz"),
        ("als_lasr_bcts", "bcts_1.laz"),
        ("als_lidr", "Megaplot.laz"),
        ("als_lidr", "MixedConifer.laz"),
        ("als_lidr", "Topography.laz"),
        ("als_pycrown_dtm", "POINTS.laz"),
        ("lidar_itsme", "pc_tree.las"),
        ("lidar_itsme", "buttressed_tree_1_pc.txt"),
        ("lidar_itsme", "pc_tree_uav.txt"),
        ("lidar_spanner", "ALS_Clip.laz"),
        ("lidar_spanner", "UAS_Clip.laz"),
        ("lidar_treeiso", "LPine1_demo.laz"),
        ("lidar_treels", "pine.laz"),
        ("lidar_treels", "pine_plot.laz"),
        ("lidar_treels", "spruce.laz"),
        ("plot_a", "lidar/plot_a_uls.laz"),
        ("plot_h", "lidar/plot_h_uls.laz"),
    ],
)
def test_real_clouds_pass(folder, name):
    path = needs_shared(folder) / name
    cloud = read_cloud(path, crs="local", attributes=())
    extent, findings = examine(cloud.xyz, path, True, describe_cloud(path).scale)
    assert extent.n_strays == 0 and {finding.kind for finding in findings} <= {"ground"}
    assert not any(finding.refuse for finding in findings)
    if folder in ("lidar_treels", "plot_a") and name != "pine.laz":
        for odd in (turned(cloud.xyz, 0), turned(cloud.xyz, 1)):
            assert kinds(odd)[0] == ("axis", True)


def test_stem_points_alone_need_no_ground_that_lies_flat():
    rng = np.random.default_rng(2)
    places = rng.uniform(0, 7, (13, 2))
    stems = [stem_points(rng, 25, 110, xy=place, high=13, taper_cm_m=0.8) for place in places]
    cloud = PointCloud(np.vstack(stems))
    assert kinds(cloud.xyz)[0] == ("axis", True)
    labelled = cloud.with_attribute("tree_id", np.repeat(np.arange(1, 14), 110))
    assert len(checked(labelled, Path("stems.laz"), Reporter(), find_stems=False)[0]) == len(cloud)
