"""Accuracy of measured trees against known ones: errors always beside the success rate, on the same trees."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ...core.errors import InputError

#: A measured tree within this distance of a true one may be it, m.
MATCH_M = 0.5


@dataclass(frozen=True)
class Accuracy:
    """Pooled accuracy. Errors are measured - reference, cm; rates 0..1; None where nothing was measured."""

    n_reference: int
    n_measured: int
    success_rate: float
    rmse_cm: float | None
    rrmse_pct: float | None
    mae_cm: float | None
    me_cm: float | None
    max_abs_cm: float | None
    n_false: int
    coverage_90: float | None

    def figures(self) -> dict:
        """The names of ``metrics.json``, rounded: ``n`` is the number of trees behind every error figure."""
        found = {"n": self.n_measured, **asdict(self)}
        del found["n_measured"]
        return {name: round(value, 4) if isinstance(value, float) else value for name, value in found.items()}


def pair_by_position(reference_xy: np.ndarray, measured_xy: np.ndarray, gate_m: float = MATCH_M) -> np.ndarray:
    """One-to-one pairs within ``gate_m`` minimising the summed distance (diameters are never used).

    Returns:
        (K, 2) int: indices into reference and measured.
    """
    if len(reference_xy) == 0 or len(measured_xy) == 0:
        return np.zeros((0, 2), int)
    distance = cdist(reference_xy, measured_xy)
    # A dummy cost above the gate lets a tree stay single instead of pushing its neighbour out of a good pair.
    cost = np.where(distance <= gate_m, distance, 10 * gate_m)
    rows, columns = linear_sum_assignment(cost)
    good = distance[rows, columns] <= gate_m
    return np.column_stack([rows[good], columns[good]])


def score(
    errors_cm: np.ndarray,
    reference_dbh_cm: np.ndarray,
    n_reference: int,
    n_false: int = 0,
    inside: np.ndarray | None = None,
) -> Accuracy:
    """Accuracy from the errors (K,) of the measured trees and the reference DBHs (K,) of the same trees."""
    errors = np.asarray(errors_cm, float)
    n = len(errors)
    if n == 0:
        return Accuracy(n_reference, 0, 0.0, None, None, None, None, None, n_false, None)
    rmse = float(np.sqrt(np.mean(errors**2)))
    return Accuracy(
        n_reference=n_reference,
        n_measured=n,
        success_rate=n / n_reference,
        rmse_cm=rmse,
        rrmse_pct=100 * rmse / float(np.mean(reference_dbh_cm)),
        mae_cm=float(np.mean(np.abs(errors))),
        me_cm=float(np.mean(errors)),
        max_abs_cm=float(np.max(np.abs(errors))),
        n_false=n_false,
        coverage_90=None if inside is None else float(np.mean(inside)),
    )


def accuracy_of(trees: pd.DataFrame, n_false: int = 0) -> Accuracy:
    """Accuracy of the rows of ``tables.PairsEvidence.trees``."""
    done = trees[trees["error_cm"].notna()]
    with_interval = done["inside_90"].notna()
    inside = done.loc[with_interval, "inside_90"].to_numpy(bool) if with_interval.any() else None
    return score(done["error_cm"].to_numpy(float), done["reference_cm"].to_numpy(float), len(trees), n_false, inside)


def score_against_truth(
    trees: gpd.GeoDataFrame, truth_csv: Path, min_clear_views: int = 0, gate_m: float = 0.5
) -> tuple[Accuracy, pd.DataFrame]:
    """Score a tree layer against a simulated or rendered plot's ``truth/trees.csv``.

    Reference: in-plot stems with at least ``min_clear_views`` unoccluded breast-height views. False: a tree with a DBH
    that is near no true stem or sapling (in or out of the plot, at its base or at breast height).

    Returns:
        the pooled accuracy and one row per reference stem (``tree_id`` of the truth, ``layer_id``: the layer's or None,
        ``dbh_true_cm, dbh_cm, error_cm, qc_flag, …``).
    """
    truth = pd.read_csv(truth_csv)
    for column in ("E_bh", "N_bh", "dbh_cm", "in_plot", "n_unoccluded_bh_views"):
        if column not in truth:
            raise InputError(f"{truth_csv}: lacks the column {column!r}; give the truth table of a simulated plot.")
    true_xy, found_xy = truth[["E_bh", "N_bh"]].to_numpy(float), trees[["x", "y"]].to_numpy(float)
    measured = trees["dbh_cm"].notna().to_numpy()
    anywhere = np.vstack([true_xy, truth[["E_base", "N_base"]].to_numpy(float), _saplings(truth_csv)])
    n_false = int((cdist(found_xy[measured], anywhere).min(axis=1) > gate_m).sum()) if measured.any() else 0
    # Of each stem the tree that was seen there: one with a DBH, where there is one.
    seen, own = np.full(len(truth), -1), np.full(len(truth), -1)
    for at, rows in ((seen, np.arange(len(trees))), (own, np.flatnonzero(measured))):
        stems, partners = pair_by_position(true_xy, found_xy[rows], gate_m).T
        at[stems] = rows[partners]
    seen = np.where(own >= 0, own, seen)
    wanted = truth["in_plot"].astype(str).str.lower().eq("true") & (truth["n_unoccluded_bh_views"] >= min_clear_views)
    stems, seen, own = truth[wanted], seen[wanted], own[wanted] >= 0
    there = pd.DataFrame(trees).assign(meas_cm=trees.get("meas_cm", trees["dbh_cm"])).reset_index(drop=True)
    there = there.reindex(seen).set_index(stems.index)
    diameters = there[["dbh_cm", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm"]].astype(float)
    diameters.loc[~own] = np.nan
    true_cm = stems["dbh_cm"]
    inside = (diameters["dbh_lo_cm"] <= true_cm) & (true_cm <= diameters["dbh_hi_cm"])
    table = pd.DataFrame(
        {
            "tree_id": stems["tree_id"],
            "layer_id": there["tree_id"],
            "kind": stems.get("kind"),
            "clear_views": stems["n_unoccluded_bh_views"],
            "dbh_true_cm": true_cm,
            **diameters,
            "meas_cm": there["meas_cm"],
            "rev_flag": there.get("rev_flag"),
            "error_cm": diameters["dbh_cm"] - true_cm,
            "inside_90": inside.astype(object).where(own, None),
            "qc_flag": there["qc_flag"].mask(seen < 0, "not found"),
            "qc_reason": there["qc_reason"].mask(seen < 0, ""),
        }
    ).reset_index(drop=True)
    return accuracy_of(table.rename(columns={"dbh_true_cm": "reference_cm"}), n_false), table


def _saplings(truth_csv: Path) -> np.ndarray:
    """(K, 2) saplings of a simulated plot, which are not in the tree table: a DBH there is no invention."""
    stems = Path(truth_csv).with_name("stems.json")
    if not stems.exists():
        return np.zeros((0, 2))
    record = json.loads(stems.read_text(encoding="utf-8"))
    local = np.array([row[:2] for row in record.get("saplings_xy_dbhcm", [])], float).reshape(-1, 2)
    return local + np.asarray(record["origin"][:2], float)
