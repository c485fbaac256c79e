"""Settings of the route that finds and fits stems straight in the photos."""

from __future__ import annotations

from dataclasses import dataclass

from ..quality.priors import BREAST_HEIGHT_M


@dataclass(frozen=True, kw_only=True)
class PhotoStemOptions:
    """Tuned on rendered plots; which ones is said in ``docs/evidence/photos.md``."""

    #: Breast height above the ground, m.
    bh_m: float = BREAST_HEIGHT_M
    #: Thinner stems are refused as too small; thickest stem that is looked for, cm.
    min_dbh_cm: float = 7.5
    max_dbh_cm: float = 90.0
    #: How far beyond the plots stems are looked for, m.
    margin_m: float = 1.0
    #: Most photos used, spread over the directions.
    max_views: int = 96
    #: Pixels finer than this at the stems are averaged to it, m.
    finest_gsd_m: float = 0.008
    #: Largest lean searched for, degrees (by edges alone: 10).
    max_lean_deg: float = 25.0
    #: Sideways error of a photo's pose at a stem, px.
    offset_sd_px: float = 0.3
    #: A small network (trained on simulated photos) is asked where stems stand, how wide they are and which are under
    #: ivy: ``auto`` = where the photos show the ground behind the stems; ``off`` = never.
    stem_network: str = "auto"
    #: Seed of the random places that chance is measured at.
    seed: int = 7
    #: Threads; 0 = all.
    threads: int = 0
