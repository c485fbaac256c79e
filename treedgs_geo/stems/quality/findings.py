"""What a limit is, and what it means for a tree to lie beyond some: the words of :mod:`.limits`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .reasons import REASONS

Level = Literal["check", "reject"]
Flag = Literal["ok", "check", "reject"]
Route = Literal["photos", "points", "survey"]
Settings = Mapping[str, float]

#: So many reasons that flag refuse a tree together: one is for the forester to look at, several at once were gross
#: errors in sparse clouds more often than not. Of photos a probability adds up what speaks against a stem
#: (:data:`.limits.PREDICTORS`).
TOGETHER: dict[Route, int] = {"points": 3, "survey": 3}


@dataclass(frozen=True)
class Bound:
    """Where a limit lies: a number, a share of the diameter, the larger of the two where both are given, or the value
    of a setting."""

    value: float | None = None
    share: float | None = None
    setting: str = ""

    def at(self, dbh_cm: float = float("nan"), settings: Settings | None = None) -> float:
        """The limit of one stem. dbh_cm: the diameter of which ``share`` is taken.

        Raises:
            KeyError: the limit is a setting that ``settings`` lacks.
        """
        if self.setting:
            return (settings or {})[self.setting]
        if self.share is None:
            assert self.value is not None
            return self.value
        shared = self.share * dbh_cm
        return shared if self.value is None else max(self.value, shared)

    def text(self, unit: str) -> str:
        """For the page: ``2 cm or 10 % of the DBH``."""
        if self.setting:
            return f"`{self.setting}`"
        parts = [] if self.value is None else [f"{self.value:g}{' ' * (unit != '°')}{unit}".strip()]
        if self.share is not None:
            parts.append(f"{100 * self.share:g} % of the DBH")
        return " or ".join(parts) + (", whichever is more" if len(parts) == 2 else "")


@dataclass(frozen=True)
class Limit:
    """One row. quantity: key under which the value is handed over. measured: the same in words. side: on which side of
    its bounds (not on them) a value is flagged. check, reject: from where on the tree is flagged or refused, ``None`` =
    never. source: the data or the reasoning that set the limit.

    Raises:
        ValueError: the reason is not in :data:`.reasons.REASONS`, or both bounds are missing.
    """

    reason: str
    quantity: str
    measured: str
    unit: str
    side: Literal["above", "below"]
    check: Bound | None
    reject: Bound | None
    source: str

    def __post_init__(self) -> None:
        if self.reason not in REASONS:
            raise ValueError(f"undocumented qc_reason {self.reason!r}")
        if self.check is None and self.reject is None:
            raise ValueError(f"{self.quantity}: a limit that neither flags nor refuses")

    def level(self, value: float, dbh_cm: float = float("nan"), settings: Settings | None = None) -> Level | None:
        """``"reject"``, ``"check"`` or ``None``; a value that is NaN says nothing."""
        levels: tuple[tuple[Level, Bound | None], ...] = (("reject", self.reject), ("check", self.check))
        for level, bound in levels:
            if bound is not None:
                limit = bound.at(dbh_cm, settings)
                if value > limit if self.side == "above" else value < limit:
                    return level
        return None


@dataclass(frozen=True)
class Findings:
    """The limits that a stem lies beyond, in the order of judging."""

    found: tuple[tuple[Limit, Level], ...] = ()

    def __add__(self, other: Findings) -> Findings:
        return Findings(self.found + other.found)

    def _reasons(self, wanted: Level) -> tuple[str, ...]:
        return tuple(dict.fromkeys(limit.reason for limit, level in self.found if level == wanted))

    @property
    def refused(self) -> tuple[str, ...]:
        """Reasons that refuse the tree by themselves."""
        return self._reasons("reject")

    @property
    def flagged(self) -> tuple[str, ...]:
        """Reasons that flag it."""
        return self._reasons("check")

    @property
    def reasons(self) -> tuple[str, ...]:
        """All of them once, those that refuse first."""
        return tuple(dict.fromkeys(self.refused + self.flagged))

    @property
    def quantities(self) -> frozenset[str]:
        """Quantities beyond a limit of theirs."""
        return frozenset(limit.quantity for limit, _ in self.found)

    def flag(self, route: Route) -> Flag:
        """``reject`` where one reason refuses or several flag (:data:`TOGETHER`)."""
        if self.refused or len(self.flagged) >= TOGETHER.get(route, math.inf):
            return "reject"
        return "check" if self.flagged else "ok"
