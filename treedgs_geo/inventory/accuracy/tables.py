"""Accuracy per plot and pooled, with bootstrap intervals, from pairs or from a simulated plot's truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd

from ...core.errors import InputError
from ...core.wrong_units import wrong_unit
from ..pairs_layer import FIELD, MEASURED, PAIRS, PLOTS, STATUSES, SUGGESTED, read_layer, refuse_moved
from ..tree_reading import text_of
from .scores import accuracy_of, score_against_truth

#: Statuses that count as a pair; ``rejected`` never does.
COUNTED = ("auto", "ok", "moved")
#: Figures that get an interval.
INTERVALS = ("rmse_cm", "rrmse_pct", "mae_cm", "me_cm", "success_rate")
#: Of the intervals: resamples, their seed, and the probability with its percentiles.
_REPEATS, _SEED, _LEVEL = 2000, 0, 0.95
_TAILS = [50 * (1 - _LEVEL), 50 * (1 + _LEVEL)]
#: What a pair says of its measured tree.
_OF_PAIR = ("dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag", "meas_cm", "rev_flag")


@dataclass(frozen=True)
class PairsEvidence:
    """What accuracy is computed from.

    trees: one row a reference tree that could have been measured: ``plot_id, tree_id, reference_cm``, ``dbh_cm`` (NaN
    where it was not found or refused), ``dbh_lo_cm, dbh_hi_cm, qc_flag, error_cm, inside_90``; ``meas_cm`` (DBH as
    measured) and ``rev_flag`` where a person decided (:mod:`treedgs_geo.inventory.reviewed`). n_false: plot_id ->
    measured trees with a DBH inside the plot that are no reference tree. notes: sentences about what was left out.
    """

    trees: pd.DataFrame
    n_false: dict[str, int]
    reference: str
    notes: list[str]


def evidence_from_pairs(path: Path, min_dbh_cm: float = 0.0) -> PairsEvidence:
    """Read a pairs layer. min_dbh_cm: the tally's limit; thinner measured trees without a partner are not false.

    Left out, and said so: plots left to a hand check, trees whose pair a person rejected, field trees without a DBH or
    on ground that was not searched.

    Raises:
        InputError: no pairs file, unknown statuses, or nothing to evaluate.
    """
    key = ["plot_id", "field_id"]
    pairs, field = (read_layer(path, name).astype(dict.fromkeys(key, str)) for name in (PAIRS, FIELD))
    measured, plots = read_layer(path, MEASURED), read_layer(path, PLOTS)
    unknown = sorted(set(pairs["pair_status"].dropna()) - set(STATUSES))
    if unknown or pairs["pair_status"].isna().any():
        raise InputError(
            f"{path}: pair_status {unknown[0] if unknown else 'empty'!r} found, expected {', '.join(STATUSES)}; "
            "run match-plots again to read in what was edited."
        )
    notes = []
    used = pairs[pairs["pair_status"].isin(COUNTED)]
    _refuse_stale(path, used, measured, plots)
    unplaced = sorted(plots.loc[plots["status"] == "check", "plot_id"].astype(str))
    if unplaced:
        notes.append(
            f"{len(unplaced)} of {len(plots)} plots are left to a hand check and do not count: {', '.join(unplaced)}."
        )
    if used.duplicated(key).any():
        raise InputError(f"{path}: a field tree is in two pairs; reject one of them or run match-plots again.")
    trees = field.reindex(columns=[*key, "dbh_cm", "paired"]).rename(columns={"dbh_cm": "reference_cm"})
    trees = trees[~trees["plot_id"].isin(unplaced)].merge(
        used.reindex(columns=[*key, *_OF_PAIR]), how="left", on=key, indicator="found"
    )
    if "meas_cm" not in used:
        trees["meas_cm"] = trees["dbh_cm"]
    alone = trees["found"] == "left_only"
    trees["qc_flag"] = trees["qc_flag"].mask(alone, "not found")
    of_person = pairs.loc[pairs["pair_status"] == "rejected", key]
    rejected = alone & pd.MultiIndex.from_frame(trees[key]).isin(pd.MultiIndex.from_frame(of_person))
    beyond = alone & ~rejected & (trees["paired"] == "unsearched")
    blank = ~rejected & ~beyond & trees["reference_cm"].isna()
    for out, text in (
        (rejected, "whose pair was rejected by a person"),
        (beyond, "on ground that was not searched for stems"),
        (blank, "without a DBH"),
    ):
        if out.any():
            notes.append(f"{int(out.sum())} field trees {text} do not count.")
    table = evidence_table(trees[~(rejected | beyond | blank)].rename(columns={"field_id": "tree_id"}))
    if (slip := wrong_unit(table["reference_cm"].to_numpy(), table["meas_cm"].to_numpy())) is not None:
        notes.append(f"Field DBHs look like another unit than their table says: {slip.text()}; run match-plots again.")
    extra = measured[(measured["paired"] == "no") & measured["dbh_cm"].notna()]
    extra = extra[(extra["in_plot"] == "in") & (extra["dbh_cm"] >= min_dbh_cm) & ~extra["plot_id"].isin(unplaced)]
    counts = extra["plot_id"].astype(str).value_counts().to_dict()
    return _checked(PairsEvidence(table, {str(k): int(v) for k, v in counts.items()}, "field DBH", notes), path)


def _refuse_stale(path: Path, used: gpd.GeoDataFrame, measured: gpd.GeoDataFrame, plots: gpd.GeoDataFrame) -> None:
    """Refuse a layer edited since match-plots wrote it: the DBHs beside its lines would be those of other trees."""
    place = {int(t): (g.x, g.y) for t, g in zip(measured["tree_id"], measured.geometry, strict=True)}
    for _, row in used[used["tree_id"].notna()].iterrows():
        if row.geometry is None or row.geometry.is_empty:
            raise InputError(
                f"{path}: the pair of field tree {row['plot_id']}/{row['field_id']} has no line; delete or draw it, "
                "and run match-plots again onto this file."
            )
        refuse_moved(path, row, place.get(int(row["tree_id"]), (np.inf, np.inf)))
    suggested = set(read_layer(path, SUGGESTED)["plot_id"])
    for plot in plots.loc[plots["status"] == "ok", "plot_id"]:
        if plot in suggested and plot not in set(used["plot_id"]):
            raise InputError(
                f"{path}: plot {plot} was confirmed but is not paired yet; run match-plots again onto this file."
            )


def evidence_from_truth(trees: gpd.GeoDataFrame, truth_csv: Path, plot_id: str) -> PairsEvidence:
    """A tree layer against a simulated or rendered plot's ``truth/trees.csv``
    (:func:`.scores.score_against_truth`)."""
    accuracy, table = score_against_truth(trees, truth_csv)
    renamed = table.rename(columns={"dbh_true_cm": "reference_cm"}).assign(plot_id=plot_id)
    found = PairsEvidence(evidence_table(renamed), {plot_id: accuracy.n_false}, "true DBH", [])
    return _checked(found, truth_csv)


def resampled(plots: pd.Series, columns: Sequence[np.ndarray], seed: int, repeats: int) -> tuple[str, int, np.ndarray]:
    """Sums of columns over trees drawn by whole plots, or, of one plot, one by one.

    Returns:
        what was drawn (plot or tree), how many there are, and (repeats, columns) sums.
    """
    names, unit = np.unique(plots.astype(str), return_inverse=True)
    by = "plot" if len(names) > 1 else "tree"
    unit = unit if by == "plot" else np.arange(len(plots))
    sums = np.column_stack([np.bincount(unit, column) for column in columns])
    rng, n = np.random.default_rng(seed), len(sums)
    drawn = np.array([np.bincount(rng.integers(0, n, n), minlength=n) for _ in range(repeats)])
    return by, n, drawn @ sums


def bootstrap(trees: pd.DataFrame, repeats: int = _REPEATS) -> dict:
    """Percentile intervals of the pooled figures.

    Plots are resampled whole, because trees of one plot share their errors (one reconstruction, one crew); with a
    single plot there is nothing to resample but its trees, and the interval says nothing about other plots.

    Returns:
        ``by`` (plot or tree), ``repeats``, ``level``, ``note`` and a ``[low, high]`` per figure of :data:`INTERVALS`.
    """
    error, reference = trees["error_cm"].to_numpy(float), trees["reference_cm"].to_numpy(float)
    done = np.isfinite(error)
    # Sums are all that the figures need.
    summed = (np.ones(len(error)), done, *(np.where(done, v, 0.0) for v in (error, abs(error), error**2, reference)))
    by, n_units, sums = resampled(trees["plot_id"], summed, _SEED, repeats)
    total, n, s1, sa, s2, ref = sums.T
    with np.errstate(divide="ignore", invalid="ignore"):
        rmse = np.sqrt(s2 / n)
        figures = {
            "rmse_cm": rmse,
            "rrmse_pct": 100 * rmse / (ref / n),
            "mae_cm": sa / n,
            "me_cm": s1 / n,
            "success_rate": n / total,
        }
    note = ""
    if by == "tree":
        note = "one plot only: trees were resampled, so the interval says nothing about other plots"
    elif n_units < 6:
        note = f"only {n_units} plots were resampled: the interval is coarse and tends to be too narrow"
    result = {"by": by, "n_units": n_units, "repeats": repeats, "level": _LEVEL, "seed": _SEED, "note": note}
    for name in INTERVALS:
        values = figures[name][np.isfinite(figures[name])]
        result[name] = [round(float(v), 4) for v in np.percentile(values, _TAILS)] if len(values) else None
    return result


def metrics_of(evidence: PairsEvidence, repeats: int = _REPEATS) -> dict:
    """Everything in ``metrics.json``; the pooled figures also stand at the top level."""
    per_plot = {
        str(plot): accuracy_of(rows, evidence.n_false.get(str(plot), 0)).figures()
        for plot, rows in evidence.trees.groupby("plot_id", sort=True)
    }
    pooled = accuracy_of(evidence.trees, sum(evidence.n_false.values())).figures()
    each = pd.DataFrame(per_plot.values(), columns=list(INTERVALS)).astype(float)
    strict = evidence.trees.copy()
    flagged = strict["qc_flag"] != "ok"
    strict.loc[flagged, ["error_cm", "dbh_cm"]] = np.nan
    as_measured, review_notes = _as_measured(evidence)
    return {
        **pooled,
        "reference": evidence.reference,
        "n_plots": len(per_plot),
        "pooled": pooled,
        "per_plot": per_plot,
        "mean_of_plots": {name: _rounded(mean) for name, mean in each.mean().items()},
        **({"over_plots": _over_plots(each)} if len(each) > 1 else {}),
        "ok_only": accuracy_of(strict).figures(),
        **as_measured,
        "bootstrap": bootstrap(evidence.trees, repeats),
        "notes": [*evidence.notes, *review_notes],
    }


def _over_plots(each: pd.DataFrame) -> dict:
    """Mean, standard deviation and range of each figure over the plots that have it."""
    return {
        name: {
            **{key: _rounded(v) for key, v in zip(("mean", "sd", "low", "high"), found, strict=True)},
            "plots": int(each[name].count()),
        }
        for name, *found in each.agg(["mean", "std", "min", "max"]).T.itertuples()
        if each[name].count()
    }


def _rounded(value: float) -> float | None:
    return None if pd.isna(value) else round(float(value), 4)


def _as_measured(evidence: PairsEvidence) -> tuple[dict, list[str]]:
    """``as_measured``: the pooled figures with the diameters that the method gave, where a person decided otherwise;
    and what such decisions do to the figures."""
    decided = evidence.trees["rev_flag"].map(text_of) != ""
    if not decided.any():
        return {}, []
    trees = evidence.trees.assign(dbh_cm=evidence.trees["meas_cm"])
    changed = (evidence.trees["meas_cm"] - evidence.trees["dbh_cm"]).abs() > 0.005
    # The interval of a diameter that a person replaced is that of the tape.
    trees.loc[changed | evidence.trees["dbh_cm"].isna(), "inside_90"] = None
    trees["error_cm"] = trees["dbh_cm"] - trees["reference_cm"]
    measured = accuracy_of(trees, sum(evidence.n_false.values())).figures()
    taped = int((evidence.trees["rev_flag"] == "dbh").sum())
    found = "no tree" if not measured["n"] else f"{measured['n']} trees at an RMSE of {measured['rmse_cm']:.2f} cm"
    note = (
        f"A person decided on {int(decided.sum())} of these trees; {taped} of the diameters are by tape and no result "
        f"of the method. As measured: {found} (row 'pooled, as measured')."
    )
    return {"as_measured": measured}, [note]


def evidence_table(trees: pd.DataFrame) -> pd.DataFrame:
    """``PairsEvidence.trees``: typed, with ``error_cm`` (measured - reference) and ``inside_90``."""
    table = trees.reindex(columns=["plot_id", "tree_id", "reference_cm", *_OF_PAIR]).reset_index(drop=True)
    for name in ("reference_cm", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "meas_cm"):
        table[name] = pd.to_numeric(table[name]).astype(float)
    table["error_cm"] = table["dbh_cm"] - table["reference_cm"]
    inside = (table["dbh_lo_cm"] <= table["reference_cm"]) & (table["reference_cm"] <= table["dbh_hi_cm"])
    known = table["error_cm"].notna() & table["dbh_lo_cm"].notna() & table["dbh_hi_cm"].notna()
    table["inside_90"] = inside.astype(object).where(known, None)
    return table


def _checked(evidence: PairsEvidence, path: Path) -> PairsEvidence:
    if not len(evidence.trees):
        why = f" ({' '.join(evidence.notes)})" if evidence.notes else ""
        raise InputError(f"{path}: holds no reference tree to evaluate{why}; check the pairs first.")
    return evidence


#: Figures that are compared on the common trees.
COMPARED = ("n", "rmse_cm", "rrmse_pct", "mae_cm", "me_cm", "max_abs_cm", "coverage_90")


def compare(first: PairsEvidence, second: PairsEvidence) -> dict:
    """Score two methods on the reference trees that both measured.

    Returns:
        ``n_common, n_only_this, n_only_other``; ``this`` and ``other``: figures on the common trees; ``other_all``: the
        other's figures on all its trees; ``rmse_gain_cm``: RMSE of this minus RMSE of the other on the common trees,
        with its bootstrap interval ``rmse_gain_interval_cm`` (plots resampled, or trees with one plot: ``by``).

    Raises:
        InputError: no common reference tree, or a tree's reference DBH differs.
    """
    keys = ["plot_id", "tree_id"]
    a, b = (e.trees.astype(dict.fromkeys(keys, str)) for e in (first, second))
    both = a.merge(b, on=keys, suffixes=("_this", "_other"))
    if not len(both):
        raise InputError("--against: shares no reference tree with --pairs; give pairs of the same field table.")
    differ = (both["reference_cm_this"] - both["reference_cm_other"]).abs() > 0.01
    if differ.any():
        row = both[differ].iloc[0]
        raise InputError(
            f"--against: field tree {row['plot_id']}/{row['tree_id']} has {row['reference_cm_other']:g} cm, in --pairs "
            f"it has {row['reference_cm_this']:g} cm; give pairs of the same field table."
        )
    done_a, done_b = both["error_cm_this"].notna(), both["error_cm_other"].notna()
    common = both[done_a & done_b]
    result = {
        "n_common": len(common),
        "n_only_this": int((done_a & ~done_b).sum()),
        "n_only_other": int((done_b & ~done_a).sum()),
        "other_all": accuracy_of(second.trees, sum(second.n_false.values())).figures(),
    }
    for side in ("this", "other"):
        names = {f"{name}_{side}": name for name in ("reference_cm", "error_cm", "inside_90")}
        scored = accuracy_of(common[list(names)].rename(columns=names)).figures()
        result[side] = {name: scored[name] for name in COMPARED}
    if not len(common):
        return {**result, "rmse_gain_cm": None, "rmse_gain_interval_cm": None, "by": None}
    square = common[["error_cm_this", "error_cm_other"]].to_numpy(float) ** 2
    by, _, total = resampled(common["plot_id"], (np.ones(len(square)), *square.T), _SEED, _REPEATS)
    gains = np.sqrt(total[:, 1] / total[:, 0]) - np.sqrt(total[:, 2] / total[:, 0])
    exact = np.sqrt(square.mean(axis=0))
    return {
        **result,
        "rmse_gain_cm": round(float(exact[0] - exact[1]), 4),
        "rmse_gain_interval_cm": [round(float(end), 4) for end in np.percentile(gains, _TAILS)],
        "by": by,
    }
