"""Between the planes that the kernels write and want, and those that ``rasterize`` shows."""

from __future__ import annotations

import torch

from ..kernels import N_PLANES


def shown_planes(raw: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """(4 or 8, H, W) colour, alpha, sum w d, sum w n, and (H, W) median depth (empty for four planes) of raw planes (4
    or 9, H, W: R, G, B, T, sum w d, median, sum w n)."""
    full = len(raw) == N_PLANES
    planes = torch.empty((8 if full else 4, *raw.shape[1:]), device=raw.device)
    planes[:3], planes[3] = raw[:3], 1 - raw[3]
    if not full:
        return planes, torch.empty(0, device=raw.device)
    planes[4], planes[5:] = raw[4], raw[6:9]
    return planes, torch.where(raw[3] <= 0.5, raw[5], torch.nan)


def for_kernels(given: tuple[torch.Tensor | None, ...], raw: torch.Tensor) -> torch.Tensor:
    """(4, 8 or 9, H, W) float32 gradients as the kernels want them: of colour, alpha, sum w d, sum w n and, where it
    has any, of the median depth. given: those of :func:`shown_planes`; None: none."""
    planes, median = given
    full = len(raw) == N_PLANES
    if planes is None:
        planes = torch.zeros((8 if full else 4, *raw.shape[1:]), device=raw.device)
    planes = planes.detach().to(torch.float32)
    if not full or median is None:
        return planes.contiguous()
    # Where there is no median there is nothing to pull at, whatever a loss says there.
    pulled = torch.where(raw[3] <= 0.5, torch.nan_to_num(median.detach().to(torch.float32)), 0.0)
    return torch.cat([planes, pulled[None]])
