"""Stand figures corrected by taped trees: double sampling, the plots as first phase, the tapes as second.

The measured trees give a total per hectare for every plot; the tapes say what it lacks, with a variance of their own
that adds to that between the plots (Cochran 1977, ch. 12; Sarndal, Swensson and Wretman 1992, ch. 9). The estimator
is that of :mod:`treedgs_geo.inventory.double_sampling.estimators`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from ...core.errors import InputError
from ...core.shown import count_of
from ...report.blocks import known
from ..double_sampling.estimators import Corrected, Tapes, correct_total, more_tapes_to_halve, share_out, t_factor
from ..double_sampling.tapes import Taped
from ..reviewed import TAPE_SE_CM
from .estimate import Design, Estimate
from .expansion import Expanded
from .sample import first_plot
from .units import UNITS
from .values import BA, TreeValues

#: What is corrected, in this order: numbers first, since mean diameters need both.
CORRECTED = ("trees", "ba", "volume", "biomass")


@dataclass(frozen=True)
class TapeInput:
    """taped: the table; rows: (n,) positions of its trees in the tree list; species: of trees that the layer lacks."""

    taped: Taped
    rows: np.ndarray
    min_dbh_cm: float
    species: str | None


@dataclass
class TapedTotals:
    """What the tapes did. taped_cm: (T,) by tree of the list, NaN: not taped. before: the estimates without them;
    found: quantity -> correction per hectare."""

    n: int
    n_frame: int
    n_extra: int
    taped_cm: np.ndarray
    before: dict[str, Estimate] = field(default_factory=dict)
    found: dict[str, Corrected] = field(default_factory=dict)

    @property
    def more_to_halve(self) -> int:
        """Tapes more that halve the tapes' own standard error."""
        return more_tapes_to_halve(self.n, self.n_frame)


def with_taped_rows(table: pd.DataFrame, given: TapeInput) -> pd.DataFrame:
    """The tree list, with rows at its end: the drawn trees with their taped DBHs, and the trees that the layer lacks.

    They are valued by the same equations and heights as the others, and count nowhere (``in_table``, ``in_curve``).
    """
    drawn = table.iloc[given.rows].assign(dbh_cm=given.taped.trees["taped_cm"].to_numpy(float))
    common = table["species"].mode()
    extra = table.iloc[:0].reindex(range(len(given.taped.extra)))
    extra["dbh_cm"] = given.taped.extra["taped_cm"].to_numpy(float)
    extra["species"] = given.species or (common.iloc[0] if len(common) else None)
    more = pd.concat([drawn, extra], ignore_index=True).assign(
        dbh_se_cm=TAPE_SE_CM, height_se_m=0.0, dead=False, in_table=False, in_curve=False
    )
    return pd.concat([table.assign(in_curve=True), more], ignore_index=True).astype(
        {"dead": bool, "in_table": bool, "in_curve": bool}
    )


def find_homes(expanded: Expanded, table: pd.DataFrame, given: TapeInput) -> np.ndarray:
    """(T,) number of the first plot that each living tree stands in, -1: none.

    Raises:
        InputError: more trees than the tapes were drawn from.
    """
    home = first_plot(expanded.plots, table[["x", "y"]].to_numpy(float))
    home[table["dead"].to_numpy(bool)] = -1
    n = int((home >= 0).sum())
    if n > given.taped.n_frame:
        raise InputError(
            f"{given.taped.path}: its trees were drawn from {given.taped.n_frame}, but {n} living trees stand in the "
            "plots: the tapes say nothing of the others; draw from all plots (tape-sample --plots)."
        )
    return home


