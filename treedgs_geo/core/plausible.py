"""Diameters and heights that no tree of a stand has: marks for "not measured", and values in another unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .errors import InputError

#: Trees that a distribution needs.
_LEAST = 5
#: Diameters this large, and that many times the next smaller one of the stand, are looked at; up to a third of all.
LARGE_CM, GAP = 150.0, 3.0
#: Trees of at least 5 cm are at most 250 times as high as they are thick; their median is at most 110 (150 in single
#: dense stands), and 3.3 times as much where heights are in feet.
_SLENDER, _SLENDER_STAND, _THIN_CM = 4.0, 2.0, 5.0
#: A tree from this DBH on, so many times as thick as the next of its species, is worth a second look.
_LOOKED_AT_CM, _THICKER = 60.0, 1.8
#: What a column in two units holds: its values are so many times the others', at the same DBH or height, within this
#: (logarithm). Heights of 3.3 times the others' no forest has; trees grown in the open may have such DBHs.
_UNITS = (
    ("heights", 1 / 0.3048, "feet read as metres", 0.25),
    ("DBHs", np.pi, "girths read as diameters", 0.08),
    ("DBHs", 1 / 2.54, "inches read as centimetres", 0.08),
)
#: Slopes to begin with, of log height over log DBH; a gap between trees of two units is this share of what lies between
#: the units.
_SLOPES, _GAP_OF_TREES = np.array([0.3, 0.55, 0.8]), 0.3
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
    """Raise ``InputError`` for what :func:`odd_diameters` finds among the first ``n_asked`` (``None``: all). where: of
    the first of a mask, for the sentence."""
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


@dataclass(frozen=True)
class MixedUnits:
    """Heights, or DBHs, of which some are in another unit than the others."""

    #: (N,) bool: these.
    rows: np.ndarray
    #: How many were compared.
    of: int
    #: ``heights`` or ``DBHs``.
    what: str
    #: Times those of like trees.
    ratio: float
    #: What they look like, for a sentence.
    unit: str
    #: No forest is like this; else one plot of another kind might be.
    certain: bool

    def text(self) -> str:
        """``12 of 20 heights are 3.3 times those of trees as thick, as feet read as metres are``."""
        alike = "thick" if self.what == "heights" else "high"
        return (
            f"{self.what}: {int(self.rows.sum())} of {self.of} values are {self.ratio:.2g} times those of trees as "
            f"{alike}, as {self.unit} are"
        )


def mixed_units(height_m: np.ndarray, dbh_cm: np.ndarray, plots: np.ndarray | None = None) -> MixedUnits | None:
    """Whether heights and DBHs (N,) lie on two height curves that are a unit apart: plot by plot (their names, (N,)),
    or tree by tree with a gap between. Where the two hold other heights, or DBHs, nothing can be compared: old trees
    beside young ones."""
    h, d = np.asarray(height_m, float), np.asarray(dbh_cm, float)
    known = np.flatnonzero(np.isfinite(h) & (h > 0) & (d >= _THIN_CM))
    if len(known) < 2 * _LEAST:
        return None
    log_h, log_d = np.log(h[known]), np.log(d[known])
    places = None if plots is None else np.unique(np.asarray(plots).astype(str)[known], return_inverse=True)[1]
    best, nearest = None, 1.0
    for what, times, unit, near in _UNITS:
        of_heights = what == "heights"
        values, other, slopes = (log_h, log_d, _SLOPES) if of_heights else (log_d, log_h, 1 / _SLOPES)
        sign = 1.0 if times > 1 else -1.0
        for slope in slopes:
            # High curves are flat: by its height alone a single tree's DBH cannot be told from another unit's.
            for by in ((None,) if of_heights else ()) + ((places,) if places is not None else ()):
                odd = _apart(sign * values, sign * slope * other, by)
                if odd is None or not max(2, 0.1 * len(odd)) <= odd.sum() <= 0.9 * len(odd):
                    continue
                among = odd & (other >= other[~odd].min()) & (other <= other[~odd].max())
                if among.sum() < max(3, 0.5 * odd.sum()):
                    continue
                left = _above(values, other, ~odd)
                shift = float(np.median(left[among]))
                off = abs(shift - np.log(times)) / near
                # Of plots nearly all trees belong to theirs; single trees leave a gap.
                low, high = np.quantile(sign * left[~odd], 0.95), np.quantile(sign * left[among], 0.05)
                if off < nearest and high - low > (_GAP_OF_TREES if by is None else 0.0) * abs(np.log(times)):
                    rows = np.zeros(len(h), bool)
                    rows[known[odd]] = True
                    best, nearest = MixedUnits(rows, len(known), what, float(np.exp(shift)), unit, of_heights), off
    return best


def _apart(values: np.ndarray, expected: np.ndarray, places: np.ndarray | None) -> np.ndarray | None:
    """(N,) the upper of the two groups that values less expected ones fall into, of trees or of places (their medians);
    ``None`` where there are no two."""
    left = values - expected
    if places is None:
        middles, of = left, np.arange(len(left))
    else:
        middles, of = np.array([np.median(left[places == k]) for k in range(places.max() + 1)]), places
    order = np.sort(middles)
    if len(order) < 2:
        return None
    count = np.arange(1, len(order))
    lower, total = np.cumsum(order)[:-1], order.sum()
    between = (lower / count - (total - lower) / (len(order) - count)) ** 2 * count * (len(order) - count)
    return (middles > order[np.argmax(between)])[of]


def _above(values: np.ndarray, other: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(N,) values less the median of the right ones with the nearest ``other``, without itself."""
    order = np.flatnonzero(right)[np.argsort(other[right], kind="stable")]
    at = np.searchsorted(other[order], other)[:, None] + np.arange(-_LEAST // 2, _LEAST // 2 + 2)
    near = order[np.clip(at, 0, len(order) - 1)]
    return values - np.nanmedian(np.where(near == np.arange(len(values))[:, None], np.nan, values[near]), axis=1)


def refuse_odd_heights(
    height_m: np.ndarray,
    dbh_cm: np.ndarray,
    where: Callable[[np.ndarray], str],
    remedy: str,
    plots: np.ndarray | None = None,
    units_only: bool = False,
) -> None:
    """Refuse heights that no tree of its DBH has. height_m, dbh_cm: (N,), NaN where there is none. where: of the first
    of a mask, for the sentence. plots: (N,) names, where they are known. units_only: a single odd height stays.

    Raises:
        InputError: heights in feet, all or some; DBHs in another unit than the others, by their heights; a height above
            120 m, below breast height, too slender.
    """
    h, d = np.asarray(height_m, float), np.asarray(dbh_cm, float)
    some = np.isfinite(h) & (d >= _THIN_CM)
    ratio = slenderness(h, d)
    if ratio > 100 * _SLENDER_STAND:
        raise InputError(
            f"{where(some)}: the trees are {ratio:.0f} times as high as they are thick (median of {int(some.sum())}), "
            f"expected 40 to 150: the heights look like feet in metres; {remedy}."
        )
    found = mixed_units(h, d, plots)
    if found is not None and found.certain:
        raise InputError(
            f"{where(found.rows)}: {found.text()}; correct them{', or ' + remedy if found.what == 'heights' else ''}."
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        slender = np.where(d >= _THIN_CM, h / d, np.nan)
        checks = (
            (h > 120, "expected up to 120"),
            (np.isfinite(d) & (h < _MIN_HEIGHT_M), "so low that it has no DBH, but one is given"),
            (slender > _SLENDER, "too much for its DBH"),
        )
    for bad, why in () if units_only else checks:
        if bad.any():
            dbh = f" (DBH {d[bad][0]:g} cm)" if np.isfinite(d[bad][0]) else ""
            raise InputError(f"{where(bad)}: a height of {h[bad][0]:.3g} m{dbh}, {why}; correct it, or {remedy}.")
