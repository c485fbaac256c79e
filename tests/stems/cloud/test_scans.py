"""Scans and flight lines that do not fit together, and two dates in one cloud: moved together, widened or refused."""

from __future__ import annotations

import numpy as np
import pytest

import treedgs_geo as tg
from treedgs_geo.core.progress import Reporter
from treedgs_geo.stems.cloud.estimate.passes import Passes, dates_apart_cm, file_cuts
from treedgs_geo.stems.geometry.cone import Cone

STEMS = [(2.5, 2.5, 14.0), (9.0, 2.0, 22.0), (2.0, 9.0, 30.0), (9.0, 9.0, 40.0)]
SCANNERS = [(5.7, 5.2), (-1.0, -1.0), (13.0, -1.0), (-1.0, 13.0), (13.0, 13.0)]


def bark(rng, x, y, dbh_cm, seen_from=None, count=1500, noise_m=0.004, oval=0.0):
    h = rng.uniform(0.1, 5.0, count)
    a = rng.uniform(-np.pi, np.pi, count)
    if seen_from is not None:
        a = np.arctan2(seen_from[1] - y, seen_from[0] - x) + np.radians(rng.uniform(-80, 80, count))
    r = (dbh_cm - (h - 1.37)) / 200 * (1 + oval * np.cos(2 * a)) + rng.normal(0, noise_m, count)
    return np.column_stack([x + r * np.cos(a), y + r * np.sin(a), h])


def scan(rng, seen_from=None, thicker_cm=0.0, **kind):
    """One scan of the stand: ground, then stem by stem."""
    ground = np.column_stack([rng.uniform(-1, 12, (12000, 2)), rng.normal(0, 0.01, 12000)])
    return np.vstack([ground, *(bark(rng, x, y, d + thicker_cm, seen_from, **kind) for x, y, d in STEMS)])


def joined(rng, scans, by, shifts=None):
    """The scans as one cloud; ``by``: what tells them apart (the file's order always goes, but for ``order``)."""
    number = np.repeat(np.arange(len(scans)), [len(part) for part in scans])
    xyz = np.vstack(scans)
    if shifts is not None:
        xyz[:, :2] += shifts[number]
    attributes = {
        "order": {},
        "gps_time": {"gps_time": 1e8 + 300.0 * number + rng.uniform(0, 20, len(xyz))},
        "point_source_id": {"point_source_id": (number + 7).astype(np.uint16)},
        "none": {},
    }[by]
    cloud = tg.PointCloud(xyz, attributes=attributes)
    return cloud if by == "order" else cloud.select(rng.permutation(len(xyz)))


def measured(cloud, reporter=None):
    """The stems' rows in the order of :data:`STEMS`."""
    table = tg.measure_cloud(cloud, reporter=reporter)
    gap = [np.hypot(table["x"] - x, table["y"] - y) for x, y, _ in STEMS]
    assert len(table) == len(STEMS) and max(each.min() for each in gap) < 0.1
    return table.iloc[[int(each.argmin()) for each in gap]]


@pytest.mark.parametrize("by", ["order", "gps_time", "point_source_id"])
@pytest.mark.parametrize("off_m", [0.02, 0.05])
def test_scans_beside_one_another_are_moved_together(by, off_m):
    rng = np.random.default_rng(3)
    away = rng.normal(0, 1, (5, 2))
    cloud = joined(rng, [scan(rng, s) for s in SCANNERS], by, off_m * away / np.hypot(*away.T)[:, None])
    lines: list[str] = []
    reporter = Reporter()
    reporter.warn = lines.append
    reporter.info = lines.append
    table = measured(cloud, reporter)
    assert (table["qc_flag"] == "ok").all()
    np.testing.assert_allclose(table["dbh_cm"], [d for *_, d in STEMS], atol=0.4)
    assert any("do not fit together: 5 were moved" in line for line in lines)


@pytest.mark.parametrize("sign", [-1, 1])
def test_two_opposite_scans_apart_or_towards_each_other(sign):
    rng = np.random.default_rng(4)
    shift = sign * 0.02 * np.array([[-1.0, -1.0], [1.0, 1.0]])
    table = measured(joined(rng, [scan(rng, SCANNERS[1]), scan(rng, SCANNERS[4])], "gps_time", shift))
    np.testing.assert_allclose(table["dbh_cm"], [d for *_, d in STEMS], atol=0.8)


def test_oval_stems_in_scans_that_fit_stay_as_they_are():
    rng = np.random.default_rng(5)
    table = measured(joined(rng, [scan(rng, s, oval=0.05) for s in SCANNERS], "gps_time"))
    np.testing.assert_allclose(table["dbh_cm"], [d for *_, d in STEMS], atol=0.4)


@pytest.mark.parametrize("by", ["order", "gps_time", "point_source_id"])
def test_two_dates_in_one_cloud_are_refused_by_name(by):
    rng = np.random.default_rng(6)
    scans = [scan(rng, thicker_cm=grown, count=500, noise_m=0.012) for grown in (0, 0, 4, 4)]
    table = measured(joined(rng, scans, by))
    assert (table["qc_flag"] == "reject").all() and table["qc_reason"].str.contains("double").all()


def test_growth_is_told_from_a_shift_and_from_an_oval_section():
    rng = np.random.default_rng(7)
    cone = Cone(0.0, 0.0, 0.0, 0.0, 0.15, -0.005, 1.37)
    label = np.repeat([0, 1], 1500)
    first = bark(rng, 0, 0, 30.0)
    assert dates_apart_cm(np.vstack([first, bark(rng, 0, 0, 33.0)]), label, cone) == pytest.approx(3.0, abs=0.2)
    assert dates_apart_cm(np.vstack([first, bark(rng, 0, 0, 30.0) + [0.03, 0, 0]]), label, cone) < 0.2
    sides = [bark(rng, 0, 0, 30.0, side, oval=0.06) for side in ((9, 0), (0, 9))]
    assert dates_apart_cm(np.vstack(sides), label, cone) == 0


def test_the_files_order_tells_scans_only_where_each_stem_is_visited_anew():
    one, two = np.arange(100, 200), np.arange(300, 400)
    assert file_cuts([np.r_[one, one + 5000], np.r_[two, two + 5000]], 10000).tolist() == [5100]
    assert not len(file_cuts([one, two], 10000))  # sorted by place
    assert not len(file_cuts([np.r_[one, one + 5000], np.arange(150, 5300, 10)], 10000))  # one of them all along
    labels = Passes({"gps_time": np.r_[0.0, 0.1, 50.0, 50.1]}, 4, []).of(np.array([3, 2, 1, 0]))
    assert labels.tolist() == [1, 1, 0, 0]
