"""Settings of the route that finds and fits stems straight in the photos."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.settings import param
from ..quality.priors import BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M


@dataclass(frozen=True, kw_only=True)
class PhotoStemOptions:
    """Tuned on rendered plots; which ones is said in ``docs/evidence/photos.md``."""

    bh_m: float = param(
        BREAST_HEIGHT_M,
        kind="number",
        help="breast height above the ground",
        unit="m",
        minimum=LOWEST_BREAST_HEIGHT_M,
        maximum=HIGHEST_BREAST_HEIGHT_M,
    )
    min_dbh_cm: float = param(7.5, kind="number", help="thinner stems are refused as too small", unit="cm", minimum=2)
    max_dbh_cm: float = param(90.0, kind="number", help="thickest stem that is looked for", unit="cm", maximum=300)
    margin_m: float = param(1.0, kind="number", help="look this far beyond the plots", unit="m", minimum=0, maximum=10)
    max_views: int = param(
        96, kind="integer", help="most photos used, spread over the directions", minimum=3, advanced=True
    )
    max_lean_deg: float = param(
        25.0,
        kind="number",
        help="largest lean searched for; above 10 a second search follows",
        unit="deg",
        minimum=0,
        maximum=30,
        advanced=True,
    )
    cell_m: float = param(
        0.05, kind="number", help="cell of the search grid", unit="m", minimum=0.02, maximum=0.1, advanced=True
    )
    offset_sd_px: float = param(
        0.3,
        kind="number",
        help="sideways error of a photo's pose at a stem",
        unit="px",
        minimum=0,
        maximum=3,
        advanced=True,
    )
    stem_network: str = param(
        "auto",
        kind="choice",
        help="a small network (trained on simulated photos) is asked: auto = which measured stems are under ivy, how "
        "wide stems of low confidence are and, where too many stems are not certain without it, where all stems are; "
        "off = nothing",
        choices=("auto", "off"),
        advanced=True,
    )
    #: Share of the seen stems that are certain by their edges, from which the network is not asked where all stems are.
    enough_certain: float = 0.75
    most_asked: int = param(
        16,
        kind="integer",
        help="stems of low confidence that the network is asked about one by one, at most; the clearest first",
        minimum=0,
        advanced=True,
    )
    seed: int = param(
        7, kind="integer", help="seed of the random places that chance is measured at", minimum=0, advanced=True
    )
    threads: int = param(0, kind="integer", help="threads, 0 = all", minimum=0, advanced=True)
