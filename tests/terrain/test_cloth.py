"""The cloth filter on ground whose shape is known."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.terrain.cloth import near_cloth, particles_over
from treedgs_geo.terrain.ground import classify_ground
from treedgs_geo.terrain.options import ClothSimulation


def cloud(height, side_m=30.0, n=8000, seed=0) -> np.ndarray:
    """(N, 3) points of a surface, 2 cm of noise."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, side_m, (n, 2))
    return np.column_stack([xy, height(*xy.T) + rng.normal(0, 0.02, n)])


@pytest.mark.parametrize("slope", [0.0, 0.3, 0.5])
def test_a_slope_is_ground_whole(slope):
    points = cloud(lambda x, y: slope * x + 0.1 * np.sin(y))
    assert classify_ground(points, ClothSimulation(rigidness=1)).mean() > 0.99


def test_roofs_and_crowns_are_not_ground_and_the_ground_round_them_is():
    points = cloud(lambda x, y: 0.05 * x)
    roof = (np.abs(points[:, :2] - 15) < 3).all(axis=1)
    points[roof, 2] += 4.0
    ground = classify_ground(points)
    assert not ground[roof].any() and ground[~roof].mean() > 0.98


def test_a_bank_is_followed_by_a_soft_cloth():
    """A step of 3 m over 6 m between two levels."""
    points = cloud(lambda x, y: np.clip((x - 12) / 2, 0, 3))
    assert classify_ground(points, ClothSimulation(rigidness=1)).mean() > 0.98


def test_the_floor_of_a_hollow_over_which_a_stiff_cloth_hangs_is_ground():
    """Wide and smooth: the ground is followed down from its rim."""
    points = cloud(lambda x, y: -1.2 * np.exp(-((x - 15) ** 2 + (y - 15) ** 2) / 40))
    floor = np.hypot(*(points[:, :2] - 15).T) < 2
    assert classify_ground(points, ClothSimulation(rigidness=3))[floor].mean() > 0.95


def test_gaps_and_a_single_line_of_points_do_no_harm():
    points = cloud(lambda x, y: 0.1 * x)
    gap = (np.abs(points[:, :2] - 15) < 6).all(axis=1)
    assert near_cloth(points[~gap], ClothSimulation()).mean() > 0.99
    line = np.column_stack([np.arange(40.0), np.zeros(40), np.zeros(40)])
    assert near_cloth(line, ClothSimulation()).all()


def test_heights_and_places_may_be_anywhere():
    """The same ground far from zero, and below it."""
    points = cloud(lambda x, y: 0.2 * x)
    here = near_cloth(points, ClothSimulation())
    there = near_cloth(points + (-512.0, 4096.0, -256.0), ClothSimulation())
    assert (here != there).mean() < 0.001


def test_the_size_of_the_cloth_is_known_before_it_is_made():
    rows, cols = particles_over(np.array([[0.0, 0.0, 0.0], [1000.0, 10.0, 0.0]]), ClothSimulation(cloth_m=0.5))
    assert (rows, cols) == (24, 2004)
