"""Poses, pairs, tracks, images, dense: on small synthetic blocks with exact answers."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest
from synthetic_block import block_of, ring

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.dense import densify_band, vote
from treedgs_geo.reconstruction.images import pinhole_maps
from treedgs_geo.reconstruction.model import load_points, load_views, point_colours, save_model
from treedgs_geo.reconstruction.pairs import select_pairs
from treedgs_geo.reconstruction.poses import fit_similarity_robust, rotation_angle_deg, rotation_from_gimbal
from treedgs_geo.reconstruction.predicted_points import _in_field, find_points, turn_to_points
from treedgs_geo.reconstruction.tracks import build_tracks, triangulate


def test_gimbal_angles() -> None:
    down = rotation_from_gimbal(0, -90, 0)
    np.testing.assert_allclose(down[2], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(down[0], [1, 0, 0], atol=1e-12)
    east = rotation_from_gimbal(90, 0, 0)
    np.testing.assert_allclose(east[2], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(east[1], [0, 0, -1], atol=1e-12)


def test_similarity_ignores_wrong_tags() -> None:
    rng = np.random.default_rng(3)
    target = rng.normal(0, 20, (20, 3)) + [0, 0, 60]
    turn = rotation_from_gimbal(33, -40, 10)
    source = (target - [1, 2, 3]) @ turn / 7.5
    target = target + rng.normal(0, 0.02, target.shape)
    target[4] += [5, 0, 0]
    target[9] += [0, 3, 2]
    fitted, inliers = fit_similarity_robust(source, target, np.full(20, 0.03), rng)
    assert inliers.sum() == 18 and not inliers[[4, 9]].any()
    assert fitted.scale == pytest.approx(7.5, rel=1e-3)
    line = np.arange(12)[:, None] * np.array([[1.0, 2.0, 0.0]])
    assert fit_similarity_robust(line, line, np.full(12, 0.03), rng) is None


def test_pairs_prefer_overlap() -> None:
    views = ring(36)
    rotations = np.array([v.rotation for v in views])
    xyz = np.array([v.centre for v in views])
    pairs = select_pairs(xyz, rotations, 0.0, 0.34, neighbours=6)
    apart = np.abs(pairs[:, 0] - pairs[:, 1])
    assert np.minimum(apart, 36 - apart).max() <= 4 and set(pairs.ravel()) == set(range(36))
    xyz[5] = np.nan
    assert 5 in select_pairs(xyz, rotations, 0.0, 0.34, neighbours=6), "a photo without position is still matched"


def test_tracks_drop_contradictions() -> None:
    keypoints = [np.zeros((4, 2)) for _ in range(3)]
    matches = {
        (0, 1): np.array([[0, 0], [1, 1]]),
        (1, 2): np.array([[0, 0], [1, 1]]),
        (0, 2): np.array([[0, 0], [2, 1]]),
    }
    image, key, track = build_tracks(keypoints, matches, np.ones(3, bool))
    full = track[(image == 0) & (key == 0)][0]
    assert (track == full).sum() == 3
    assert not ((image == 0) & np.isin(key, [1, 2])).any(), "two keypoints of one photo in one track: neither is kept"


def test_triangulation_and_outliers() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-15, -15, 0], [15, 15, 8], (200, 3))
    block = block_of(ring(), points, 0.2, rng)
    wrong = rng.choice(len(block.image), 60, replace=False)
    for row in wrong:
        block.keypoints[block.image[row]][block.key[row]] += rng.choice([-1, 1], 2) * rng.uniform(20, 60, 2)
    block.points[:] = 0
    before = len(block.image)
    triangulate(block, 3.0)
    assert len(block.image) >= before - 80
    nearest = np.linalg.norm(block.points[:, None] - points[None], axis=2).min(axis=1)
    assert np.median(nearest) < 0.02 and nearest.max() < 0.3


def test_turn_to_points_with_a_tenth_right() -> None:
    rng = np.random.default_rng(5)
    view = ring()[2]
    points = rng.uniform([-15, -15, 0], [15, 15, 6], (120, 3))
    rays = (points - view.centre) @ view.rotation.T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    rays[18:] = rays[rng.permutation(np.arange(18, 120))]
    guess = rotation_from_gimbal(1, 0, 1) @ rotation_from_gimbal(0, 0, 0).T @ view.rotation
    found, inliers = turn_to_points(points, rays, view.centre, 3 / 1900, rng, trials=4000, near=guess, max_turn_deg=3)
    assert rotation_angle_deg(found @ view.rotation.T) < 0.1 and inliers[:18].all()


def test_known_points_are_found_again() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform([-15, -15, 0], [15, 15, 3], (300, 3))
    block = block_of(ring(), points, 0.2, rng)
    code = rng.integers(0, 60, (300, 128), dtype=np.uint8)
    descriptors = [code[block.point[block.image == i]] for i in range(10)]
    rotation = rotation_from_gimbal(0.3, 0, 0) @ rotation_from_gimbal(0, 0, 0).T @ block.rotations[4]
    point, key = find_points(block, descriptors, 4, rotation, -rotation @ block.centres[4], 40.0, 0.8)
    own = block.point[block.image == 4]
    assert len(point) > 0.9 * len(own) and (own[key] == point).mean() > 0.99


@pytest.mark.parametrize("k1", [-0.08, 0.0, 0.2])
def test_points_that_may_lie_in_a_photo_are_all_looked_for(k1: float) -> None:
    camera = Camera(1280, 960, 900.0, 905.0, 645.0, 476.0, k1, 0.02)
    view = replace(ring(3, camera=camera)[1], readout_travel_m=np.array([0.2, 0.1, 0.0]))
    points = np.random.default_rng(5).uniform([-200, -200, 0], [200, 200, 20], (20_000, 3))
    pixels = view.project(points)[0]
    inside = ((pixels > -30) & (pixels < [1310, 990])).all(axis=1)
    near = _in_field(view, points, 30.0)
    assert inside.sum() > 500 and near[inside].all() and near.mean() < 0.5


def test_what_is_kept_is_returned_and_points_are_numbered_anew() -> None:
    block = block_of(ring(5), np.random.default_rng(6).uniform(-10, 10, (40, 3)), 0.0, np.random.default_rng(0))
    before = np.column_stack([block.image, block.key])
    places = block.points[block.point]
    mask = np.arange(len(block.image)) % 3 > 0
    kept = block.keep(mask)
    np.testing.assert_array_equal(np.column_stack([block.image, block.key]), before[kept])
    np.testing.assert_array_equal(block.points[block.point], places[kept])
    assert (np.bincount(block.point) >= 2).all() and len(np.unique(block.point)) == len(block.points)

    some = np.arange(len(block.points)) % 2 == 0
    part = block.part(some)
    np.testing.assert_array_equal(part.points, block.points[some])
    np.testing.assert_array_equal(part.points[part.point], block.points[block.point][some[block.point]])
    part.translations[0] += 1.0
    assert not np.array_equal(part.translations[0], block.translations[0])


def test_undistortion_keeps_the_pixel_convention(tmp_path: Path) -> None:
    camera = Camera(400, 300, 350.0, 352.0, 203.3, 148.1, -0.12, 0.03, 0.001, -0.002)
    view = View("a.png", tmp_path / "a.png", camera, np.eye(3), np.zeros(3))
    target = np.array([[0.3, -0.2, 1.0], [-0.35, 0.25, 1.0], [0.0, 0.0, 1.0]])
    pixels, _ = view.project(target)
    v, u = np.mgrid[:300, :400] + 0.5
    image = np.zeros((300, 400))
    for x, y in pixels:
        image += 255 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / 18)
    image = np.repeat(np.clip(image, 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)
    for wanted, box, scale in ((target, (0, 0, 400, 300), 1.0), (target[:1], (50, 40, 390, 290), 2.0)):
        map_x, map_y, matrix = pinhole_maps(camera, box, scale)
        picture = cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR)
        expected = (wanted @ matrix.T)[:, :2]
        for x, y in expected:
            c, r = int(x), int(y)
            patch = picture[max(r - 9, 0) : r + 10, max(c - 9, 0) : c + 10, 0].astype(float)
            rows, columns = np.mgrid[: patch.shape[0], : patch.shape[1]]
            assert (columns * patch).sum() / patch.sum() + max(c - 9, 0) + 0.5 == pytest.approx(x, abs=0.35)
            assert (rows * patch).sum() / patch.sum() + max(r - 9, 0) + 0.5 == pytest.approx(y, abs=0.35)


@pytest.mark.parametrize("width", [1600, 3200])
def test_points_have_the_colours_of_their_places_in_small_and_large_photos(tmp_path: Path, width: int) -> None:
    height = width * 3 // 4
    camera = Camera(width, height, 1.5 * width, 1.5 * width, width / 2, height / 2)
    v, u = np.mgrid[:height, :width] + 0.5
    shade = np.stack([np.full_like(u, 90), 255 * v / height, 255 * u / width], axis=2).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "a.jpg"), shade)
    rng = np.random.default_rng(7)
    block = block_of(ring(4, camera=camera), rng.uniform([-15, -15, 0], [15, 15, 4], (60, 3)), 0.0, rng)
    colours = point_colours(block, [tmp_path / "a.jpg"] * 4)
    place = block.observed() / [width, height] * 255
    expected = [np.bincount(block.point, place[:, k]) / np.bincount(block.point) for k in range(2)]
    assert len(colours) == 60
    np.testing.assert_allclose(colours[:, :2], np.array(expected).T, atol=3)
    np.testing.assert_allclose(colours[:, 2], 90, atol=3)


def test_model_round_trip(tmp_path: Path) -> None:
    import pyproj

    rng = np.random.default_rng(0)
    views = ring(4)
    points = rng.uniform([-10, -10, 0], [10, 10, 3], (30, 3))
    block = block_of(views, points, 0.0, rng)
    for view in views:
        cv2.imwrite(str(tmp_path / view.name), np.full((960, 1280, 3), (10, 20, 200), np.uint8))
    frame = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))
    block.rotations[3], block.translations[3] = np.nan, np.nan
    block.keep(block.image != 3)
    save_model(
        tmp_path / "sfm",
        block,
        [v.name for v in views],
        [tmp_path / v.name for v in views],
        np.array([0, 0, 1, 1]),
        frame,
        {"a": 1},
        {"model": "X"},
    )
    again, loaded = load_views(tmp_path / "sfm", tmp_path)
    assert [v.name for v in loaded] == ["0.png", "1.png", "2.png"] and loaded[2].flight == 1
    np.testing.assert_allclose(loaded[1].rotation, views[1].rotation, atol=1e-9)
    np.testing.assert_allclose(again.origin, frame.origin)
    sparse = pycolmap.Reconstruction(tmp_path / "sfm").points3D.values()
    assert len(load_points(tmp_path / "sfm")) == len(sparse) == len(points)
    assert all(point.color.tolist() == [200, 20, 10] and point.error < 1e-6 for point in sparse)


@pytest.mark.parametrize(("unchecked", "loaded"), [(80, 120), (150, 200)])
def test_points_that_only_two_photos_show_count_where_few_others_do(
    tmp_path: Path, unchecked: int, loaded: int
) -> None:
    import pyproj

    rng = np.random.default_rng(0)
    views = ring(4)
    block = block_of(views, rng.uniform([-10, -10, 0], [10, 10, 3], (200, 3)), 0.0, rng)
    block.keep((block.image < 2) | (block.point >= unchecked))
    for view in views:
        cv2.imwrite(str(tmp_path / view.name), np.zeros((960, 1280, 3), np.uint8))
    names, frame = [v.name for v in views], LocalFrame(pyproj.CRS.from_epsg(6344), np.zeros(3))
    save_model(tmp_path / "sfm", block, names, [tmp_path / n for n in names], np.zeros(4, int), frame, {}, {})
    found, kept = load_points(tmp_path / "sfm"), pycolmap.Reconstruction(tmp_path / "sfm").points3D.values()
    three = [point.xyz for point in kept if point.track.length() >= 3]
    assert len(found) == loaded and (sorted(found.tolist()) == sorted(map(list, three))) == (loaded == 120)


@pytest.mark.parametrize("travel_m", [0.0, 0.16])
def test_dense_band_finds_a_textured_wall(tmp_path: Path, travel_m: float) -> None:
    rng = np.random.default_rng(4)
    camera = Camera(640, 480, 900.0, 900.0, 320.0, 240.0)
    texture = cv2.GaussianBlur(rng.uniform(0, 255, (700, 700)).astype(np.float32), (0, 0), 1.2)
    texture = np.clip((texture - 127) * 3 + 127, 0, 255)
    views = []
    # A slanted plane z = 1 + 0.1 x under three oblique cameras a few metres apart.
    for k, east in enumerate((-4.0, 0.0, 4.0)):
        rotation = rotation_from_gimbal(-east * 2, -55, 0)
        centre = np.array([east, -25.0, 36.0])
        # A rolling shutter, each photo flown through in a direction of its own.
        travel = travel_m * np.array([[1, 0, 0], [0, -1, 0], [-0.7, 0.7, 0]][k])
        view = View(f"{k}.png", tmp_path / f"{k}.png", camera, rotation, -rotation @ centre, 0, travel)
        u, v = np.meshgrid(np.arange(640) + 0.5, np.arange(480) + 0.5)
        rays = view.rays(np.column_stack([u.ravel(), v.ravel()]))
        stood = centre + (v.ravel()[:, None] / 480 - 0.5) * travel
        reach = (1 + 0.1 * stood[:, 0] - stood[:, 2]) / (rays[:, 2] - 0.1 * rays[:, 0])
        spot = stood + reach[:, None] * rays
        maps = ((spot[:, :2] + 14) * 25).astype(np.float32).reshape(480, 640, 2)
        picture = cv2.remap(texture, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR)
        cv2.imwrite(str(view.path), np.repeat(picture.astype(np.uint8)[:, :, None], 3, axis=2))
        views.append(view)
    xyz, rgb, votes = densify_band(views, lambda x, y: np.zeros_like(np.asarray(x, float)), np.zeros(2), 4.0)
    assert len(xyz) > 2000 and rgb.dtype == np.uint8 and votes.min() >= 2
    off = xyz[:, 2] - (1 + 0.1 * xyz[:, 0])
    assert np.abs(np.median(off)) < 0.03 and np.median(np.abs(off)) < 0.06


def test_vote_counts_each_photo_once() -> None:
    point = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]])
    colour = np.full((2, 3), 9, np.uint8)
    xyz, _, votes = vote([(0, point, colour), (0, point, colour), (1, point[:1], colour[:1])], 0.1, 2)
    assert len(xyz) == 3 and (votes == 2).all() and np.abs(xyz).max() == 0
