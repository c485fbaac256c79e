"""Settings of fitting and sampling Gaussians (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...core.settings import param


def time_limit_option() -> Any:
    """How long the fit may take."""
    return param(
        60.0,
        unit="min",
        help="Of the published method: CPU time that fitting Gaussians over the whole plot may take; a short one means "
        "fewer steps and smaller photos, and the report says how far it came.",
        minimum=0.1,
        maximum=10_000,
    )


def device_option() -> Any:
    """What fits."""
    return param(
        "cpu",
        choices=("cpu", "cuda"),
        help="Of the published method: where the Gaussians are fitted; cuda = an NVIDIA GPU, through "
        "the packages warp-lang and torch (its CUDA build); the time limit then counts by the clock.",
    )


def dense_option() -> Any:
    """Whose points the fit starts from."""
    return param(
        None,
        help="Of the published method: points to start the Gaussians from, OpenMVS's scene_dense.ply made from the "
        "workspace's sfm folder, or LAS/LAZ in the project CRS; without it our own stereo makes them.",
        suffixes=(".ply", ".laz", ".las"),
    )


@dataclass(frozen=True, kw_only=True)
class SampleOptions:
    """How a field becomes points; of the library only.

    samples: candidate points drawn per Gaussian (M). threads: views scored at once. seed: of the drawn points.
    """

    samples: int = 100
    threads: int = 2
    seed: int = 0


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
