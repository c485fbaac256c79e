"""Columns in another unit than their name says, found by their ratio to known values."""

from __future__ import annotations

import re

import numpy as np
import pytest

from treedgs_geo.core.wrong_units import wrong_unit


def _pairs(seed=0, n=20, noise=0.05):
    """Known diameters, cm, and others of the same trees."""
    rng = np.random.default_rng(seed)
    known = rng.normal(24, 7, n).clip(7, 50)
    return known, known * np.exp(rng.normal(0, noise, n))


@pytest.mark.parametrize(
    ("times", "says"),
    [
        (1 / 2.54, "0.39 times .* inches read as centimetres"),
        (2.54, "centimetres read as inches"),
        (10, "(10|9.9|9.8) times .* millimetres read as centimetres"),
        (0.1, "centimetres read as millimetres"),
        (0.01, "metres read as centimetres"),
        (1 / 30.48, "feet read as centimetres"),
        (np.pi, "3.1 times .* girths read as diameters"),
        (0.5, "radii read as diameters"),
    ],
)
@pytest.mark.parametrize("every", [1, 2, 4])
def test_a_column_or_a_part_of_it_in_another_unit_is_named(times, says, every):
    known, values = _pairs()
    values[::every] *= times
    found = wrong_unit(values, known)
    assert found is not None and found.whole == (every == 1) and found.rows.sum() == len(values[::every])
    assert pytest.approx(1 / times) == found.factor
    assert re.search(says, found.text())


def test_one_tenfold_value_is_named_and_one_double_is_another_tree():
    known, values = _pairs()
    values[3] *= 10
    found = wrong_unit(values, known)
    assert found is not None and np.flatnonzero(found.rows).tolist() == [3]
    values[3] /= 5
    assert wrong_unit(values, known) is None


def test_lengths_have_their_own_units():
    known = np.array([4.2, 6.1, 3.4, 7.7, 5.4])
    found = wrong_unit(known / 0.3048, known, lengths=True)
    assert found is not None and found.text("those of the map").endswith("as feet read as metres are")


def test_good_and_shuffled_tables_are_left_alone():
    """Shuffled values belong to other trees, which no unit mends."""
    flagged = 0
    for seed in range(300):
        known, values = _pairs(seed, noise=0.1)
        assert wrong_unit(values, known) is None
        assert wrong_unit(values * 1.2, known) is None
        flagged += wrong_unit(np.random.default_rng(seed).permutation(values), known) is not None
    assert flagged <= 3
    assert wrong_unit([np.nan], [3.0]) is None and wrong_unit([], []) is None
