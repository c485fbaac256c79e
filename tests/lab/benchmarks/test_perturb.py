"""Each trouble does by how much it says, and nothing else."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from photo_ring import ring

from treedgs_geo.core.settings import build
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_lab.benchmarks.stability import perturb
from treedgs_lab.benchmarks.stability.factors import BASE, FACTORS
from treedgs_lab.simulate.settings import SIZES, SimulateSettings, resolve
from treedgs_lab.simulate.trouble import TroubleSettings, disturb, photo_troubles, shake


def test_pose_noise_moves_the_picture_by_that_many_pixels():
    views, point = ring(200), np.zeros((1, 3))
    moved = perturb.noisy_poses(views, 2.0, np.random.default_rng(1))
    off = np.array([(a.project(point)[0] - b.project(point)[0])[0] for a, b in zip(moved, views, strict=True)])
    assert off.std(axis=0) == pytest.approx([2.0, 2.0], rel=0.15) and abs(off.mean()) < 0.3
    for a, b in zip(moved, views, strict=True):
        assert np.allclose(a.centre, b.centre)


def test_too_large_a_block_shows_the_same_pictures():
    views = ring(8)
    large = perturb.scaled_views(views, 1.02)
    point = np.array([[1.0, 2.0, 0.5]])
    for a, b in zip(large, views, strict=True):
        assert np.allclose(a.project(1.02 * point)[0], b.project(point)[0], atol=1e-6)
    ground = perturb.scaled_ground(lambda x, y: 0.1 * np.asarray(x), 1.02)
    assert ground(np.array([2.04]), np.array([0.0]))[0] == pytest.approx(1.02 * 0.2)


def test_few_photos_stay_spread_and_one_side_stays_one_side():
    views = ring(24)
    kept = perturb.few_views(views, 6, np.random.default_rng(0))
    azimuth = np.sort([np.degrees(np.arctan2(*v.centre[:2])) % 360 for v in kept])
    assert len(kept) == 6 and np.diff(azimuth).max() < 80
    assert perturb.few_views(views, 99, np.random.default_rng(0)) == views
    side = perturb.sector_views(views, 90.0, np.random.default_rng(3))
    turned = np.array([v.centre[:2] / np.linalg.norm(v.centre[:2]) for v in side])
    assert 5 <= len(side) <= 7 and (turned @ turned.T).min() >= -1e-6


def test_cloud_troubles():
    rng = np.random.default_rng(0)
    turn, z = rng.uniform(0, 2 * np.pi, 20000), rng.uniform(0, 5, 20000)
    bark = np.column_stack([0.15 * np.cos(turn), 0.15 * np.sin(turn), z])
    cloud = PointCloud(bark, None, {"intensity": np.arange(20000, dtype=np.uint16)})
    half = perturb.one_side_of_stems(cloud, np.array([[0, 0, 0.0, 0.15]]), 180.0, np.random.default_rng(1))
    left = half.xyz[half.xyz[:, 2] > 0.4]
    angle = np.arctan2(left[:, 1], left[:, 0])
    middle = np.angle(np.exp(1j * angle).mean())
    assert np.abs(np.angle(np.exp(1j * (angle - middle)))).max() <= np.radians(91)
    assert (half.xyz[:, 2] < 0.3).sum() == (z < 0.3).sum()  # the foot is left alone
    full = perturb.cluttered_cloud(cloud, np.array([[0, 0, 0.0]]), 400.0, np.random.default_rng(1))
    added = full.xyz[len(cloud) :]
    assert len(added) == int(400 * np.pi * 0.36 * 4) and np.hypot(*added[:, :2].T).max() <= 0.6
    assert len(full.attributes["intensity"]) == len(full.xyz) and full.attributes["intensity"].dtype == np.uint16
    assert len(perturb.thin_cloud(cloud, 0.1, np.random.default_rng(0))) == pytest.approx(2000, rel=0.1)
    noisy = perturb.noisy_cloud(cloud, 0.03, np.random.default_rng(0))
    assert (noisy.xyz - cloud.xyz).std() == pytest.approx(0.03, rel=0.02)


def test_photo_troubles_touch_the_stated_share_only():
    settings = TroubleSettings(shaken_pct=10, shake_px=6, misexposed_pct=20, misexposed_stops=2)
    lots = photo_troubles(settings, 40, np.random.default_rng(0))
    assert sum(t.shake_px > 0 for t in lots) == 4
    assert sorted({t.gain for t in lots}) == [0.25, 1.0, 4.0] and sum(t.gain != 1 for t in lots) == 8
    assert all((t.white == 1).all() for t in lots)


def test_shaking_blurs_along_one_line_and_keeps_the_light():
    image = np.zeros((41, 41, 3), np.float32)
    image[20, 20] = 1
    moved = shake(image, 10.0, 0.0)
    assert moved.sum() == pytest.approx(3, rel=1e-4)
    assert moved[20, :, 0].sum() == pytest.approx(1, rel=1e-3) and (moved[20, :, 0] > 1e-3).sum() in (10, 11, 12)
    assert shake(image, 0.5, 1.0) is image


def test_two_stops_darker_is_a_quarter_of_the_light():
    pixels = np.full((4, 4, 3), 188, np.uint8)
    trouble = photo_troubles(TroubleSettings(misexposed_pct=100, misexposed_stops=2), 1, np.random.default_rng(0))[0]
    assert trouble.gain == 0.25
    dark = disturb(pixels, trouble)
    linear = ((188 / 255 + 0.055) / 1.055) ** 2.4
    assert dark[0, 0, 0] == pytest.approx(255 * (1.055 * (linear / 4) ** (1 / 2.4) - 0.055), abs=1)


def test_untroubled_photos_are_not_copied(tmp_path):
    image = np.full((440, 560, 3), 90, np.uint8)
    views = []
    for k, view in enumerate(ring(10)):
        path = tmp_path / f"{k}.png"
        cv2.imwrite(str(path), image)
        views.append(dataclasses.replace(view, path=path))
    out = tmp_path / "out"
    made = perturb.troubled_photos(
        views, TroubleSettings(misexposed_pct=10, misexposed_stops=1), out, np.random.default_rng(0)
    )
    changed = [view for view in made if view.path.parent == out]
    assert len(changed) == 1 and cv2.imread(str(changed[0].path)).mean() < 80


def test_every_level_is_a_plot_that_can_be_made(tmp_path):
    assert len({factor.key for factor in FACTORS}) == len(FACTORS)
    for factor in FACTORS:
        assert len(factor.levels) >= 2 and bool(factor.render) != bool(factor.perturb), factor.key
        assert factor.inputs and factor.unit and factor.about.endswith("."), factor.key
        for change in factor.render.values():
            settings = build(SimulateSettings, {**BASE, **change, "output": tmp_path, "seed": 1})
            assert resolve(settings)[1].photos == change.get("photos", SIZES[BASE["preset"]].photos)
