"""Drone LiDAR: the scanner's track told by its beams, rims that beams half hit, and what stands against the bark."""

from __future__ import annotations

import numpy as np
import pytest

import treedgs_geo as tg
from tests.synthetic_cloud import stem_points
from treedgs_geo.stems.cloud.estimate.passes import fit_passes
from treedgs_geo.stems.cloud.estimate.stem import measure_points
from treedgs_geo.stems.cloud.estimate.track import SensorTrack
from treedgs_geo.stems.cloud.propose.sensors import SENSORS
from treedgs_geo.stems.geometry.cone import Cone

STEMS = [(2.5, 2.5, 16.0), (9.0, 2.0, 22.0), (2.0, 9.0, 30.0), (9.0, 9.0, 40.0)]
#: Where the scanner is on each of four lines, m.
SCANNER = np.array([(30.0, 5.0, 50.0), (-20.0, 5.0, 50.0), (5.0, 30.0, 50.0), (5.0, -20.0, 50.0)])
BEAM_M = 0.02


def bark(rng, x, y, dbh_cm, scanner, count=90):
    """What beams of 4 cm return of a stem: the middle of the part that hits it, on the beam's own axis."""
    h = rng.uniform(0.1, 6.0, count)
    r = (dbh_cm - (h - 1.37)) / 200
    across = rng.uniform(-1, 1, count) * (r + BEAM_M)
    part = across[:, None] + BEAM_M * np.array([-0.9, -0.6, -0.3, 0.0, 0.3, 0.6, 0.9])
    hit = np.abs(part) < r[:, None]
    depth = np.where(hit, np.sqrt(np.maximum(r[:, None] ** 2 - part**2, 0)), 0).sum(axis=1) / np.maximum(hit.sum(1), 1)
    towards = scanner[:2] - [x, y]
    towards = towards / np.linalg.norm(towards)
    flat = depth[:, None] * towards + across[:, None] * np.array([-towards[1], towards[0]])
    points = np.column_stack([flat + [x, y], h]) + rng.normal(0, 0.003, (count, 3))
    return points[hit.any(axis=1)]


def flown(rng, lines=4):
    """A stand from some lines: bark, and beams with a return in the crowns and one on the ground."""
    parts = []
    for line, scanner in enumerate(SCANNER[:lines]):
        trunks = np.vstack([bark(rng, *stem, scanner) for stem in STEMS])
        ground = np.column_stack([rng.uniform(-1, 12, (6000, 2)), rng.normal(0, 0.01, 6000)])
        way = scanner - ground
        crown = ground + way * (rng.uniform(8, 14, 6000) / way[:, 2])[:, None]
        time = 1e5 + 60.0 * line + rng.uniform(0, 0.4, 6000)
        parts.append((np.vstack([trunks]), 1e5 + 60.0 * line + rng.uniform(0, 0.4, len(trunks)), np.ones(len(trunks))))
        parts.append((np.stack([crown, ground], 1).reshape(-1, 3), np.repeat(time, 2), np.tile([1, 2], 6000)))
    xyz, time, number = (np.concatenate([part[k] for part in parts]) for k in range(3))
    return tg.PointCloud(xyz, attributes={"gps_time": time, "return_number": number.astype(np.uint8)})


def errors_cm(cloud):
    table = tg.measure_cloud(cloud, source="uls")
    gap = [np.hypot(table["x"] - x, table["y"] - y) for x, y, _ in STEMS]
    assert max(each.min() for each in gap) < 0.1
    rows = table.iloc[[int(each.argmin()) for each in gap]]
    return rows["dbh_cm"].to_numpy(float) - [dbh for _, _, dbh in STEMS]


def test_the_beams_of_half_a_second_meet_at_the_scanner():
    cloud = flown(np.random.default_rng(1))
    track = SensorTrack.of(cloud.xyz, cloud.attributes)
    assert track is not None and len(track.time) == 4
    assert track.place == pytest.approx(SCANNER, abs=0.05)
    stem = np.flatnonzero(np.hypot(*(cloud.xyz[:, :2] - [2.5, 2.5]).T) < 0.1)[:1]
    towards = SCANNER[0, :2] - cloud.xyz[stem[0], :2]
    assert track.towards(stem)[0] == pytest.approx((towards[0] + 1j * towards[1]) / np.hypot(*towards), abs=0.01)


def test_without_times_there_is_no_track():
    cloud = flown(np.random.default_rng(1))
    assert SensorTrack.of(cloud.xyz, {"return_number": cloud.attributes["return_number"]}) is None


def test_pulses_of_one_time_are_told_apart_by_their_returns():
    cloud = flown(np.random.default_rng(1))
    coarse = {**cloud.attributes, "gps_time": np.round(cloud.attributes["gps_time"], 2)}
    track = SensorTrack.of(cloud.xyz, coarse)
    assert track is not None and track.place == pytest.approx(SCANNER, abs=0.05)
    assert SensorTrack.of(cloud.xyz, {"gps_time": coarse["gps_time"]}) is None


def test_half_hit_rims_do_not_make_stems_thick():
    known, unknown = [], []
    for seed in range(3):
        cloud = flown(np.random.default_rng(seed), lines=3)
        known.append(errors_cm(cloud))
        unknown.append(
            errors_cm(tg.PointCloud(cloud.xyz, attributes={"gps_time": np.floor(cloud.attributes["gps_time"])}))
        )
    assert np.mean(unknown) > 0.8
    assert abs(np.mean(known)) < 0.2 and np.abs(known).max() < 0.4


@pytest.mark.parametrize(("taper_cm_m", "flag"), [(1.0, "ok"), (0.0, "check"), (2.8, "check")])
def test_poles_and_cones_that_narrow_too_fast_are_flagged(taper_cm_m, flag):
    points = stem_points(np.random.default_rng(2), 24.0, 300, 0.004, taper_cm_m=taper_cm_m)
    measured = measure_points(points, None, SENSORS["uls"]).assessment
    assert measured.flag == flag and ("no_taper" in measured.reasons) == (flag == "check")
    assert measured.dbh_cm == pytest.approx(24.0, abs=1.6 * measured.se_cm)


def test_leaves_on_one_side_are_flagged_and_the_interval_holds():
    rng = np.random.default_rng(4)
    points = stem_points(rng, 28.0, 500, 0.010)
    side = (points[:, 0] > 0) & (rng.uniform(size=500) < 0.7)
    away = points[side, :2] / np.hypot(*points[side, :2].T)[:, None]
    points[side, :2] += away * rng.uniform(0.03, 0.08, (side.sum(), 1))
    measured = measure_points(points, None, SENSORS["uls"]).assessment
    assert measured.flag != "ok" and "covered" in measured.reasons
    if measured.measured:
        assert abs(measured.dbh_cm - 28.0) < 1.645 * measured.se_cm


def test_a_stem_that_shows_rims_alone_moves_no_flight_line():
    points = bark(np.random.default_rng(5), 0.0, 0.0, 30.0, SCANNER[0])
    label = np.arange(len(points)) % 2
    cone = Cone(0.0, 0.0, 0.0, 0.0, 0.15, -0.005, 1.37, 0.01)
    behind = -np.exp(1j * cone.azimuths(points))
    fit = fit_passes(points, label, label, cone, 1.37, 0.007, behind)
    assert fit.dates_cm == 0 and np.abs(fit.shift).max() < 1e-9
