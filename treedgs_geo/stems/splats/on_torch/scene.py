"""The Gaussians of a whole scene as torch tensors with their optimiser; split, clone and prune as published (3DGS,
RaDe-GS) keep both together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ..camera import CropCamera
from ..field import GaussianField
from .harmonics import COEFFICIENTS, colours_of, constant_of
from .project import placed, turned
from .rasterize import Rendered, rasterize

#: Steps of Adam as published (3DGS); the positions' are shares of the scene's extent and fall to a hundredth.
RATES = {
    "means": 1.6e-4,
    "quats": 1e-3,
    "log_scales": 5e-3,
    "opacity_logits": 5e-2,
    "constant": 2.5e-3,
    "harmonics": 2.5e-3 / 20,
}
#: Opacity at the start, as published.
_FIRST_OPACITY = 0.1


class Scene:
    """N Gaussians: ``tensors`` by the names of :data:`RATES` (means (N, 3), quats (N, 4), log_scales (N, 3),
    opacity_logits (N,), constant (N, 1, 3) and harmonics (N, K - 1, 3) of the colours), ``optimiser`` and ``filter_m``
    (N,), the 3D smoothing filter."""

    def __init__(self, points: np.ndarray, colours: np.ndarray, scales_m: np.ndarray, device: str = "cpu") -> None:
        """points: (N, 3) local. colours: (N, 3) 0..1. scales_m: (N,) standard deviations."""

        def leaf(value: Any) -> torch.Tensor:
            return torch.as_tensor(np.asarray(value), dtype=torch.float32, device=device).contiguous().requires_grad_()

        n = len(points)
        self.tensors = {
            "means": leaf(points),
            "quats": leaf(np.tile([1.0, 0, 0, 0], (n, 1))),
            "log_scales": leaf(np.tile(np.log(scales_m)[:, None], (1, 3))),
            "opacity_logits": leaf(np.full(n, np.log(_FIRST_OPACITY / (1 - _FIRST_OPACITY)))),
            "constant": leaf(constant_of(torch.as_tensor(colours))[:, None]),
            "harmonics": leaf(np.zeros((n, COEFFICIENTS[-1] - 1, 3))),
        }
        self.filter_m = torch.zeros(n, device=device)
        groups = [{"params": [tensor], "lr": RATES[name], "name": name} for name, tensor in self.tensors.items()]
        self.optimiser = torch.optim.Adam(groups, eps=1e-15, fused=True)

    def __len__(self) -> int:
        return len(self.tensors["means"])

    @property
    def device(self) -> torch.device:
        """Where the tensors are."""
        return self.tensors["means"].device

    def smoothed(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Log-scales and opacity logits with the 3D smoothing filter worked in (Mip-Splatting, arXiv 2311.16493)."""
        square, added = torch.exp(2 * self.tensors["log_scales"]), (self.filter_m**2)[:, None]
        shrunk = 0.5 * torch.log(square / (square + added)).sum(dim=1)
        log_opacity = torch.nn.functional.logsigmoid(self.tensors["opacity_logits"]) + shrunk
        log_opacity = log_opacity.clamp(-20.0, -1e-6)
        return 0.5 * torch.log(square + added), log_opacity - torch.log(-torch.expm1(log_opacity))

    def render(self, camera: CropCamera, degree: int, geometry: bool) -> Rendered:
        """What a camera sees, with colours up to a degree of harmonics."""
        log_scales, logits = self.smoothed()
        colours = self.tensors["constant"]
        if degree > 0:
            colours = torch.cat([colours, self.tensors["harmonics"][:, : COEFFICIENTS[degree] - 1]], dim=1)
        means, quats = self.tensors["means"], self.tensors["quats"]
        return rasterize(means, quats, log_scales, logits, colours, camera, geometry=geometry)

    def keep(
        self, which: torch.Tensor, new: dict[str, torch.Tensor] | None = None, filter_m: torch.Tensor | None = None
    ) -> None:
        """Only the Gaussians of a mask (N,), their optimiser's moments with them; behind them new ones, without
        moments. new: their tensors by name; filter_m: theirs."""
        for group in self.optimiser.param_groups:
            name, old = group["name"], group["params"][0]
            state, tensor = self.optimiser.state.pop(old, None), old.detach()[which]
            tensor = tensor if new is None else torch.cat([tensor, new[name]])
            tensor = tensor.contiguous().requires_grad_()
            group["params"][0] = self.tensors[name] = tensor
            if state:
                for key in ("exp_avg", "exp_avg_sq"):
                    moment = torch.zeros_like(tensor, requires_grad=False)
                    kept = state[key][which]
                    moment[: len(kept)] = kept
                    state[key] = moment
                self.optimiser.state[tensor] = state
        self.filter_m = self.filter_m[which] if filter_m is None else torch.cat([self.filter_m[which], filter_m])

    def fade(self, opacity: float) -> None:
        """Opacities above ``opacity`` fall to it and lose their moments (the published reset)."""
        most = float(np.log(opacity / (1 - opacity)))
        with torch.no_grad():
            self.tensors["opacity_logits"].clamp_(max=most)
        state = self.optimiser.state.get(self.tensors["opacity_logits"], {})
        for name in ("exp_avg", "exp_avg_sq"):
            if name in state:
                state[name].zero_()

    def save(self) -> dict[str, Any]:
        """Copies of everything a step changes."""
        states = {name: self.optimiser.state.get(tensor, {}) for name, tensor in self.tensors.items()}
        return {
            "tensors": {name: tensor.detach().clone() for name, tensor in self.tensors.items()},
            "states": {name: {key: part.clone() for key, part in state.items()} for name, state in states.items()},
            "filter_m": self.filter_m.clone(),
        }

    def restore(self, kept: dict[str, Any]) -> None:
        """Back to :meth:`save`."""
        for group in self.optimiser.param_groups:
            name = group["name"]
            self.optimiser.state.pop(group["params"][0], None)
            tensor = kept["tensors"][name].clone().requires_grad_()
            group["params"][0] = self.tensors[name] = tensor
            if kept["states"][name]:
                self.optimiser.state[tensor] = {key: value.clone() for key, value in kept["states"][name].items()}
        self.filter_m = kept["filter_m"].clone()

    def field(self) -> GaussianField:
        """As a field, filter worked in, colours as seen from all sides (degree 0)."""
        with torch.no_grad():
            log_scales, logits = self.smoothed()
            colours = colours_of(self.tensors["constant"][:, 0])
            parts = [self.tensors["means"], self.tensors["quats"], log_scales, logits[:, None], colours]
            packed = torch.cat([part.cpu().double() for part in parts], dim=1).numpy()
        return GaussianField.from_packed(packed[np.isfinite(packed).all(axis=1)])


