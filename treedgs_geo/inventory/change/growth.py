"""Growth of trees and of the stand, with the errors that both dates share and those that they do not.

A measured diameter is true + own error of the tree + bias of the date + relative error of the block's lengths. In the
difference of two dates all of these add; bias and block's error are the same for all trees of a date, so that they do
not average out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from ..stand.estimate import Design, Estimate, combine, ratio
from ..stand.values import BA


@dataclass(frozen=True)
class SharedErrors:
    """common_se_cm: standard error of a bias that all DBHs of a date share, each date's by itself. block1, block2:
    relative standard error of lengths in each date's block."""

    common_se_cm: float = 0.2
    block1: float = 0.0
    block2: float = 0.0


def tree_growth(trees: pd.DataFrame, shared: SharedErrors, years: float, level: float) -> pd.DataFrame:
    """Per tree: ``growth_cm, growth_se, grow_lo, grow_hi, growth_cm_a`` and ``ba_growth_m2`` (freed of what the errors
    themselves add to a squared diameter); NaN where one date has no DBH."""
    d1, d2 = trees["dbh1_cm"].to_numpy(float), trees["dbh2_cm"].to_numpy(float)
    se1, se2 = trees["se1_cm"].to_numpy(float), trees["se2_cm"].to_numpy(float)
    block1, block2 = shared.block1 * d1, shared.block2 * d2
    # What is a tree's own of its standard error: the layer's holds its block's relative error too.
    own1, own2 = (np.sqrt(np.maximum(se**2 - block**2, 0.0)) for se, block in ((se1, block1), (se2, block2)))
    se = np.sqrt(own1**2 + own2**2 + 2 * shared.common_se_cm**2 + block1**2 + block2**2)
    growth, half = d2 - d1, stats.norm.ppf(0.5 + level / 2) * se
    error1, error2 = np.nan_to_num(se1), np.nan_to_num(se2)
    return pd.DataFrame(
        {
            "growth_cm": growth,
            "growth_se": se,
            "grow_lo": growth - half,
            "grow_hi": growth + half,
            "growth_cm_a": growth / years,
            "ba_growth_m2": BA * ((d2**2 - error2**2) - (d1**2 - error1**2)),
            "own1_cm": own1,
            "own2_cm": own2,
        },
        index=trees.index,
    )


class Slopes(NamedTuple):
    """What a figure changes by with each date's diameters: value = f(d1, d2). by1, by2: (T,) derivatives per cm."""

    value: np.ndarray
    by1: np.ndarray
    by2: np.ndarray


def change_per_area(
    design: Design,
    plot: np.ndarray,
    weight: np.ndarray,
    slopes: Slopes,
    trees: pd.DataFrame,
    shared: SharedErrors,
    below: np.ndarray | None = None,
) -> Estimate:
    """A sum over trees per area, or (``below``: (T,) counts) per tree; se_common: from what all trees of a date share.

    plot: (T,) number of each tree's plot. weight: (T,) how often it counts (0: not).
    """
    bottom = design.areas if below is None else np.bincount(plot, weight * below, minlength=design.n)
    used = weight > 0
    value = np.where(used, slopes.value, 0.0)
    mean, se_plots = ratio(np.bincount(plot, weight * value, minlength=design.n), np.asarray(bottom, float))
    each = np.where(used, weight, 0.0) / bottom.sum()
    by1, by2 = (each * np.where(used, slope, 0.0) for slope in (slopes.by1, slopes.by2))
    d1, d2 = (np.nan_to_num(trees[name].to_numpy(float)) for name in ("dbh1_cm", "dbh2_cm"))
    own1, own2 = (
        np.where(slope != 0, slope * trees[name].to_numpy(float), 0.0)
        for slope, name in ((by1, "own1_cm"), (by2, "own2_cm"))
    )
    se_trees = float(np.sqrt(np.sum(own1**2 + own2**2)))
    s1, s2 = by1.sum(), by2.sum()
    se_shared = float(
        np.sqrt(
            shared.common_se_cm**2 * (s1**2 + s2**2)
            + (shared.block1 * (by1 * d1).sum()) ** 2
            + (shared.block2 * (by2 * d2).sum()) ** 2
            + _missed_error(used, value, trees, float(bottom.sum())) ** 2
        )
    )
    return combine(design, mean, se_plots, se_trees, se_shared, least=-np.inf)


def _missed_error(counted: np.ndarray, value: np.ndarray, trees: pd.DataFrame, area: float) -> float:
    """Standard error from not knowing which lost and new trees were only missed (``chance``, tree by tree), and how
    many flights miss (``chance_sd``, for all of them together)."""
    open_ = np.where(counted, value, 0.0) / area
    chance, common = trees["chance"].to_numpy(float), trees["chance_sd"].to_numpy(float)
    single = np.sum(open_**2 * chance * (1 - chance))
    together = [np.sum((open_ * common)[(trees["fate"] == fate).to_numpy()]) for fate in ("mortality", "ingrowth")]
    return float(np.sqrt(single + np.sum(np.square(together))))


