"""Totals from trees measured everywhere and a few of them taped: the difference estimator of double sampling.

The measured values are known for every tree, the true ones for a probability sample. What the tapes say that the
measured total lacks, sum((y - x) / p), is added to it (Sarndal, Swensson and Wretman 1992, Model Assisted Survey
Sampling, 6.3). Where the measured trees stand in sample plots, tapes are the second phase (Cochran 1977, ch. 12;
Sarndal et al., ch. 9): both variances add. Nothing is assumed of the errors of the measured diameters; the tapes' own
error adds its part (Sarndal et al., ch. 16), so that tapes of all trees do not make a total certain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from ...core.errors import InputError


@dataclass(frozen=True)
class Tapes:
    """The sample. prob: (n,) inclusion probabilities. stratum: (n,) names.

    Trees that could not be taped are left out beforehand, with the others' probabilities lowered
    (:func:`without_unanswered`).
    """

    prob: np.ndarray
    stratum: np.ndarray

    def total(self, value: np.ndarray) -> float:
        """Sum over all trees, estimated: sum(value / prob) (Horvitz and Thompson 1952)."""
        return float(np.sum(value / self.prob))

    def variance(self, value: np.ndarray, own: np.ndarray | float = 0.0) -> tuple[float, float]:
        """Variance of :meth:`total` and its degrees of freedom; NaN where one tape alone says nothing of the spread.

        Hajek's variance for samples of high entropy in each stratum (Hajek 1964; Brewer and Donadio 2003, Survey
        Methodology 29: 189-196); with equal probabilities it is the usual one of a stratified sample, with its finite
        population correction. Degrees of freedom by Satterthwaite (Cochran 1977, 5.16). own: (n,) standard errors of
        the values by the tapes' own error; the spread holds the share (1 - prob) of their variance already.
        """
        value = np.asarray(value, float)
        total = square = tails = 0.0
        for group in self._groups():
            free = group[self.prob[group] < 1 - 1e-12]
            m, c = len(free), 1 - self.prob[free]
            if m == 0:
                continue
            if m == 1:
                return np.nan, np.nan
            each = value[free] / self.prob[free]
            parts = m / (m - 1) * c * (each - np.sum(c * each) / c.sum()) ** 2
            total, square = total + parts.sum(), square + parts.sum() ** 2 / (m - 1)
            tails += m * np.var(parts, ddof=1)
        whole = total + float(np.sum(np.square(own) / self.prob))
        if not square:
            return whole, np.inf
        return whole, float(min(whole**2 / square, 2 * whole**2 / tails if tails else np.inf))

    def _groups(self) -> list[np.ndarray]:
        """Positions by stratum; one with a single tape of several trees joins the next one (Cochran 1977, 5A.12)."""
        found: list[np.ndarray] = []
        lone = np.zeros(0, int)
        for name in sorted(set(self.stratum)):
            mine = np.concatenate([lone, np.flatnonzero(self.stratum == name)])
            alone = len(mine) == 1 and self.prob[mine[0]] < 1 - 1e-12
            lone = mine if alone else lone[:0]
            found += [] if alone else [mine]
        if len(lone):
            found = [*found[:-1], np.concatenate([found[-1], lone])] if found else [lone]
        return found


def without_unanswered(tapes: Tapes, answered: np.ndarray) -> Tapes:
    """The trees that were taped, each standing for its share of those of its stratum that were not.

    Sarndal et al. 1992, 15.6: within a stratum, whether a tree could be taped is taken to have nothing to do with its
    DBH's error.

    Raises:
        InputError: a stratum of which no tree was taped.
    """
    prob = tapes.prob.copy()
    for name in sorted(set(tapes.stratum)):
        mine = tapes.stratum == name
        taken = mine & answered
        if not taken.any():
            raise InputError(
                f"Of stratum {name!r} no tree was taped ({int(mine.sum())} were drawn): tape at least one of them, or "
                "draw anew."
            )
        prob[mine] *= np.sum(1 / prob[taken]) / np.sum(1 / prob[mine])
    return Tapes(np.minimum(prob, 1.0)[answered], tapes.stratum[answered])


@dataclass(frozen=True)
class Corrected:
    """A corrected total. measured: sum of x over all trees. total: corrected. se: of the correction, with df degrees of
    freedom. residual: (n,) what each tape says is lacking, own: (n,) its standard error, for further sums."""

    measured: float
    total: float
    se: float
    df: float
    residual: np.ndarray
    own: np.ndarray

    def interval(self, confidence: float = 0.9) -> tuple[float, float]:
        """Student's t interval; never below 0."""
        half = t_factor(confidence, self.df) * self.se
        return max(self.total - half, 0.0), self.total + half


