"""Bowed stems: measured along their curved axis; straight ones left as they are."""

import numpy as np
import pytest

from treedgs_geo.stems.cloud.estimate.stem import measure_points
from treedgs_geo.stems.cloud.estimate.sweep import follow_axis, is_bowed
from treedgs_geo.stems.cloud.propose.sensors import SENSORS
from treedgs_geo.stems.geometry.cone import Cone


def bowed(rng, bow, n=350, noise=0.010, r=0.15):
    """Points on a round stem of 30 cm at breast height, bow (m) at 2 m, straight again at 4 m."""
    h, turn = rng.uniform(0.3, 4.8, n), rng.uniform(-np.pi, np.pi, n)
    radius = r - 0.005 * (h - 1.37) + rng.normal(0, noise, n)
    centre = bow * np.sin(np.pi * np.clip(h / 4.0, 0, 1)) ** 2
    return np.column_stack([centre + radius * np.cos(turn), radius * np.sin(turn), h])


@pytest.mark.parametrize("bow", [0.15, 0.25, 0.35])
def test_a_bowed_stem_is_measured_along_its_axis(bow):
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(4):
        points = bowed(rng, bow)
        start = Cone(0.5 * bow, 0.0, 0.0, 0.0, 0.16, -0.005, 1.37, 0.02)
        near = np.abs(start.residuals(points)) < 0.6 * 0.16 + 0.02
        measured = measure_points(points[near], None, SENSORS["uls"], 1.37, None, start, points[~near])
        assert measured.assessment.measured
        errors.append(measured.assessment.dbh_cm - 30.0)
        # The place at breast height is on the curved axis, the lean is that of the axis there.
        assert abs(measured.cone.centre(1.37)[0] - bow * np.sin(np.pi * 1.37 / 4.0) ** 2) < 0.02
        true = np.degrees(np.arctan(bow * np.pi / 4.0 * np.sin(2 * np.pi * 1.37 / 4.0)))
        assert abs(measured.cone.lean_deg - true) < 2.0
    # A section across a slope of 0.2 is 2 % longer than wide where the points were made level.
    assert abs(np.mean(errors)) < 0.5 and np.abs(errors).max() < 0.9


@pytest.mark.parametrize("bow", [0.0, 0.15])
def test_only_a_bowed_stem_is_taken_for_one(bow):
    rng = np.random.default_rng(4)
    for _ in range(6):
        points = bowed(rng, bow, noise=0.012)
        start = Cone(0.5 * bow, 0.0, 0.0, 0.0, 0.16, -0.005, 1.37, 0.02)
        measured = measure_points(points, None, SENSORS["uls"], 1.37, None, start, upright=True)
        axis = follow_axis(points, measured.cone, SENSORS["uls"], 1.37)
        assert is_bowed(axis, measured.cone, (0.4, 4.1)) == (bow > 0)


def test_the_axis_is_the_one_that_was_bent_and_straightening_undoes_it():
    points = bowed(np.random.default_rng(5), 0.15, n=4000, noise=0.004)
    axis = follow_axis(points, Cone(0.1, 0.0, 0.05, 0.0, 0.17, -0.005, 1.37, 0.02), SENSORS["uls"], 1.37)
    h = np.linspace(0.6, 4.2, 30)
    true = 0.15 * np.sin(np.pi * np.clip(h / 4.0, 0, 1)) ** 2
    assert np.abs(axis.at(h)[0] - np.column_stack([true, np.zeros(30)])).max() < 0.012
    upright = axis.straightened(points, 1.37)
    assert np.array_equal(upright[:, 2], points[:, 2])
    near = (points[:, 2] > 0.6) & (points[:, 2] < 4.2)
    distance = np.hypot(*(upright[near, :2] - axis.at(1.37)[0]).T) + 0.005 * (points[near, 2] - 1.37)
    assert distance.std() < 0.010 and abs(distance.mean() - 0.15) < 0.004


def test_no_axis_without_bark():
    start = Cone(0.0, 0.0, 0.0, 0.0, 0.15, -0.005, 1.37, 0.01)
    assert follow_axis(np.empty((0, 3)), start, SENSORS["uls"], 1.37) is None
    twigs = np.random.default_rng(1).uniform([-0.3, -0.3, 0.3], [0.3, 0.3, 4.5], (30, 3))
    assert follow_axis(twigs, start, SENSORS["uls"], 1.37) is None