def correct_estimates(
    design: Design,
    estimates: dict[str, Estimate],
    rows: pd.DataFrame,
    expanded: Expanded,
    values: TreeValues,
    homes: np.ndarray,
    given: TapeInput,
) -> tuple[dict[str, Estimate], TapedTotals]:
    """Estimates per hectare with the tapes.

    rows: those that the estimates were made from. values: of the list of :func:`with_taped_rows`.
    """
    taped = given.taped
    tapes, mine = taped.sample(), taped.answered
    n_list = len(values.dbh) - len(taped.trees) - len(taped.extra)
    by_tree = np.full(n_list, np.nan)
    by_tree[given.rows] = taped.trees["taped_cm"]
    made = TapedTotals(int(mine.sum()), taped.n_frame, len(taped.extra), by_tree, dict(estimates))
    area = design.areas.sum()
    listed = expanded.of("measured", "missing", "small")
    reach = np.bincount(listed["tree"].to_numpy(int), listed["weight"].to_numpy(float), minlength=n_list) / area
    counts = (taped.trees["state"] == "taped").to_numpy() & (taped.trees["taped_cm"] >= given.min_dbh_cm - 1e-9)
    names = np.array([plot.plot_id for plot in expanded.plots] + [None], object)
    members = {name: int((homes == k).sum()) for k, name in enumerate(names[:-1])}
    plot_of = names[homes[given.rows]][mine]
    ids = taped.trees["tree_id"].to_numpy(object)[mine]
    changed = dict(estimates)
    for name in CORRECTED:
        unit, before = 1000.0 if name == "biomass" else 1.0, estimates[name]
        each, sd = np.ones(len(values.dbh)), np.zeros(len(values.dbh))
        if name != "trees":
            # What a tape read counts as read: the sum is one that a crew can check.
            each = np.concatenate([values.value[name][:n_list], values.raw[name][n_list:]]) / unit
            sd = values.sd[name] / unit
        x = _as_counted(rows, expanded, each, n_list) / area
        y, own = (
            np.where(counts, reach[given.rows] * part[n_list : n_list + len(taped.trees)], 0.0) for part in (each, sd)
        )
        extra = _extra(taped, each[n_list + len(taped.trees) :], given, reach, area, set(members))
        total = y[mine] + share_out(ids, plot_of, members, extra)
        if not (np.isfinite(before.mean) and np.isfinite(total).all()):
            changed[name] = Estimate() if np.isfinite(before.mean) and name != "trees" else before
            continue
        found = correct_total(tapes, before.mean, x[given.rows][mine], total, np.nan_to_num(own[mine]))
        made.found[name] = found
        factor = found.total / before.mean if before.mean > 0 else 1.0
        changed[name] = _combine(design, found.total, before.se_plots * factor, found.se, found.df)
    changed["qmd"] = _mean_diameter(design, estimates["qmd"], made, tapes)
    return changed, made


def _as_counted(rows: pd.DataFrame, expanded: Expanded, each: np.ndarray, n_list: int) -> np.ndarray:
    """(T,) what each tree of the list brings to the sum over ``rows``; stand-ins' shares go to the stems they stand
    for."""
    own = rows[rows["kind"] == "measured"]
    found = np.bincount(
        own["tree"].to_numpy(int), own["weight"].to_numpy(float) * each[own["tree"].to_numpy(int)], minlength=n_list
    )
    imputed = rows[rows["kind"] == "imputed"]
    stems = expanded.gaps.stems
    for group, part in imputed.groupby("group"):
        mine = stems[(stems["group"] == group) & (stems["chance"] > 0)]
        chance = mine["weight"].to_numpy(float) * mine["chance"].to_numpy(float)
        worth = float((part["weight"].to_numpy(float) * each[part["tree"].to_numpy(int)]).sum())
        np.add.at(found, mine["tree"].to_numpy(int), worth * chance / chance.sum())
    return found


def _extra(
    taped: Taped, each: np.ndarray, given: TapeInput, reach: np.ndarray, area: float, plots: set[object]
) -> list[tuple[object, object, float]]:
    """Trees that the layer lacks: (plot, drawn tree beside it, value per hectare)."""
    by_id = dict(zip(taped.trees["tree_id"], given.rows, strict=True))
    found: list[tuple[object, object, float]] = []
    for row, value in zip(taped.extra.itertuples(), each, strict=True):
        near = None if pd.isna(row.near_id) else int(row.near_id)
        counts = row.taped_cm >= given.min_dbh_cm - 1e-9
        # A census is one plot, whatever the crew calls it.
        plot = next(iter(plots)) if row.plot_id not in plots and len(plots) == 1 else row.plot_id
        if near is not None:
            found.append((None, near, value * reach[by_id[near]] * counts if near in by_id else value))
        elif plot in plots:
            found.append((plot, None, value / area * counts))
    return found


