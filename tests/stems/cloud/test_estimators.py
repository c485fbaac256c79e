"""Properties of the estimators: bias limits on arcs, shells and discs, noise and clutter; invariances; odd sections."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_cloud import stem_points

from treedgs_geo.stems.cloud.estimate.stem import measure_points
from treedgs_geo.stems.cloud.estimate.track import SensorTrack
from treedgs_geo.stems.cloud.propose.sensors import SENSORS
from treedgs_geo.stems.geometry.circles import SolidCircle, fit_circle, fit_solid_circles
from treedgs_geo.stems.geometry.ellipse import fit_ellipse
from treedgs_geo.stems.geometry.taper import taper_line

R = 0.125


def section(rng, count=200, noise=0.01, arc_deg=360.0, clutter=0.0, filled=0.0, r=R):
    """Points of a section: ``filled`` = share that lies anywhere in the disc, ``clutter`` = share of stray points."""
    angle = rng.uniform(0, np.radians(arc_deg), count)
    radius = np.where(rng.uniform(size=count) < filled, r * np.sqrt(rng.uniform(0, 1, count)), r)
    points = np.column_stack([np.cos(angle), np.sin(angle)]) * (radius + rng.normal(0, noise, count))[:, None]
    stray = rng.uniform(-3 * r, 3 * r, (4 * count, 2))
    stray = stray[np.hypot(*stray.T) > r][: int(round(clutter * count))]
    return np.vstack([points, stray])


# Limits in cm of diameter (R 12.5 cm), without clutter and with half as many stray points as bark. Half an arc in
# noise of a quarter of the radius and clutter is beyond a single slice: the last limits say so.
@pytest.mark.parametrize(
    "noise, arc, clutter, limit",
    [
        (0.0, 360, 0.0, 0.02),
        (0.0, 180, 0.0, 0.02),
        (0.01, 360, 0.0, 0.25),
        (0.01, 180, 0.0, 0.5),
        (0.02, 360, 0.0, 0.5),
        (0.02, 180, 0.0, 1.0),
        (0.03, 360, 0.0, 0.8),
        (0.03, 180, 0.0, 2.5),
        (0.0, 360, 0.5, 0.05),
        (0.0, 180, 0.5, 0.05),
        (0.01, 360, 0.5, 0.3),
        (0.01, 180, 0.5, 0.6),
        (0.02, 360, 0.5, 0.8),
        (0.02, 180, 0.5, 3.0),
        (0.03, 360, 0.5, 1.5),
        (0.03, 180, 0.5, 8.0),
    ],
)
def test_rings_on_shells(noise, arc, clutter, limit):
    fits = [
        fit_circle(section(np.random.default_rng(s), 200, noise, arc, clutter), noise_m=max(noise, 0.004))
        for s in range(30)
    ]
    error = np.array([200 * (fit.r - R) for fit in fits])
    assert abs(np.median(error)) < limit


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.02, 0.03])
@pytest.mark.parametrize(
    "filled, power, low, high",
    [
        # A disc at p = 1 is what the published score is made for; on shells it reads wide, the wider the noisier.
        (1.0, 1.0, -2.5, 1.5),
        (0.0, 1.0, -0.5, 9.5),
        (0.5, 1.0, -0.5, 8.0),
    ],
)
def test_solid_circles_on_discs_and_shells(noise, filled, power, low, high):
    slices = [section(np.random.default_rng(s), 300, noise, filled=filled) for s in range(20)]
    circles = fit_solid_circles(slices, [np.ones(len(p)) for p in slices], SolidCircle(power=power), seed=1)
    bias = float(np.median(200 * (circles[:, 2] - R)))
    assert low <= bias <= high
    if filled == 0.0 and noise >= 0.01:
        assert bias > 1.5  # the known bias is there: nobody may take this for an unbiased method


@settings(max_examples=15, deadline=None)
@given(st.floats(-5e6, 5e6), st.floats(0, 2 * np.pi), st.floats(0.4, 2.0), st.integers(0, 1000))
def test_rings_move_turn_scale_and_reorder(shift, turn, factor, seed):
    rng = np.random.default_rng(seed)
    points = section(rng, 120, 0.005, 300)
    base = fit_circle(points, noise_m=0.005)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = factor * points[rng.permutation(len(points))] @ rotation.T + (shift, -shift)
    other = fit_circle(moved, noise_m=0.005 * factor)
    assert other.r == pytest.approx(factor * base.r, abs=1e-3)
    np.testing.assert_allclose([other.x, other.y], factor * rotation @ (base.x, base.y) + (shift, -shift), atol=2e-3)


def test_solid_circles_do_not_depend_on_place_and_count_single_precision_well():
    points = [section(np.random.default_rng(s), 400, 0.01, filled=1.0) for s in range(6)]
    weights = [np.random.default_rng(s).uniform(0.1, 1, len(p)) for s, p in enumerate(points)]
    here = fit_solid_circles(points, weights, SolidCircle(), seed=3)
    there = fit_solid_circles([p + (611300.0, 3718400.0) for p in points], weights, SolidCircle(), seed=3)
    np.testing.assert_allclose(there[:, 2], here[:, 2], atol=1e-6)
    # Weights only matter relatively.
    scaled = fit_solid_circles(points, [1e-3 * w for w in weights], SolidCircle(), seed=3)
    np.testing.assert_allclose(scaled, here, atol=1e-9)


@pytest.mark.parametrize("ratio", [1.0, 0.95, 0.88, 0.75])
def test_ellipses_are_distinguished_from_circles(ratio):
    gain, error = [], []
    a, b = 0.15, 0.15 * ratio
    h = ((a - b) / (a + b)) ** 2
    girth = (a + b) * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))
    for seed in range(12):
        rng = np.random.default_rng(seed)
        t = rng.uniform(0, 2 * np.pi, 240)
        points = np.column_stack([a * np.cos(t), b * np.sin(t)]) + rng.normal(0, 0.006, (240, 2))
        turn = np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]])
        fitted = fit_ellipse(points @ turn.T + (400.0, -90.0), noise_m=0.006)
        gain.append(fitted.gain > 0)
        error.append(100 * (fitted.girth_d - girth))
        if ratio < 0.9:
            assert fitted.turn == pytest.approx(0.6, abs=0.15) and fitted.b / fitted.a == pytest.approx(ratio, abs=0.03)
    assert np.mean(gain) == (0.0 if ratio == 1.0 else pytest.approx(1.0, abs=0.2))
    assert abs(np.mean(error)) < 0.1
    assert fit_ellipse(section(np.random.default_rng(0), 100, 0.004, 150)) is None
    assert fit_ellipse(np.zeros((20, 2))) is None


def test_butt_swell_is_chosen_where_it_is():
    rng = np.random.default_rng(0)
    h = np.arange(0.3, 4.3, 0.1)
    plain = 28 - 1.0 * (h - 1.37)
    swollen = plain + 20 * (np.exp(-h / 0.3) - np.exp(-1.37 / 0.3))
    noise, se = rng.normal(0, 0.25, len(h)), np.full(len(h), 0.25)
    butt = taper_line(h, swollen + noise, se, 1.37)
    assert butt.model == "butt" and butt.butt_cm == pytest.approx(20, abs=6)
    assert butt.at_bh_cm == pytest.approx(28, abs=0.3) and butt.slope_cm_m == pytest.approx(-1, abs=0.3)
    assert taper_line(h, plain + noise, se, 1.37).model in ("linear", "constant")
    # Without slices near the ground there is no swell to be seen, whatever they say.
    high = h > 1.0
    assert taper_line(h[high], (swollen + noise)[high], se[high], 1.37).model != "butt"


def test_a_swollen_foot_does_not_reach_the_dbh():
    errors = []
    for seed in range(6):
        points = stem_points(np.random.default_rng(seed), 25.0, 1500, 0.008)
        swell = 0.12 * np.exp(-points[:, 2] / 0.3)
        angle = np.arctan2(points[:, 1], points[:, 0])
        points[:, :2] += swell[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        found = measure_points(points, None, SENSORS["uls"])
        errors.append(found.assessment.dbh_cm - 25.0)
    assert np.abs(errors).max() < 0.9


@pytest.mark.parametrize("lean_deg", [10, 20])
@pytest.mark.parametrize("sweep", [0.0, 0.012])
def test_leaning_and_sweeping_stems(lean_deg, sweep):
    """DBH is across the axis, whatever the lean; sweep as strong as a bend of 5 cm over the lower 3 m."""
    errors = []
    for seed in range(6):
        points = stem_points(np.random.default_rng(seed), 25.0, 1200, 0.008, lean=(np.tan(np.radians(lean_deg)), 0.0))
        points[:, 1] += 0.5 * sweep * (points[:, 2] - 1.37) ** 2
        found = measure_points(points, None, SENSORS["uls"])
        assert found.assessment.measured, found.assessment.reasons
        errors.append(found.assessment.dbh_cm - 25.0)
        assert found.cone.lean_deg == pytest.approx(lean_deg, abs=2.0)
    assert abs(np.mean(errors)) < 0.4 and np.abs(errors).max() < 0.9


def flight(rng, count=6000, height=60.0):
    """Pulses with two returns from a scanner on a straight line, and where it was."""
    time = np.sort(rng.uniform(0, 12, count))
    place = np.column_stack([5 * time - 30, 0.3 * np.sin(time), np.full(count, height)])
    target = place + np.column_stack([rng.normal(0, 4, count), rng.uniform(-25, 25, count), np.full(count, -height)])
    ray = target - place
    share = rng.uniform(0.75, 0.95, count)[:, None]
    return time, place, np.vstack([place + share * ray, target]), np.r_[time, time]


def test_the_scanner_is_found_from_its_pulses():
    rng = np.random.default_rng(0)
    _, _, points, stamp = flight(rng)
    points = points + rng.normal(0, 0.01, points.shape) + (5e5, 4e6, 100.0)
    track = SensorTrack.of(points, {"gps_time": stamp})
    assert track is not None
    times, places = track.time, track.place
    true = np.column_stack([5 * times - 30, 0.3 * np.sin(times), np.full(len(times), 60.0)]) + (5e5, 4e6, 100.0)
    assert len(times) >= 20 and np.abs(places - true).max() < 0.7
