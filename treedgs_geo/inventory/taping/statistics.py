"""What the tapes say of the measured diameters: bias, RMSE, intervals, flags, outliers, totals."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from ...core.errors import InputError
from ...core.intervals import LEVEL
from ...core.shown import count_of, some
from ..double_sampling.estimators import (
    ESTIMATORS,
    Corrected,
    Tapes,
    correct_total,
    more_tapes_to_halve,
    share_out,
    t_factor,
)
from ..double_sampling.other_trees import outlier_sentences, outliers
from ..double_sampling.tapes import Taped
from ..stand.values import BA
from .frame import Frame

#: Below this probability a difference of ``ok`` and ``check`` trees is more than chance.
CHANCE = 0.1


@dataclass
class Checked:
    """trees: one row a drawn tree (``tree_id, plot_id, qc_flag, dbh_cm, dbh_lo_cm, dbh_hi_cm, taped_cm, error_cm,
    inside, state, outlier, note, x, y``). figures: what ``summary.json`` holds. totals: quantity and estimator ->
    corrected total. warnings, notes: sentences."""

    trees: pd.DataFrame
    figures: dict[str, Any]
    totals: dict[tuple[str, str], Corrected]
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def check_tapes(frame: Frame, taped: Taped, rows: np.ndarray, dbh_cm: np.ndarray, confidence: float) -> Checked:
    """rows: (n,) positions of the drawn trees in the frame; dbh_cm: DBHs of the frame as they were when drawn.

    Raises:
        InputError: fewer than two trees have both a measured and a taped DBH.
    """
    table = taped.trees.assign(
        dbh_cm=dbh_cm[rows],
        **{name: frame.trees[name].to_numpy()[rows] for name in ("qc_flag", "plot_id")},
        **{f"dbh_{end}_cm": frame.trees[f"meas_{end}_cm"].to_numpy()[rows] for end in ("lo", "hi")},
    )
    table["error_cm"] = table["dbh_cm"] - table["taped_cm"]
    both = table["error_cm"].notna().to_numpy()
    if both.sum() < 2:
        raise InputError(
            f"{taped.path}: {count_of(int(both.sum()), 'tree')} with both a measured and a taped DBH, expected at "
            f"least 2."
        )
    low, high = table["dbh_lo_cm"].to_numpy(float), table["dbh_hi_cm"].to_numpy(float)
    known = both & (low <= table["dbh_cm"] + 1e-6).to_numpy() & (high >= table["dbh_cm"] - 1e-6).to_numpy()
    t = table["taped_cm"].to_numpy(float)
    table["inside"] = np.where(known, (t >= low) & (t <= high), None)
    table["outlier"] = outliers(*(table[name].to_numpy() for name in ("dbh_cm", "taped_cm", "tree_id")))
    made = Checked(table, {}, {})
    answered = taped.answered
    if taped.n_frame:
        tapes = taped.sample()
    else:
        tapes = Tapes(np.full(int(answered.sum()), 1e-9), np.full(int(answered.sum()), "all", object))
        made.warnings.append(
            f"{taped.path.name} does not hold the chances of the draw ({', '.join(('stratum', 'prob', 'n_frame'))}): "
            "the taped trees are taken as a simple random sample, and no total is corrected."
        )
    _errors(made, tapes, answered, both, confidence)
    _intervals(made, known, confidence)
    _flags(made, both)
    if taped.n_frame:
        _totals(made, frame, taped, tapes, rows, dbh_cm, confidence)
    _remark(made, taped, answered)
    return made


def _errors(made: Checked, tapes: Tapes, answered: np.ndarray, both: np.ndarray, confidence: float) -> None:
    """Mean error and RMSE of the layer's trees, weighted by what each tape stands for."""
    error = np.where(both, made.trees["error_cm"], 0.0)[answered]
    has = both[answered].astype(float)
    count = tapes.total(has)

    def mean(value: np.ndarray) -> tuple[float, float, float]:
        middle = tapes.total(value * has) / count
        variance, df = tapes.variance((value - middle) * has / count)
        return middle, float(np.sqrt(variance)), t_factor(confidence, df)

    bias, se, t = mean(error)
    square, se_square, t_square = mean(error**2)
    spread = t_square * se_square / square if square > 0 else 0.0
    made.figures |= {
        "n_taped": int(both.sum()),
        "confidence": confidence,
        "bias_cm": bias,
        "bias_se_cm": se,
        "bias_lo_cm": bias - t * se,
        "bias_hi_cm": bias + t * se,
        "rmse_cm": np.sqrt(square),
        # On the log scale, so that no limit falls below 0.
        "rmse_lo_cm": np.sqrt(square * np.exp(-spread)),
        "rmse_hi_cm": np.sqrt(square * np.exp(spread)),
        "mae_cm": mean(np.abs(error))[0],
        "sd_cm": np.sqrt(max(square - bias**2, 0.0)),
    }


def _intervals(made: Checked, known: np.ndarray, confidence: float) -> None:
    n = int(known.sum())
    k = int(sum(bool(value) for value in made.trees["inside"][known]))
    made.figures |= {"n_intervals": n, "n_inside": k}
    if not n:
        return
    limits = stats.binomtest(k, n).proportion_ci(confidence, method="exact")
    made.figures |= {"inside": k / n, "inside_lo": limits.low, "inside_hi": limits.high}