def update_filter(scene: Scene, cameras: list[CropCamera]) -> None:
    """Set the 3D smoothing filter (Mip-Splatting): the root of 0.2 of a pixel of the nearest photo that shows the
    Gaussian; those that none shows get the largest."""
    means = scene.tensors["means"].detach()
    nearest = torch.full((len(means),), torch.inf, device=means.device)
    for camera in cameras:
        local = means @ placed(camera.rotation, means).T + placed(camera.translation, means)
        z = local[:, 2].clamp_min(1e-6)
        u, v = camera.fx * local[:, 0] / z + camera.cx, camera.fy * local[:, 1] / z + camera.cy
        # A margin, because an ellipse reaches further than its centre.
        near_u, near_v = 0.15 * camera.width, 0.15 * camera.height
        inside = (local[:, 2] > 0) & (u > -near_u) & (u < camera.width + near_u)
        inside = inside & (v > -near_v) & (v < camera.height + near_v)
        nearest = torch.where(inside, torch.minimum(nearest, z / camera.fx), nearest)
    known = torch.isfinite(nearest)
    most = nearest[known].max() if bool(known.any()) else torch.tensor(0.0, device=means.device)
    scene.filter_m = torch.where(known, nearest, most) * 0.2**0.5


@dataclass(frozen=True)
class DensityRule:
    """The published numbers; times are shares of the fit (of 30,000 steps).

    grow: mean gradient on a centre, in half picture widths, from which a Gaussian is split or cloned. large: share of
    the scene's extent up to which it is cloned, above it is split. shrink: of the two halves of a split. faint: pruned
    below this opacity. huge: pruned above this share of the extent, once opacities have been reset. Nothing is pruned
    for its width in a photo: the released code never does (its radii are zero by then), and stems are long and even.
    begin, end, every: of the densification. reset: share between two resets of the opacities to ``reset_to``.
    rest_steps: nothing is pruned for being faint in so many steps after a reset; resets follow each other by three
    times as many at least.
    """

    grow: float = 2e-4
    large: float = 0.01
    shrink: float = 1.6
    faint: float = 0.05
    huge: float = 0.1
    begin: float = 500 / 30_000
    end: float = 0.5
    every: float = 100 / 30_000
    reset: float = 3_000 / 30_000
    reset_to: float = 0.01
    rest_steps: int = 100


