"""The grid of points against a search through all of them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from treedgs_geo.stems.cloud.propose.nearby import Nearby


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 400), st.floats(0.01, 30.0), st.floats(0.0, 4.0))
def test_the_same_as_looking_at_every_point(seed, n, size, reach):
    rng = np.random.default_rng(seed)
    points = rng.uniform([-size, 5.0, 0.0], [size, 5.0 + 2 * size, 4.0], (n, 3))
    at = rng.uniform([-size, 5.0], [size, 5.0 + 2 * size])
    near = np.hypot(*(points[:, :2] - at).T) <= reach
    band = (points[:, 2] > 1.0) & (points[:, 2] < 2.5)
    grid = Nearby(points)
    assert np.array_equal(grid.within(at, reach), np.flatnonzero(near))
    assert np.array_equal(grid.within(at, reach, 1.0, 2.5), np.flatnonzero(near & band))


def test_points_far_apart_open_the_cells_and_are_still_found():
    points = np.array([[0.0, 0.0, 1.0], [5e5, 4e5, 2.0]])
    grid = Nearby(points)
    assert grid.span.prod() <= 4_000_000
    assert grid.within(np.array([5e5, 4e5]), 0.1).tolist() == [1]
    assert grid.within(np.array([1e6, -1e6]), 3.0).tolist() == []
