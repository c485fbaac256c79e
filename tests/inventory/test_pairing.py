"""Co-registration and assignment on simulated plots, and on a real one."""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulated_tallies import paired, simulate
from treedgs_geo.inventory.options import PairingOptions
from treedgs_geo.inventory.pairing import assign, fit_rigid, move, register


def test_move_turns_as_bearings_do():
    assert move(np.array([[0.0, 1.0]]), np.array([5.0, 0.0]), 90.0)[0] == pytest.approx([6.0, 0.0])


def test_fit_rigid_inverts_move():
    xy = np.random.default_rng(0).uniform(-10, 10, (8, 2))
    offset, turn = fit_rigid(xy, move(xy, np.array([1.5, -2.0]), 7.0))
    assert offset == pytest.approx([1.5, -2.0]) and turn == pytest.approx(7.0)


def test_pairs_are_right_and_doubtful_plots_are_left():
    """The issue's case on 60 plots: at least 95 % of the pairs right, no plot paired on a wrong placing."""
    found = paired(60, 90000)
    assert found["right"] >= 0.98 * found["made"] and found["on_a_wrong_placing"] == 0
    assert found["right"] >= 0.85 * found["pairable"] and found["to_hand_check"] <= 12


def test_half_of_the_trees_missed():
    found = paired(18, 91000, missed=0.5)
    assert found["made"] and found["right"] >= 0.95 * found["made"]


def test_another_stand_is_never_paired():
    """The tally of one plot against the map of another: nothing fits, and that is what is said."""
    for seed in range(12):
        tally, other = simulate(seed, "random", 2.0), simulate(seed + 500, "random", 2.0)
        assert register(tally.field, other.measured, PairingOptions()).status == "check"


def test_a_perfect_lattice_is_left_to_a_person():
    i, j = np.meshgrid(np.arange(-12.0, 13, 3), np.arange(-12.0, 13, 3))
    measured = np.column_stack([i.ravel(), j.ravel()])
    field = measured[np.hypot(*measured.T) < 7]
    placed = register(field, measured, PairingOptions())
    assert placed.status == "check" and "another placing" in placed.reason
    # Where the centre is known to decimetres it is clear.
    assert register(field, measured, PairingOptions(centre_error_m=0.3)).status == "auto"


def test_anchors_place_a_plot_that_repeats_itself():
    i, j = np.meshgrid(np.arange(-12.0, 13, 3), np.arange(-12.0, 13, 3))
    measured = np.column_stack([i.ravel(), j.ravel()])
    field = measured[np.hypot(*measured.T) < 7] + 0.05
    a, b = (int(np.argmin(np.hypot(*(measured - field[k] - [3.0, 0.0]).T))) for k in (0, 5))
    placed = register(field, measured, PairingOptions(), np.array([[0, a], [5, b]]))
    assert placed.status == "ok" and placed.offset_m == pytest.approx([2.95, -0.05], abs=0.1)


@pytest.mark.parametrize(("n", "m"), [(0, 5), (5, 0), (2, 5), (5, 1)])
def test_too_few_trees_are_left_to_a_person(n, m):
    rng = np.random.default_rng(1)
    placed = register(rng.uniform(-5, 5, (n, 2)), rng.uniform(-5, 5, (m, 2)), PairingOptions())
    assert placed.status == "check" and placed.reason


def test_two_stems_at_one_place_are_not_guessed():
    field = np.array([[0.0, 0.0], [6.0, 0.0], [0.0, 6.0], [-5.0, 2.0]])
    measured = np.vstack([field, [0.0, 0.05]])
    pairs = assign(field, measured, 0.2, 1.5)
    margin = dict(zip(pairs.index[:, 0].tolist(), pairs.margin, strict=True))
    assert margin[0] < 1 and min(margin[1], margin[2], margin[3]) > 3


def test_assignment_is_one_to_one_and_within_the_gate():
    rng = np.random.default_rng(2)
    field, measured = rng.uniform(-8, 8, (40, 2)), rng.uniform(-8, 8, (30, 2))
    pairs = assign(field, measured, 0.4, 1.0)
    assert len(set(pairs.index[:, 0])) == len(pairs.index) == len(set(pairs.index[:, 1]))
    assert (pairs.distance_m <= 1.0).all() and (pairs.margin >= -1e-9).all()
    assert assign(field, np.zeros((0, 2)), 0.4, 1.0).index.shape == (0, 2)


def test_the_same_input_gives_the_same_pairs():
    scene = simulate(3, "random", 2.0)
    first, second = (register(scene.field, scene.measured, PairingOptions()) for _ in range(2))
    assert first.offset_m.tolist() == second.offset_m.tolist() and first.ratio == second.ratio
