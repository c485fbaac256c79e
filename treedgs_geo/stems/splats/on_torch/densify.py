"""Split, clone and prune as published (3DGS, RaDe-GS), in torch operations on the scene's device."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from .project import turned
from .scene import Scene


@dataclass(frozen=True)
class DensityRule:
    """The published numbers; times are shares of the fit (of 30,000 steps).

    grow: mean gradient on a centre, in half picture widths, from which a Gaussian is split or cloned. large: share of
    the scene's extent up to which it is cloned, above it is split. shrink: of the two halves of a split. faint: pruned
    below this opacity. huge: pruned above this share of the extent, and wide_px: above this radius (3 sigma) in the
    nearest photo, both once opacities have been reset. begin, end, every: of the densification. reset: share between
    two resets of the opacities to ``reset_to``. rest_steps: nothing is pruned for being faint in so many steps after a
    reset; resets follow each other by three times as many at least.
    """

    grow: float = 2e-4
    large: float = 0.01
    shrink: float = 1.6
    faint: float = 0.05
    huge: float = 0.1
    wide_px: float = 20.0
    begin: float = 500 / 30_000
    end: float = 0.5
    every: float = 100 / 30_000
    reset: float = 3_000 / 30_000
    reset_to: float = 0.01
    rest_steps: int = 100


@dataclass
class Pull:
    """What has pulled at each Gaussian since the last densification. total, seen: (N,)."""

    total: torch.Tensor
    seen: torch.Tensor

    @classmethod
    def none(cls, scene: Scene) -> Pull:
        """Nothing yet."""
        return cls(*(torch.zeros(len(scene), device=scene.device) for _ in range(2)))

    def add(self, pull: torch.Tensor, width: int, height: int) -> None:
        """The pull of one picture, (N, 2) per pixel."""
        length = (pull * torch.tensor([width / 2, height / 2], device=pull.device)).norm(dim=1)
        self.total += length
        self.seen += length > 0

    def clone(self) -> Pull:
        """A copy."""
        return Pull(self.total.clone(), self.seen.clone())


@dataclass
class Counts:
    """What densification did in all."""

    split: int = 0
    cloned: int = 0
    pruned: int = 0


def grow(
    scene: Scene,
    pull: Pull,
    extent_m: float,
    room: int,
    rule: DensityRule,
    generator: torch.Generator,
    grow_factor: float = 1.0,
    shrink_factor: float = 1.0,
) -> tuple[int, int]:
    """Clone the small and split the large Gaussians that are pulled at, the most pulled first, as far as ``room`` (how
    many more there may be) reaches. grow_factor, shrink_factor: the controller's. Returns how many were split and
    cloned."""
    mean = pull.total / pull.seen.clamp_min(1)
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
    filter_m = torch.cat([scene.filter_m[cloned], scene.filter_m[own]])
    scene.append(new, filter_m)
    stays = torch.ones(len(scene), dtype=torch.bool, device=scene.device)
    stays[split] = False
    scene.keep(stays)
    return len(split), len(cloned)


def to_prune(
    scene: Scene, inside: torch.Tensor, footprint_m: torch.Tensor, extent_m: float, rule: DensityRule, sizes: bool,
    faint: bool,
) -> torch.Tensor:  # fmt: skip
    """(N,) bool: outside the box, not finite, fainter (``faint``) or larger (``sizes``) than the rule allows.

    inside: (N,) bool. footprint_m: (N,) of a pixel at the Gaussian.
    """
    scale = torch.exp(scene.tensors["log_scales"].detach()).max(dim=1).values
    logit = scene.tensors["opacity_logits"].detach()
    gone = ~inside | ~torch.isfinite(scale) | ~torch.isfinite(logit)
    if faint:
        gone = gone | (torch.sigmoid(logit) < rule.faint)
    if sizes:
        gone = gone | (scale > rule.huge * extent_m) | (3 * scale > rule.wide_px * footprint_m)
    return gone
