"""Settings of fitting and sampling Gaussians (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..core.settings import param
from ..trees.priors import BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M

#: Numbers behind each preset; every one can be overridden by the option of the same name.
GAUSSIAN_PRESETS: dict[str, dict[str, float]] = {
    "fast": {
        "gaussians": 600,
        "coarse_epochs": 8,
        "fine_epochs": 2,
        "max_views": 24,
        "ssim": 0.1,
        "normals": 0.0,
        "fog": 0.07,
        "smoothing_px": 0.0,
    },
    "balanced": {
        "gaussians": 1000,
        "coarse_epochs": 8,
        "fine_epochs": 6,
        "max_views": 32,
        "ssim": 0.1,
        "normals": 0.0,
        "fog": 0.07,
        "smoothing_px": 0.0,
    },
    "best": {
        "gaussians": 2000,
        "coarse_epochs": 10,
        "fine_epochs": 10,
        "max_views": 48,
        "ssim": 0.1,
        "normals": 0.0,
        "fog": 0.07,
        "smoothing_px": 0.0,
    },
    "paper": {
        "gaussians": 3000,
        "coarse_epochs": 10,
        "fine_epochs": 10,
        "max_views": 48,
        "ssim": 0.2,
        "normals": 0.05,
        "fog": 0.0,
        "smoothing_px": 0.447,
    },
}


@dataclass(frozen=True, kw_only=True)
class GaussianOptions:
    """How stems become Gaussians. Options left empty follow the preset."""

    preset: str = param("balanced", kind="choice", choices=tuple(GAUSSIAN_PRESETS), help="how much work is spent")
    gaussians: int | None = param(
        None, kind="integer", help="Gaussians per stem", minimum=10, maximum=100000, advanced=True
    )
    max_gaussians: int = param(
        60000,
        kind="integer",
        help="hard limit on Gaussians in all; shared among the stems",
        minimum=10,
        maximum=10_000_000,
        advanced=True,
    )
    coarse_epochs: int | None = param(
        None, kind="integer", help="passes over the crops at half resolution", minimum=1, maximum=1000, advanced=True
    )
    fine_epochs: int | None = param(
        None, kind="integer", help="passes over the crops at full resolution", minimum=0, maximum=1000, advanced=True
    )
    max_views: int | None = param(
        None, kind="integer", help="photos used per stem", minimum=1, maximum=1000, advanced=True
    )
    ssim: float | None = param(
        None, kind="number", help="share of D-SSIM in the photometric loss", minimum=0, maximum=1, advanced=True
    )
    normals: float | None = param(
        None, kind="number", help="weight of depth-normal consistency", minimum=0, maximum=10, advanced=True
    )
    fog: float | None = param(
        None,
        kind="number",
        help="price of covering a pixel, in mean absolute colour (0..1); keeps Gaussians from explaining the ground",
        minimum=0,
        maximum=1,
        advanced=True,
    )
    smoothing_px: float | None = param(
        None,
        kind="number",
        help="3D smoothing filter of free Gaussians, in pixels' footprints; 0 = none",
        minimum=0,
        maximum=3,
        advanced=True,
    )
    band_m: float = param(
        3.0, kind="number", help="top of the modelled stem band above ground", unit="m", minimum=1.5, maximum=20
    )
    radius_m: float = param(
        0.5, kind="number", help="radius of the modelled cylinder about each seed", unit="m", minimum=0.1, maximum=5
    )
    mask_foliage: bool = param(
        True, kind="flag", help="leave out green pixels where the photos' colours show a clear split", advanced=True
    )
    stems: str = param(
        "primitive",
        kind="choice",
        choices=("primitive", "start", "free"),
        help="primitive = a tapered stem is fitted in one loop with the Gaussians around it, and its bark written as "
        "Gaussians; start = its bark Gaussians are then fitted freely; free = nothing but Gaussians, as published",
    )
    stem_gaussians: int = param(
        300,
        kind="integer",
        help="Gaussians around a stem primitive (twigs and leaves before and beside it)",
        minimum=0,
        maximum=100000,
        advanced=True,
    )
    stem_epochs: int = param(
        4,
        kind="integer",
        help="passes over the crops in which primitive and Gaussians are fitted together",
        minimum=0,
        maximum=1000,
        advanced=True,
    )
    bh_m: float = param(
        BREAST_HEIGHT_M,
        kind="number",
        help="breast height above the ground",
        unit="m",
        minimum=LOWEST_BREAST_HEIGHT_M,
        maximum=HIGHEST_BREAST_HEIGHT_M,
        advanced=True,
    )
    density: str = param(
        "relocate",
        kind="choice",
        choices=("relocate", "split"),
        advanced=True,
        help="of free Gaussians: relocate = a fixed number, dead ones move onto live ones; split = split, clone and "
        "prune up to the limit",
    )
    controller: str = param(
        "fixed",
        kind="choice",
        choices=("fixed", "plateau", "backtrack", "rlgs"),
        advanced=True,
        help="of free Gaussians: fixed = every epoch of the preset; plateau = stop when two held-out photos no longer "
        "improve; backtrack = go back to the last good state with smaller steps instead; rlgs = a learned policy "
        "chooses the steps (several times slower)",
    )
    device: str = param(
        "cpu",
        kind="choice",
        choices=("cpu", "cuda"),
        advanced=True,
        help="where Gaussians are drawn: cpu, or cuda = an NVIDIA GPU through the optional package warp-lang",
    )
    threads: int = param(2, kind="integer", help="stems fitted at once", minimum=1, maximum=256, advanced=True)
    seed: int = param(0, kind="integer", help="random seed", minimum=0, maximum=2**31 - 1, advanced=True)

    def value(self, name: str) -> float:
        """The option, or the preset's value where it was left empty."""
        own = getattr(self, name)
        return GAUSSIAN_PRESETS[self.preset][name] if own is None else own

    @property
    def free(self) -> bool:
        """No stem primitive: asked for, or the published method."""
        return self.stems == "free" or self.preset == "paper"


