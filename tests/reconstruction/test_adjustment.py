"""The bundle adjustment on small exact blocks: lens, rolling shutter, control points, and what it claims to know."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_block import CAMERA, LENS, block_of, known_of, ring, still_sensor

from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags.control import ControlPoints
from treedgs_geo.reconstruction import bundle_kernels as kernels
from treedgs_geo.reconstruction.adjustment import PHOTO_PARTS, TRACKS_A_PART, adjust, adjust_roughly
from treedgs_geo.reconstruction.bundle import (
    LAST,
    MIN_OBSERVATIONS,
    PHOTO_GAP_S,
    State,
    _cauchy,
    _soft_l1,
    camera_of,
    shared_of,
)
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.control import align_to_control, control_residuals, rms_of
from treedgs_geo.reconstruction.covariance import GEOTAG_DRIFT_S, posterior_of
from treedgs_geo.reconstruction.georeference import _turned_to_gimbals, as_stored
from treedgs_geo.reconstruction.incremental_block import leave_out, strays
from treedgs_geo.reconstruction.poses import rotation_angle_deg, rotation_from_gimbal
from treedgs_geo.reconstruction.rolling_shutter import settle_lens, settle_shutter
from treedgs_geo.reconstruction.tracks import Block

SHUTTER = frozenset({"readout"})


def _flight() -> list[View]:
    return ring(12) + ring(9, 80.0, -75.0)


def _scene(
    seed: int, noise_px: float = 0.2, views: list[View] | None = None, points: int = 400
) -> tuple[Block, np.ndarray]:
    rng = np.random.default_rng(seed)
    block = block_of(views or _flight(), rng.uniform([-15, -15, 0], [15, 15, 6], (points, 3)), noise_px, rng)
    return block, block.centres.copy()


def _rolling(speed_m_s: float, readout_s: float, seed: int = 0) -> tuple[list[View], np.ndarray]:
    """Views of a camera that flies while it reads, and their velocities."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(21, 3)) * [1, 1, 0.1]
    velocity = speed_m_s * way / np.linalg.norm(way, axis=1, keepdims=True)
    views = [replace(view, readout_travel_m=readout_s * v) for view, v in zip(_flight(), velocity, strict=True)]
    return views, velocity


def test_derivatives_are_those_of_the_residuals() -> None:
    rng = np.random.default_rng(7)
    camera = Camera(1280, 960, 1900.0, 1905.0, 645.0, 476.0, -0.1, 0.05, 0.001, -0.0007, -0.02)
    views, velocity = _rolling(4.0, 0.02)
    views = [replace(view, camera=camera) for view in views]
    block = block_of(views, rng.uniform([-15, -15, 0], [15, 15, 6], (30, 3)), 0.0, rng)
    flight = np.arange(len(views)) % 2
    image, point, pixels = block.image, block.point, block.observed()
    seen = kernels.Seen(image, point, pixels, pixels[:, 1] / 960 - 0.5, flight)
    # Off the solution, so that nothing cancels.
    state = State(
        shared_of(camera, 0.015),
        np.array([0.0, 3e-3]),
        block.rotations,
        block.centres + rng.normal(0, 0.1, (len(views), 3)),
        rng.normal(0, 0.02, (len(views), 3)),
        block.points + rng.normal(0, 0.1, block.points.shape),
    )

    def linear(x: State) -> list[np.ndarray]:
        out = [np.zeros((len(image), 2, *size)) for size in ((), (9,), (11,), (3,))]
        kernels.linearise(
            kernels.Model(x.shared, x.drift, x.rotations, x.centres, x.travel, x.points, velocity), seen, *out
        )
        return out

    residual, by_pose, by_shared, by_point = linear(state)
    step = 1e-6
    for k in range(10):
        moved = replace(state, shared=state.shared + step * (np.arange(10) == k))
        np.testing.assert_allclose((linear(moved)[0] - residual) / step, by_shared[:, :, k], rtol=1e-4, atol=2e-2)
    np.testing.assert_allclose(
        (linear(replace(state, drift=state.drift + [0, step]))[0] - residual) / step, by_shared[:, :, 10], rtol=1e-4
    )
    for axis in range(3):
        unit = step * (np.arange(3) == axis)
        for name, place in (("centres", 3), ("travel", 6)):
            moved = replace(state, **{name: getattr(state, name) + unit})
            np.testing.assert_allclose(
                (linear(moved)[0] - residual) / step, by_pose[:, :, place + axis], rtol=1e-4, atol=1e-3
            )
        turn = Rotation.from_rotvec(unit).as_matrix()
        found = (linear(replace(state, rotations=turn @ state.rotations))[0] - residual) / step
        np.testing.assert_allclose(found, by_pose[:, :, axis], rtol=1e-3, atol=0.5)
        found = (linear(replace(state, points=state.points + unit))[0] - residual) / step
        np.testing.assert_allclose(found, by_point[:, :, axis], rtol=1e-4, atol=1e-3)


