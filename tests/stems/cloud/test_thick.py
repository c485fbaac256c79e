"""Stems thicker than usual: measured where they are allowed, listed with the reason where they are not."""

from __future__ import annotations

import numpy as np
import pytest

import treedgs_geo as tg

THICK = [(6.0, 6.0, 60.0), (14.0, 6.0, 130.0), (6.0, 15.0, 220.0), (16.0, 16.0, 340.0)]


@pytest.fixture(scope="module")
def cloud():
    rng = np.random.default_rng(1)
    parts = [np.column_stack([rng.uniform(0, 22, (40000, 2)), rng.normal(0, 0.01, 40000)])]
    for x, y, dbh in THICK:
        h, a = rng.uniform(0.05, 7, 9000), rng.uniform(-np.pi, np.pi, 9000)
        r = (dbh - (h - 1.37)) / 200 + rng.normal(0, 0.005, 9000)
        parts[0] = parts[0][np.hypot(*(parts[0][:, :2] - (x, y)).T) > dbh / 200]
        parts.append(np.column_stack([x + r * np.cos(a), y + r * np.sin(a), h]))
    return tg.PointCloud(np.vstack(parts))


def test_stems_up_to_the_setting_are_measured(cloud):
    table = tg.measure_cloud(cloud, max_dbh_cm=400.0).sort_values("dbh_cm")
    np.testing.assert_allclose(table["dbh_cm"], [d for *_, d in THICK], rtol=0.01)
    assert (table["qc_flag"] == "ok").all()


def test_thicker_ones_are_listed_with_the_reason(cloud):
    table = tg.measure_cloud(cloud)
    assert (table["qc_flag"] == "ok").sum() == 1
    assert (table["qc_reason"] == "too_large").sum() >= 2
