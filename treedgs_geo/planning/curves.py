"""From clear views to results: the chance that a stem is measured and its standard error, by measured curves.

The curves were fitted to the project's own results (``planning/curves.json`` names them; the script has left:
``treedgs_lab/benchmarks/README.md``): true cameras, simulated stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from ..core.files import read_json

#: More clear views than this count as this many.
_MAX_VIEWS = 90


@dataclass(frozen=True)
class Curves:
    """measured: intercept, slopes of log(views + 0.5) and log(width / 10 px) of the logit. c, a, b: standard error
    ``c gsd^a / views^b``, cm."""

    intercept: float
    views: float
    width: float
    c: float
    a: float
    b: float

    @staticmethod
    def load() -> Curves:
        """The shipped figures."""
        found = read_json(Path(__file__).with_name("curves.json"))
        return Curves(**found["measured"], **{name: found["error"][name] for name in "cab"})

    def chance(self, views: np.ndarray, width_px: np.ndarray) -> np.ndarray:
        """Chance that a stem with so many clear views, so wide in pixels, is measured."""
        of_views, of_width = np.log(np.asarray(views) + 0.5), np.log(np.asarray(width_px) / 10)
        return 1 / (1 + np.exp(-(self.intercept + self.views * of_views + self.width * of_width)))

    def error_cm(self, views: np.ndarray, gsd_cm: np.ndarray) -> np.ndarray:
        """Standard error of a measured stem."""
        return self.c * np.asarray(gsd_cm) ** self.a / np.maximum(views, 1) ** self.b

    def coarsest_gsd_cm(self, error_cm: float, views: float) -> float:
        """Ground sample distance at the stem that still gives this standard error with so many clear views."""
        return float((error_cm * views**self.b / self.c) ** (1 / self.a))


@dataclass(frozen=True)
class Outcome:
    """What a flight is expected to give. share: of the stems measured. error_cm: median standard error of these.
    views: mean clear views a stem. chance, expected, error: (S,) of each stem: chance to be measured, clear views,
    standard error if measured, cm."""

    share: float
    error_cm: float
    views: float
    chance: np.ndarray
    expected: np.ndarray
    error: np.ndarray


def weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """NaN without a weight."""
    order = np.argsort(values)
    heap = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(heap, heap[-1] / 2)]) if weights.sum() > 0 else float("nan")


def outcome(curves: Curves, clear: np.ndarray, gsd_cm: np.ndarray, dbh_m: np.ndarray) -> Outcome:
    """What a flight gives. clear: (S, P) chance that each view is clear; gsd_cm: (S, P) ground sample distance at the
    stem; dbh_m: (S,)."""
    expected = clear.sum(axis=1)
    # Where no view is clear any figure does: nothing is measured there.
    gsd = (clear * gsd_cm).sum(axis=1) / np.maximum(expected, 1e-9)
    gsd = np.where(expected > 1e-6, gsd, 3.0)
    odds = view_odds(np.ascontiguousarray(clear, np.float64))
    count = np.arange(odds.shape[1])
    chance = odds * curves.chance(count[None], (100 * dbh_m / gsd)[:, None])
    each = chance.sum(axis=1)
    error = (chance * curves.error_cm(count[None], gsd[:, None])).sum(axis=1) / np.maximum(each, 1e-12)
    return Outcome(float(each.mean()), weighted_median(error, each), float(expected.mean()), each, expected, error)


@numba.njit(parallel=True, cache=True)
def view_odds(clear):
    """(S, P) chances -> (S, K) chance of exactly so many clear views (independent views, not equally likely)."""
    most = _MAX_VIEWS
    odds = np.zeros((clear.shape[0], most + 1))
    for s in numba.prange(clear.shape[0]):
        odds[s, 0] = 1.0
        top = 0
        for p in range(clear.shape[1]):
            chance = clear[s, p]
            if chance <= 0.0:
                continue
            top = min(top + 1, most)
            if top == most:
                odds[s, most] += odds[s, most - 1] * chance
                start = most - 1
            else:
                start = top
            for k in range(start, 0, -1):
                odds[s, k] = odds[s, k] * (1.0 - chance) + odds[s, k - 1] * chance
            odds[s, 0] *= 1.0 - chance
    return odds
