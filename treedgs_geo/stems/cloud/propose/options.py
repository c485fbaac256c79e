"""Settings of stem segmentation in point clouds (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass

from ....core.settings import param


@dataclass(frozen=True, kw_only=True)
class SegmentOptions:
    """How stems are found. ``source`` sets the noise and density that are expected.

    Of the library only: max_lean_deg: more lean is refused. low_m, high_m: of the band that is searched.
    min_arc_deg: least circumference seen, degrees, all rows together. min_rows: share of 25 cm rows of the band
    that must show bark. grow_m: height up to which stem points are followed, metres.
    """

    source: str = param("auto", help="what made the points", choices=("auto", "uls", "tls", "splat"))
    max_dbh_cm: float = param(100.0, help="thickest stem", unit="cm", minimum=5, maximum=500)
    max_lean_deg: float = 25.0
    low_m: float = 0.5
    high_m: float = 5.0
    min_arc_deg: float = 90.0
    min_rows: float = 0.4
    grow_m: float = 15.0

    @property
    def fitted_m(self) -> tuple[float, float]:
        """Heights between which cones are fitted to the points, metres."""
        return self.low_m - 0.1, min(self.high_m, 4.25)
