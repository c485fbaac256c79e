"""Stems without a DBH: whether each can be a tree of the tally, which trees stand in for it, and what is unsure of it.

A stem that was refused may be a hidden tree or a sapling. Its height, its points and the crew's tally say which; where
they do not settle it the stem counts by its chance, and the interval holds both what is not known: whether it is a
tree, and of which diameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ...core.shown import count_of, some
from ...stems.quality.reasons import split_reasons

#: With fewer measured trees than this a plot borrows from all plots, and evidence is not judged.
OWN_DONORS = 5
#: Measured trees whose heights and points are below this quantile are the small ones that a stem is compared with.
_SMALL = 0.05
#: Of that height: a stem below the first is no tree of the tally; from the second on nothing speaks against it.
LOW_HEIGHT, FULL_HEIGHT = 0.7, 1.0
#: Of those points: thin stems hold few, but so do hidden ones, so that few points never settle it.
FEW_POINTS, FEW_POINTS_CHANCE = 0.3, 0.1
#: Chance that a stem is a tree where nothing speaks against it and nothing but its place is known of it.
#: (Nine of twelve refused stems of a kept-back and a rendered plot were trees.)
NOTHING_KNOWN = 0.75
#: How alike stems are in whether they are trees: the correlation of two that a chance known from twelve leaves.
ALIKE = 1 / 13
#: The same for a stem that was read as thin, but badly seen: one of the thin trees stands in for it, those below this
#: quantile. (Of five such stems of a rendered plot four were trees, of 9, 10, 10 and 24 cm.)
THIN_CHANCE, THIN_QUANTILE = 0.5, 0.25
#: A reading that was refused is off by this share of itself at least (its standard error holds the other explanations).
UNKNOWN_SHARE = 0.1


@dataclass(frozen=True)
class Gaps:
    """stems: ``plot, tree, weight, chance`` (0: left out), ``why`` left out (``too_small``, ``low``, ``tally``),
    ``thin``: whether only thin trees can stand in for it, ``read_cm, read_se_cm`` (NaN: not read), ``group``: those of
    one group have the same stand-ins.

    error: standard error of a sum over the stand-ins, from what is unsure of them.
    """

    stems: pd.DataFrame

    def error(self, rows: pd.DataFrame, value: np.ndarray) -> float:
        """Standard error of the sum of ``weight * value[tree]`` over the imputed ``rows``, in the sum's unit.

        Which diameter: independent from stem to stem, as wide as the stand-ins differ. Whether it is a tree: each by
        itself, and all together as far as the chance itself is not known (:data:`ALIKE`).
        """
        imputed = rows[rows["kind"] == "imputed"]
        single = common = 0.0
        for group, stems in self.stems[self.stems["chance"] > 0].groupby("group"):
            mine = imputed[imputed["group"] == group]
            weight, chance = stems["weight"].to_numpy(float), stems["chance"].to_numpy(float)
            count, worth = float((weight * chance).sum()), value[mine["tree"].to_numpy(int)]
            share = mine["weight"].to_numpy(float) / count
            # Stand-ins below the tally's limit are no rows: they are worth nothing.
            mean, square = float((share * worth).sum()), float((share * worth**2).sum())
            single += float((weight**2 * chance).sum()) * max(square - mean**2, 0.0)
            single += (1 - ALIKE) * float((weight**2 * chance * (1 - chance)).sum()) * mean**2
            common += float((weight * np.sqrt(chance * (1 - chance))).sum()) * mean
        return float(np.sqrt(single + ALIKE * common**2))


def judge_gaps(
    rows: pd.DataFrame, table: pd.DataFrame, plots: list[str], tallied: dict[str, float], min_dbh_cm: float
) -> Gaps:
    """How likely each row of kind ``missing`` is a tree that counts.

    table: trees with ``dbh_cm, height_m, n_pts, qc_reason, dead`` and ``paired`` (a tally tree is this stem). plots:
    their ids. tallied: plot id -> chance that a tree there would be found among the tally's pairs.
    """
    stems = rows[rows["kind"] == "missing"].drop(columns="kind").reset_index(drop=True)
    tree = stems["tree"].to_numpy(int)
    chance, low = _by_evidence(table, min_dbh_cm)
    stems["chance"], stems["why"] = chance[tree], ""
    stems.loc[low[tree], "why"] = "low"
    for k, plot in enumerate(plots):
        found = tallied.get(plot, 0.0)
        mine = stems["plot"].eq(k) & (stems["chance"] > 0)
        if not found or not mine.any():
            continue
        # A tally that would most likely hold the tree, and does not, speaks against it (Bayes).
        prior = stems.loc[mine, "chance"].clip(upper=NOTHING_KNOWN)
        missed = prior * (1 - found)
        stems.loc[mine, "chance"] = missed / (missed + 1 - prior)
        stems.loc[mine & (stems["chance"] <= 0), "why"] = "tally"
    thin = table["qc_reason"].iloc[tree].map(is_thin).to_numpy(int)
    stems["thin"] = thin == 1
    stems.loc[stems["thin"], "chance"] *= THIN_CHANCE
    sure = table["paired"].eq(True).to_numpy()[tree] if "paired" in table else np.zeros(len(tree), bool)
    stems.loc[sure, "chance"], stems.loc[sure, "why"] = 1.0, ""
    certain = (thin == 2) & ~sure
    stems.loc[certain, "chance"], stems.loc[certain, "why"] = 0.0, "too_small"
    for name in ("read_cm", "read_se_cm"):
        stems[name] = table[name].to_numpy(float)[tree] if name in table else np.nan
    # Every stem that was read has stand-ins of its own; the others of a plot share theirs.
    shared = stems.groupby(["plot", "thin"]).ngroup()
    stems["group"] = np.where(stems["read_cm"].notna(), len(stems) + np.arange(len(stems)), shared)
    return Gaps(stems)


def is_thin(reasons: object) -> int:
    """0: not refused as too thin to measure; 1: for that among other reasons; 2: for that alone."""
    found = split_reasons(reasons)
    return 0 if "too_small" not in found else 2 if len(found) == 1 else 1


def _by_evidence(table: pd.DataFrame, min_dbh_cm: float) -> tuple[np.ndarray, np.ndarray]:
    """(T,) chances from height and points, and a mask of the stems that are too low to be a tree that counts."""
    d = table["dbh_cm"].to_numpy(float)
    counted = np.isfinite(d) & (d >= min_dbh_cm - 1e-9) & ~table["dead"].to_numpy(bool)
    height, points = (_share_of_small(table, name, counted) for name in ("height_m", "n_pts"))
    by_height = np.clip((height - LOW_HEIGHT) / (FULL_HEIGHT - LOW_HEIGHT), 0, 1)
    by_points = FEW_POINTS_CHANCE + (1 - FEW_POINTS_CHANCE) * np.clip((points - FEW_POINTS) / (1 - FEW_POINTS), 0, 1)
    known = np.where(np.isfinite(by_height), by_height, 1.0) * np.where(np.isfinite(by_points), by_points, 1.0)
    # A crown above a place is no proof of a stem in it; many points on one are.
    return np.where(np.isfinite(points), known, np.minimum(known, NOTHING_KNOWN)), height < LOW_HEIGHT


def _share_of_small(table: pd.DataFrame, name: str, counted: np.ndarray) -> np.ndarray:
    """(T,) the column over what small measured trees have; NaN where either is not known."""
    column = table.get(name, pd.Series(np.nan, index=table.index))
    values = pd.to_numeric(column, errors="coerce").to_numpy(float)
    known = values[counted & (values > 0)]
    return values / (np.quantile(known, _SMALL) if len(known) >= OWN_DONORS else np.nan)


def sentences(gaps: Gaps, table: pd.DataFrame) -> list[str]:
    """What was left out, and why, with the trees' numbers."""
    words = {
        "too_small": "too thin to measure (too_small)",
        "low": f"lower than {LOW_HEIGHT:.0%} of the smallest measured trees, so no tree of the tally",
        "tally": "in a plot whose tally pairs every tree and does not hold them",
    }
    found = []
    for why, text in words.items():
        trees = gaps.stems.loc[gaps.stems["why"] == why, "tree"].unique()
        if len(trees):
            named = some(table["tree_id"].to_numpy(object)[trees], 10)
            found.append(f"Left out of every figure: {count_of(len(trees), 'stem')} {text} (tree {named}).")
    return found


