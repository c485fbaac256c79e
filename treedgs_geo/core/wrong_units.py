"""Values in another unit than their column says: seen by their ratio to what is known of the same trees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_DIAMETERS = (
    (2.54, "inches", "centimetres"),
    (0.1, "millimetres", "centimetres"),
    (100.0, "metres", "centimetres"),
    (30.48, "feet", "centimetres"),
    (1 / np.pi, "girths", "diameters"),
    (2.0, "radii", "diameters"),
)
_LENGTHS = (
    (0.3048, "feet", "metres"),
    (0.01, "centimetres", "metres"),
    (0.1, "decimetres", "metres"),
    (0.001, "millimetres", "metres"),
)
#: A ratio belongs to a unit within this share, and is none within the other; diameters of one tree by tape and from
#: data differ by a tenth at most, of a thin or hidden one by a quarter.
NEAR, _SAME = 0.15, 0.25
#: Of a mixed table this share has to be either right or in the one wrong unit: else its rows are other trees.
_EXPLAINED = 0.8
#: How many rows make a mixed table, and their share: diameters twice or half of another stem's are more common than a
#: ratio of 2.54 or pi; tenfold ones do not happen at all.
_FEW, _SHARE = (2, 0.1), (3, 0.15)


#: A single diameter ten times too large or small is one beyond these, cm.
ONE_CM = (3.0, 100.0)


@dataclass(frozen=True)
class WrongUnit:
    """Rows (N,) of a column whose values are ``ratio`` times what they should be; ``factor`` makes them right.

    is_unit: what they are (``inches``). read_as: what they were taken for (``centimetres``).
    """

    rows: np.ndarray
    n: int
    ratio: float
    factor: float
    is_unit: str
    read_as: str

    @property
    def whole(self) -> bool:
        """The column as a whole, not some of its rows."""
        return bool(self.rows.sum() >= 0.6 * self.n)

    def text(self, reference: str = "the measured ones") -> str:
        """``12 of 20 values are 0.39 times the measured ones, as inches read as centimetres are``."""
        k = int(self.rows.sum())
        return (
            f"{k} of {self.n} values {'is' if k == 1 else 'are'} {self.ratio:.2g} times {reference}, as {self.is_unit} "
            f"read as {self.read_as} are"
            + (" (or a decimal point is elsewhere)" if abs(np.log10(self.factor)) > 0.95 else "")
        )


def wrong_unit(values: np.ndarray, known: np.ndarray, lengths: bool = False) -> WrongUnit | None:
    """Whether a column, or some of its rows, is in another unit than ``known`` values of the same trees.

    values, known: (N,) in the same unit, NaN where there is none. lengths: distances, radii and heights instead of
    diameters. Fewer than three values of a column say nothing, unless one is ten times too large or small.
    """
    values, known = np.asarray(values, float), np.asarray(known, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(values / known)
    some = np.isfinite(ratio)
    n = int(some.sum())
    if not n:
        return None
    units = [
        (factor**sign, *((is_unit, read_as) if sign < 0 else (read_as, is_unit)))
        for factor, is_unit, read_as in (_LENGTHS if lengths else _DIAMETERS)
        for sign in (-1, 1)
    ]
    away = np.abs(np.where(some, ratio, np.inf) - np.log([[unit[0]] for unit in units]))
    nearest, fits = away.argmin(axis=0), away.min(axis=0) < np.log1p(NEAR)
    fine = int((np.abs(ratio[some]) < np.log1p(_SAME)).sum())
    best = None
    for k, (times, is_unit, read_as) in enumerate(units):
        rows = fits & (nearest == k)
        n_rows = int(rows.sum())
        tenfold = abs(np.log10(times)) > 0.95
        least, share = (1, 0.0) if tenfold else _SHARE if abs(np.log2(times)) < 1.1 else _FEW
        all_ = n >= 3 and n_rows >= 0.6 * n
        mixed = n_rows >= max(least, share * n) and n_rows + fine >= _EXPLAINED * n and fine >= 3
        # A single one is another tree's, unless no tree has it.
        odd = tenfold and n_rows and (n_rows > 1 or lengths or not ONE_CM[0] < values[rows][0] < ONE_CM[1])
        mixed = (mixed and not tenfold) or bool(odd)
        if (all_ or mixed) and (best is None or n_rows > best.rows.sum()):
            best = WrongUnit(rows, n, float(np.exp(np.median(ratio[rows]))), 1 / times, is_unit, read_as)
    return best
