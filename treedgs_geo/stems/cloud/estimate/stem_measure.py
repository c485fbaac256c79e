"""What the points say about one stem, by whichever method."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...geometry.cone import Cone
from ...quality.assessment import Assessment
from .rings import Inside


@dataclass(frozen=True)
class StemMeasure:
    """One stem's measurement. cone: in the tree's own frame, metres. assessment: diameter, error, flag and reasons.
    arc_deg: circumference covered by bark. taper_cm_m: change of the diameter with height. noise_m: spread of the
    points about the bark, NaN unknown. inside: points on its inner side."""

    cone: Cone | None
    assessment: Assessment
    arc_deg: float = 0.0
    points: int = 0
    slices: int = 0
    taper_cm_m: float | None = None
    noise_m: float = float("nan")
    inside: Inside = Inside()

    def assessed(self, assessment: Assessment, cone: Cone | None = None) -> StemMeasure:
        """The same with more evidence; cone: instead of its own."""
        return replace(self, assessment=assessment, cone=cone or self.cone)


def refuse(*reasons: str, cone: Cone | None = None, points: int = 0) -> StemMeasure:
    """A stem without a number."""
    return StemMeasure(cone, Assessment.refused(*reasons), points=points)
