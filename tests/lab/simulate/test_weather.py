"""Sky and wind of the simulator: shadows with penumbrae, none under clouds; trees that sway from their feet."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from bare_stem import stem_world

from treedgs_lab.simulate import light, scene, stem_mesh, terrain
from treedgs_lab.simulate.barks import Barks
from treedgs_lab.simulate.foliage import LYING, ROOTED, Faces, Material
from treedgs_lab.simulate.settings import SIZES, SimulateSettings
from treedgs_lab.simulate.textures import GroundTexture
from treedgs_lab.simulate.vegetation import all_foliage
from treedgs_lab.simulate.wind import Sway, Wind, flutter
from treedgs_lab.simulate.world import build_world

STEP_M, HALF_M = 0.05, 24.0


def settings(**more):
    return SimulateSettings(output="x", preset="micro", **more)


def ground_light(**more):
    """Green light on the ground about the single stem, the sun in the south at 20 degrees; (n, n)."""
    world, _, _ = stem_world()
    weather = light.weather_of(settings(sun_elevation_deg=20.0, **more))
    sun = light.held_at(np.array([0.0, -0.6, 0.8]), weather.elevation_deg)
    sky = light.SkyField(world.faces, 40.0)
    return light.bake(world, sky, sun, HALF_M, np.random.default_rng(0), STEP_M, weather).ground[..., 1]


def across(image, north_m):
    """Mean brightness from west to east over 0.7 m about ``north_m``."""
    row = int((HALF_M + north_m) / STEP_M)
    return image[row - 7 : row + 7].mean(axis=0)


def shadow_width(image, north_m):
    """Standard deviation of the shadow across, m: what sharp edges have of the stem's own width grows by the disc."""
    lost = np.clip(np.median(across(image, north_m)) - across(image, north_m), 0, None)
    lost[lost < 0.1 * lost.max()] = 0
    x = np.arange(len(lost)) * STEP_M
    mean = (lost * x).sum() / lost.sum()
    return np.sqrt((lost * (x - mean) ** 2).sum() / lost.sum())


def test_shadows_have_penumbrae_that_widen_with_the_distance():
    image = ground_light(shadow_samples=32)
    near, far = shadow_width(image, 4.0), shadow_width(image, 20.0)
    # A disc's standard deviation is half its radius; the stem's own is a third of its shrinking width.
    disc = 0.5 * light.SUN_RADIUS * 20.0 / np.cos(np.radians(20))
    assert far > 0.8 * disc
    stem = near / (0.15 / 2)
    assert far / near > 0.9 * np.hypot(disc, 0.05) / near > 0 and stem > 0.5
    # With two rays a spot the penumbra is noise, with 32 it is smooth: from one row to the next.
    row = int((HALF_M + 20.0) / STEP_M)
    rough, smooth = (np.diff(picture[row - 20 : row + 20], axis=0).std() for picture in (ground_light(), image))
    assert smooth < 0.6 * rough


def test_a_low_sun_is_red_and_the_camera_makes_up_for_it():
    low, usual = (light.weather_of(settings(sun_elevation_deg=e)) for e in (12.0, light.USUAL_ELEVATION_DEG))
    assert low.sun[0] / low.sun[2] > 1.4 * usual.sun[0] / usual.sun[2]
    assert usual.exposure == pytest.approx(1.0) and low.exposure > 1.5
    assert light.held_at(np.array([0.6, 0.0, 0.8]), 30.0) == pytest.approx([np.cos(np.pi / 6), 0, 0.5])
    assert repr(light.weather_of(settings())) == repr(light.CLEAR)


def test_no_shadow_under_clouds():
    clear, cloudy = ground_light(), None
    world, _, _ = stem_world()
    weather = light.weather_of(settings(sky="overcast"))
    sky = light.SkyField(world.faces, 40.0)
    sun = np.array([0.0, -0.94, 0.342])
    baked = light.bake(world, sky, sun, HALF_M, np.random.default_rng(0), STEP_M, weather)
    cloudy = baked.ground[..., 1]
    assert np.ptp(across(clear, 5.0)) > 0.2
    assert np.ptp(across(cloudy, 5.0)) < 0.01
    assert baked.stems.max() > 0.2
    assert weather.exposure * cloudy.mean() == pytest.approx(1.0, abs=0.1)


def stand():
    """A few trees with crowns, and what grows under them."""
    wanted = dataclasses.replace(settings(seed=3), leaf_area_m2=4.0, wind_sway_cm=30.0, wind_flutter_cm=3.0)
    ground = terrain.make_ground(np.random.default_rng(0), 30, 5.0, 0.1)
    stems = scene.grow_stand(np.random.default_rng(1), wanted, SIZES["micro"], ground, 12.0, 14.0)
    mesh = stem_mesh.mesh_stems(np.random.default_rng(2), stems)
    faces = all_foliage(np.random.default_rng(3), wanted, ground, stems, 10.0)
    texture = GroundTexture(-10.0, 1.0, np.zeros((20, 20, 3), np.uint8))
    bark = Barks.plain(np.zeros((8, 8, 3), np.uint8), len(stems))
    return wanted, stems, build_world(ground, mesh, faces, texture, bark, np.random.default_rng(4))


