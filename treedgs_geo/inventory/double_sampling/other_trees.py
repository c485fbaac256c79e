"""Tapes of other trees: a column that slipped, was sorted alone, or fits its trees no better than chance does."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import binom, spearmanr

from ...core.errors import InputError
from ...core.shown import some
from .tapes import Taped

#: A tape is that of its tree within this share of the DBH, this many standard errors of it, and this, cm.
_SHARE, _SES, _MIN_CM = 0.08, 4.0, 1.0
#: This share of all tapes, and two, have to be off before an order is looked for in them; so many before they can tell
#: one; this share of them has to fit it, where chance would do so with this probability at most.
_OFF, _OFF_SHARE, _EXPLAINED, _CHANCE = 4, 0.25, 0.7, 1e-3
#: How far a column slips, rows.
_SLIPS = (1, -1, 2, -2, 3, -3)
#: A table is refused that fits its trees no better than this share of exchanged ones, if half of it is off.
_NO_BETTER, _DRAWS = 0.05, 2000
#: A column that was sorted alone goes with its trees in order less than this (rank correlation).
_ORDERED = 0.7
#: An error this many robust standard deviations from the median one is an outlier (Iglewicz and Hoaglin 1993); and no
#: spread below what a tape itself errs by counts, cm.
OUTLIER, MIN_SPREAD_CM = 3.5, 0.3


class OtherTrees(NamedTuple):
    """why: the tapes cannot be those of their trees. certain: another order of them fits; else it may be the layer that
    is wrong all over."""

    why: str
    certain: bool


def tapes_of_other_trees(taped: Taped, trees: pd.DataFrame, rows: np.ndarray, dbh_cm: np.ndarray) -> str:
    """What is odd of a tape table as a whole, '' where nothing is. rows: (n,) of ``trees``, the layer, that were drawn.
    dbh_cm: (T,) as they were then.

    Raises:
        InputError: the tapes are certainly those of other trees.
    """
    ids = np.array([f"tree {tree}" for tree in taped.trees["tree_id"]], object)
    tape = taped.trees["taped_cm"].to_numpy(float)
    if (found := of_other_trees(tape, dbh_cm[rows], trees["dbh_se_cm"].to_numpy(float)[rows], ids)) is None:
        return ""
    text = f"{taped.path}: {found.why}; hold the column against the form and correct it."
    if found.certain:
        raise InputError(text)
    return text


def of_other_trees(taped_cm: np.ndarray, dbh_cm: np.ndarray, se_cm: np.ndarray, names: np.ndarray) -> OtherTrees | None:
    """Why taped diameters cannot be those of their trees, as a part of a sentence; ``None`` where they can.

    All (N,), in the order of the table: as taped, as measured, standard error of that (NaN: not known), and what the
    sentence calls the row. NaN: none.
    """
    within = np.maximum(np.fmax(_SHARE * dbh_cm, _SES * se_cm), _MIN_CM)
    both = np.isfinite(taped_cm) & np.isfinite(dbh_cm)
    n = int(both.sum())
    off = both & ~_fits(taped_cm, dbh_cm, within)
    if off.sum() < max(2, _OFF_SHARE * n) or n < _OFF:
        return None
    t, d, w = taped_cm[both], dbh_cm[both], within[both]
    by_chance = float(np.mean(np.abs(t[:, None] - d[None]) <= w[None]))
    for rows in _SLIPS:
        moved = pd.Series(taped_cm).shift(-rows).to_numpy(float)
        asked = off & np.isfinite(moved)
        n_fit, n_asked = int(_fits(moved, dbh_cm, within)[asked].sum()), int(asked.sum())
        if n_fit >= _EXPLAINED * n_asked and binom.sf(n_fit - 1, n_asked, by_chance) < _CHANCE:
            first = int(np.flatnonzero(off)[0])
            return OtherTrees(
                f"from {names[first]} on the taped values fit the trees {abs(rows)} row{'s' * (abs(rows) > 1)} "
                f"{'above' if rows > 0 else 'below'} theirs ({int(off.sum())} of {n} do not fit their own tree): the "
                f"column has slipped {'down' if rows > 0 else 'up'}",
                True,
            )
    if (same := _filled_down(taped_cm, off)) is not None:
        return OtherTrees(
            f"{len(same)} rows in turn, from {names[same[0]]} on, have the same {taped_cm[same[0]]:g} cm and do not "
            "fit their trees: the cell was filled down",
            True,
        )
    mixed = off.sum() >= _OFF and float(spearmanr(t, d).statistic) < _ORDERED
    for name, sign in (("smallest", 1), ("largest", -1)):
        if mixed and (np.diff(sign * t) >= 0).all() and not (sign * np.diff(d) >= 0).all():
            why = f"the taped values go from the {name} on, those measured do not: the column was sorted alone"
            return OtherTrees(why, True)
    if off.sum() >= n / 2:
        rng = np.random.default_rng(0)
        drawn = [_spread(rng.permutation(t), d) for _ in range(_DRAWS)]
        if np.mean(np.array(drawn) <= _spread(t, d)) > _NO_BETTER:
            return OtherTrees(
                f"{int(off.sum())} of {n} taped values do not fit their tree, and all together fit no better than "
                "exchanged ones would: they are of other trees, or the layer's diameters are wrong all over",
                False,
            )
    return None


def _filled_down(taped: np.ndarray, off: np.ndarray) -> np.ndarray | None:
    """Rows in turn with one value that fits few of them; ``None`` where there are none."""
    for rows in np.split(np.arange(len(taped)), np.flatnonzero(np.diff(taped) != 0) + 1):
        if off[rows].sum() >= _OFF:
            return rows
    return None


def outliers(dbh_cm: np.ndarray, taped_cm: np.ndarray, names: np.ndarray) -> list[str | None]:
    """Why a tree is worth a second look, in words; ``None`` for the others. All (N,), NaN: none."""
    d, t = np.asarray(dbh_cm, float), np.asarray(taped_cm, float)
    error = d - t
    both = np.isfinite(error)
    middle = float(np.median(error[both])) if both.any() else 0.0
    spread = max(1.4826 * float(np.median(np.abs(error[both] - middle))) if both.any() else 0.0, MIN_SPREAD_CM)
    limit, found = OUTLIER * spread, list[str | None]([None] * len(d))
    odd = np.flatnonzero(both & (np.abs(error - middle) > limit))
    for k in odd:
        crossed = np.maximum(np.abs(d[k] - t[odd] - middle), np.abs(d[odd] - t[k] - middle))
        others = names[odd[(odd != k) & (crossed <= limit)]]
        exchanged = f"; perhaps exchanged with tree {others[0]}" if len(others) else ""
        found[k] = f"measured {d[k]:.1f} cm, taped {t[k]:.1f} cm{exchanged}"
    return found


def outlier_sentences(names: Iterable[Any], found: Iterable[str | None]) -> list[str]:
    """One warning about what :func:`outliers` found; none where it found nothing."""
    named = [f"tree {name} ({text})" for name, text in zip(names, found, strict=True) if isinstance(text, str)]
    if not named:
        return []
    return [
        f"Look again at {some(named, 8, '; ')}: a slip of the tape or of the number "
        "counts as an error of the measurement. Leave a right value as it is."
    ]


def _spread(taped: np.ndarray, dbh: np.ndarray) -> float:
    """Mean distance of their ratios from the middle one (a bias of all is no sign of other trees), logarithms."""
    ratio = np.log(taped) - np.log(dbh)
    return float(np.abs(ratio - np.median(ratio)).mean())


def _fits(taped: np.ndarray, dbh: np.ndarray, within: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return np.abs(taped - dbh) <= within