def test_shared_parameters_and_cameras_are_the_same() -> None:
    camera = Camera(1280, 960, 1900.0, 1905.0, 645.0, 476.0, -0.1, 0.05, 0.001, -0.0007, -0.02)
    again = camera_of(shared_of(camera, 0.01), camera)
    np.testing.assert_allclose([again.fx, again.fy, *again.distortion], [1900, 1905, *camera.distortion], rtol=1e-12)


def test_adjustment_frees_focal_and_principal_point() -> None:
    rng = np.random.default_rng(1)
    block, truth = _scene(1)
    tags = truth + rng.normal(0, 0.02, truth.shape)
    tags[3] += [1.5, 0, 0]
    for i in range(len(truth)):
        wobble = rotation_from_gimbal(*rng.normal(0, 0.2, 3)) @ rotation_from_gimbal(0, 0, 0).T
        block.rotations[i] = wobble @ block.rotations[i]
        block.translations[i] = -block.rotations[i] @ tags[i]
    start = Camera(1280, 960, 1880.0, 1880.0, 640.0, 480.0)
    block.sensor = replace(block.sensor, camera=start)
    known = known_of(tags, 0.02, start)
    for _ in range(2):
        adjusted = adjust(block, known, LENS)
    assert adjusted.sigma_px == pytest.approx(0.2, rel=0.1)
    assert block.camera.fx == pytest.approx(1900, abs=1.5) and block.camera.cx == pytest.approx(645, abs=1.5)
    error = np.linalg.norm(block.centres - truth, axis=1)
    assert error[3] < 0.1 and np.sqrt(np.mean(error**2)) < 0.05
    assert np.flatnonzero(strays(block, known)).tolist() == [3], "the wrong geotag is found, and only that"


def test_adjustments_repeat_to_the_bit() -> None:
    poses = []
    for _ in range(2):
        block, truth = _scene(1, 0.3, ring(30), 1500)
        tags = truth + np.random.default_rng(2).normal(0, 0.05, truth.shape)
        adjust(block, known_of(tags, 0.05), LENS, iterations=6)
        assert len(block.image) > 25_000
        poses.append(np.concatenate([block.translations.ravel(), block.rotations.ravel(), block.points.ravel()]))
    np.testing.assert_array_equal(poses[0], poses[1])