@pytest.fixture(scope="module")
def windy():
    return stand()


def wind_of(windy, **more):
    wanted, stems, world = windy
    return Wind(world, stems, dataclasses.replace(wanted, **more), np.random.default_rng(6))


def test_every_face_has_its_owner(windy):
    _, stems, world = windy
    faces = world.faces
    assert len(faces.owner) == len(faces.corners)
    assert {ROOTED, LYING} < set(faces.owner) and faces.owner.max() < len(stems)
    assert faces.kind.dtype == np.uint8 and set(faces.kind[faces.owner == LYING]) == {Material.WOOD}
    assert set(faces.kind[faces.owner >= 0]) == {Material.WOOD, Material.FOLIAGE}
    assert set(faces.kind[faces.owner == ROOTED]) == {Material.SHRUB, Material.GRASS}
    for k in range(0, len(stems), 5):
        own = faces.corners[faces.owner == k].mean(axis=1)
        if len(own):
            assert np.hypot(*(own[:, :2].mean(axis=0) - stems[k].axis[-1, :2])) < 2.5


def test_tops_sway_and_feet_stand(windy):
    _, stems, world = windy
    wind = wind_of(windy, wind_flutter_cm=0.0)
    moments = [wind.at(k, 3.1 * k) for k in range(40)]
    tops, breast, along = [], [], []
    for k, stem in enumerate(stems):
        if stem.kind != "normal" or not stem.in_plot:
            continue
        own = np.flatnonzero(world.mesh.vertex_owner == k)
        share = (world.mesh.vertices[own, 2] - stem.axis[0, 2]) / stem.height_m
        moved = np.array([m.mesh.vertices[own] - world.mesh.vertices[own] for m in moments])
        assert np.abs(moved[:, share <= 0]).max() == 0 and np.abs(moved[..., 2]).max() == 0
        tops.append(moved[:, np.argmax(share), :2])
        breast.append(np.abs(moved[:, np.argmin(np.abs(share * stem.height_m - 1.37))]).max())
        half = np.argmin(np.abs(share - 0.5))
        along.append(np.linalg.norm(moved[:, half], axis=1).mean() / np.linalg.norm(tops[-1], axis=1).mean())
    assert np.hypot(*np.std(np.concatenate(tops), axis=0)) == pytest.approx(0.30 * np.hypot(1.0, 0.5), rel=0.2)
    assert np.mean(along) == pytest.approx(0.25, abs=0.05)
    assert max(breast) < 0.012
    # Neighbours are not in step, and a tree moves smoothly in time.
    a, b = (np.concatenate([part[:, 0], part[:, 1]]) for part in tops[:2])
    assert np.corrcoef(a, b)[0, 1] < 0.9
    soon, now = wind.at(0, 10.05), wind.at(0, 10.0)
    assert np.abs(soon.mesh.vertices - now.mesh.vertices).max() < 0.12


def test_crowns_stay_on_their_stems(windy):
    _, stems, world = windy
    sway = Sway(stems, 50.0, np.random.default_rng(0))
    top = sway.tops(7.0)
    stem = next(k for k, s in enumerate(stems) if s.kind == "normal")
    points = stems[stem].axis[::20]
    shifted = sway.shift(points, np.full(len(points), stem), top)
    assert np.linalg.norm(shifted[-1]) > 0.9 * np.linalg.norm(top[stem])
    assert np.array_equal(sway.shift(points, np.full(len(points), ROOTED), top), np.zeros(points.shape))


def test_leaves_flutter_by_centimetres_and_logs_lie(windy):
    _, _, world = windy
    wind = wind_of(windy, wind_sway_cm=0.0)
    faces = world.faces
    middle = faces.corners.mean(axis=1)
    moved = np.concatenate([wind.at(k, 2.0 * k).faces.corners.mean(axis=1) - middle for k in range(6)])
    owner = np.tile(faces.owner, 6)
    above = np.tile(middle[:, 2] - world.ground.height(middle[:, :2]), 6)
    assert moved[owner >= 0][:, :2].std() == pytest.approx(0.03, rel=0.2)
    assert moved[(owner == ROOTED) & (above > 0.5)][:, :2].std() == pytest.approx(0.03, rel=0.25)
    assert np.abs(moved[owner == LYING]).max() < 1e-6
    # Stems stand still, and a leaf is not bent.
    later = wind.at(3, 6.0)
    assert np.array_equal(later.mesh.vertices, world.mesh.vertices)
    edges = [f.corners[:, 1] - f.corners[:, 0] for f in (faces, later.faces)]
    assert np.abs(edges[0] - edges[1]).max() < 1e-5
    near = flutter(np.array([[0.0, 0, 5], [0.03, 0, 5]]), np.random.default_rng(1))
    assert np.linalg.norm(near[0] - near[1]) < 1.0


def test_without_wind_there_is_one_world(windy):
    wind = wind_of(windy, wind_sway_cm=0.0, wind_flutter_cm=0.0)
    assert wind.phases == 1 and wind.at(0, 0.0) is wind.at(7, 33.0)
    assert isinstance(windy[2].faces, Faces)
