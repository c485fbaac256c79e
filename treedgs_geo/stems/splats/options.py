"""Settings of fitting and sampling Gaussians (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...core.settings import param
from ..quality.priors import BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M


@dataclass(frozen=True, kw_only=True)
class GaussianOptions:
    """How stems in photos become primitives, and Gaussians on their bark.

    Of the library only: gaussians: most of a stem. max_views: photos used per stem. band_m: top of the modelled band
    above the ground, radius_m: of the modelled cylinder about each seed, metres. threads: stems fitted at once.
    """

    bh_m: float = param(
        BREAST_HEIGHT_M,
        help="breast height above the ground",
        unit="m",
        minimum=LOWEST_BREAST_HEIGHT_M,
        maximum=HIGHEST_BREAST_HEIGHT_M,
    )
    gaussians: int = 3000
    max_views: int = 60
    band_m: float = 3.0
    radius_m: float = 0.5
    threads: int = 2


@dataclass(frozen=True, kw_only=True)
class SampleOptions:
    """How a field becomes points.

    Of the library only: threads: views scored at once. seed: of the drawn points. seen_transmittance: a view sees a
    point when more than this share of light gets past what is in front of it; Gaussians that no view sees are dropped
    (0 keeps all).
    """

    samples: int = param(100, help="candidate points drawn per Gaussian (M)", minimum=1, maximum=10000)
    threads: int = 2
    seed: int = 0
    seen_transmittance: float = 0.02


#: As published: M = 100, and nothing is dropped for being unseen.
PAPER_SAMPLING: dict[str, Any] = {"samples": 100, "seen_transmittance": 0.0}


#: Steps of the published fit.
PUBLISHED_STEPS = 30_000


@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """The published fit of a whole plot (``on_torch/scene_fit.py``); of the library only.

    steps: optimiser steps, 30,000 as published; everything that happens on the way is scheduled by the share of them
    that is done. time_limit_min: CPU minutes that the fit may take (of a GPU: minutes); then fewer steps are planned,
    and where those are too few, smaller photos. max_gaussians: no split or clone beyond, and half as many points of the
    prior start them (published: no limit). tried_every: RLGS tries its proposals in every so-manyth phase and keeps the
    last rates in between (published: 1, which takes seven times as long), 0 = never. phase_steps: steps of a phase (K).
    factor: size of the photos, 0 = as the time limit asks for. device: ``cpu`` or ``cuda``. seed: of all draws.
    """

    steps: int = PUBLISHED_STEPS
    time_limit_min: float | None = None
    max_gaussians: int = 200_000
    tried_every: int = 8
    phase_steps: int = 20
    factor: float = 0.0
    device: str = "cpu"
    seed: int = 0