def test_an_adjustment_on_the_way_takes_the_longest_tracks_and_the_other_points_follow() -> None:
    rng = np.random.default_rng(4)
    block, truth = _scene(4, 0.2, ring(30), 2500)
    # Half of the points are seen by three photos only: those are left out, but for the last ones of a part.
    few = np.arange(len(block.points)) % 2 == 0
    block.keep(~few[block.point] | ((block.image + block.point // 2) % 10 == 0))
    chosen = block.long_tracks(*PHOTO_PARTS, TRACKS_A_PART)
    views = np.bincount(block.point, minlength=len(block.points))
    assert chosen.mean() < 0.5 and views[chosen].mean() > 2 * views[~chosen].mean()
    assert (np.bincount(block.image[chosen[block.point]], minlength=30) > 100).all()

    places = block.points.copy()
    wrong = np.flatnonzero(~chosen & (views > 12))[:20]
    rows = [int(np.flatnonzero(block.point == p)[0]) for p in wrong]
    for row in rows:
        block.keypoints[block.image[row]][block.key[row]] += [9.0, -7.0]
    for i in range(30):
        wobble = rotation_from_gimbal(*rng.normal(0, 0.1, 3)) @ rotation_from_gimbal(0, 0, 0).T
        block.rotations[i] = wobble @ block.rotations[i]
        block.translations[i] = -block.rotations[i] @ (truth[i] + rng.normal(0, 0.02, 3))
    known = known_of(truth, 0.02)
    adjust_roughly(block, known, LENS)
    adjust_roughly(block, known, LENS)
    assert np.sqrt(np.mean((block.centres - truth) ** 2)) < 0.02
    error = np.linalg.norm(block.residuals(), axis=1)
    assert np.median(error) < 0.3 and (error[rows] > 8).all(), "a wrong observation does not move its point"
    away = np.linalg.norm(block.points - places, axis=1)
    assert np.median(away[~chosen]) < 0.05 and away[wrong].max() < 0.1


def test_a_photo_whose_few_points_lie_close_together_is_held_by_all_of_them() -> None:
    block, truth = _scene(4, 0.2, ring(30), 4000)
    pixels = block.observed()
    # Within one part of the photo, and seen by two others, which have longer tracks to choose from.
    own_points = block.point[(block.image == 3) & (np.abs(pixels - [720, 400]) < 40).all(axis=1)]
    among = np.isin(block.point, own_points)
    block.keep(np.where(block.image == 3, among, ~among | np.isin(block.image, [11, 19])))
    own = int((block.image == 3).sum())
    assert 6 < own < 60
    chosen = block.long_tracks(*PHOTO_PARTS, TRACKS_A_PART)
    assert chosen[block.point[block.image == 3]].sum() < MIN_OBSERVATIONS, "too few to move the photo by"
    turn = rotation_from_gimbal(0.3, 0.2, 0.0) @ rotation_from_gimbal(0, 0, 0).T
    right = block.rotations[3].copy()
    block.rotations[3] = turn @ right
    block.translations[3] = -block.rotations[3] @ truth[3]
    for _ in range(2):
        adjust_roughly(block, known_of(truth, 0.02), LENS)
    assert rotation_angle_deg(block.rotations[3] @ right.T) < 0.1 < rotation_angle_deg(turn)


def test_an_adjustment_on_the_way_takes_all_points_where_there_are_few() -> None:
    poses = []
    for how in (adjust, adjust_roughly):
        block, truth = _scene(1)
        how(block, known_of(truth + 0.01, 0.02), LENS)
        poses.append(np.concatenate([block.translations.ravel(), block.points.ravel()]))
    np.testing.assert_array_equal(poses[0], poses[1])


def test_a_block_without_points_is_refused_in_a_sentence() -> None:
    block, truth = _scene(2, views=ring(6), points=40)
    block.points, block.image, block.key, block.point = block.points[:0], *[np.zeros(0, int)] * 3
    with pytest.raises(ReconstructionError, match="fly with 80 % overlap"):
        adjust(block, known_of(truth, 0.02), frozenset())


@pytest.mark.parametrize("readout_s", [0.0, 0.01, 0.03])
def test_the_readout_time_is_found_and_without_it_the_block_is_wrong(readout_s: float) -> None:
    views, velocity = _rolling(4.0, readout_s)
    errors = {}
    for name, free in (("found", LENS | SHUTTER), ("ignored", LENS)):
        block, truth = _scene(3, 0.2, views)
        tags = truth + np.random.default_rng(4).normal(0, 0.02, truth.shape)
        count = len(views)
        block.sensor = replace(still_sensor(CAMERA, count), velocity_m_s=velocity)
        known = known_of(tags, 0.02, readout_sd_s=0.02)
        for _ in range(2):
            adjusted = adjust(block, known, free, final=True)
        errors[name] = float(np.sqrt(np.mean((block.centres - truth) ** 2)))
        if name == "found":
            posterior = posterior_of(adjusted)
            off = block.sensor.readout_s - readout_s
            assert abs(off) < max(2 * posterior.shared_sd[kernels.READOUT], 2e-4)
            assert adjusted.sigma_px == pytest.approx(0.2, rel=0.1)
    assert errors["found"] < 0.02
    if readout_s >= 0.03:
        assert errors["ignored"] > 1.5 * errors["found"]


def test_movements_without_known_speeds_are_found_photo_by_photo() -> None:
    views, _ = _rolling(4.0, 0.03)
    block, truth = _scene(5, 0.2, views)
    travel = block.sensor.travel_m.copy()
    block.sensor = still_sensor(CAMERA, len(views))
    tags = truth + np.random.default_rng(6).normal(0, 0.02, truth.shape)
    for _ in range(2):
        adjust(block, known_of(tags, 0.02, travel_sd_m=0.1), LENS | {"travel"}, final=True)
    assert np.sqrt(np.mean((block.sensor.travel_m - travel)[:, :2] ** 2)) < 0.25 * np.sqrt(np.mean(travel[:, :2] ** 2))
    assert np.sqrt(np.mean((block.centres - truth) ** 2)) < 0.03


def test_a_flight_may_have_a_focal_length_of_its_own() -> None:
    views = [replace(view, camera=replace(CAMERA, fx=1902.0, fy=1902.0)) for view in ring(12, 90.0, -50.0)]
    rng = np.random.default_rng(8)
    block = block_of(ring(12) + views, rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3)), 0.1, rng)
    truth = block.centres.copy()
    flight = np.repeat([0, 1], 12)
    block.sensor = replace(still_sensor(CAMERA, 24), flight=flight, drift=np.zeros(2))
    tags = truth + rng.normal(0, 0.01, truth.shape)
    adjust(block, known_of(tags, 0.01, drift_sd=2e-3), LENS | {"drift"}, final=True, iterations=30)
    assert np.expm1(block.sensor.drift[1]) == pytest.approx(2 / 1900, abs=2.5e-4)
    assert block.sensor.camera_of(20).fx == pytest.approx(block.camera.fx * np.exp(block.sensor.drift[1]))


@pytest.mark.parametrize("drifting", [False, True])
def test_the_posterior_is_as_wide_as_the_errors(drifting: bool) -> None:
    """Errors of the geotags that are independent, and errors that change in minutes only, as a receiver's do."""
    sd_m = 0.3 if drifting else 0.03
    taken_s = PHOTO_GAP_S * np.arange(21)
    alike = np.exp(-np.abs(np.subtract.outer(taken_s, taken_s)) / GEOTAG_DRIFT_S) if drifting else np.eye(21)
    draw = sd_m * np.linalg.cholesky(alike)
    focal, claimed, scales, scale_claimed = [], [], [], []
    for seed in range(16):
        rng = np.random.default_rng(100 + seed)
        block, truth = _scene(seed, 0.3, points=150)
        points = block.points.copy()
        tags = truth + draw @ rng.normal(size=truth.shape)
        adjusted = adjust(block, known_of(tags, sd_m), LENS, iterations=30, final=True)
        posterior = posterior_of(adjusted)
        focal.append(np.log(block.camera.fx / CAMERA.fx))
        claimed.append(posterior.focal)
        # The size of what stands there: the points' spread across the line of sight.
        a, b = (p - p.mean(axis=0) for p in (points, block.points))
        scales.append(np.sum(a * b) / np.sum(a * a) - 1)
        scale_claimed.append(posterior.scale)
    for real, stated in ((focal, claimed), (scales, scale_claimed)):
        assert 0.3 < np.std(real) / np.mean(stated) < 0.8, f"{np.std(real):.5f}, stated {np.mean(stated):.5f}"


def test_a_photo_that_nothing_holds_does_not_end_the_adjustment() -> None:
    block, truth = _scene(19)
    tags = truth + np.random.default_rng(20).normal(0, 0.02, truth.shape)
    # All that photo 5 sees is one place: it may turn about it as it likes, and no geotag says where it stands.
    tags[5] = np.nan
    seen = np.flatnonzero(block.image == 5)
    block.keypoints[5][block.key[seen]] = block.keypoints[5][block.key[seen[0]]]
    block.point[seen] = block.point[seen[0]]
    adjusted = adjust(block, known_of(tags, 0.02), LENS, final=True)
    assert np.isfinite(posterior_of(adjusted).scale)
    others = np.delete(block.centres - truth, 5, axis=0)
    assert np.sqrt(np.mean(others**2)) < 0.05


def _control(block: Block, truth: np.ndarray, places: np.ndarray, rng: np.random.Generator) -> ControlPoints:
    marks = []
    for k, place in enumerate(places):
        for i in range(len(truth)):
            pixels, _ = block.view(i).project(place[None])
            if block.view(i).contains(pixels)[0]:
                marks.append((k, i, *(pixels[0] + rng.normal(0, 0.4, 2))))
    point, photo = np.array([mark[:2] for mark in marks], int).T
    surveyed = places + rng.normal(0, 0.01, places.shape)
    check = np.arange(len(places)) == len(places) - 1
    labels = [f"P{k}" for k in range(len(places))]
    return ControlPoints(
        labels, surveyed, np.full(places.shape, 0.02), check, point, photo, np.array([mark[2:] for mark in marks])
    )


def _navigation_grade(block: Block, truth: np.ndarray) -> np.ndarray:
    """Move the block to geotags that are metres off together and a metre each; the geotags."""
    rng = np.random.default_rng(9)
    tags = truth + [2.0, -1.5, 4.0] + rng.normal(0, 0.8, truth.shape)
    block.translations -= np.einsum("nij,j->ni", block.rotations, np.array([2.0, -1.5, 4.0]))
    block.points += [2.0, -1.5, 4.0]
    return tags


def test_control_points_hold_a_block_whose_geotags_are_metres_off() -> None:
    places = np.array([[-12.0, -10, 0], [12, -9, 1], [10, 12, 0], [-11, 11, 2], [1, 2, 1.0]])
    block, truth = _scene(10)
    control = _control(block, truth, places, np.random.default_rng(11))
    tags = _navigation_grade(block, truth)
    assert align_to_control(block, control) is not None
    known = known_of(tags, 2.0, control=control)
    for _ in range(2):
        adjusted = adjust(block, known, LENS, final=True)
    assert np.sqrt(np.mean((block.centres - truth) ** 2)) < 0.06
    rows = control_residuals(block, control)
    assert [row["is_check"] for row in rows] == [False] * 4 + [True]
    check = rms_of(rows, True)
    assert check is not None and max(check) < 0.05 and rms_of(rows, False) is not None
    with_control = posterior_of(adjusted).scale
    alone, _ = _scene(10)
    loose = adjust(alone, known_of(_navigation_grade(alone, truth), 2.0), LENS, final=True)
    assert with_control < 0.003 < 0.01 < posterior_of(loose).scale, "geotags of 2 m do not fix a scale; control does"


def test_a_wrong_control_point_stands_out() -> None:
    places = np.array([[-12.0, -10, 0], [12, -9, 1], [10, 12, 0], [-11, 11, 2], [1, 2, 1.0]])
    block, truth = _scene(12)
    control = _control(block, truth, places, np.random.default_rng(13))
    control.xyz[1] += [0.5, 0.0, 0.0]
    known = known_of(truth + np.random.default_rng(1).normal(0, 0.02, truth.shape), 0.02, control=control)
    for _ in range(2):
        adjust(block, known, LENS, final=True)
    rows = control_residuals(block, control)
    off = [np.linalg.norm([row["e_m"], row["n_m"], row["u_m"]]) for row in rows]
    assert np.argmax(off) == 1 and off[1] > 0.3 and max(np.delete(off, 1)) < 0.12


def test_fewer_than_three_control_points_do_not_turn_the_block() -> None:
    places = np.array([[-12.0, -10, 0], [12, -9, 1]])
    block, truth = _scene(14)
    control = _control(block, truth, places, np.random.default_rng(15))
    _navigation_grade(block, truth)
    assert align_to_control(block, control) is None


def test_files_of_a_rolling_block_come_back(tmp_path: Path) -> None:
    import cv2
    import pycolmap
    import pyproj

    from treedgs_geo.core.crs import LocalFrame
    from treedgs_geo.reconstruction.model import load_views, save_model

    views, velocity = _rolling(4.0, 0.02)
    views = [replace(view, camera=replace(CAMERA, k3=-0.2)) for view in views[:6]]
    block, _ = _scene(16, 0.0, views, 60)
    names = [view.name for view in views]
    for name in names:
        cv2.imwrite(str(tmp_path / name), np.zeros((960, 1280, 3), np.uint8))
    frame = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))
    paths = [tmp_path / name for name in names]
    save_model(tmp_path / "sfm", block, names, paths, np.zeros(6, int), frame, {}, {"model": "X"})
    _, loaded = load_views(tmp_path / "sfm", tmp_path)
    assert loaded[2].camera.k3 == -0.2
    np.testing.assert_allclose(loaded[3].readout_travel_m, 0.02 * velocity[3], atol=1e-5)
    probe = block.points[:20]
    np.testing.assert_allclose(loaded[3].project(probe)[0], views[3].project(probe)[0], atol=1e-3)
    points = pycolmap.Reconstruction(tmp_path / "sfm").points3D.values()
    assert max(point.error for point in points) < 1e-4, "COLMAP's own residuals are those of a still camera"


