"""A block that looks complete but contradicts what is known is refused; a small real run end to end."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pycolmap
import pyproj
import pytest
from shared_data import needs_shared
from synthetic_block import CAMERA, LENS, block_of, known_of, ring, still_sensor

from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.control import ControlPoints
from treedgs_geo.geotags.photos import read_photo
from treedgs_geo.geotags.readout import Readout
from treedgs_geo.geotags.stations import Stations
from treedgs_geo.reconstruction.adjustment import adjust
from treedgs_geo.reconstruction.calibration import Calibration, calibration_of
from treedgs_geo.reconstruction.checks import check_block
from treedgs_geo.reconstruction.geotag_errors import as_photos_say
from treedgs_geo.reconstruction.incremental_block import Joined
from treedgs_geo.reconstruction.matching_strategy import reconstruct_photos
from treedgs_geo.reconstruction.model import load_points, load_views
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.rolling_shutter import free_shutter
from treedgs_geo.reconstruction.tracks import Block

READOUT = Readout(0.0, 0.0, "test")


def _case() -> tuple[Joined, Stations, Calibration]:
    rng = np.random.default_rng(0)
    views = ring() + ring(8, 80.0, -75.0)
    block = block_of(views, rng.uniform([-15, -15, 0], [15, 15, 3], (300, 3)), 0.2, rng)
    count = len(block.keypoints)
    xyz = block.centres + rng.normal(0, 0.02, (count, 3))
    stations = Stations(
        [f"{i}.jpg" for i in range(count)],
        [Path(f"{i}.jpg") for i in range(count)],
        xyz,
        np.full((count, 3), 0.02),
        ["fix"] * count,
        np.arange(count, dtype=float),
        np.zeros(count, int),
        np.zeros(count),
        np.full(count, -60.0),
        np.zeros(count),
        np.array([60.0] * 10 + [80.0] * 8),
        pyproj.CRS.from_epsg(6344),
    )
    return _joined(block, xyz, stations.sd), stations, Calibration(CAMERA, "xmp", 0.04)


def _joined(block: Block, xyz: np.ndarray, sd: np.ndarray) -> Joined:
    known = known_of(xyz, sd)
    return Joined(block, adjust(block, known, LENS, final=True), known, LENS, False, block.is_posed, 0, 0)


def test_a_good_block_passes() -> None:
    joined, stations, calibration = _case()
    report = check_block(joined, stations, calibration, READOUT, Reporter())
    assert report["registered"] == 18 and report["geotag_median_m"] < 0.06 and not report["warnings"]
    assert 0 < report["focal_sd_px"] < 10 and report["readout_s"] == 0 and report["readout_sd_s"] is None


def test_poor_geotags_are_reported_and_precise_ones_are_not() -> None:
    joined, stations, calibration = _case()
    good = check_block(joined, stations, calibration, READOUT, Reporter())
    assert good["scale_sd"] < 0.002 and not good["warnings"]
    sd = np.full_like(stations.sd, 2.0)
    poor = replace(stations, sd=sd, quality=["exif"] * len(stations))
    loose = _joined(joined.block, joined.known.xyz, sd)
    reported = check_block(loose, poor, calibration, READOUT, Reporter())
    assert reported["scale_sd"] > 0.01 and "RTK or PPK" in reported["warnings"][0]


def test_geotags_worse_than_they_state_widen_the_scale() -> None:
    joined, stations, calibration = _case()
    honest = check_block(joined, stations, calibration, READOUT, Reporter())["scale_sd"]
    xyz = joined.known.xyz + np.random.default_rng(5).normal(0, 0.12, joined.known.xyz.shape)
    worse = _joined(joined.block, xyz, stations.sd)
    assert check_block(worse, stations, calibration, READOUT, Reporter())["scale_sd"] > 1.2 * honest


def test_a_photo_metres_from_its_geotag_is_named() -> None:
    joined, stations, calibration = _case()
    joined.known.xyz[4] += [0.0, 2.5, 0.0]
    known = as_photos_say(joined.known, joined.adjusted)
    adjusted = adjust(joined.block, known, joined.free)
    report = check_block(joined._replace(known=known, adjusted=adjusted), stations, calibration, READOUT, Reporter())
    assert len(report["warnings"]) == 1 and "1 photos stand 2.5" in report["warnings"][0]
    assert "4.jpg" in report["warnings"][0] and report["geotag_contradicted"] == ["4.jpg"]


def test_groups_without_overlap_are_said_in_two_sentences() -> None:
    joined, stations, calibration = _case()
    assert check_block(joined, stations, calibration, READOUT, Reporter())["groups"] == [18]
    # The points of the second ring are others than those of the first.
    block = joined.block
    high = block.image >= 10
    block.point[high] += len(block.points)
    block.points = np.vstack([block.points, block.points])
    apart = _joined(block, joined.known.xyz, stations.sd)
    report = check_block(apart, stations, calibration, READOUT, Reporter())
    assert report["groups"] == [10, 8] and report["registered"] == 18
    assert "2 groups that share no points: 10 (0.jpg, 1.jpg and 8 more), 8 (10.jpg" in report["warnings"][0]
    assert "held by its own geotags" in report["warnings"][1]


def test_a_block_of_half_of_the_photos_goes_on_and_names_the_others() -> None:
    joined, stations, calibration = _case()
    block = joined.block
    block.unpose(np.arange(18) >= 10)
    half = _joined(block, joined.known.xyz, stations.sd)
    report = check_block(half, stations, calibration, READOUT, Reporter())
    assert report["registered"] == 10 and report["left_out"] == [f"{k}.jpg" for k in range(10, 18)]
    assert "10 of 18 photos registered; left out: 10.jpg" in report["warnings"][0]
    block.unpose(np.arange(18) >= 8)
    with pytest.raises(ReconstructionError, match="8 of 18 photos could be registered, expected 50%"):
        check_block(_joined(block, joined.known.xyz, stations.sd), stations, calibration, READOUT, Reporter())


def test_movements_by_photo_need_geotags_that_hold_the_block() -> None:
    joined, stations, calibration = _case()
    rolling = Readout(0.033, 0.007, "table")
    for sd_m, expected in ((0.02, {"travel"}), (2.0, set())):
        known = known_of(joined.known.xyz, sd_m)
        known, _, free = free_shutter(known, still_sensor(CAMERA, 18), stations, rolling, 60.0)
        assert set(free) == expected and (known.travel_sd_m > 0) == bool(expected)
    report = check_block(joined, stations, calibration, rolling, Reporter())
    assert "33 ms, table) is not taken into account" in report["warnings"][0]


def test_contradictions_are_refused() -> None:
    joined, stations, calibration = _case()
    rough = joined.known.xyz + np.random.default_rng(1).normal(0, 0.4, joined.known.xyz.shape)
    with pytest.raises(ReconstructionError, match="from their geotags"):
        check_block(joined._replace(known=replace(joined.known, xyz=rough)), stations, calibration, READOUT, Reporter())
    wrong = replace(calibration, camera=replace(CAMERA, fx=1700.0, fy=1700.0))
    with pytest.raises(ReconstructionError, match="focal length came out as 190. px"):
        check_block(joined, stations, wrong, READOUT, Reporter())
    with pytest.raises(ReconstructionError, match="flying height"):
        high = replace(stations, relative_altitude_m=np.full(18, 120.0))
        check_block(joined, high, calibration, READOUT, Reporter())
    joined.block.unpose(np.arange(18) < 10)
    with pytest.raises(ReconstructionError, match="8 of 18 photos"):
        check_block(joined, stations, calibration, READOUT, Reporter())


def test_control_points_are_reported_and_a_wrong_one_is_refused() -> None:
    joined, stations, calibration = _case()
    places = np.array([[-12.0, -10, 0], [12, -9, 1], [10, 12, 0], [1, 2, 1.0]])
    marks = [(k, i, *joined.block.view(i).project(places[k][None])[0][0]) for k in range(4) for i in (0, 3, 6)]
    point, photo = np.array([mark[:2] for mark in marks], int).T
    pixels = np.array([mark[2:] for mark in marks])
    control = ControlPoints(list("ABCD"), places, np.full((4, 3), 0.02), np.arange(4) == 3, point, photo, pixels)
    held = joined._replace(known=replace(joined.known, control=control))
    report = check_block(held, stations, calibration, READOUT, Reporter())
    assert [row["label"] for row in report["control"]] == list("ABCD") and max(report["check_rms_e_n_u_m"]) < 0.01
    control.xyz[3] += [0.0, 0.0, 0.6]
    with pytest.raises(ReconstructionError, match=r"0\.60 m from check point D, which claims 0\.03 m"):
        check_block(held, stations, calibration, READOUT, Reporter())


def test_calibration_sources(tmp_path: Path) -> None:
    plot = needs_shared("plot_a")
    assert calibration_of([read_photo(next((plot / "images").iterdir()))]).focal_px == 3795
    beach = calibration_of([read_photo(needs_shared("drone_brighton_beach") / "images" / "DJI_0018.JPG")])
    assert beach.source == "sensor" and beach.focal_px == pytest.approx(2344, abs=1)
    from PIL import Image

    Image.new("RGB", (64, 48)).save(tmp_path / "plain.jpg")
    with pytest.raises(ReconstructionError, match="focal length"):
        calibration_of([read_photo(tmp_path / "plain.jpg")])


def test_part_of_plot_a(tmp_path: Path) -> None:
    """Twelve neighbouring photos end to end: cameras within centimetres, a model that loads."""
    import csv

    plot = needs_shared("plot_a")
    photos = tmp_path / "photos"
    photos.mkdir()
    for path in sorted((plot / "images").iterdir())[:12]:
        shutil.copy(path, photos)
    stations = read_stations(photos, plot, "EPSG:6344", check_photos=False)
    report = reconstruct_photos(stations, ReconstructOptions(max_features=2500), tmp_path / "sfm")
    assert report["registered"] == 12 and not (tmp_path / "cache").exists()
    frame, views = load_views(tmp_path / "sfm", photos)
    with open(plot / "truth" / "cameras.csv", newline="") as stream:
        truth = {row["image"]: [float(row[key]) for key in "ENh"] for row in csv.DictReader(stream)}
    error = frame.to_project(np.array([view.centre for view in views])) - np.array([truth[view.name] for view in views])
    assert np.sqrt(np.mean(error**2)) < 0.06
    assert len(load_points(tmp_path / "sfm")) > 300
    assert pycolmap.Reconstruction(tmp_path / "sfm").compute_mean_reprojection_error() < 1.0