def _combine(design: Design, mean: float, se_plots: float, se_taped: float, df_taped: float) -> Estimate:
    """Both phases; of a census only the tapes' error is there. Of one plot it is all that is known: none is nothing."""
    sampled = np.isfinite(se_plots) and not design.census
    parts = [(se_taped, df_taped)] + ([(se_plots, design.n - 1.0)] if sampled else [])
    made = Estimate(mean, se_plots if sampled else np.nan, se_taped=se_taped)
    blind = not np.isfinite(se_plots) and not design.census and not se_taped
    if blind or not all(np.isfinite(se) for se, _ in parts):
        return made
    se = float(np.sqrt(sum(part**2 for part, _ in parts)))
    fourth = sum(part**4 / df for part, df in parts if np.isfinite(df) and part > 0)
    df = se**4 / fourth if fourth > 0 else np.inf
    t = t_factor(design.confidence, df)
    return replace(made, se=se, df=df, low=max(mean - t * se, 0.0), high=mean + t * se)


def _mean_diameter(design: Design, before: Estimate, made: TapedTotals, tapes: Tapes) -> Estimate:
    """sqrt(basal area / (pi/4 trees)); its error from both corrections together (linearised)."""
    if not ({"trees", "ba"} <= set(made.found)) or not made.found["trees"].total > 0:
        return before
    trees, ba = made.found["trees"], made.found["ba"]
    square = ba.total / BA / trees.total
    if not square > 0:
        return Estimate()
    variance, df = tapes.variance((ba.residual / BA - square * trees.residual) / trees.total, ba.own / BA / trees.total)
    q = float(np.sqrt(square))
    return _combine(design, q, before.se_plots, float(np.sqrt(variance)) / (2 * q), df)


def scale_rows(rows: pd.DataFrame, values: TreeValues, made: TapedTotals) -> pd.DataFrame:
    """Rows and tree values scaled so that every table sums to the corrected totals (``values`` in place)."""
    factors = {
        name: found.total / found.measured
        for name, found in made.found.items()
        if found.measured > 0 and found.total > 0
    }
    number = factors.get("trees", 1.0)
    for name in ("ba", "volume", "biomass"):
        values.value[name] = values.value[name] * factors.get(name, number) / number
    return rows.assign(weight=rows["weight"] * number)


def taped_sentences(made: TapedTotals, estimates: dict[str, Estimate], units: str, census: bool) -> list[str]:
    """What the tapes did, and what more of them would do."""
    said = []
    for name in CORRECTED:
        if name in made.found and made.found[name].measured > 0:
            q, found = UNITS[units][name], made.found[name]
            said.append(
                f"{q.label.lower()} {found.measured * q.factor:,.{q.decimals}f} to "
                f"{found.total * q.factor:,.{q.decimals}f} {q.unit} ({100 * (found.total / found.measured - 1):+.1f} %)"
            )
    extra = f", {count_of(made.n_extra, 'tree')} that the map lacks" if made.n_extra else ""
    sentences = [
        f"Corrected by {count_of(made.n, 'taped tree')} of {made.n_frame}{extra}: "
        f"{'; '.join(said)}. Lorey's and dominant height are not corrected."
    ]
    whole, q = estimates["ba"], UNITS[units]["ba"]
    if not np.isfinite(whole.se_taped):
        sentences.append("Too few trees of a stratum were taped to know the tapes' error: no interval is given.")
    elif whole.se_taped > 0 and made.more_to_halve:
        half = (
            f"{made.more_to_halve} more tapes would halve their part of the error of basal area "
            f"({whole.se_taped * q.factor:.2f} {q.unit})"
        )
        if np.isfinite(whole.se_plots) and not census:
            after = float(np.hypot(whole.se_plots, whole.se_taped / 2))
            half += (
                f"; with the spread between the plots ({whole.se_plots * q.factor:.2f}) the error in all would fall "
                f"from {whole.se * q.factor:.2f} to {after * q.factor:.2f}"
            )
            if whole.se_plots > whole.se / 2:
                half += ": no number of tapes halves it, more plots would"
        sentences.append(half + ".")
    return sentences


def taped_summary(made: TapedTotals) -> dict[str, Any]:
    """For ``summary.json``, metric per hectare."""
    return {
        "n": made.n,
        "n_frame": made.n_frame,
        "n_extra": made.n_extra,
        "more_tapes_to_halve_se": made.more_to_halve,
        "quantities": {
            name: {"measured": found.measured, "corrected": found.total, "se": known(found.se)}
            for name, found in made.found.items()
        },
    }