def t_factor(confidence: float, df: float) -> float:
    """Half width of a two-sided interval in standard errors; NaN where the degrees of freedom are not known."""
    if not np.isfinite(df):
        return float(stats.norm.ppf(0.5 + confidence / 2)) if df == np.inf else np.nan
    return float(stats.t.ppf(0.5 + confidence / 2, max(df, 1.0)))


def correct_total(tapes: Tapes, measured: float, x: np.ndarray, y: np.ndarray, own: np.ndarray) -> Corrected:
    """Correct a total.

    measured: sum of x over all trees of the frame. x, y: (n,) measured and true value of the sampled trees (y = 0: no
    tree stands there), trees that the layer lacks already in y (:func:`share_out`). own: (n,) standard error of y by
    the tape's own.
    """
    residual = np.asarray(y, float) - np.asarray(x, float)
    variance, df = tapes.variance(residual, own)
    return Corrected(measured, measured + tapes.total(residual), float(np.sqrt(variance)), df, residual, own)


def share_out(
    tree: np.ndarray, plot: np.ndarray, members: Mapping[Any, int], extra: Sequence[tuple[Any, Any, float]]
) -> np.ndarray:
    """(n,) what each sampled tree brings of the trees that the layer lacks (generalized weight share, Lavallee 2007,
    Indirect Sampling).

    tree, plot: (n,) ids. members: plot -> number of its trees in the frame. extra: (plot or None, tree or None, value):
    found by searching a whole plot, it is shared by all trees of the frame there, so that its expected weight is one
    whichever of them were drawn; found beside one sampled tree, nearer to it than to any other, it is that one's.

    Raises:
        InputError: an extra tree that belongs to no sampled tree and no plot with one.
    """
    found = np.zeros(len(tree))
    for where, near, value in extra:
        if near is not None:
            mine, parts = np.flatnonzero(tree == near), 1
        else:
            mine, parts = np.flatnonzero(plot == where), members.get(where, 0)
        if not len(mine) or not parts:
            named = f"tree {near}" if near is not None else f"plot {where}"
            raise InputError(
                f"A tree that is not on the map was noted at {named}, where no tree was taped: note it at the plot or "
                "the drawn tree that it stands beside."
            )
        found[mine] += value / parts
    return found


def more_tapes_to_halve(n: int, n_frame: int) -> int:
    """Tapes beside ``n`` that halve the standard error, by n / (1/4 + 3/4 n / N), at the same spread and shares."""
    if n >= n_frame:
        return 0
    wanted = 1 / (0.25 * (1 / n - 1 / n_frame) + 1 / n_frame)
    return int(np.ceil(wanted - 1e-9)) - n


def coverage(inside: np.ndarray, confidence: float) -> dict[str, Any]:
    """How many intervals hold the tape: ``n_intervals, n_inside``, and where there are any their share ``inside`` with
    Clopper and Pearson's interval ``inside_lo, inside_hi``. inside: (N,) bool."""
    n, k = len(inside), int(np.sum(inside))
    if not n:
        return {"n_intervals": 0, "n_inside": 0}
    limits = stats.binomtest(k, n).proportion_ci(confidence, method="exact")
    return {"n_intervals": n, "n_inside": k, "inside": k / n, "inside_lo": limits.low, "inside_hi": limits.high}
