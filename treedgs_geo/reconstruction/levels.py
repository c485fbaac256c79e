"""How much is spent on a block: few features first, and more only where the poses are not sure enough with them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..core.progress import Reporter

#: Contrast that a feature needs at least: all that tell anything, and those that photos of another angle show as well.
ALL_FEATURES, CLEAR_FEATURES = 0.0067, 0.02
#: A block of the first level is good enough when its photos are this sure at the stems, pixels: the median, and the
#: least sure of them (:func:`.posterior.posterior_of`; ``docs/evidence/speed-accuracy.md``).
SURE_MEDIAN_PX, SURE_WORST_PX = 0.25, 1.0
#: And when so many points tie each photo (median), seen in so many photos each (mean).
TIED_POINTS, TIED_TRACK = 100, 3.0


@dataclass(frozen=True)
class Level:
    """name: in ``run.json`` and the report. contrast: that a feature needs. guided: matched where geotags and gimbals
    say, and placed by them; otherwise every feature with every other, and placed by a mapper."""

    name: str
    max_features: int
    neighbours: int
    contrast: float
    guided: bool


def levels_of(max_features: int, neighbours: int, can_guide: bool) -> list[Level]:
    """The levels that a block may take, the cheapest first. can_guide: geotags and gimbals are good enough to say where
    a feature lies in another photo."""
    full = Level("full", max_features, neighbours, ALL_FEATURES, False)
    return [Level("guided", max_features, min(neighbours, 12), ALL_FEATURES, True), full] if can_guide else [full]


def doubts(report: dict[str, Any]) -> str:
    """Why the block of this report is not good enough yet, empty where it is."""
    left = report["photos"] - report["registered"]
    median, worst = report["poses_px_median"], report["poses_px_worst"]
    if left:
        return f"{left} of {report['photos']} photos are not placed"
    if median is None or median > SURE_MEDIAN_PX or worst > SURE_WORST_PX:
        return f"poses are sure to {median} px (worst {worst} px), wanted {SURE_MEDIAN_PX} px ({SURE_WORST_PX} px)"
    if report["points_per_photo_median"] < TIED_POINTS or report["track_length"] < TIED_TRACK:
        return (
            f"photos are tied by {report['points_per_photo_median']:.0f} points (median) that "
            f"{report['track_length']:.1f} photos show"
        )
    return ""


class Held(Reporter):
    """Passes progress on and keeps messages back until it is clear that the work they tell of is used."""

    def __init__(self, inner: Reporter) -> None:
        super().__init__()
        self._inner = inner
        self._kept: list[tuple[str, dict[str, Any]]] = []

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind in ("warn", "info"):
            self._kept.append((kind, body))
        elif kind == "progress":
            self._inner.progress(body["fraction"], body["message"])
        else:
            self._inner._emit(kind, body)

    def release(self) -> None:
        """The messages, in their order."""
        for kind, body in self._kept:
            self._inner._emit(kind, body)
        self._kept.clear()
