"""Leaves, ivy and moss on stems, and bark that is seen twice: the inner face measures, or the stem is flagged."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.cloud.estimate.rings import Inside, Rings, inner_face
from treedgs_geo.stems.cloud.estimate.stem import measure_points
from treedgs_geo.stems.cloud.propose.sensors import SENSORS
from treedgs_geo.stems.geometry.cone import Cone

DBH_CM = 30.0


def stem(rng, count=4000, noise_m=0.004, share=0.0, thick_m=(0.03, 0.08), side_deg=180.0):
    """(count, 3) bark, a share of it covered over so many degrees to both sides of east."""
    h, a = rng.uniform(0.2, 5.0, count), rng.uniform(-np.pi, np.pi, count)
    r = (DBH_CM - (h - 1.37)) / 200 + rng.normal(0, noise_m, count)
    covered = (rng.uniform(size=count) < share) & (np.abs(a) < np.radians(side_deg))
    r = r + covered * rng.uniform(*thick_m, count)
    return np.column_stack([r * np.cos(a), r * np.sin(a), h])


@pytest.mark.parametrize(
    ("share", "thick_m", "side_deg"),
    [(0.7, (0.03, 0.08), 180), (0.8, (0.01, 0.03), 180), (0.9, (0.02, 0.04), 180), (0.7, (0.03, 0.08), 90)],
)
def test_the_bark_that_shows_under_leaves_is_measured_and_flagged(share, thick_m, side_deg):
    points = stem(np.random.default_rng(1), share=share, thick_m=thick_m, side_deg=side_deg)
    found = measure_points(points, None, SENSORS["tls"]).assessment
    assert found.flag == "check" and "covered" in found.reasons
    assert abs(found.dbh_cm - DBH_CM) < min(0.6, 1.64 * found.se_cm)


def test_under_leaves_in_drone_lidar():
    points = stem(np.random.default_rng(2), 2400, 0.012, 0.7)
    found = measure_points(points, None, SENSORS["uls"].at_noise(0.035)).assessment
    assert found.flag != "ok" and (not found.measured or abs(found.dbh_cm - DBH_CM) < 1.64 * found.se_cm)


@pytest.mark.parametrize(("kind", "noise_m"), [("tls", 0.004), ("tls", 0.010), ("uls", 0.012), ("uls", 0.025)])
def test_a_clean_ring_has_no_second_one(kind, noise_m):
    points = stem(np.random.default_rng(3), 3000, noise_m)
    cone = Cone(0.0, 0.0, 0.0, 0.0, DBH_CM / 200, -0.005, 1.37, noise_m)
    assert Rings.of(points, cone, (0.9, 1.9)) == Rings()
    assert inner_face(points, cone, (0.9, 1.9), SENSORS[kind].floor_m) is None
    assert Inside.of(points, cone, (0.9, 1.9)).skew_se < 1.6
    found = measure_points(points, None, SENSORS[kind].at_noise(noise_m)).assessment
    assert found.flag == "ok" and abs(found.dbh_cm - DBH_CM) < 0.6


def test_leaves_that_hide_all_bark_leave_a_flat_ring():
    found = measure_points(stem(np.random.default_rng(4), share=1.0), None, SENSORS["tls"]).assessment
    assert found.flag != "ok" and "covered" in found.reasons


@pytest.mark.parametrize(("kind", "noise_m", "share"), [("uls", 0.012, 0.8), ("uls", 0.012, 0.9), ("tls", 0.004, 0.95)])
def test_bark_between_moss_is_seen_inside_what_was_fitted(kind, noise_m, share):
    points = stem(np.random.default_rng(6), 2400, noise_m, share, (0.02, 0.04))
    found = measure_points(points, None, SENSORS[kind])
    assert found.inside.skew_se > 2.5
    assert found.inside.depth_m == 0 or 0.02 < found.inside.depth_m < 0.045


def test_furrows_twigs_and_one_side_are_no_bark_between_moss():
    rng, cone = np.random.default_rng(7), Cone(0.0, 0.0, 0.0, 0.0, DBH_CM / 200, -0.005, 1.37, 0.005)
    clean = stem(rng)
    turn = np.arctan2(clean[:, 1], clean[:, 0])
    scale = np.ones((3, len(clean)))
    depth = 0.015 / np.hypot(clean[:, 0], clean[:, 1])
    scale[0] -= depth * np.clip(1 - np.abs((24 * turn / np.pi) % 1 - 0.5) * 4, 0, 1)
    scale[1] += 4 * depth * (rng.uniform(size=len(clean)) < 0.1) * rng.uniform(0, 1, len(clean))
    scale[2] -= 2 * depth * (np.abs(turn) < 0.4)
    for factor in scale:
        points = clean * np.column_stack([factor, factor, np.ones(len(clean))])
        assert Inside.of(points, cone, (0.9, 1.9)).skew_se < 1.6


def test_furrowed_bark_is_measured():
    rng = np.random.default_rng(8)
    points = stem(rng)
    turn = np.arctan2(points[:, 1], points[:, 0])
    deep = 0.02 * np.clip(1 - np.abs((12 * turn / np.pi) % 1 - 0.2) * 5, 0, 1)
    points[:, :2] *= (1 - deep / np.hypot(points[:, 0], points[:, 1]))[:, None]
    found = measure_points(points, None, SENSORS["tls"]).assessment
    assert found.measured and abs(found.dbh_cm - DBH_CM) < min(0.8, 1.64 * found.se_cm)


def test_two_sharp_rings_are_refused_as_two_dates():
    rng = np.random.default_rng(5)
    points = stem(rng, share=0.5, thick_m=(0.02, 0.0201))
    found = measure_points(points, None, SENSORS["tls"]).assessment
    assert found.flag == "reject" and "double" in found.reasons
