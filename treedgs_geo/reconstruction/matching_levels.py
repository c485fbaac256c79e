"""How much is spent on a block: guided matching of a few pairs first, more pairs guided by what that gave, and every
feature with every other only where photos are still missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.progress import Reporter
from ..geotags.stations import are_precise

#: Share of the photos that must have geotag and gimbal angles for those to say where features are looked for.
GUIDED_SHARE = 0.9
#: Photos that each photo is matched with at most where geotags and gimbals guide the matching.
GUIDED_NEIGHBOURS = 12
#: Places described in a photo at most there (:mod:`.sift`).
GUIDED_FEATURES = 5000
#: A block of the first level is good enough when its photos are this sure at the stems, pixels: the median, and the
#: least sure of them (:func:`.covariance.posterior_of`). A stem's edges are fitted with a sideways error of 0.3 px for
#: each photo: what is sure to that costs no diameter (``docs/evidence/speed-accuracy.md``).
SURE_MEDIAN_PX, SURE_WORST_PX = 0.15, 0.3
#: The next level starts from the photos that are this sure at the stems, pixels, where they are this share; else anew.
KEPT_SURE_PX, KEPT_SHARE = 0.15, 0.5
#: And when what is left in the photos is no more than this, pixels: swaying shrubs leave 0.54 on ``plot_h``.
LEFT_PX = 0.6
#: And when no more than this share of the photos is not placed: one of 62 is not worth another level.
MISSING_SHARE = 0.03
#: After the level that a block guides, every feature is matched with every other only where fewer photos are placed.
PLACED_SHARE = 0.9
#: And when so many points tie each photo (median), seen in so many photos each (mean).
TIED_POINTS, TIED_TRACK = 100, 3.0


@dataclass(frozen=True)
class Level:
    """name: in ``run.json`` and the report. stage: what progress calls it. neighbours: photos that a photo is matched
    with. guided: own features, ``features`` a photo at most, matched where geotags and gimbals say, and placed by
    them; otherwise COLMAP's, every feature with every other, and placed by a mapper. again: guided by the block of
    the level before."""

    name: str
    stage: str
    neighbours: int
    guided: bool = False
    features: int = 0
    again: bool = False


def can_guide(xyz: np.ndarray, sd: np.ndarray, rotations: np.ndarray, ground: float) -> bool:
    """Whether geotags and gimbals say where to look for a feature of one photo in another.

    xyz, sd: (N, 3) geotags and their standard errors, metres. rotations: (N, 3, 3) of the gimbals. ground: height,
    metres. NaN is unknown.
    """
    known = np.isfinite(rotations).all(axis=(1, 2)) & np.isfinite(xyz).all(axis=1)
    return bool(known.mean() >= GUIDED_SHARE) and are_precise(xyz, sd) and bool(np.isfinite(ground))


def levels_of(neighbours: int, guidable: bool) -> list[Level]:
    """The levels that a block may take, the cheapest first. guidable: :func:`can_guide`."""
    full = Level("full", "without a guide", neighbours)
    fewer = min(neighbours, GUIDED_NEIGHBOURS)
    guided = Level("guided", "guided by geotags and gimbals", fewer, True, GUIDED_FEATURES)
    fine = Level("fine", "guided by the block so far", neighbours, True, GUIDED_FEATURES, True)
    return [guided, fine, full] if guidable else [full]


def better(level: Level, report: dict[str, Any], former: dict[str, Any]) -> bool:
    """Whether a level's block is better than the one of a level before: more photos, or as many from more matches of
    the same kind. How sure it is of its poses does not tell: more matches in moving crowns are less alike."""
    return report["registered"] >= former["registered"] + (not level.again)


def not_enough(level: Level, report: dict[str, Any]) -> str:
    """Why the block of this report is not good enough yet, empty where it is. Where crowns move, poses do not become
    surer without a guide, and single photos are not placed without one either: after ``again`` only the photos count,
    and a few may be missing."""
    missing = report["photos"] - report["registered"]
    median, worst, left = report["poses_px_median"], report["poses_px_worst"], report["reprojection_rms_px"]
    few = (1 - PLACED_SHARE) if level.again else MISSING_SHARE
    if missing > few * report["photos"]:
        return f"{missing} of {report['photos']} photos are not placed"
    if level.again:
        return ""
    if median is None or worst is None:
        return "how sure the poses are is not known"
    if median > SURE_MEDIAN_PX or worst > SURE_WORST_PX:
        return (
            f"poses are sure to {median:.2f} px (the worst {worst:.2f} px), wanted {SURE_MEDIAN_PX:g} px "
            f"({SURE_WORST_PX:g} px)"
        )
    if left > LEFT_PX:
        return f"{left:.2f} px are left in the photos, wanted {LEFT_PX:g} px"
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
