"""A tiny plot, simulated once a session, checked file by file; and the parts that have known answers."""

from __future__ import annotations

import csv
import datetime as dt
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import cv2
import laspy
import numpy as np
import pyproj
import pytest
import rasterio
from PIL import Image

from treedgs_geo.core.errors import InputError, OutputError
from treedgs_geo.core.settings import build, params_of
from treedgs_geo.planning.sun import sun_direction
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_lab.simulate import flight, scene, stem_mesh, terrain, truth
from treedgs_lab.simulate.settings import SimulateOptions, SimulateSettings, command_words, resolve
from treedgs_lab.simulate.simulate import simulate_plot

TINY = dict(
    preset="test",
    seed=5,
    radius_m=3.5,
    image_width=480,
    image_height=360,
    photos=14,
    samples=3,
    stems_per_ha=900.0,
    dbh_mean_cm=30.0,
    lidar_density_m2=150.0,
)
#: Without anything that stands in the way or that LiDAR could take for a stem.
BARE = dict(TINY, leaf_area_m2=0.0, shrubs_per_m2=0.0, saplings_per_m2=0.0, logs=0)


@pytest.fixture(scope="session")
def leafy(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sim") / "leafy"
    simulate_plot(SimulateSettings(output=folder, forks_below_bh=1, touching_saplings=1, **TINY))
    return folder


@pytest.fixture(scope="session")
def bare(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sim") / "bare"
    simulate_plot(SimulateSettings(output=folder, **BARE))
    return folder


def table(path: Path) -> list[dict]:
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def origin(folder: Path) -> np.ndarray:
    return np.array(json.loads((folder / "truth" / "config.json").read_text())["origin_E_N_h"])


def views_of(folder: Path) -> dict[str, View]:
    views = {}
    for row in table(folder / "truth" / "cameras.csv"):
        number = {key: float(row[key]) for key in ("fx", "fy", "cx", "cy", "k1", "k2")}
        camera = Camera(int(row["width"]), int(row["height"]), **number)
        rotation = np.array([[float(row[f"r{i}{j}"]) for j in range(3)] for i in range(3)])
        translation = np.array([float(row["t" + axis]) for axis in "xyz"])
        views[row["image"]] = View(
            row["image"], folder / "images" / row["image"], camera, rotation, translation, int(row["flight"])
        )
    return views


def test_layout(leafy):
    names = {path.relative_to(leafy).as_posix() for path in leafy.rglob("*") if path.is_file()}
    assert {
        "dtm.tif",
        "plots.csv",
        "field_trees.csv",
        "leafy_ppk.pos",
        "lidar/leafy_uls.laz",
        "truth/trees.csv",
        "truth/visibility.csv",
        "truth/cameras.csv",
        "truth/stems.json",
        "truth/config.json",
        "truth/field_key.json",
        "truth/timing.json",
    } <= names
    photos = sorted(path.name for path in (leafy / "images").iterdir())
    assert len(photos) == 14 and all(re.fullmatch(r"DJI_\d{14}_\d{4}_V\.JPG", name) for name in photos)
    assert [row["image"] for row in table(leafy / "truth" / "cameras.csv")] == photos
    assert len(list(leafy.glob("DJI_*_Timestamp.MRK"))) == 1


def test_same_seed_same_bytes_wherever_it_is_made(leafy, tmp_path):
    """On one core, in another folder, language and time zone, with other hashes and rights: also the plugin's sample
    flight, which is such a plot."""
    again = tmp_path / "elsewhere" / "leafy"
    options = command_words(dict(TINY, forks_below_bh=1, touching_saplings=1))
    elsewhere = {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONHASHSEED": "7"}
    elsewhere |= {"TZ": "Pacific/Auckland", "LC_ALL": "de_DE.UTF-8", "PYTHONUTF8": "0"}
    subprocess.run(
        [sys.executable, "-m", "treedgs_geo", "simulate-plot", *options, "--output", str(again)],
        env={**os.environ, **elsewhere}, umask=0o077, check=True, capture_output=True,
    )  # fmt: skip
    for path in sorted(leafy.rglob("*")):
        if path.is_file() and path.name != "timing.json":
            assert path.read_bytes() == (again / path.relative_to(leafy)).read_bytes(), path.name


def test_mrk_and_pos_give_the_true_camera_positions(leafy):
    """Antenna interpolated at the MRK's time plus the MRK's offset: within PPK noise, except in float bursts."""
    epochs = []
    to_grid = pyproj.Transformer.from_crs(6318, 6344, always_xy=True)
    for line in (leafy / "leafy_ppk.pos").read_text().splitlines():
        if not line.startswith("%"):
            part = line.split()
            when = dt.datetime.strptime(part[0] + " " + part[1], "%Y/%m/%d %H:%M:%S.%f")
            assert when.microsecond % 200000 == 0
            epochs.append(
                (
                    (when - dt.datetime(1980, 1, 6)).total_seconds() % 604800,
                    *to_grid.transform(float(part[3]), float(part[2])),
                    float(part[4]),
                    int(part[5]),
                )
            )
    epochs = np.array(epochs)
    cameras = table(leafy / "truth" / "cameras.csv")
    lines = next(leafy.glob("*.MRK")).read_text().splitlines()
    assert len(lines) == len(cameras)
    errors, floating = [], []
    for line, camera in zip(lines, cameras, strict=True):
        found = re.match(
            r"\d+\t([\d.]+)\t\[(\d+)\]\t\s*(-?\d+),N\t\s*(-?\d+),E\t\s*(-?\d+),V\t"
            r"(.+),Lat\t(.+),Lon\t(.+),Ellh",
            line,
        )
        seconds, north, east, down = (float(found[k]) for k in (1, 3, 4, 5))
        utc = dt.datetime.fromisoformat(camera["utc"])
        since = (utc - dt.datetime(1980, 1, 6)).total_seconds() + 18 - 604800 * int(found[2])
        assert since == pytest.approx(seconds, abs=1e-5)
        antenna = np.array([np.interp(seconds, epochs[:, 0], epochs[:, k]) for k in (1, 2, 3)])
        position = antenna + np.array([east, north, -down]) / 1000
        errors.append(position - [float(camera[key]) for key in ("E", "N", "h")])
        floating.append(camera["ppk_float"] == "1")
        # The receiver's own position is metres off, not kilometres.
        raw = np.array(to_grid.transform(float(found[7]), float(found[6])))
        assert 0.05 < np.linalg.norm(raw - position[:2]) < 12
    errors, floating = np.array(errors), np.array(floating)
    assert floating.any() and (epochs[:, 4] == 2).any()
    assert np.abs(errors[~floating][:, :2]).max() < 0.08 and np.abs(errors[~floating][:, 2]).max() < 0.13
    assert np.linalg.norm(errors[floating], axis=1).max() > 0.1


def test_photo_metadata(leafy):
    cameras = {row["image"]: row for row in table(leafy / "truth" / "cameras.csv")}
    for path in sorted((leafy / "images").iterdir())[::5]:
        image = Image.open(path)
        camera = cameras[path.name]
        assert image.size == (480, 360)
        exif = image.getexif()
        assert exif[271] == "DJI" and "SYNTHETIC" in exif[270]
        detail, gps = exif.get_ifd(0x8769), exif.get_ifd(0x8825)
        utc = dt.datetime.fromisoformat(camera["utc"])
        assert detail[36867] == f"{utc - dt.timedelta(hours=5):%Y:%m:%d %H:%M:%S}" and detail[36881] == "-05:00"
        focal_px = detail[41989] / 43.2666 * np.hypot(*image.size)
        assert focal_px == pytest.approx(float(camera["fx"]), rel=0.01)
        lat, lon = (float(np.dot(gps[key], [1, 1 / 60, 1 / 3600])) for key in (2, 4))
        assert gps[1] == "N" and gps[3] == "W"
        east, north = pyproj.Transformer.from_crs(6318, 6344, always_xy=True).transform(-lon, lat)
        assert np.hypot(east - float(camera["E"]), north - float(camera["N"])) < 12
        data = path.read_bytes()
        xmp = data[data.index(b"<x:xmpmeta") : data.index(b"</x:xmpmeta>")].decode()
        value = {key: float(text) for key, text in re.findall(r'drone-dji:(\w+)="([+-]?[\d.]+)"', xmp)}
        convergence = json.loads((leafy / "truth" / "config.json").read_text())["meridian_convergence_deg"]
        off = (value["GimbalYawDegree"] - float(camera["yaw_grid_deg"]) - convergence + 180) % 360 - 180
        assert abs(off) < 2.5
        assert value["GimbalPitchDegree"] == pytest.approx(float(camera["pitch_deg"]), abs=0.6)
        assert value["RelativeAltitude"] == pytest.approx(float(camera["h"]) - origin(leafy)[2], abs=0.01)


def test_angles_make_the_rotation(leafy):
    for row in table(leafy / "truth" / "cameras.csv"):
        angles = [float(row[key]) for key in ("yaw_grid_deg", "pitch_deg", "roll_deg")]
        stated = np.array([[float(row[f"r{i}{j}"]) for j in range(3)] for i in range(3)])
        np.testing.assert_allclose(flight.rotation_from_angles(*angles), stated, atol=2e-5)
        assert np.linalg.det(stated) == pytest.approx(1, abs=1e-6)


def test_stem_edges_lie_where_the_truth_projects(bare):
    """Brightness across the breast-height band of big bare stems: the steepest steps are at the true outline."""
    views, shift = views_of(bare), origin(bare)
    stems = json.loads((bare / "truth" / "stems.json").read_text())["stems"]
    trees = {row["tree_id"]: row for row in table(bare / "truth" / "trees.csv")}
    misses = []
    for record in table(bare / "truth" / "visibility.csv"):
        tree = trees[record["tree_id"]]
        if (
            float(record["visible_fraction"]) < 0.95
            or record["in_frame"] == "0"
            or float(tree["dbh_cm"]) < 22
            or float(record["foreshortening"]) < 0.4
        ):
            continue
        view = views[record["image"]]
        profile = np.array(stems[record["tree_id"]])
        s = np.linspace(1.0, 1.8, 41)
        axis = np.column_stack([np.interp(s, profile[:, 0], profile[:, k]) for k in (2, 3, 4)])
        pixel, depth = view.project(axis)
        along = (pixel[-1] - pixel[0]) / np.linalg.norm(pixel[-1] - pixel[0])
        across = np.array([-along[1], along[0]])
        offset = np.arange(-18, 18.01, 0.25)
        where = (pixel[:, None] + offset[None, :, None] * across - 0.5).astype(np.float32)
        grey = cv2.GaussianBlur(cv2.imread(str(view.path), cv2.IMREAD_GRAYSCALE).astype(np.float32), (0, 0), 0.6)
        mean = cv2.remap(grey, where[..., 0], where[..., 1], cv2.INTER_LINEAR).mean(axis=0)
        slope = np.abs(np.gradient(mean))
        half = 0.5 * view.camera.fx * float(tree["dbh_cm"]) / 100 / depth.mean()
        for side in (-1, 1):
            near = np.abs(offset - side * half) < 2.5
            if slope[near].max() > 3 * np.median(slope):
                misses.append(side * (offset[near][slope[near].argmax()] - side * half))
    misses = np.array(misses)
    assert len(misses) >= 8
    assert abs(np.median(misses)) < 0.4 and np.median(np.abs(misses)) < 0.8
    assert origin(bare).shape == shift.shape


def test_lidar_lies_on_ground_and_stems(bare):
    cloud = laspy.read(bare / "lidar" / "bare_uls.laz")
    assert cloud.header.point_format.id == 6 and cloud.header.parse_crs().to_epsg() == 6344
    xyz = np.column_stack([cloud.x, cloud.y, cloud.z])
    with rasterio.open(bare / "dtm.tif") as dtm:
        assert dtm.crs.to_epsg() == 6344
        ground = np.array([value[0] for value in dtm.sample(xyz[:, :2])])
    height = xyz[:, 2] - ground
    assert (np.abs(height) < 0.08).mean() > 0.4 and height.min() > -0.15
    stems = json.loads((bare / "truth" / "stems.json").read_text())
    local = xyz - np.array(stems["origin"])
    band = (height > 1.0) & (height < 1.8) & (np.hypot(local[:, 0], local[:, 1]) < 6)
    # Distance to the nearest stem surface, from the axis at the point's own height.
    gaps = []
    for point in local[band]:
        best = np.inf
        for profile in stems["stems"].values():
            profile = np.array(profile)
            axis = [np.interp(point[2], profile[:, 4], profile[:, k]) for k in (2, 3, 1)]
            best = min(best, abs(np.hypot(point[0] - axis[0], point[1] - axis[1]) - axis[2] / 200))
        gaps.append(best)
    # The rest are dead branches.
    assert len(gaps) > 50 and np.mean(np.array(gaps) < 0.06) > 0.75 and np.median(gaps) < 0.015
    number, count = np.asarray(cloud.return_number), np.asarray(cloud.number_of_returns)
    assert set(np.unique(number)) <= {1, 2} and (number <= count).all()


def test_visibility_is_sane(leafy, bare):
    for folder in (leafy, bare):
        for row in table(folder / "truth" / "visibility.csv"):
            assert 0 <= float(row["visible_fraction"]) <= 1 and 0 <= float(row["foreshortening"]) <= 1
        nadir = {row["image"] for row in table(folder / "truth" / "cameras.csv") if row["kind"] == "nadir"}
        inside = {row["tree_id"] for row in table(folder / "truth" / "trees.csv") if row["in_plot"] == "True"}
        assert inside
        for row in table(folder / "truth" / "visibility.csv"):
            if row["image"] in nadir and row["tree_id"] in inside:
                assert float(row["foreshortening"]) < 0.35
    mean = {
        folder.name: np.mean(
            [
                float(row["visible_fraction"])
                for row in table(folder / "truth" / "visibility.csv")
                if float(row["foreshortening"]) > 0.35
            ]
        )
        for folder in (leafy, bare)
    }
    assert mean["leafy"] < 0.6 * mean["bare"] and mean["bare"] > 0.7


def test_visibility_agrees_with_the_photo(bare):
    """Free stems are darker at breast height than the ground beside them."""
    views = views_of(bare)
    trees = {row["tree_id"]: row for row in table(bare / "truth" / "trees.csv")}
    shift = origin(bare)
    tones = {True: [], False: []}
    for record in table(bare / "truth" / "visibility.csv"):
        if record["in_frame"] == "0" or float(record["visible_fraction"]) < 0.95 or float(record["width_px"]) < 8:
            continue
        view, tree = views[record["image"]], trees[record["tree_id"]]
        point = np.array([[float(tree[key]) for key in ("E_bh", "N_bh", "h_bh")]]) - shift
        pixel, _ = view.project(point)
        image = cv2.imread(str(view.path), cv2.IMREAD_GRAYSCALE)
        for on, du in ((True, 0.0), (False, 1.2 * float(record["width_px"]))):
            u, v = int(pixel[0, 0] + du), int(pixel[0, 1])
            if 4 <= u < 476 and 4 <= v < 356:
                tones[on].append(image[v - 3 : v + 4, u - 1 : u + 2].mean())
    assert np.mean(tones[True]) < np.mean(tones[False]) - 5


def test_truth_table_and_field_table(leafy):
    trees = {row["tree_id"]: row for row in table(leafy / "truth" / "trees.csv")}
    for row in trees.values():
        assert float(row["w_min_cm"]) <= float(row["dbh_cm"]) <= float(row["w_max_cm"])
        assert float(row["h_bh"]) - float(row["h_base"]) == pytest.approx(1.37, abs=0.05)
        assert int(row["n_unoccluded_bh_views"]) <= int(row["n_half_visible_bh_views"]) <= 14
    inside = {tree for tree, row in trees.items() if row["in_plot"] == "True"}
    forks = sorted(tree for tree, row in trees.items() if row["kind"] == "fork_below")
    assert len(forks) == 2 and forks[0][-1] == "a" and forks[1][-1] == "b" and forks[0][:-1] == forks[1][:-1]
    assert any(row["kind"] == "touch" for row in trees.values())
    key = json.loads((leafy / "truth" / "field_key.json").read_text())["field_tree_id_to_truth"]
    tally = {row["tree_id"]: row for row in table(leafy / "field_trees.csv")}
    assert set(key) == set(tally) and set(key.values()) == inside
    convergence = json.loads((leafy / "truth" / "config.json").read_text())["meridian_convergence_deg"]
    for field_id, tree in key.items():
        row, found = trees[tree], tally[field_id]
        assert float(found["dbh_cm"]) == pytest.approx(float(row["dbh_cm"]), abs=1.6)
        grid = np.radians(float(found["azimuth_deg"]) - convergence)
        at = float(found["distance_m"]) * np.array([np.sin(grid), np.cos(grid)])
        assert np.hypot(at[0] - float(row["x_bh"]), at[1] - float(row["y_bh"])) < 0.45
    plot = table(leafy / "plots.csv")[0]
    assert np.hypot(float(plot["easting"]) - origin(leafy)[0], float(plot["northing"]) - origin(leafy)[1]) < 1.2


def test_dtm_is_the_stems_ground(leafy):
    with rasterio.open(leafy / "dtm.tif") as dtm:
        for row in table(leafy / "truth" / "trees.csv"):
            height = next(dtm.sample([(float(row["E_base"]), float(row["N_base"]))]))[0]
            assert height == pytest.approx(float(row["h_base"]), abs=0.05)


def test_section_of_a_tilted_cone_is_its_diameter():
    """No relief: an octagon-like tube of many sides; hull perimeter / pi against the taper curve."""
    rng = np.random.default_rng(0)
    ground = terrain.make_ground(rng, 10, 0.0, 0.0)
    stem = scene.grow_stem(
        rng,
        ground,
        np.zeros(2),
        0.30,
        20.0,
        np.radians(8),
        1.0,
        tree_id="T1",
        kind="normal",
        status="live",
        in_plot=True,
        detail=2,
        crown_base_m=10.0,
    )
    mesh = stem_mesh.mesh_stems(np.random.default_rng(1), [stem])
    cut = truth.section(mesh, 0, stem, 1.37)
    nominal = 2 * scene.axis_at(stem, np.array([1.37]))[2][0]
    assert cut.diameter == pytest.approx(nominal, rel=0.03)
    assert cut.narrow <= cut.diameter <= cut.wide
    assert cut.centre[2] == pytest.approx(1.37, abs=0.05)
    # The mean calliper width of a hull is its perimeter over pi (Cauchy): checked on the same mesh from the other side.
    point, tangent, _ = (part[0] for part in scene.axis_at(stem, np.array([1.37])))
    rows = mesh.vertices[np.abs((mesh.vertices - point) @ tangent) < 0.06]
    reach = np.linalg.norm(rows - point - ((rows - point) @ tangent)[:, None] * tangent, axis=1)
    assert 2 * reach.mean() == pytest.approx(cut.diameter, rel=0.03)


def test_ground_height_is_the_meshs():
    ground = terrain.make_ground(np.random.default_rng(3), 6, 20.0, 0.2)
    vertices, triangles = ground.mesh()
    weights = np.random.default_rng(4).dirichlet(np.ones(3), len(triangles))
    points = np.einsum("fk,fkc->fc", weights, vertices[triangles])
    np.testing.assert_allclose(ground.height(points[:, :2]), points[:, 2], atol=1e-9)


def test_sun_stands_where_the_almanac_says():
    """Noon altitude = 90 - latitude + declination; -3.4 degrees on 12 March; low in the east in the morning."""
    noon = dt.datetime(2026, 3, 12, 18, 17)
    vector = sun_direction(noon, -91.8, 33.6, 0.0)
    assert np.degrees(np.arcsin(vector[2])) == pytest.approx(53.0, abs=0.4)
    assert abs(np.degrees(np.arctan2(vector[0], vector[1]))) == pytest.approx(180, abs=1.5)
    morning = sun_direction(dt.datetime(2026, 3, 12, 14, 30), -91.8, 33.6, 0.0)
    assert morning[0] > 0.6 and 0.3 < morning[2] < 0.6
    assert np.linalg.norm(morning) == pytest.approx(1)


def test_every_setting_has_its_place_on_the_command_line():
    """A key of one option, or an option, and no name twice; texts and Python's values give the same plot."""
    keys = [key for _, spec, _ in params_of(SimulateOptions) if spec.record for key, _, _ in params_of(spec.record)]
    own = [name for name, spec, _ in params_of(SimulateOptions) if not spec.record]
    assert sorted(keys + own) == sorted(name for name, _, _ in params_of(SimulateSettings))
    said = build(SimulateOptions, {"output": "x", "stand": "moss_pct=12, leaf_off", "camera": "image_width=640"})
    meant = build(SimulateOptions, {"output": "x", "stand": {"moss_pct": 12, "leaf_off": True}})
    assert said.whole() == SimulateSettings(output=Path("x"), moss_pct=12.0, leaf_off=True, image_width=640)
    assert meant.stand == said.stand and meant.whole().image_width is None


def test_refusals(tmp_path):
    with pytest.raises(InputError, match="--camera image_height"):
        resolve(SimulateSettings(output=tmp_path / "x", preset="test", image_height=240))
    with pytest.raises(InputError, match="--photos"):
        resolve(SimulateSettings(output=tmp_path / "x", preset="plot", photos=10))
    for given, (value, said) in {
        "preset": ("huge", "--preset"),
        "stand": ("mos_pct=3", r"--stand: found 'mos_pct', expected one of .*moss_pct.*slope_pct"),
        "camera": ("k1=-0.1,k1=0.1", "--camera: found k1 twice"),
        "weather": ({"sky": "grey"}, "--weather: sky: found 'grey', expected one of clear, overcast"),
        "faults": ("shake_px", "--faults: shake_px: found 'true', expected a number in px"),
    }.items():
        with pytest.raises(InputError, match=said):
            build(SimulateOptions, {"output": str(tmp_path), given: value})
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("keep")
    with pytest.raises(OutputError, match="not empty"):
        simulate_plot(SimulateSettings(output=tmp_path / "mine", preset="test"))
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "keep"
    with pytest.raises(OutputError, match="is a file"):
        simulate_plot(SimulateSettings(output=tmp_path / "mine" / "thesis.txt", preset="test"))