def test_a_photo_that_looks_elsewhere_than_its_gimbal_is_a_stray() -> None:
    # Blocks had held photos that stood on their geotag, turned by 48 to 96 degrees, on a few dozen wrong matches.
    block, truth = _scene(17)
    rng = np.random.default_rng(18)
    mounting = rotation_from_gimbal(0, 1.2, 0.5) @ rotation_from_gimbal(0, 0, 0).T
    gimbal = np.array(
        [
            mounting @ rotation_from_gimbal(*rng.normal(0, 0.4, 3)) @ rotation_from_gimbal(0, 0, 0).T @ r
            for r in block.rotations
        ]
    )
    gimbal[7] = np.nan
    known = known_of(truth, 0.02, gimbal=gimbal)
    assert not strays(block, known).any(), "a common mounting error and half a degree of noise turn nobody out"
    # On the way back a real drone's compass was 5 degrees off.
    east = np.arange(21) % 2 == 0
    known.gimbal[east] = known.gimbal[east] @ Rotation.from_euler("z", 8, degrees=True).as_matrix()
    assert not strays(block, known).any(), "a compass that errs by the heading turns nobody out"
    for photo, axis, angle in ((2, "z", 60.0), (11, "x", 12.0)):
        turn = Rotation.from_euler(axis, angle, degrees=True).as_matrix()
        block.rotations[photo] = turn @ block.rotations[photo]
        block.translations[photo] = -block.rotations[photo] @ truth[photo]
    assert np.flatnonzero(strays(block, known)).tolist() == [2, 11]


