"""Photos without any position: control points alone place the block, and say how sure it is."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from small_flight import Listening
from synthetic_block import block_of, known_of, ring

from treedgs_geo.core.errors import GeotagError, InputError, ReconstructionError
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.control import ControlPoints, read_control
from treedgs_geo.reconstruction.bundle import Problem
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.checks import _check_alone
from treedgs_geo.reconstruction.control import as_block_says, control_residuals
from treedgs_geo.reconstruction.matching_strategy import reconstruct_photos
from treedgs_geo.reconstruction.model import load_views
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.tracks import Block

GPS, PHOTO, MODEL, FOCAL_35MM = 0x8825, 0x8769, 272, 41989


@pytest.fixture(scope="module")
def blind(simulated_plot: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """images/ of the simulated plot as if of a kite, without GPS and XMP, and gcp_list.txt: six points round the plot,
    half of them to check with, marked where the photos show them."""
    folder = tmp_path_factory.mktemp("blind")
    (folder / "images").mkdir()
    for path in sorted((simulated_plot / "images").iterdir()):
        with Image.open(path) as image:
            exif = image.getexif()
            del exif[GPS]
            exif[MODEL], exif.get_ifd(PHOTO)[FOCAL_35MM] = "Kite", 182
            image.save(folder / "images" / path.name, quality="keep", exif=exif)
    views = true_views(simulated_plot)
    rng, turn = np.random.default_rng(1), np.arange(6) * np.pi / 3
    aims = np.array([view.centre - view.rotation[2] / view.rotation[2, 2] * 70 for view in views.values()])
    middle = np.append(np.median(aims[:, :2], axis=0), 43.0)
    places = middle + np.column_stack([4 * np.cos(turn), 4 * np.sin(turn), rng.uniform(-0.3, 0.3, 6)])
    rows = ["EPSG:6344"]
    for k, place in enumerate(places):
        surveyed = " ".join(f"{value:.3f}" for value in place + rng.normal(0, 0.01, 3))
        for name, view in views.items():
            pixels = view.project(place[None])[0]
            if view.contains(pixels, 5.0)[0]:
                u, v = pixels[0] + rng.normal(0, 0.4, 2)
                rows.append(f"{surveyed} {u:.2f} {v:.2f} {name} P{k}{'_check' if k % 2 else ''}")
    (folder / "gcp_list.txt").write_text("\n".join(rows))
    return folder


def true_views(plot: Path) -> dict[str, View]:
    """The cameras as they were, project coordinates."""
    views = {}
    with open(plot / "truth" / "cameras.csv", newline="") as stream:
        for row in csv.DictReader(stream):
            size = int(row["width"]), int(row["height"])
            lens = (float(row[key]) for key in ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"))
            rotation = np.array([[float(row[f"r{i}{j}"]) for j in range(3)] for i in range(3)])
            centre = np.array([float(row[key]) for key in "ENh"])
            views[row["image"]] = View(row["image"], Path(), Camera(*size, *lens), rotation, -rotation @ centre)
    return views


def test_control_points_alone_place_a_block(blind: Path, simulated_plot: Path, tmp_path: Path) -> None:
    listening = Listening()
    stations = read_stations(blind / "images", None, None, control=blind / "gcp_list.txt", check_photos=False)
    assert not stations.is_placed.any() and stations.crs.to_epsg() == 6344
    control = read_control(blind / "gcp_list.txt", stations)
    report = reconstruct_photos(stations, ReconstructOptions(max_features=2500), tmp_path / "sfm", listening, control)
    assert report["registered"] >= 26 and report["level"] == "full"
    assert report["geotag_rms_e_n_u_m"] is None and report["geotag_residual_quality"] is None
    assert max(report["control_rms_e_n_u_m"]) < 0.02 and max(report["check_rms_e_n_u_m"]) < 0.04
    assert 0.001 < report["scale_sd"] < 0.02 and report["focal_px"] == pytest.approx(3804, rel=0.01)
    frame, views = load_views(tmp_path / "sfm", blind / "images")
    truth = true_views(simulated_plot)
    off = frame.to_project(np.array([view.centre for view in views])) - [truth[view.name].centre for view in views]
    assert np.sqrt(np.mean(off**2)) < 0.8, "70 to 90 m above points within 4 m"


def test_photos_without_positions_need_control_points(blind: Path, tmp_path: Path) -> None:
    with pytest.raises(
        GeotagError, match=r"none of the 28 photos has a GPS position .* or three or more control points"
    ):
        read_stations(blind / "images", None, "EPSG:6344")
    stations = read_stations(blind / "images", None, "EPSG:6344", control=blind / "gcp_list.txt", check_photos=False)
    crs, *rows = (blind / "gcp_list.txt").read_text().splitlines()
    two = tmp_path / "two.txt"
    two.write_text("\n".join([crs, *(row for row in rows if row.endswith(("P0", "P1_check", "P2")))]))
    with pytest.raises(
        InputError, match=r"two\.txt: has 2 control points that two photos or more show; where no photo"
    ):
        read_control(two, stations)
    line = tmp_path / "line.txt"
    east, north, up = rows[0].split()[:3]
    moved = [
        f"{float(east) + int(row[-1])} {north} {up} {' '.join(row.split()[3:])}" for row in rows if row[-1] in "024"
    ]
    line.write_text("\n".join([crs, *moved]))
    with pytest.raises(InputError, match=r"has 3 control points that two photos or more show, all in a line; where"):
        read_control(line, stations)


def test_control_points_count_by_what_the_block_shows_of_them() -> None:
    rng = np.random.default_rng(2)
    views, places = ring(), rng.uniform([-15, -15, 0], [15, 15, 3], (8, 3))
    block = block_of(views, rng.uniform([-15, -15, 0], [15, 15, 3], (100, 3)), 0.0, rng)
    marks = [(k, i, *block.view(i).project(places[k][None])[0][0]) for k in range(8) for i in (0, 3, 6)]
    point, photo = np.array([mark[:2] for mark in marks], int).T
    sd, check = np.full((8, 3), 0.02), np.arange(8) == 7
    pixels = np.array([mark[2:] for mark in marks])
    right = ControlPoints(list("ABCDEFGH"), places + rng.normal(0, 0.02, (8, 3)), sd, check, point, photo, pixels)
    assert as_block_says(block, right) is right
    wrong = right.pixels + np.where(np.arange(len(point))[:, None] == 4, 400.0, 0.0)  # one mark of B on another place
    rows = control_residuals(block, replace(right, pixels=wrong))
    assert ["px" in row for row in rows] == [True, False, *[True] * 6]
    # Nor does it pull at the block.
    known = known_of(np.full((len(views), 3), np.nan), np.inf)
    marked = [replace(known, control=replace(right, pixels=own)) for own in (right.pixels, wrong)]
    held = [(Problem(block, each, frozenset()).point_weight > 0).all(axis=1).sum() for each in marked]
    assert held == [7, 6]
    rough = replace(right, xyz=places + rng.normal(0, 0.8, (8, 3)))
    assert 0.4 < as_block_says(block, rough).sd_m[0, 0] < 1.6
    assert (
        as_block_says(Block(**{**vars(block), "translations": np.full_like(block.translations, np.nan)}), rough)
        is rough
    )


def test_control_points_that_contradict_each_other_do_not_hold_a_block() -> None:
    places, told = np.array([[0.0, 0, 0], [20, 0, 0], [0, 20, 0], [20, 20, 1]]), list[str]()
    points = ControlPoints(list("ABCD"), places, np.full((4, 3), 0.3), np.zeros(4, bool), *np.zeros((3, 0)))
    _check_alone(points, np.ones(4, bool), told)
    assert len(told) == 1 and "none checks it" in told[0]
    with pytest.raises(ReconstructionError, match="2 of 4 control points lie in two or more of the placed photos"):
        _check_alone(points, np.arange(4) < 2, told)
    with pytest.raises(ReconstructionError, match=r"contradict each other by 3\.46 m over 28 m"):
        _check_alone(replace(points, sd_m=np.full((4, 3), 2.0)), np.ones(4, bool), told)
