"""Compositing of tensors that stay on their device: projection in torch, Warp's kernels on the tensors' own memory."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

import torch
import warp as wp

from .. import warp_raster
from ..kernels import N_PLANES
from ..point_kernels import TILE_PX
from ..project import CropCamera
from .planes import for_kernels, shown_planes

# Arrays are made from tensors' memory before the first kernel is launched.
wp.init()


def lists_by_tile(rows: torch.Tensor, width: int, height: int) -> tuple[torch.Tensor, torch.Tensor, int]:
    """Gaussians by tile, front to back within each: start (tiles + 1,) int32, items int32, tiles along x.

    rows: (17, n) front to back.
    """
    tiles_x, tiles_y = (width - 1) // TILE_PX + 1, (height - 1) // TILE_PX + 1
    u, v, ka, kb, kc, cut = rows[0], rows[1], rows[2], rows[3], rows[4], rows[13]
    det = ka * kc - kb * kb
    reach_u, reach_v = (cut * kc / det).sqrt(), (cut * ka / det).sqrt()
    left, right = (((u + side * reach_u) / TILE_PX).floor().long() for side in (-1, 1))
    top, bottom = (((v + side * reach_v) / TILE_PX).floor().long() for side in (-1, 1))
    left, top = left.clamp_min(0), top.clamp_min(0)
    across = (right.clamp_max(tiles_x - 1) - left + 1).clamp_min(0)
    count = across * (bottom.clamp_max(tiles_y - 1) - top + 1).clamp_min(0)
    of = torch.repeat_interleave(torch.arange(len(u), device=rows.device), count)
    place = torch.arange(len(of), device=rows.device) - (torch.cumsum(count, 0) - count)[of]
    wide = across[of].clamp_min(1)
    tile = (top[of] + place // wide) * tiles_x + left[of] + place % wide
    tile, order = torch.sort(tile, stable=True)
    start = torch.searchsorted(tile, torch.arange(tiles_x * tiles_y + 1, device=rows.device))
    return start.to(torch.int32), of[order].to(torch.int32).contiguous(), tiles_x


class CompositeOnDevice(torch.autograd.Function):
    """(17, n) float32 rows, front to back -> the planes and median depth of ``Rendered``."""

    @staticmethod
    def forward(ctx: Any, rows: torch.Tensor, index: torch.Tensor, camera: CropCamera, full: bool, kept: dict) -> Any:
        """Draw."""
        rows = rows.detach().to(torch.float32).contiguous()
        planes = torch.zeros((N_PLANES if full else 4, camera.height, camera.width), device=rows.device)
        planes[3] = 1
        if full:
            planes[5] = torch.nan
        lists = lists_by_tile(rows, camera.width, camera.height)
        kept["pairs"] = int(lists[0][-1]) * TILE_PX**2
        if len(index):
            with _stream(rows.device):
                warp_raster.draw(_shared(rows), _shared(lists[0]), _shared(lists[1]), lists[2], _shared(planes))
        ctx.rows, ctx.index, ctx.lists, ctx.planes, ctx.kept = rows, index, lists, planes, kept
        ctx.set_materialize_grads(False)
        return shown_planes(planes)

    @staticmethod
    def backward(ctx: Any, *given: torch.Tensor | None) -> Any:
        """Pull back: gradients of the rows."""
        rows, planes, full = ctx.rows, ctx.planes, len(ctx.planes) == N_PLANES
        whole = for_kernels(given, planes)
        if len(whole) == 8:
            whole = torch.cat([whole, torch.zeros_like(whole[:1])])
        rest = (whole[:3] * planes[:3]).sum(0) + whole[3] * (1 - planes[3])
        if full:
            rest = rest + whole[4] * planes[4] + (whole[5:8] * planes[6:9]).sum(0)
        grad = torch.zeros((15, rows.shape[1]), device=rows.device)
        start, items, tiles_x = ctx.lists
        if rows.shape[1]:
            with _stream(rows.device):
                held = _shared(rows), _shared(start), _shared(items)
                given_back = _shared(whole), _shared(rest.contiguous()), _shared(grad)
                warp_raster.pull_back(*held, tiles_x, *given_back)
        ctx.kept["pull"][ctx.index] = grad[:2].T
        out = torch.zeros_like(rows)
        out[:12], out[14:] = grad[:12], grad[12:15]
        return out, None, None, None, None


def _shared(tensor: torch.Tensor) -> Any:
    """The tensor's memory as a Warp array."""
    return wp.from_torch(tensor)


def _stream(device: torch.device) -> AbstractContextManager:
    """Warp's launches in the stream that torch works in: neither waits for the other."""
    if device.type != "cuda":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))