@dataclass(frozen=True, kw_only=True)
class SampleOptions:
    """How a field becomes points."""

    samples: int = param(100, kind="integer", help="candidate points drawn per Gaussian (M)", minimum=1, maximum=10000)
    law: str = param(
        "clamp",
        kind="choice",
        choices=("clamp", "vacancy"),
        advanced=True,
        help="opacity law: clamp = RaDe-GS depth clamp, vacancy = stochastic solid",
    )
    tau: float = param(
        0.0,
        kind="number",
        minimum=0,
        maximum=1,
        advanced=True,
        help="keep points whose smallest opacity over the views is above this",
    )
    seen_transmittance: float = param(
        0.02,
        kind="number",
        minimum=0,
        maximum=1,
        advanced=True,
        help="a view sees a point when more than this share of light gets past what is in front of it; "
        "Gaussians that no view sees are dropped (0 keeps all)",
    )
    quantile: float = param(
        0.0,
        kind="number",
        minimum=0,
        maximum=0.5,
        advanced=True,
        help="opacity kept of a point: this quantile over its foreground views; 0 = the smallest, as published",
    )
    min_foreground: float = param(
        0.0,
        kind="number",
        minimum=0,
        maximum=1,
        advanced=True,
        help="a view counts as foreground where the accumulated alpha is above this",
    )
    threads: int = param(2, kind="integer", help="views scored at once", minimum=1, maximum=256, advanced=True)
    seed: int = param(0, kind="integer", help="random seed", minimum=0, maximum=2**31 - 1, advanced=True)


#: The constants of the paper (M = 100, tau = 0); nothing is dropped for being unseen.
PAPER_SAMPLING: dict[str, Any] = {
    "samples": 100,
    "law": "clamp",
    "tau": 0.0,
    "seen_transmittance": 0.0,
    "quantile": 0.0,
    "min_foreground": 0.0,
}