def stand_change(trees: pd.DataFrame, design: Design, shared: SharedErrors, years: float) -> dict[str, Estimate]:
    """Components of change per hectare over the period (Beers 1962, Journal of Forestry 60: 700-704): basal area of
    survivors' growth, ingrowth and mortality, and their sum; numbers of trees; mean growth of the survivors, cm a year.

    trees: of :func:`tree_growth`, joined with the fates. Lost and new trees count by their ``chance`` (its error:
    ``chance_sd``). Survivors without a DBH at one date count as the mean of their plot's survivors (of all plots' where
    it has none).
    """
    fate, plot = trees["fate"].to_numpy(object), trees["plot"].to_numpy(int)
    d1, d2 = trees["dbh1_cm"].to_numpy(float), trees["dbh2_cm"].to_numpy(float)
    zero, one = np.zeros(len(trees)), np.ones(len(trees))
    survivor = (fate == "survivor").astype(float)
    chance = trees["chance"].to_numpy(float)
    weight = survivor * _stand_in(fate, plot, design.n, chance)[plot]
    se1, se2 = (np.nan_to_num(trees[name].to_numpy(float)) for name in ("se1_cm", "se2_cm"))
    came, gone = (fate == "ingrowth").astype(float), (fate == "mortality").astype(float)
    gone *= np.isfinite(d1) * chance
    came *= chance
    grown = Slopes(trees["ba_growth_m2"].to_numpy(float), -2 * BA * d1, 2 * BA * d2)
    # A tree that grew over the limit brings its whole basal area: it counted for nothing before.
    new = Slopes(BA * (d2**2 - se2**2), zero, 2 * BA * d2)
    lost = Slopes(BA * (d1**2 - se1**2), 2 * BA * d1, zero)
    sign = np.where(gone > 0, -1.0, 1.0)
    net = Slopes(*(np.select([came > 0, gone > 0], [a, -b], c) for a, b, c in zip(new, lost, grown, strict=True)))

    def made(weights: np.ndarray, slopes: Slopes, below: np.ndarray | None = None) -> Estimate:
        return change_per_area(design, plot, weights, slopes, trees, shared, below)

    def events(weights: np.ndarray, slopes: Slopes, more: float) -> Estimate:
        return few_events(made(weights, slopes), design, weights, slopes.value, more)

    count = Slopes(one, zero, zero)
    # What one more tree would bring where there is none: the thinnest of the second date, a usual one of the first.
    known2, known1 = (values[np.isfinite(values)] for values in (new.value, lost.value))
    thinnest = float(known2.min()) if len(known2) else 0.0
    usual = float(known1.mean()) if len(known1) else 0.0
    return {
        "growth_cm_a": made(survivor, Slopes((d2 - d1) / years, -one / years, one / years), one),
        "ba_growth": made(weight, grown),
        "ba_ingrowth": events(came, new, thinnest),
        "ba_mortality": events(gone, lost, usual),
        "ba_change": made(weight + came + gone, net),
        "trees_ingrowth": events(came, count, 1.0),
        "trees_mortality": events(gone, count, 1.0),
        "trees_change": made(came + gone, Slopes(sign, zero, zero)),
    }


def few_events(found: Estimate, design: Design, weight: np.ndarray, value: np.ndarray, usual: float) -> Estimate:
    """The figure with an interval that holds for a handful of events too, where the plots' spread says little.

    Gamma interval of a weighted sum of Poisson counts (Fay and Feuer 1997, Statistics in Medicine 16: 791-801) with
    half of one more event at its upper end (mid-P); its variance is that of the counts, or of the plots where they
    differ more than chance lets them.

    weight: (T,) how often each event counts. value: (T,) what it brings. usual: what one would bring where there is
    none. From one plot nothing is known of the stand, and the figure stays as it is (never below nothing).
    """
    if not np.isfinite(found.se_plots):
        return replace(found, low=max(found.low, 0.0))
    area, used = float(design.areas.sum()), weight > 0
    each = np.maximum(np.where(used, value, 0.0), 0.0) / area
    counts = float(np.sum(each**2 * weight))
    variance = max(counts, found.se_plots**2)
    more = 0.5 * (float(each.max()) if used.any() else usual / area)
    tail, mean = (1 - design.confidence) / 2, max(found.mean, 0.0)
    down = mean - _gamma(tail, mean, variance)
    up = max(_gamma(1 - tail, mean + more, variance + more**2) - mean, 0.0)
    # Errors that all trees share are no counts: both sides in quadrature (Zou and Donner 2008, Statistics in Medicine
    # 27: 1693-1702).
    shared = float(stats.norm.ppf(1 - tail)) * found.se_common
    low, high = max(mean - float(np.hypot(down, shared)), 0.0), mean + float(np.hypot(up, shared))
    return replace(found, se=float(np.hypot(np.sqrt(variance), found.se_common)), df=np.inf, low=low, high=high)


def _gamma(share: float, mean: float, variance: float) -> float:
    """Quantile of the gamma distribution with this mean and variance; the mean where one of them is nothing."""
    if mean <= 0 or variance <= 0:
        return max(mean, 0.0)
    return float(stats.gamma.ppf(share, mean**2 / variance, scale=variance / mean))


def _stand_in(fate: np.ndarray, plot: np.ndarray, n: int, chance: np.ndarray) -> np.ndarray:
    """(n,) what each measured survivor of a plot counts, so that those without a DBH are represented."""
    measured = np.bincount(plot, fate == "survivor", minlength=n)
    alive = measured + np.bincount(plot, np.isin(fate, ["no growth", "missed before"]), minlength=n)
    alive = alive + np.bincount(plot, np.isin(fate, ["mortality", "ingrowth"]) * (1 - chance), minlength=n)
    whole = alive.sum() / measured.sum() if measured.sum() else 1.0
    return np.where(measured > 0, alive / np.maximum(measured, 1), whole)
