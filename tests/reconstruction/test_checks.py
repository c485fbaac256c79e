"""A block that looks complete but contradicts what is known is refused; a small real run end to end."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
from shared_data import needs_shared
from synthetic_block import CAMERA, block_of, ring

from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.photos import read_photo
from treedgs_geo.geotags.stations import Stations
from treedgs_geo.reconstruction.calibration import Calibration, calibration_of
from treedgs_geo.reconstruction.checks import check_block, scale_error
from treedgs_geo.reconstruction.model import load_points, load_views
from treedgs_geo.reconstruction.pipeline import ReconstructOptions, reconstruct_photos

FREE = {"focal": True, "principal_point": True, "distortion": True}


def _case() -> tuple:
    rng = np.random.default_rng(0)
    block = block_of(ring(), rng.uniform([-15, -15, 0], [15, 15, 3], (300, 3)), 0.2, rng)
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
        np.full(count, 60.0),
        pyproj.CRS.from_epsg(6344),
    )
    return block, stations, xyz, Calibration(CAMERA, "xmp", 0.04)


def test_a_good_block_passes() -> None:
    block, stations, xyz, calibration = _case()
    report = check_block(block, stations, xyz, calibration, FREE, Reporter())
    assert report["registered"] == 10 and report["geotag_median_m"] < 0.06 and not report["warnings"]


def test_the_scale_is_as_sure_as_geotags_make_it() -> None:
    rng = np.random.default_rng(1)
    centres = np.array([view.centre for view in ring()])
    sd = np.tile([1.0, 1.0, 2.0], (len(centres), 1))
    sd[0] = np.nan  # a photo without geotag
    found = []
    for _ in range(4000):  # scale by weighted least squares, the way the block is fitted to its geotags
        tags = centres[1:] + rng.normal(0, sd[1:]) + [5.0, 0.0, 0.0]
        weight = 1 / sd[1:] ** 2
        a, b = (x - (weight * x).sum(axis=0) / weight.sum(axis=0) for x in (centres[1:], tags))
        found.append((weight * a * b).sum() / (weight * a * a).sum())
    assert np.mean(found) == pytest.approx(1, abs=0.01)
    assert scale_error(centres, sd) == pytest.approx(np.std(found), rel=0.05)
    assert scale_error(centres, sd / 100) == pytest.approx(scale_error(centres, sd) / 100)
    assert np.isnan(scale_error(centres[:1], sd[1:2]))


def test_poor_geotags_are_reported_and_precise_ones_are_not() -> None:
    block, stations, xyz, calibration = _case()
    good = check_block(block, stations, xyz, calibration, FREE, Reporter())
    assert good["scale_sd"] < 0.001 and not good["warnings"]
    poor = replace(stations, sd=np.full_like(stations.sd, 2.0), quality=["exif"] * len(stations))
    reported = check_block(block, poor, xyz, calibration, FREE, Reporter())
    assert reported["scale_sd"] > 0.005 and "RTK or PPK" in reported["warnings"][0]


def test_a_photo_metres_from_its_geotag_is_named() -> None:
    block, stations, xyz, calibration = _case()
    xyz[4] += [0.0, 2.5, 0.0]
    report = check_block(block, stations, xyz, calibration, FREE, Reporter())
    assert len(report["warnings"]) == 1 and "1 photos stand up to 2.5 m" in report["warnings"][0]
    assert "4.jpg" in report["warnings"][0]


def test_contradictions_are_refused() -> None:
    block, stations, xyz, calibration = _case()
    with pytest.raises(ReconstructionError, match="from their geotags"):
        check_block(
            block,
            stations,
            xyz + np.random.default_rng(1).normal(0, 0.4, xyz.shape),
            calibration,
            FREE,
            Reporter(),
        )
    wrong = replace(calibration, camera=replace(CAMERA, fx=1700.0, fy=1700.0))
    with pytest.raises(ReconstructionError, match="focal length came out as 1900 px"):
        check_block(block, stations, xyz, wrong, FREE, Reporter())
    with pytest.raises(ReconstructionError, match="flying height"):
        check_block(
            block, replace(stations, relative_altitude_m=np.full(10, 100.0)), xyz, calibration, FREE, Reporter()
        )
    block.rotations[:5], block.translations[:5] = np.nan, np.nan
    block.keep(block.image >= 5)
    with pytest.raises(ReconstructionError, match="5 of 10 photos"):
        check_block(block, stations, xyz, calibration, FREE, Reporter())


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
    points = load_points(tmp_path / "sfm")
    assert len(points.xyz) > 300 and points.error_px.mean() < 1.0
