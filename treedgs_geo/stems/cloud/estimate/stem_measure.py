"""What the points say about one stem: diameter, error, flag and reasons, by whichever method."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...geometry.cone import Cone
from ...quality.findings import Findings, Flag


@dataclass(frozen=True)
class StemMeasure:
    """One stem's measurement. cone: in the tree's own frame, metres. dbh_cm, se_cm: diameter and standard error, cm;
    ``None`` when refused (and no error where the method has none). reasons: keys of
    :data:`treedgs_geo.stems.quality.reasons.REASONS`. arc_deg: circumference covered by bark. taper_cm_m: change of the
    diameter with height. noise_m: spread of the points about the bark, NaN unknown."""

    cone: Cone | None
    dbh_cm: float | None
    se_cm: float | None
    flag: Flag
    reasons: tuple[str, ...]
    arc_deg: float = 0.0
    points: int = 0
    slices: int = 0
    taper_cm_m: float | None = None
    noise_m: float = float("nan")

    def with_flagged(self, found: Findings) -> StemMeasure:
        """The same with further reasons for a check; a refused stem stays refused."""
        if not found.reasons:
            return self
        flag: Flag = "check" if self.flag == "ok" else self.flag
        return replace(self, flag=flag, reasons=tuple(dict.fromkeys(self.reasons + found.reasons)))


def refuse(*reasons: str, cone: Cone | None = None, points: int = 0) -> StemMeasure:
    """A stem without a number."""
    return StemMeasure(cone, None, None, "reject", reasons, points=points)
