"""Settings of measuring stems in point clouds (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass

from ....core.settings import param
from ...quality.priors import BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M


@dataclass(frozen=True, kw_only=True)
class MeasureOptions:
    """How stems are measured.

    Of the library only: max_lean_deg: more lean is refused. seed: of the random draws.
    """

    weights: str = param(
        "none",
        help="reliability of the points: none, LiDAR intensity, or opacity of surface points",
        choices=("none", "intensity", "opacity"),
    )
    fit: str = param("circle", help="cross-section model", choices=("circle", "cylinder"))
    method: str = param(
        "default", help="default = our estimator; paper = the published constants", choices=("default", "paper")
    )
    bh_m: float = param(
        BREAST_HEIGHT_M, help="breast height", unit="m", minimum=LOWEST_BREAST_HEIGHT_M, maximum=HIGHEST_BREAST_HEIGHT_M
    )
    min_dbh_cm: float = param(5.0, help="thinner stems are refused as too small", unit="cm", minimum=1, maximum=100)
    max_dbh_cm: float = param(100.0, help="thicker stems are refused as too large", unit="cm", minimum=5, maximum=500)
    max_lean_deg: float = 25.0
    source: str = param("auto", help="what made the points", choices=("auto", "uls", "tls", "splat"))
    seed: int = 0
