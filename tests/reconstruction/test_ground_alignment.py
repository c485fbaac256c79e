"""Photos turned to the ground that the others show together, and tied to it, under leaves that hide most of it."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from rendered_stems import Stem, leaves, oblique_views, render
from scipy.spatial.transform import Rotation

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.ground_alignment import (
    _neighbours,
    picture_of_ground,
    ties_to_ground,
    turned_to_ground,
)


def ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.zeros(np.shape(x))


@pytest.fixture(scope="module")
def flown(tmp_path_factory) -> list[View]:
    views = oblique_views(tmp_path_factory.mktemp("flown"), 24, distance=18.0)
    render(views, [Stem(-1.5, 1.0, 0.20), Stem(2.0, -1.5, 0.15)])
    assert 0.5 < leaves(views, np.random.default_rng(7)) < 0.8
    return views


def turned(view: View, degrees: tuple[float, float, float]) -> View:
    rotation = view.rotation @ Rotation.from_rotvec(np.radians(degrees)).as_matrix()
    return replace(view, rotation=rotation, translation=-rotation @ view.centre)


def off_px(view: View, other: View) -> float:
    """How far two poses of a photo show the ground of its middle apart."""
    x, y = np.meshgrid(np.linspace(-2, 2, 5), np.linspace(-2, 2, 5))
    places = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return float(np.linalg.norm(view.project(places)[0] - other.project(places)[0], axis=1).max())


@pytest.mark.parametrize("degrees", [(0.5, -0.6, 0.4), (-0.7, 0.3, -0.6)])
@pytest.mark.parametrize("number", [3, 16])
def test_a_turned_photo_is_turned_back(flown, number, degrees):
    wrong = turned(flown[number], degrees)
    picture = picture_of_ground(flown[:number] + flown[number + 1 :], [wrong], ground)
    rotation = turned_to_ground(wrong, picture)
    assert off_px(wrong, flown[number]) > 5
    right = replace(wrong, rotation=rotation, translation=-rotation @ wrong.centre)
    assert off_px(right, flown[number]) < 1.5
    tiles, pixels, _ = ties_to_ground(right, picture)
    apart = pixels - flown[number].project(picture.places[tiles])[0]
    assert len(tiles) > 0.12 * len(picture.seen_by(right))
    assert np.abs(np.median(apart, axis=0)).max() < 0.6  # not to one side; single ones are there by chance
    assert np.median(np.abs(apart)) < 1.0


def test_a_photo_that_shows_no_such_ground_is_not_turned(flown, tmp_path):
    picture = picture_of_ground(flown[:-1], flown[-1:], ground)
    litter = cv2.GaussianBlur(np.random.default_rng(3).normal(size=(400, 520, 1)), (0, 0), 2.0)
    cv2.imwrite(str(tmp_path / "other.png"), np.dstack([120 + 300 * litter] * 3).clip(0, 255).astype(np.uint8))
    other = replace(flown[-1], path=tmp_path / "other.png")
    assert turned_to_ground(other, picture) is None
    off_px = np.linalg.norm(ties_to_ground(other, picture)[2], axis=1)
    assert np.mean(off_px < 1.5) < 0.2  # by chance, anywhere about


def test_few_photos_and_photos_of_the_sky_give_no_picture_and_no_ties(flown):
    assert picture_of_ground(flown[:3], flown[-1:], ground) is None
    sky = turned(flown[-1], (0, 0, 0))
    up = np.diag([1.0, -1.0, -1.0]) @ sky.rotation
    assert picture_of_ground(flown[:-1], [replace(sky, rotation=up, translation=-up @ sky.centre)], ground) is None
    picture = picture_of_ground(flown[:-1], flown[-1:], ground)
    tiles, pixels, off_px = ties_to_ground(replace(sky, rotation=up, translation=-up @ sky.centre), picture)
    assert len(tiles) == 0 and pixels.shape == off_px.shape == (0, 2)


def test_photos_have_a_picture_together_with_those_of_their_flight_and_place():
    xyz = np.zeros((9, 3))
    xyz[:, 0] = [0, 40, 80, 20, 30, 400, 430, 10, 0]
    flight, chosen = np.array([0, 0, 0, 1, 1, 1, 1, 0, 2]), np.arange(9) != 1
    groups = [sorted(group) for group in _neighbours(xyz, chosen, flight)]
    assert sorted(groups) == [[0, 2, 7], [3, 4], [5, 6], [8]]