def stand_ins(gaps: Gaps, rows: pd.DataFrame, table: pd.DataFrame, min_dbh_cm: float) -> pd.DataFrame:
    """Rows of kind ``imputed`` (``group``: of the stems they stand for): each stem counts, by its chance, as the
    measured trees of about the diameter that was read of it; one that was not read as the mean of its plot's."""
    d = table["dbh_cm"].to_numpy(float)
    alive = rows[rows["kind"].isin(["measured", "small"])]
    alive_cm = d[alive["tree"].to_numpy(int)]
    parts = [rows.iloc[:0].assign(kind=pd.Series(dtype=object), group=pd.Series(dtype=int))]
    for group, mine in gaps.stems.groupby("group"):
        plot, read_cm = mine["plot"].iloc[0], float(mine["read_cm"].iloc[0])
        gone = float((mine["weight"] * mine["chance"]).sum())
        if not gone or not len(alive):
            continue
        donors, alike = alive, np.ones(1)
        if np.isfinite(read_cm):
            alike = _alike(alive_cm, read_cm, float(mine["read_se_cm"].iloc[0]))
        else:
            donors = alive[alive_cm <= np.quantile(alive_cm, THIN_QUANTILE)] if mine["thin"].iloc[0] else alive
            own = donors[donors["plot"] == plot]
            donors = own if len(own) >= OWN_DONORS else donors
        share = donors["weight"].to_numpy() * alike
        share = share / share.sum() * gone
        part = donors[["plot", "tree"]].assign(plot=plot, weight=share, kind="imputed", group=group)
        part = part[share > 1e-6 * gone]
        # Those that a stand-in below the tally's limit stands for would not be tallied either.
        parts.append(part[d[part["tree"]] >= min_dbh_cm - 1e-9])
    return pd.concat(parts, ignore_index=True)


def _alike(dbh_cm: np.ndarray, read_cm: float, se_cm: float) -> np.ndarray:
    """(N,) how well trees of these diameters agree with what was read of a refused stem, the best 1."""
    wide = max(float(np.nan_to_num(se_cm)), UNKNOWN_SHARE * read_cm)
    off = 0.5 * ((dbh_cm - read_cm) / wide) ** 2
    return np.exp(off.min() - off)