def _flags(made: Checked, both: np.ndarray) -> None:
    table = made.trees[both]
    groups = {flag: table["error_cm"][table["qc_flag"] == flag].to_numpy(float) for flag in ("ok", "check")}
    for flag, errors in groups.items():
        made.figures[f"n_{flag}"] = len(errors)
        made.figures[f"rmse_{flag}_cm"] = float(np.sqrt(np.mean(errors**2))) if len(errors) else None
    if min(len(errors) for errors in groups.values()) >= 3:
        test = stats.mannwhitneyu(np.abs(groups["check"]), np.abs(groups["ok"]), alternative="greater")
        made.figures["check_worse_p"] = float(test.pvalue)


def _totals(
    made: Checked, frame: Frame, taped: Taped, tapes: Tapes, rows: np.ndarray, dbh_cm: np.ndarray, confidence: float
) -> None:
    """Number and basal area of the frame's trees, corrected."""
    has = np.isfinite(dbh_cm)
    x_ba = np.where(has, BA * dbh_cm**2, frame.trees["size"].to_numpy(float))
    mine, table = taped.answered, made.trees
    live = (table["state"] == "taped").to_numpy()[mine]
    y_ba = np.where(live, BA * table["taped_cm"].to_numpy(float)[mine] ** 2, 0.0)
    ids, plots = table["tree_id"].to_numpy(object)[mine], table["plot_id"].to_numpy(object)[mine]
    keys = [(row.plot_id, None if pd.isna(row.near_id) else row.near_id) for row in taped.extra.itertuples()]
    worth = BA * taped.extra["taped_cm"].to_numpy(float) ** 2
    members = frame.trees["plot_id"].value_counts().to_dict()
    halve = more_tapes_to_halve(int(mine.sum()), taped.n_frame)
    for name, x, y, extra in (
        ("trees", np.ones(len(dbh_cm)), live.astype(float), np.ones(len(keys))),
        ("ba_m2", x_ba, y_ba, worth),
    ):
        shared = share_out(ids, plots, members, [(*key, w) for key, w in zip(keys, extra, strict=True)])
        for estimator in ESTIMATORS:
            found = correct_total(tapes, float(x.sum()), x[rows][mine], y + shared, estimator)
            made.totals[name, estimator] = found
            low, high = found.interval(confidence)
            made.figures[f"{name}_{estimator}"] = {
                "measured": found.measured,
                "corrected": found.total,
                "se": found.se,
                "low": low,
                "high": high,
                "more_tapes_to_halve_se": halve,
            }
    made.figures |= {"n_frame": taped.n_frame, "n_extra": len(keys)}


def _remark(made: Checked, taped: Taped, answered: np.ndarray) -> None:
    """Sentences that a reader of the numbers needs."""
    f, table = made.figures, made.trees
    level = f"{100 * f['confidence']:g} %"
    if f["bias_lo_cm"] > 0 or f["bias_hi_cm"] < 0:
        made.warnings.append(
            f"The measured diameters are {'too thick' if f['bias_cm'] > 0 else 'too thin'} by {abs(f['bias_cm']):.2f} "
            f"cm on average ({level} interval {f['bias_lo_cm']:+.2f} to {f['bias_hi_cm']:+.2f}): correct the totals "
            "with stand-table --taped."
        )
    if f["n_intervals"] and not f["inside_lo"] <= LEVEL <= f["inside_hi"]:
        wrong = "too narrow" if f["inside"] < LEVEL else "too wide"
        made.warnings.append(
            f"The {100 * LEVEL:g} % intervals of the layer are {wrong}: {f['n_inside']} of {f['n_intervals']} hold the "
            f"tape ({level} interval of that share: {100 * f['inside_lo']:.0f} to {100 * f['inside_hi']:.0f} %)."
        )
    made.warnings += outlier_sentences(table["tree_id"], table["outlier"])
    open_ = table["tree_id"][~answered]
    if len(open_):
        made.warnings.append(
            f"Not taped: {count_of(len(open_), 'drawn tree')} ({some(open_, 10)}); the others of their stratum "
            "stand for them, which is right only if what kept the crew away has nothing to do with the error."
        )
    if taped.n_frame and not len(taped.extra):
        made.notes.append(
            "No tree that the map lacks was written down: it is taken that the crew looked for them and found none. If "
            "nobody looked, trees that the flight missed are missing in every total."
        )
    if len(taped.extra):
        made.notes.append(f"Trees that the map lacks, found by the crew: {len(taped.extra)}.")
    if "check_worse_p" in f:
        p, sure = f["check_worse_p"], f["check_worse_p"] < CHANCE
        made.notes.append(
            f"Trees marked ok have an RMSE of {f['rmse_ok_cm']:.2f} cm ({f['n_ok']}), those marked check "
            f"{f['rmse_check_cm']:.2f} cm ({f['n_check']}): "
            + ("the flag tells them apart" if sure else "so few tapes cannot tell whether the flag tells them apart")
            + f" (Mann and Whitney's test, p = {p:.2f})."
        )
    else:
        made.notes.append(
            f"Whether ok trees are better than check ones: too few of them were taped to say ({f['n_ok']} and "
            f"{f['n_check']}, at least 3 each are needed)."
        )