class _Heard(Reporter):
    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        self.warnings.append(text)


def test_photos_that_contradict_their_geotags_are_left_out_and_named_once() -> None:
    block, truth = _scene(21)
    tags = truth + np.random.default_rng(22).normal(0, 0.02, truth.shape)
    tags[[3, 8]] += [0.0, 0.6, 0.0]
    block.keep((block.image != 5) | (np.arange(len(block.image)) % 60 == 0))
    heard, names = _Heard(), [f"{k:02d}.jpg" for k in range(21)]
    assert leave_out(block, known_of(tags, 0.02), names, heard)
    assert np.flatnonzero(~block.is_posed).tolist() == [3, 5, 8]
    assert [text.partition(":")[2] for text in heard.warnings] == [" 03.jpg, 08.jpg.", " 05.jpg."]
    assert not leave_out(block, known_of(tags, 0.02), names, heard), "nothing is left to take out"


def test_a_block_most_of_whose_photos_contradict_good_geotags_is_refused() -> None:
    block, truth = _scene(23)
    tags = truth + np.random.default_rng(24).normal(0, 0.02, truth.shape)
    tags[:8] += [0.3, 0.0, 0.0]
    with pytest.raises(ReconstructionError, match="8 of 21 photos stand more than 15 cm .* claim 3 cm"):
        leave_out(block, known_of(tags, 0.02), [f"{k:02d}.jpg" for k in range(21)], Reporter())


