"""Numbers in words: one rounding, so that page, sheet, map and table read the same, one plural, one list."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

#: Decimals of diameters and their errors in a tree layer.
LAYER_DECIMALS = 2


def half_up(value: float, decimals: int) -> float:
    """A finite number as QGIS and people round it: 0.25 and 0.35 become 0.3 and 0.4 (Python: 0.2 and 0.3).

    Examples:
        >>> half_up(0.25, 1), half_up(0.35, 1), half_up(-1.005, 2)
        (0.3, 0.4, -1.01)
    """
    return float(Decimal(repr(float(value))).quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_UP))


def shown_cm(value: float) -> str:
    """A diameter or its error, cm, with one decimal: from what the tree layer keeps of it, as the map shows it.

    Examples:
        >>> shown_cm(0.346), shown_cm(0.344)
        ('0.4', '0.3')
    """
    return f"{half_up(round(float(value), LAYER_DECIMALS), 1):.1f}"


def some(names: Iterable[Any], limit: int, joint: str = ", ") -> str:
    """The first few names in a row, with an ellipsis where there are more.

    Examples:
        >>> some([3, 5, 8], 2), some("ab", 2, "; ")
        ('3, 5, …', 'a; b')
    """
    texts = [str(name) for name in names]
    return joint.join(texts[:limit] + ["…"] * (len(texts) > limit))


def shorten(names: list[str], most: int = 5) -> str:
    """The first few names in a row, and how many more there are.

    Examples:
        >>> shorten(["a", "b", "c"], 2)
        'a, b and 1 more'
    """
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def count_of(n: int, what: str) -> str:
    """``1 tree``, ``2 trees``."""
    return f"{n} {what}{'' if n == 1 else 's'}"
