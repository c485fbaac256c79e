"""Geotags of another instant, and float solutions labelled fixed: what the photos of exact blocks say of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_block import CAMERA, LENS, block_of, known_of, ring

from treedgs_geo.reconstruction.adjustment import Adjusted, Known, adjust
from treedgs_geo.reconstruction.bundle import LAST
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.covariance import posterior_of
from treedgs_geo.reconstruction.geotag_errors import as_photos_say, in_time, lateness, settle_time
from treedgs_geo.reconstruction.poses import rotation_from_gimbal
from treedgs_geo.reconstruction.tracks import Block

#: An 11 degree field, as stems are photographed from 70 m: a camera that is pulled aside only turns a little.
NARROW = Camera(720, 540, 3804.0, 3804.0, 365.3, 266.3, -0.02, 0.01)
FIX_M = np.array([0.011, 0.011, 0.027])


def _rings() -> tuple[list[View], np.ndarray]:
    """28 photos of a drone that circles at 6 m/s, and its velocities."""
    views = ring(14, 60.0, -60.0, NARROW) + ring(14, 68.0, -80.0, NARROW)
    out = np.array([-view.rotation.T @ view.translation for view in views])[:, :2]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return views, 6.0 * np.column_stack([-out[:, 1], out[:, 0], np.zeros(len(out))])


def _one_way() -> tuple[list[View], np.ndarray]:
    """28 nadir photos of a drone that flies four lines, all to the north."""
    turn, views = rotation_from_gimbal(0, -90, 0), []
    for east in np.linspace(-12, 12, 4):
        for north in np.linspace(-12, 12, 7):
            views.append(View("", Path(), CAMERA, turn, -turn @ [east, north, 60.0]))
    return views, np.tile([0.0, 6.0, 0.0], (28, 1))


def _adjusted(flight, late_s: float, error: np.ndarray | float = 0.0, seed: int = 0) -> tuple:
    """Block, what held it, adjustment, posterior and true cameras: geotags late by so much, and off by ``error``."""
    views, velocity = flight
    rng = np.random.default_rng(seed)
    low = np.column_stack([rng.uniform(-22, 22, (900, 2)), rng.uniform(0, 1, 900)])
    crowns = np.column_stack([rng.uniform(-22, 22, (500, 2)), rng.uniform(2, 20, 500)])
    block = block_of(views, np.vstack([low, crowns]), 0.25, rng)
    block.keep(np.bincount(block.point)[block.point] >= 3)
    truth = block.centres.copy()
    block.sensor = replace(block.sensor, velocity_m_s=velocity)
    tags = truth - late_s * velocity + rng.normal(0, 1, truth.shape) * FIX_M + error
    known = known_of(tags, FIX_M, views[0].camera, late_sd_s=np.array([0.3]))
    adjusted = adjust(block, known, LENS, iterations=40, tolerance=LAST)
    return block, known, adjusted, posterior_of(adjusted), truth


@pytest.mark.parametrize("late_s", [0.017, -0.06, 0.2])
def test_geotags_of_another_instant_are_found_and_moved(late_s: float) -> None:
    block, known, adjusted, posterior, truth = _adjusted(_rings(), late_s, seed=3)
    assert posterior.late_sd_s[0] < 0.004
    assert abs(posterior.late_s[0] - late_s) < 2.5 * posterior.late_sd_s[0], "and the standard error is true"
    assert lateness(known, adjusted, posterior)[1].all()
    moved = in_time(known, known, adjusted, posterior)
    assert moved.late_s[0] == pytest.approx(late_s, abs=0.004)
    assert np.abs(np.median(moved.xyz - truth, axis=0)).max() < 0.02
    assert np.sqrt(np.mean((block.centres - truth) ** 2)) < 0.02, "the block is right with or without the move"


def test_the_time_of_good_geotags_is_none() -> None:
    _, known, adjusted, posterior, _ = _adjusted(_rings(), 0.0, seed=4)
    assert abs(posterior.late_s[0]) < 2.5 * posterior.late_sd_s[0]
    assert not lateness(known, adjusted, posterior)[1].any(), "so that clocks are believed"
    assert in_time(known, known, adjusted, posterior) is known


def test_what_was_moved_and_then_not_shown_is_taken_back() -> None:
    _, known, adjusted, posterior, _ = _adjusted(_rings(), 0.06, seed=8)
    moved = in_time(known, known, adjusted, posterior)
    assert moved is not known
    unsure = replace(posterior, late_s=-moved.late_s, late_sd_s=np.array([0.05]))
    back = settle_time(moved, known, adjusted, unsure)
    assert np.array_equal(back.xyz, known.xyz) and np.array_equal(back.sd, known.sd)
    assert not back.late_s.any() and not back.late_sd_s.any()


def test_a_flight_in_one_direction_does_not_tell_the_time() -> None:
    _, known, adjusted, posterior, _ = _adjusted(_one_way(), 0.2, seed=5)
    assert posterior.late_sd_s[0] * 6.0 > 0.1, "nor does it claim to"
    assert not lateness(known, adjusted, posterior)[1].any()
    assert in_time(known, known, adjusted, posterior) is known


def _contradicted(known: Known, block: Block, adjusted: Adjusted) -> tuple[Known, Adjusted]:
    for _ in range(3):
        found = as_photos_say(known, adjusted)
        if found is known:
            break
        known, adjusted = found, adjust(block, found, LENS, iterations=40, tolerance=LAST, final=True)
    return known, adjusted


def test_float_solutions_labelled_fixed_count_less() -> None:
    wrong = np.zeros((28, 3))
    wrong[[4, 5, 6, 20]] = [[0.25, 0.1, 0.1], [0.25, 0.12, 0.1], [0.24, 0.1, 0.12], [-0.1, 0.2, 0.3]]
    block, known, adjusted, _, truth = _adjusted(_rings(), 0.0, wrong, seed=6)
    before = np.linalg.norm(block.centres - truth, axis=1)
    known, adjusted = _contradicted(known, block, adjusted)
    assert np.flatnonzero(known.contradicted).tolist() == [4, 5, 6, 20]
    after = np.linalg.norm(block.centres - truth, axis=1)
    assert after[[4, 5, 6]].max() < 0.6 * before[[4, 5, 6]].max() and after.max() < 0.05
    off = np.linalg.norm(adjusted.off_geotags_m, axis=1)
    np.testing.assert_allclose(off[[4, 5, 6, 20]], np.linalg.norm(wrong[[4, 5, 6, 20]], axis=1), atol=0.06)


def test_good_geotags_are_not_contradicted() -> None:
    _, known, adjusted, _, _ = _adjusted(_rings(), 0.0, seed=7)
    assert as_photos_say(known, adjusted) is known


def test_a_flight_that_does_not_tell_the_time_takes_that_of_the_others() -> None:
    _, known, adjusted, posterior, _ = _adjusted(_rings(), 0.06, seed=9)
    flight = np.repeat([0, 1], 14)
    sensor = replace(adjusted.problem.sensor, flight=flight, drift=np.zeros(2))
    adjusted.problem.sensor = sensor
    two = replace(known, late_s=np.zeros(2), late_sd_s=np.full(2, 0.3))
    seen = replace(posterior, late_s=np.array([0.06, 0.02]), late_sd_s=np.array([0.003, 0.03]))
    late_s, told = lateness(two, adjusted, seen)
    assert told.tolist() == [True, False] and late_s[0] == 0.06 and late_s[1] == pytest.approx(0.06, abs=0.001)
    unshown = replace(seen, late_s=np.array([0.006, 0.02]))
    assert not lateness(two, adjusted, unshown)[0].any(), "what is not shown is no lateness"