def grow(
    scene: Scene,
    pull: torch.Tensor,
    extent_m: float,
    room: int,
    rule: DensityRule,
    generator: torch.Generator,
    grow_factor: float = 1.0,
    shrink_factor: float = 1.0,
) -> tuple[int, int]:
    """Clone the small and split the large Gaussians that are pulled at, the most pulled first, as far as ``room`` (how
    many more there may be) reaches. pull: (2, N) how much the photos have pulled at each centre since the last
    densification, in half picture widths, and how many photos. grow_factor, shrink_factor: the controller's. Returns
    how many were split and cloned."""
    mean = pull[0] / pull[1].clamp_min(1)
    chosen = torch.nonzero(mean >= rule.grow * grow_factor)[:, 0]
    if len(chosen) > room:
        chosen = chosen[torch.argsort(-mean[chosen], stable=True)[: max(room, 0)]]
        chosen = torch.sort(chosen)[0]
    if len(chosen) == 0:
        return 0, 0
    tensors = {name: tensor.detach() for name, tensor in scene.tensors.items()}
    large = torch.exp(tensors["log_scales"][chosen]).max(dim=1).values > rule.large * extent_m
    cloned, split = chosen[~large], chosen[large]
    new = {name: torch.cat([tensor[cloned], tensor[split], tensor[split]]) for name, tensor in tensors.items()}
    # The halves of a split are drawn from the Gaussian that they stand for.
    own = split.repeat(2)
    scales = torch.exp(tensors["log_scales"][own])
    draw = torch.randn(scales.shape, generator=generator).to(scales.device) * scales
    moved = (turned(tensors["quats"][own]) @ draw[:, :, None])[:, :, 0]
    new["means"] = torch.cat([tensors["means"][cloned], tensors["means"][own] + moved])
    shrink = max(rule.shrink * shrink_factor, 1.05)
    new["log_scales"] = torch.cat([tensors["log_scales"][cloned], torch.log(scales / shrink)])
    stays = torch.ones(len(scene), dtype=torch.bool, device=scene.device)
    stays[split] = False
    scene.keep(stays, new, torch.cat([scene.filter_m[cloned], scene.filter_m[own]]))
    return len(split), len(cloned)


def to_prune(
    scene: Scene, inside: torch.Tensor, extent_m: float, rule: DensityRule, sizes: bool, faint: bool
) -> torch.Tensor:
    """(N,) bool: outside the box, not finite, fainter (``faint``) or larger (``sizes``) than the rule allows.

    inside: (N,) bool.
    """
    scale = torch.exp(scene.tensors["log_scales"].detach()).max(dim=1).values
    logit = scene.tensors["opacity_logits"].detach()
    gone = ~inside | ~torch.isfinite(scale) | ~torch.isfinite(logit)
    if faint:
        gone = gone | (torch.sigmoid(logit) < rule.faint)
    if sizes:
        gone = gone | (scale > rule.huge * extent_m)
    return gone
