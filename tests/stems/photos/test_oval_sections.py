"""Oval sections: the radius is girth over 2 pi, from whatever directions the photos are."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.photos.fit.edge_adjustment import _damping, _solve
from treedgs_geo.stems.photos.fit.edge_points import gathered
from treedgs_geo.stems.photos.images.axis_patches import StemAxis, Strips


def oval_edges(direction: np.ndarray, oval: np.ndarray) -> tuple[Strips, np.ndarray]:
    """Edges of an oval stem of 0.15 m, with 2 mm of noise, in photos that look across ``direction`` (V,) radians."""
    normal = np.column_stack([np.cos(direction), np.sin(direction)])
    q = np.arange(-0.7, 2.0, 0.1)
    shown = 0.15 + oval[0] * np.cos(2 * direction) + oval[1] * np.sin(2 * direction)
    half = shown[:, None] - 0.005 * q
    place = np.stack([-half, half], axis=2)[..., None] + np.random.default_rng(2).normal(0, 0.002, (*half.shape, 2, 1))
    views, blocks = half.shape
    nothing = np.zeros((views, blocks, 3), np.float32)
    return Strips(
        np.zeros(3), q, nothing, np.zeros((*nothing.shape, 3)), normal, np.full(views, 0.02), np.ones(views)
    ), place


@pytest.mark.parametrize("directions_deg", [(0, 175), (10, 80)])
def test_the_radius_of_an_oval_stem_is_that_of_its_girth_from_any_side(directions_deg):
    axis = StemAxis(np.zeros(2), np.zeros(2), np.zeros(2), 0.0, 1.37)
    oval = np.array([0.006, -0.008])
    strips, place = oval_edges(np.radians(np.linspace(*directions_deg, 12)), oval)
    edges = gathered(strips, place, np.full(place.shape, 0.9), np.ones(12), 2.2)
    round_one, oval_one = (
        _solve(strips, edges, 0.15, -0.005, _damping(strips, axis, 0.3, 0.15, allowed), axis)[1]
        for allowed in (False, True)
    )
    one_sided = directions_deg[1] < 90
    assert abs(oval_one.r0 - 0.15) < (0.0025 if one_sided else 0.0004)
    assert oval_one.oval == pytest.approx(oval, abs=0.0025 if one_sided else 0.001)
    assert np.abs(round_one.oval).max() < 1e-6
    # Seen from one side only the round one reads what that side shows; and the oval one says that it is less sure.
    if one_sided:
        assert abs(round_one.r0 - 0.15) > 0.003
    assert oval_one.fit_sd_m > (1.5 if one_sided else 0.99) * round_one.fit_sd_m
