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
    #: Largest lean searched for, degrees; above 10 a second search follows.
    max_lean_deg: float = 25.0
    #: Cell of the search grid, m.
    cell_m: float = 0.05
    #: Sideways error of a photo's pose at a stem, px.
    offset_sd_px: float = 0.3
    #: A small network (trained on simulated photos) is asked: ``auto`` = which measured stems are under ivy, how wide
    #: stems of low confidence are and, where a sample of the photos shows it stems that edges missed, where all stems
    #: are; ``low-confidence`` and ``full`` = the same without a sample; ``off`` = nothing.
    stem_network: str = "auto"
    #: Stems of low confidence that the network is asked about one by one, at most; the clearest first.
    most_asked: int = 16
    #: Seed of the random places that chance is measured at.
    seed: int = 7
    #: Threads; 0 = all.
    threads: int = 0
