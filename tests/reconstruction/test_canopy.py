"""The canopy from photos of a scene that is drawn: two crowns of three loose layers over a textured ground."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.canopy import surface_of, volume_of
from treedgs_geo.reconstruction.ground_sight import ground_sight
from treedgs_geo.reconstruction.multi_view_correlation import pictures_of

#: A crown (level squares with gaps, 0.6 m apart): half width, middle, height above the ground, metres; a smaller one.
CROWNS = ((1.5, (2.0, 1.0), 12.0), (1.0, (-4.0, -2.0), 7.0))
GROUND_Z = 3.0
ABOUT = np.array([0.0, 0.0, GROUND_Z + 8])


def drawn(view: View, textures: list[np.ndarray], sway: np.ndarray | float = 0.0) -> np.ndarray:
    """The scene in a photo: each level seen through the photo's own rays, the higher before the lower. sway: (2,) by
    which the crowns are moved, metres."""
    camera = view.camera
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = view.rays(np.column_stack([u.ravel(), v.ravel()]))
    levels = [(GROUND_Z, np.array([0.0, 0.0]), 60.0)]
    for half, middle, height in CROWNS:
        levels += [(GROUND_Z + height - down, np.array(middle) + sway, half) for down in (1.2, 0.6, 0.0)]
    image = np.zeros(len(rays), np.uint8)
    for (z, middle, half), texture in zip(levels, textures, strict=True):
        at = view.centre[:2] + rays[:, :2] * ((z - view.centre[2]) / rays[:, 2])[:, None]
        inside = (np.abs(at - middle) <= half).all(axis=1)
        cell = np.floor((at[inside] - middle + half) / 0.05).astype(int) % len(texture)
        leaf = texture[cell[:, 0], cell[:, 1]]
        # Every other patch of a crown is a gap.
        solid = (z == GROUND_Z) | ((cell // 6).sum(axis=1) * 7919 % 5 > 1)
        image[np.flatnonzero(inside)[solid]] = leaf[solid]
    return np.repeat(image.reshape(camera.height, camera.width, 1), 3, axis=2)


def flown(folder: Path, sway_m: float) -> list[View]:
    """20 photos, 40 m up, in two rings; a lens that bends. sway_m: s.d. of the crowns' places in the photos."""
    rng = np.random.default_rng(5)
    noise = [cv2.GaussianBlur(rng.integers(0, 256, (800, 800)).astype(np.uint8), (0, 0), 0.7) for _ in range(7)]
    textures = [np.clip(128 + 3.0 * (t.astype(float) - t.mean()), 0, 255).astype(np.uint8) for t in noise]
    made: list[View] = []
    camera = Camera(640, 480, 1240.0, 1240.0, 325.0, 237.0, k1=-0.05, p1=0.001)
    for ring, away in enumerate((6.0, 18.0)):
        for k in range(6 + 8 * ring):
            turn = 2 * np.pi * k / (6 + 8 * ring)
            centre = np.array([away * np.cos(turn), away * np.sin(turn), GROUND_Z + 40.0])
            ahead = (ABOUT - centre) / np.linalg.norm(ABOUT - centre)
            right = np.cross(ahead, [0.0, 0.0, 1.0])
            right /= np.linalg.norm(right)
            rotation = np.vstack([right, np.cross(ahead, right), ahead])
            path = folder / f"{ring}_{k}.png"
            view = View(path.name, path, camera, rotation, -rotation @ centre)
            cv2.imwrite(str(path), drawn(view, textures, rng.normal(0, sway_m, 2)))
            made.append(view)
    return made


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("canopy"), 0.0)


def ground(x, y):
    return np.full(np.shape(x), GROUND_Z)


@pytest.fixture(scope="module")
def volume(views):
    return volume_of(pictures_of(views, ABOUT, 0.11, 4), ground, (-8.0, -8.0, 8.0, 8.0), 20.0)


def test_what_stands_is_found_at_its_height_and_nothing_is_in_the_air(volume):
    found = surface_of(volume)
    x, y = np.meshgrid(volume.x, volume.y)
    near = np.zeros(x.shape, bool)
    for half, (cx, cy), height in CROWNS:
        away = np.maximum(np.abs(x - cx), np.abs(y - cy))
        assert np.nanmedian(found[away < half - 0.2]) == pytest.approx(height, abs=0.6)
        assert np.isfinite(found[away < half - 0.2]).mean() > 0.9
        near |= away < half + 1.0
    assert np.isfinite(found[~near]).mean() < 0.02


def test_pictures_are_no_finer_than_the_photo_and_unknown_ground_is_left_out(views):
    assert pictures_of(views[:3], ABOUT, 0.001).images.shape[1:] == (480, 640)
    half = lambda x, y: np.where(x > 0, GROUND_Z, np.nan)  # noqa: E731
    unknown = volume_of(pictures_of(views, ABOUT, 0.11, 4), half, (-4.0, -4.0, 4.0, 4.0), 20.0)
    found = surface_of(unknown)
    assert np.isnan(found[:, unknown.x < 0]).all() and np.isfinite(found).any()


def test_without_neighbouring_photos_nothing_is_alike(views):
    lonely = pictures_of([views[6], views[10]], ABOUT, 0.12)
    assert len(lonely.pairs) == 0 and not lonely.alike(np.zeros((4, 3)))[0].any()


@pytest.mark.parametrize("sway_m", [0.0, 0.3])
def test_crowns_hide_the_ground_and_air_does_not_whatever_the_wind(tmp_path, sway_m):
    sight = ground_sight(flown(tmp_path, sway_m), ground, (-8.0, -8.0, 8.0, 8.0), 8.0)
    (_, (x, y), top), _ = CROWNS
    inside, above = (sight.hides(np.array([x, y, GROUND_Z + top + up])) for up in (-0.6, 4.0))
    assert inside.min() > 3.0
    # Steep photos still meet the crown below; that it is dense there, they deny.
    assert above[0] < 0 and (above < inside - 5).all()
    # Beside the crowns, and where no photo tells.
    assert sight.hides(np.array([-2.0, 5.0, GROUND_Z + 6.0])).max() < 0
    assert (sight.hides(np.array([90.0, 90.0, GROUND_Z + 6.0])) == 0).all()


def test_without_a_known_ground_nothing_is_said(views):
    sight = ground_sight(views, lambda x, y: np.full(np.shape(x), np.nan), (-8.0, -8.0, 8.0, 8.0), 8.0)
    assert (sight.hides(np.zeros((3, 3))) == 0).all()