def _line_of_photos() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eight nadir photos on one line: rotations, centres, what their gimbals say (half a degree of noise)."""
    rng = np.random.default_rng(25)
    rotations = np.array([rotation_from_gimbal(45, -90, 0)] * 8)
    noise = Rotation.from_rotvec(np.radians(rng.normal(0, 0.3, (8, 3)))).as_matrix()
    along = np.linspace(-35, 35, 8)
    centres = np.column_stack([0.7 * along, 0.7 * along, np.full(8, 60.0)]) + rng.normal(0, 0.2, (8, 3))
    return rotations, centres, noise @ rotations


@pytest.mark.parametrize("on_its_head", [False, True])
def test_a_line_of_photos_is_turned_as_its_gimbals_say(on_its_head: bool) -> None:
    rotations, centres, gimbal = _line_of_photos()
    stored = np.diag([-1.0, -1.0, 1.0]) @ rotations if on_its_head else rotations
    tags = centres + np.random.default_rng(26).normal(0, 1.5, centres.shape)
    # Positions on a line leave the turn about it open: 130 degrees off.
    turn = Rotation.from_rotvec(np.radians(130) * np.array([1, 1, 0]) / np.sqrt(2)).as_matrix()
    middle = centres.mean(axis=0)
    found, moved = _turned_to_gimbals(stored @ turn.T, middle + (centres - middle) @ turn.T, gimbal, tags)
    np.testing.assert_allclose(found, stored, atol=0.02)
    np.testing.assert_allclose(moved, centres, atol=0.6)
    np.testing.assert_allclose(as_stored(found, gimbal), found, atol=0.03)


def test_gimbals_level_a_block_whose_geotags_are_metres_off() -> None:
    tilts = []
    for gimbals in (False, True):
        block, truth = _scene(27, views=ring(4, 40.0, -80.0), points=200)
        true = block.rotations.copy()
        rng = np.random.default_rng(28)
        tags = truth + rng.normal(0, 2.0, truth.shape)
        noise = Rotation.from_rotvec(np.radians(rng.normal(0, 0.5, (4, 3)))).as_matrix()
        turn = Rotation.from_euler("x", 6, degrees=True).as_matrix()
        centres = block.centres @ turn.T
        block.rotations, block.points = block.rotations @ turn.T, block.points @ turn.T
        block.translations = -np.einsum("nij,nj->ni", block.rotations, centres)
        for _ in range(3):
            adjust(block, known_of(tags, 2.0, gimbal=noise @ true if gimbals else None), frozenset(), final=True)
        cosine = np.einsum("nk,nk->n", block.rotations[:, :, 2], true[:, :, 2])
        tilts.append(float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()))
    assert tilts[1] < 1.0 < 3.0 < tilts[0]


@pytest.mark.parametrize("readout_s", [0.0, 0.03])
def test_held_out_points_ask_for_movements_only_where_the_camera_moved(readout_s: float) -> None:
    views, _ = _rolling(4.0, readout_s)
    block, truth = _scene(29, 0.2, views)
    block.sensor = still_sensor(CAMERA, len(views))
    tags = truth + np.random.default_rng(30).normal(0, 0.02, truth.shape)
    known, free = known_of(tags, 0.02, travel_sd_m=0.1), LENS | {"travel"}
    for _ in range(2):
        adjusted = adjust(block, known, free, final=True)
    kept = settle_shutter(block, known, free, posterior_of(adjusted))[1]
    assert ("travel" in kept) == (readout_s > 0)
    assert block.sensor.extra_travel_m.any() == (readout_s > 0)


@pytest.mark.parametrize("change", [0.0, 0.004])
def test_flights_keep_focal_lengths_of_their_own_where_these_clearly_differ(change: float) -> None:
    focal = 1900.0 * (1 + change)
    views = [replace(view, camera=replace(CAMERA, fx=focal, fy=focal)) for view in ring(12, 90.0, -50.0)]
    rng = np.random.default_rng(31)
    block = block_of(ring(12) + views, rng.uniform([-15, -15, 0], [15, 15, 6], (400, 3)), 0.1, rng)
    tags = block.centres + rng.normal(0, 0.01, block.centres.shape)
    block.sensor = replace(still_sensor(CAMERA, 24), flight=np.repeat([0, 1], 12), drift=np.zeros(2))
    known, free = known_of(tags, 0.01, drift_sd=2e-3), LENS | {"drift"}
    adjusted = adjust(block, known, free, final=True, iterations=30)
    assert ("drift" in settle_lens(block, known, free, posterior_of(adjusted))) == (change > 0)
    assert np.expm1(block.sensor.drift[1]) == pytest.approx(change, abs=4e-4)


@pytest.mark.parametrize("final", [False, True])
def test_an_adjustment_ends_where_many_more_steps_would(final: bool) -> None:
    """With one match in ten wrong by up to 8 pixels: cameras within a hundredth of their standard errors."""
    found = []
    for tolerance in (LAST, 0.0):
        rng = np.random.default_rng(41)
        block, truth = _scene(41, 0.3)
        wrong = rng.random(len(block.image)) < 0.1
        for i, key in zip(block.image[wrong], block.key[wrong], strict=True):
            block.keypoints[i][key] += rng.uniform(-8, 8, 2)
        known = known_of(truth + rng.normal(0, 0.02, truth.shape), 0.02)
        adjusted = adjust(block, known, LENS, final=final, iterations=300, tolerance=tolerance)
        found.append((block.centres.copy(), block.camera.fx, posterior_of(adjusted)))
    (centres, focal, posterior), (last, last_focal, _) = found
    assert np.abs(centres - last).max() < 2e-4, "a hundredth of the geotags' error"
    assert abs(np.log(focal / last_focal)) < 0.02 * posterior.shared_sd[kernels.LOG_F]


def test_a_bent_residual_has_the_slope_and_the_curvature_of_its_loss() -> None:
    rng = np.random.default_rng(42)
    residual, by = rng.normal(0, 2, (1, 2)), rng.normal(size=(1, 2, 4))
    square = float((residual**2).sum())
    for loss in (_soft_l1, _cauchy):
        _, weight, share = (each[0] for each in loss(np.array([square]), 3.0))
        assert 0 < share < 1

        def cost(step: np.ndarray, loss=loss) -> float:
            moved = residual[0] + by[0] @ step
            return float(loss(np.array([moved @ moved]), 3.0)[0][0])

        bent, parts = residual.copy(), [by[:, :, :2].copy(), by[:, :, 2:].copy(), by[:, :, :1].copy()]
        kernels.bend(bent, *parts, np.array([share]))
        whole = np.concatenate(parts[:2], axis=2)[0]
        unit = 1e-4 * np.eye(4)
        slope = [(cost(u) - cost(-u)) / 2e-4 for u in unit]
        np.testing.assert_allclose(2 * weight * whole.T @ bent[0], slope, rtol=1e-5)
        curve = [[(cost(u + v) - cost(u - v) - cost(v - u) + cost(-u - v)) / 4e-8 for v in unit] for u in unit]
        np.testing.assert_allclose(2 * weight * whole.T @ whole, curve, rtol=1e-3, atol=1e-3)
        np.testing.assert_array_equal(parts[2], parts[0][:, :, :1])
