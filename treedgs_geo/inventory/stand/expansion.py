"""From trees and plots to rows (plot, tree, weight): who stands where, how often it counts, and who stands for whom."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
import shapely
from shapely.geometry.base import BaseGeometry

from ...core.errors import InputError
from ...core.plots import as_in_plots
from ...core.shown import count_of, some
from .sample import SamplePlot, at_the_edge, overlaps, weights
from .treelist import TreeList
from .unmeasured import Gaps, judge_gaps, sentences, stand_ins

MISSING = ("impute", "exclude")
#: A plot this far (and 3 radii) from any measured tree was not surveyed: it is no empty plot.
UNSEEN_M = 50.0
#: A tree this near to a plot's line may be in or out by the positions' own error.
NEAR_LINE_M = 0.25


@dataclass
class Expanded:
    """rows: ``plot`` and ``tree`` (positions in plots and trees), ``weight`` (how often the tree counts), ``kind``:
    ``measured``, ``imputed`` (stands for a tree without a DBH), ``missing`` (such a tree), ``dead``, ``small``. gaps:
    how likely each stem without a DBH is a tree.
    """

    plots: list[SamplePlot]
    rows: pd.DataFrame
    gaps: Gaps
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def of(self, *kinds: str) -> pd.DataFrame:
        """Rows of these kinds."""
        return self.rows[self.rows["kind"].isin(kinds)].astype({"plot": int, "tree": int})


def expand(
    trees: TreeList,
    plots: list[SamplePlot],
    boundary: BaseGeometry | None,
    edge_rule: str,
    min_dbh_cm: float,
    path: Path = Path("plots"),
) -> Expanded:
    """Put the trees into the plots, weigh them at the edge, and let measured trees stand for those without a DBH.

    Raises:
        InputError: tally trees of an unknown plot, or no plot left.
    """
    plots, notes = at_the_edge(plots, boundary, edge_rule)
    found = Expanded(plots, pd.DataFrame(), Gaps(pd.DataFrame()), [], notes)
    if same := overlaps(plots):
        named = some((f"{one.plot_id} and {other.plot_id}" for one, other, _ in same), 5)
        found.warnings.append(
            f"{count_of(len(same), 'pair')} of plots overlap ({named}): the trees there count in both."
        )
    table = trees.trees
    if trees.from_field:
        parts = _by_name(found, trees, boundary, edge_rule, path)
    else:
        parts = _by_place(found, table, boundary, edge_rule, trees.searched is not None)
    if not found.plots:
        raise InputError(f"{path}: no plot is left to count. {' '.join(found.warnings[:3])}")
    rows = pd.concat(parts, ignore_index=True) if parts else _rows(0, [], [])
    known, dead = table["dbh_cm"].notna().to_numpy(), table["dead"].to_numpy(bool)
    small = known & (table["dbh_cm"].to_numpy(float) < min_dbh_cm - 1e-9)
    tree = rows["tree"].to_numpy(int)
    rows["kind"] = np.select([dead[tree], ~known[tree], small[tree]], ["dead", "missing", "small"], "measured")
    names = [plot.plot_id for plot in found.plots]
    found.gaps = judge_gaps(rows, table, names, trees.tallied, min_dbh_cm)
    found.notes += sentences(found.gaps, table)
    if (found.gaps.stems["chance"] > 0).any() and not rows["kind"].isin(["measured", "small"]).any():
        found.warnings.append("No tree has a DBH: trees without one cannot be imputed.")
    found.rows = pd.concat([rows, stand_ins(found.gaps, rows, table, min_dbh_cm)], ignore_index=True)
    return found


def _rows(plot: int, tree: np.ndarray | list, weight: np.ndarray | list) -> pd.DataFrame:
    return pd.DataFrame(
        {"plot": np.full(len(tree), plot, int), "tree": np.asarray(tree, int), "weight": np.asarray(weight, float)}
    )


def _by_place(
    found: Expanded, table: pd.DataFrame, boundary: BaseGeometry | None, rule: str, searched: bool
) -> list[pd.DataFrame]:
    """Measured trees, by where they stand. A tree in two plots counts in both: each is a sample of its own. searched:
    it is known that the plots were searched; else a plot far from any tree is taken as not surveyed."""
    x, y = table["x"].to_numpy(float), table["y"].to_numpy(float)
    parts: list[pd.DataFrame] = []
    kept: list[SamplePlot] = []
    near = 0
    for plot in found.plots:
        away = float(np.nanmin(np.hypot(x - plot.x, y - plot.y), initial=np.inf))
        reach = np.sqrt(plot.area_ha * 1e4 / np.pi)
        if not searched and plot.edge != "census" and away > max(UNSEEN_M, 3 * reach):
            why = f"the nearest measured tree is {away:,.0f} m away; taken as not surveyed and left out."
            why = why if np.isfinite(away) else "left out, the tree layer is empty."
            found.warnings.append(f"Plot {plot.plot_id}: {why}")
            continue
        inside = np.flatnonzero(plot.contains(x, y))
        count = weights(plot, x[inside], y[inside], boundary, rule)
        inside, count = inside[count > 0], count[count > 0]
        if plot.edge != "census" and plot.outline is not None and len(x):
            near += int((shapely.distance(plot.outline.boundary, shapely.points(x, y)) < NEAR_LINE_M).sum())
        if not len(inside):
            found.warnings.append(f"Plot {plot.plot_id}: no tree stands in it; it counts as an empty plot.")
        parts.append(_rows(len(kept), inside, count))
        kept.append(plot)
    found.plots[:] = kept
    if near:
        found.notes.append(
            f"Within {NEAR_LINE_M:g} m of a plot's line: {count_of(near, 'tree')}; the error of the position decides "
            "whether they count."
        )
    return parts


def _by_name(
    found: Expanded, trees: TreeList, boundary: BaseGeometry | None, rule: str, path: Path
) -> list[pd.DataFrame]:
    """Tally trees, by the plot that the crew wrote down."""
    table = trees.trees
    names = [plot.plot_id for plot in found.plots]
    if len(names) == 1:
        table["plot_id"] = table["plot_id"].where(table["plot_id"].notna(), names[0])
    listed = table["plot_id"].map(lambda value: None if value is None or pd.isna(value) else str(value))
    if listed.isna().any():
        line = table.loc[listed.isna(), "line"].iloc[0]
        raise InputError(f"Line {line} of the field table has no plot_id; name the plot of every tree.")
    listed = listed.replace(as_in_plots(listed.tolist(), names))
    lost = sorted(set(listed) - set(names))
    if lost and not any("left out" in note for note in found.warnings):
        raise InputError(
            f"{path}: lacks the plots {', '.join(lost[:5])} of the field table (it has {some(names, 5)}); add them or "
            "correct the plot_id."
        )
    parts = []
    for k, plot in enumerate(found.plots):
        rows = np.flatnonzero(listed.to_numpy() == plot.plot_id)
        count = np.ones(len(rows))
        placed = table.loc[rows, ["x", "y"]].to_numpy(float)
        if boundary is not None and rule in ("zone", "walkthrough") and plot.outline is not None and len(rows):
            if np.isfinite(placed).all():
                count = weights(plot, placed[:, 0], placed[:, 1], boundary, rule)
            elif plot.edge.startswith("slopover"):
                found.plots[k] = replace(plot, edge="slopover, area", weight_area_ha=plot.area_ha * plot.inside)
                found.warnings.append(
                    f"Plot {plot.plot_id}: the tally has no positions for the rule {rule}; its area inside the stand "
                    "counts."
                )
        if not len(rows):
            found.warnings.append(
                f"Plot {plot.plot_id}: the field table has no tree of it; it counts as an empty plot."
            )
        far = table.loc[rows, "distance_m"].astype(float) if "distance_m" in table else pd.Series(dtype=float)
        if n_far := int((far > plot.radius_m + NEAR_LINE_M).sum()):
            found.warnings.append(
                f"Plot {plot.plot_id}: {n_far} tally trees are farther from the centre than its radius of "
                f"{plot.radius_m:g} m; they count, as the crew tallied them."
            )
        parts.append(_rows(k, rows[count > 0], count[count > 0]))
    return parts
