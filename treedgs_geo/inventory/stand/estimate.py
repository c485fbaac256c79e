"""Per-hectare estimates from plots: ratio of means, its standard error, and what the DBHs' own errors add."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from ..double_sampling.estimators import t_factor
from .sample import SamplePlot
from .unmeasured import Gaps
from .values import BA, TreeValues

#: Trees a hectare whose mean height is the dominant height.
DOMINANT_PER_HA = 100.0
#: Up to here the error of Lorey's height is found by leaving out plots.
JACKKNIFE_PLOTS = 60


@dataclass(frozen=True)
class Estimate:
    """mean per hectare (or cm, m). se_plots: from the spread of the plots, NaN for one plot or a census. se_trees: from
    the trees' own DBH errors. se_common: from the error that all DBHs share. se_missing: from what is unsure of the
    stems without a DBH. se_taped: of the correction by tapes. se: what counts together; df: its degrees of freedom;
    low, high: the confidence interval."""

    mean: float = np.nan
    se_plots: float = np.nan
    se_trees: float = np.nan
    se_common: float = np.nan
    se_missing: float = 0.0
    se_taped: float = 0.0
    se: float = np.nan
    df: float = np.nan
    low: float = np.nan
    high: float = np.nan

    @property
    def half_pct(self) -> float:
        """Half the interval in per cent of the mean."""
        return 100 * (self.high - self.low) / 2 / self.mean if self.mean > 0 else np.nan


@dataclass(frozen=True)
class Design:
    """areas: (n,) ha that each plot's trees are divided by. census: one plot that is the whole stand."""

    areas: np.ndarray
    census: bool
    confidence: float = 0.95

    @property
    def n(self) -> int:
        """Plots."""
        return len(self.areas)


def ratio(top: np.ndarray, bottom: np.ndarray) -> tuple[float, float]:
    """Sum(top) / sum(bottom) and its standard error by the residuals; s / sqrt(n) when all bottoms are equal.

    Cochran 1977, Sampling Techniques, ch. 6 (without finite population correction); NaN for one plot.
    """
    total = bottom.sum()
    if total <= 0:
        return np.nan, np.nan
    value, n = top.sum() / total, len(top)
    if n < 2:
        return float(value), np.nan
    residual = top - value * bottom
    return float(value), float(np.sqrt(n / (n - 1) * np.sum(residual**2)) / total)


def combine(
    design: Design, mean: float, se_plots: float, se_trees: float, se_common: float, se_missing: float = 0.0,
    least: float = 0.0,
) -> Estimate:  # fmt: skip
    """One estimate with its interval, which does not go below ``least``.

    The spread between plots already holds the trees' own errors (they differ from plot to plot), so with two plots or
    more only the common error is added; with one plot, or a census, only the measuring errors are known. What is unsure
    of stems without a DBH shows in neither, as each counts by its mean.
    """
    sampled = np.isfinite(se_plots) and not design.census
    random = se_plots if sampled else se_trees
    if not np.isfinite(mean):
        return Estimate()
    if not np.isfinite(random):
        return Estimate(mean, np.nan, se_trees, se_common, se_missing)
    se = float(np.sqrt(random**2 + np.nan_to_num(se_common) ** 2 + np.nan_to_num(se_missing) ** 2))
    # Welch and Satterthwaite: the other errors are taken as known.
    df = (design.n - 1) * (se / random) ** 4 if sampled and random > 0 else np.inf
    t = t_factor(design.confidence, df)
    made = Estimate(mean, se_plots if sampled else np.nan, se_trees, se_common, se_missing)
    return replace(made, se=se, df=df, low=max(mean - t * se, least), high=mean + t * se)


def per_hectare(
    design: Design, rows: pd.DataFrame, value: np.ndarray, sd: np.ndarray, shift: np.ndarray, gaps: Gaps
) -> Estimate:
    """A quantity per hectare. rows: ``plot, tree, weight``. value, sd, shift: one entry a tree."""
    plot, tree, weight = (rows[name].to_numpy() for name in ("plot", "tree", "weight"))
    totals = np.bincount(plot, weight * value[tree], minlength=design.n)
    mean, se_plots = ratio(totals, design.areas)
    per_tree = np.bincount(tree, weight, minlength=len(value)) / design.areas.sum()
    # sd is NaN where nobody knows the error: then the sum is not known either.
    se_trees = float(np.sqrt(np.sum((per_tree * np.where(per_tree > 0, sd, 0.0)) ** 2)))
    se_common = float(abs(np.sum(per_tree * np.where(per_tree > 0, shift, 0.0))))
    return combine(design, mean, se_plots, se_trees, se_common, gaps.error(rows, value) / design.areas.sum())


def quadratic_mean_diameter(design: Design, rows: pd.DataFrame, values: TreeValues, gaps: Gaps) -> Estimate:
    """sqrt(basal area / (pi/4 trees)), cm, from the corrected basal area."""
    plot, tree, weight = (rows[name].to_numpy() for name in ("plot", "tree", "weight"))
    count = np.bincount(plot, weight, minlength=design.n)
    square, se_square = ratio(np.bincount(plot, weight * values.value["ba"][tree] / BA, minlength=design.n), count)
    if not np.isfinite(square) or square <= 0:
        return Estimate()
    q = float(np.sqrt(square))
    share = np.bincount(tree, weight, minlength=len(values.dbh)) / weight.sum()
    slope = share * np.nan_to_num(values.dbh) / q
    se_trees = float(np.sqrt(np.sum((slope * np.where(share > 0, values.se, 0.0)) ** 2)))
    common = values.shift["ba"] / (BA * 2 * values.dbh)
    moved = (values.value["ba"] / BA - square) / (2 * q * weight.sum())
    se_common = float(abs(np.nansum(slope * common)))
    return combine(design, q, se_square / (2 * q), se_trees, se_common, gaps.error(rows, moved))


