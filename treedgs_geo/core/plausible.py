"""Diameters and heights that no tree of a stand has: marks for "not measured", and values in another unit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .errors import InputError
from .wrong_units import wrong_unit

#: Trees that a distribution needs.
_LEAST = 5
#: Diameters this large, and that many times the next smaller one of the stand, are looked at; up to a third of all.
LARGE_CM, GAP = 150.0, 3.0
#: Trees of at least 5 cm are at most 250 times as high as they are thick; their median is at most 110 (150 in single
#: dense stands), and 3.3 times as much where heights are in feet.
_SLENDER, _SLENDER_STAND, _THIN_CM = 4.0, 2.0, 5.0
#: A tree from this DBH on, so many times as thick as the next of its species, is worth a second look.
_LOOKED_AT_CM, _THICKER = 60.0, 1.8
#: Nobody can have measured a DBH on a lower tree, m.
_MIN_HEIGHT_M = 1.3


def odd_diameters(dbh_cm: np.ndarray) -> tuple[np.ndarray, str]:
    """(N,) which of a stand's diameters (cm, NaN where there is none) are no diameters in centimetres, and why; none
    where the others say nothing."""
    d = np.asarray(dbh_cm, float)
    known = np.isfinite(d)
    digits = [set(f"{value:g}".replace(".", "")) for value in d]
    nines = np.array([value > 9 and found == {"9"} for value, found in zip(d, digits, strict=True)], bool)
    rest = d[known & ~nines]
    marks = nines & (d > 1.5 * rest.max()) if len(rest) >= 3 else np.zeros(len(d), bool)
    if marks.any():
        return marks, f"the others are up to {rest.max():.1f} cm, it looks like a mark for 'not measured'"
    order = np.sort(d[known])
    if len(order) < _LEAST:
        return np.zeros(len(d), bool), ""
    steps = order[1:] / order[:-1]
    first = len(order) - len(order) // 3
    wide = [k for k in range(first, len(order)) if steps[k - 1] >= GAP and order[k] >= LARGE_CM]
    if not wide:
        return np.zeros(len(d), bool), ""
    low, high = order[0], order[wide[0] - 1]
    large = known & (d >= order[wide[0]])
    if not ((d[large] >= 8 * low) & (d[large] <= 12 * high)).all():
        return np.zeros(len(d), bool), ""
    return large, f"the others are {low:.1f} to {high:.1f} cm, it looks like millimetres, or a decimal point is missing"


def refuse_odd_diameters(
    dbh_cm: np.ndarray, where: Callable[[np.ndarray], str], remedy: str, n_asked: int | None = None
) -> None:
    """Refuse what :func:`odd_diameters` finds among the first ``n_asked`` (``None``: all). where: of the first of a
    mask, for the sentence.

    Raises:
        InputError: see above.
    """
    odd, why = odd_diameters(dbh_cm)
    odd[n_asked if n_asked is not None else len(odd) :] = False
    if odd.any():
        more = f" (and {odd.sum() - 1} more like it)" if odd.sum() > 1 else ""
        value = np.asarray(dbh_cm, float)[odd][0]
        raise InputError(f"{where(odd)}: a DBH of {value:g} cm{more}: {why}; correct it, or {remedy}.")


def thick_ones(dbh_cm: np.ndarray, species: np.ndarray) -> np.ndarray:
    """(N,) trees so much thicker than the next of their species (of all, where it has few) that their DBH is worth a
    second look. dbh_cm: NaN where there is none. species: texts."""
    d, odd = np.asarray(dbh_cm, float), np.zeros(len(dbh_cm), bool)
    for k in np.flatnonzero(d >= _LOOKED_AT_CM):
        others = np.isfinite(d) & (np.arange(len(d)) != k)
        alike = others & (species == species[k])
        rest = d[alike if alike.sum() >= _LEAST else others]
        odd[k] = len(rest) >= _LEAST and d[k] > _THICKER * rest.max()
    return odd


def slenderness(height_m: np.ndarray, dbh_cm: np.ndarray) -> float:
    """Median of height over DBH (m/m) of the trees of at least 5 cm; NaN where fewer than five have both."""
    h, d = np.asarray(height_m, float), np.asarray(dbh_cm, float)
    both = np.isfinite(h) & (d >= _THIN_CM)
    return 100 * float(np.median(h[both] / d[both])) if both.sum() >= _LEAST else np.nan


def refuse_height_units(
    height_m: np.ndarray, dbh_cm: np.ndarray, where: Callable[[np.ndarray], str], remedy: str
) -> None:
    """Refuse heights that are in feet, all or some: by their DBHs, and by the trees of about the same DBH. The
    arguments are those of :func:`refuse_odd_heights`.

    Raises:
        InputError: see above.
    """
    h, d = np.asarray(height_m, float), np.asarray(dbh_cm, float)
    some = np.isfinite(h) & (d >= _THIN_CM)
    ratio = slenderness(h, d)
    if ratio > 100 * _SLENDER_STAND:
        raise InputError(
            f"{where(some)}: the trees are {ratio:.0f} times as high as they are thick (median of {int(some.sum())}), "
            f"expected 40 to 150: the heights look like feet in metres; {remedy}."
        )
    order = np.flatnonzero(some)[np.argsort(d[some], kind="stable")]
    if len(order) < 2 * _LEAST:
        return
    known = np.full(len(h), np.nan)
    for k, row in enumerate(order):
        low = min(max(k - _LEAST, 0), max(len(order) - 2 * _LEAST - 1, 0))
        known[row] = np.median(h[order[low : low + 2 * _LEAST + 1]])
    slip = wrong_unit(h, known, lengths=True)
    if slip is not None and slip.ratio > 1:
        raise InputError(
            f"{where(slip.rows)}: heights: {slip.text('those of trees as thick')}; correct them, or {remedy}."
        )


def refuse_odd_heights(
    height_m: np.ndarray, dbh_cm: np.ndarray, where: Callable[[np.ndarray], str], remedy: str
) -> None:
    """Refuse heights that no tree of its DBH has. height_m, dbh_cm: (N,), NaN where there is none. where: of the first
    of a mask, for the sentence.

    Raises:
        InputError: a height above 120 m, below breast height, too slender; heights in feet.
    """
    refuse_height_units(height_m, dbh_cm, where, remedy)
    h, d = np.asarray(height_m, float), np.asarray(dbh_cm, float)
    with np.errstate(invalid="ignore", divide="ignore"):
        slender = np.where(d >= _THIN_CM, h / d, np.nan)
        checks = (
            (h > 120, "expected up to 120"),
            (np.isfinite(d) & (h < _MIN_HEIGHT_M), "so low that it has no DBH, but one is given"),
            (slender > _SLENDER, "too much for its DBH"),
        )
    for bad, why in checks:
        if bad.any():
            dbh = f" (DBH {d[bad][0]:g} cm)" if np.isfinite(d[bad][0]) else ""
            raise InputError(f"{where(bad)}: a height of {h[bad][0]:.3g} m{dbh}, {why}; correct it, or {remedy}.")
