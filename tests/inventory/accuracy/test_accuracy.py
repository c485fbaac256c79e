"""Scoring: pairs by position only, false trees counted, success beside the error."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest

from treedgs_geo.inventory.accuracy.scores import pair_by_position, score, score_against_truth


def test_pairs_are_one_to_one_within_the_gate():
    reference = np.array([[0.0, 0], [1, 0], [5, 5]])
    measured = np.array([[0.9, 0], [0.1, 0], [9, 9]])
    assert sorted(map(tuple, pair_by_position(reference, measured, 0.5))) == [(0, 1), (1, 0)]
    assert pair_by_position(reference, np.zeros((0, 2))).shape == (0, 2)


def test_score_figures():
    result = score(np.array([1.0, -1, 2, -2]), np.full(4, 20.0), 5)
    assert result.rmse_cm == pytest.approx(np.sqrt(2.5)) and result.success_rate == 0.8
    assert result.me_cm == 0 and result.rrmse_pct == pytest.approx(100 * np.sqrt(2.5) / 20)
    assert score(np.zeros(0), np.zeros(0), 5).rmse_cm is None


def test_truth_scoring_counts_refused_missed_and_false(tmp_path):
    truth = pd.DataFrame(
        {
            "tree_id": list("abc"),
            "kind": "normal",
            "in_plot": [True, True, False],
            "E_bh": [0.0, 5, 20],
            "N_bh": 0.0,
            "E_base": [0.0, 5, 20],
            "N_base": 0.0,
            "dbh_cm": [30.0, 20, 25],
            "n_unoccluded_bh_views": [5, 2, 9],
        }
    )
    truth.to_csv(tmp_path / "trees.csv", index=False)
    x = [0.1, 20.0, 12.0, 5.0]
    trees = gpd.GeoDataFrame(
        {
            "tree_id": [1, 2, 3, 4],
            "x": x,
            "y": 0.0,
            "dbh_cm": [31.0, 25, 15, np.nan],
            "dbh_se_cm": 0.5,
            "dbh_lo_cm": [29.0, 24, 14, np.nan],
            "dbh_hi_cm": [33.0, 26, 16, np.nan],
            "qc_flag": ["ok", "ok", "ok", "reject"],
            "qc_reason": ["", "", "", "few_views"],
        },
        geometry=gpd.points_from_xy(x, [0] * 4),
    )
    pooled, table = score_against_truth(trees, tmp_path / "trees.csv")
    assert (pooled.n_reference, pooled.n_measured, pooled.n_false) == (2, 1, 1)
    assert pooled.rmse_cm == pytest.approx(1.0) and pooled.coverage_90 == 1.0
    assert table["qc_flag"].tolist() == ["ok", "reject"]
    assert score_against_truth(trees, tmp_path / "trees.csv", min_clear_views=3)[0].success_rate == 1.0