def weighted_height(design: Design, rows: pd.DataFrame, values: TreeValues, gaps: Gaps | None = None) -> Estimate:
    """Lorey's height: mean height weighted by basal area, m; empty when a tree has no height.

    Standard error by leaving out one plot after the other (jackknife), its measured heights too: so the error of the
    height curve is in it, and a dense plot that draws the mean to itself does not hide its own deviation. Above
    :data:`JACKKNIFE_PLOTS` plots both hardly matter, and the residuals' formula is used.
    """
    plot, tree, weight = (rows[name].to_numpy() for name in ("plot", "tree", "weight"))
    if not len(rows) or not np.isfinite(values.height[tree]).all():
        return Estimate()
    area = weight * values.value["ba"][tree]
    mean, se = ratio(
        np.bincount(plot, area * values.height[tree], minlength=design.n), np.bincount(plot, area, minlength=design.n)
    )
    if 2 < design.n <= JACKKNIFE_PLOTS and not design.census:
        left = np.full(design.n, np.nan)
        for k in range(design.n):
            mine = np.zeros(len(values.height), bool)
            mine[tree[plot == k]] = True
            heights = values.height if values.refit is None else values.refit(mine)
            others = plot != k
            if area[others].sum() > 0:
                left[k] = np.average(heights[tree[others]], weights=area[others])
        if np.isfinite(left).all():
            se = max(se, float(np.sqrt((design.n - 1) / design.n * np.sum((left - left.mean()) ** 2))))
    se_missing = gaps.error(rows, values.value["ba"] * (values.height - mean) / area.sum()) if gaps else 0.0
    return combine(design, mean, se, np.nan, np.nan, se_missing)


def dominant_height(design: Design, rows: pd.DataFrame, values: TreeValues) -> Estimate:
    """Mean height of the :data:`DOMINANT_PER_HA` thickest trees a hectare, plot by plot, m; empty when one of them has
    no height."""
    heights = plot_dominant(design, rows, values)
    used = np.isfinite(heights)
    count = np.bincount(rows["plot"].to_numpy(), rows["weight"].to_numpy(), minlength=design.n)
    if not used.any() or (~used & (count > 0)).any():
        return Estimate()
    part = Design(design.areas[used], design.census, design.confidence)
    mean, se = ratio(heights[used] * part.areas, part.areas)
    return combine(part, mean, se, np.nan, np.nan)


def plot_dominant(design: Design, rows: pd.DataFrame, values: TreeValues) -> np.ndarray:
    """(n,) dominant height of each plot: its thickest trees until they stand for so many, the last one in part."""
    found = np.full(design.n, np.nan)
    for k in range(design.n):
        mine = rows[rows["plot"] == k]
        order = np.argsort(-values.dbh[mine["tree"].to_numpy()], kind="stable")
        tree, density = mine["tree"].to_numpy()[order], mine["weight"].to_numpy()[order] / design.areas[k]
        before = np.concatenate([[0.0], np.cumsum(density)[:-1]]) if len(density) else density
        share = np.clip(DOMINANT_PER_HA - before, 0.0, density)
        if share.sum() > 0:
            # A tree without a height among the thickest: no figure, not the mean of the others.
            found[k] = np.sum(np.where(share > 0, values.height[tree], 0.0) * share) / share.sum()
    return found


def plot_table(design: Design, plots: list[SamplePlot], rows: pd.DataFrame, values: TreeValues) -> pd.DataFrame:
    """One row a plot: ``plot_id, area_ha, edge, x, y, n_trees, trees_ha, ba_m2_ha, qmd_cm, lorey_m, dominant_m,
    volume_m3_ha, biomass_t_ha`` (NaN: not known)."""
    plot, tree, weight = (rows[name].to_numpy() for name in ("plot", "tree", "weight"))

    def total(value: np.ndarray) -> np.ndarray:
        return np.bincount(plot, weight * value[tree], minlength=design.n)

    count, ba = total(np.ones(len(values.dbh))), total(values.value["ba"])
    with np.errstate(all="ignore"):
        return pd.DataFrame(
            {
                **{
                    name: [getattr(p, name) for p in plots]
                    for name in ("plot_id", "shape", "area_ha", "edge", "x", "y")
                },
                "expansion": 1 / design.areas,
                "searched_pct": [100 * p.searched for p in plots],
                "trees_ha": count / design.areas,
                "ba_m2_ha": ba / design.areas,
                "qmd_cm": np.sqrt(ba / BA / count),
                "lorey_m": total(values.value["ba"] * values.height) / ba,
                "dominant_m": plot_dominant(design, rows, values),
                "volume_m3_ha": total(values.value["volume"]) / design.areas,
                "biomass_t_ha": total(values.value["biomass"]) / 1000 / design.areas,
            }
        )
