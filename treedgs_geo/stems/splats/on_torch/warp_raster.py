"""The compositing kernels for a GPU, through NVIDIA Warp (no compiler on the user's machine): the formulas of
``kernels.py``, one thread a pixel, on Gaussians listed by tile, in the memory of torch tensors.

Warp also runs these kernels on one CPU core, which is how they are tested; they have not been run on a GPU. Import
needs ``warp-lang``; ask :func:`available` first.
"""

# Warp reads annotations when a kernel is made: no postponed annotations in this file, and mypy cannot know its types.
# mypy: disable-error-code="valid-type,misc,attr-defined"
from contextlib import AbstractContextManager, nullcontext

import torch
import warp as wp

from .. import kernels
from .project import TILE_PX, Lists, lists_by_tile

wp.config.quiet = True
# Arrays are made from tensors' memory before the first kernel is launched.
wp.init()
_TILE = wp.constant(TILE_PX)
_TOP = wp.constant(float(kernels.ALPHA_MAX))


@wp.kernel
def _forward(
    proj: wp.array2d(dtype=wp.float32),
    start: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    tiles_x: int,
    full: int,
    image: wp.array3d(dtype=wp.float32),
):
    y, x = wp.tid()
    tile = (y / _TILE) * tiles_x + x / _TILE
    px, py = float(x) + 0.5, float(y) + 0.5
    red, green, blue, trans = wp.float32(0.0), wp.float32(0.0), wp.float32(0.0), wp.float32(1.0)
    depth, nx, ny, nz = wp.float32(0.0), wp.float32(0.0), wp.float32(0.0), wp.float32(0.0)
    median = image[wp.min(full, 1) * 5, y, x] + wp.float32(0.0)
    for at in range(start[tile], start[tile + 1]):
        g = items[at]
        dx, dy = px - proj[0, g], py - proj[1, g]
        reach = proj[2, g] * dx * dx + 2.0 * proj[3, g] * dx * dy + proj[4, g] * dy * dy
        if reach <= proj[13, g]:
            alpha = wp.min(proj[5, g] * wp.exp(-0.5 * reach), _TOP)
            w = alpha * trans
            red += w * proj[14, g]
            green += w * proj[15, g]
            blue += w * proj[16, g]
            if full > 0:
                d = proj[6, g] + proj[7, g] * dx + proj[8, g] * dy
                depth += w * d
                if trans > 0.5:
                    median = d
                nx += w * proj[9, g]
                ny += w * proj[10, g]
                nz += w * proj[11, g]
            trans = trans - w
    image[0, y, x] = red
    image[1, y, x] = green
    image[2, y, x] = blue
    image[3, y, x] = trans
    if full > 0:
        image[4, y, x] = depth
        image[5, y, x] = median
        image[6, y, x] = nx
        image[7, y, x] = ny
        image[8, y, x] = nz


@wp.kernel
def _backward(
    proj: wp.array2d(dtype=wp.float32),
    start: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    tiles_x: int,
    full: int,
    given: wp.array3d(dtype=wp.float32),
    rest: wp.array2d(dtype=wp.float32),
    grad: wp.array2d(dtype=wp.float32),
):
    y, x = wp.tid()
    tile = (y / _TILE) * tiles_x + x / _TILE
    px, py = float(x) + 0.5, float(y) + 0.5
    trans = wp.float32(1.0)
    left = rest[y, x] + wp.float32(0.0)
    for at in range(start[tile], start[tile + 1]):
        g = items[at]
        dx, dy = px - proj[0, g], py - proj[1, g]
        ka, kb, kc = proj[2, g], proj[3, g], proj[4, g]
        reach = ka * dx * dx + 2.0 * kb * dx * dy + kc * dy * dy
        if reach <= proj[13, g]:
            raw = proj[5, g] * wp.exp(-0.5 * reach)
            alpha = wp.min(raw, _TOP)
            w = alpha * trans
            h = given[3, y, x] + given[0, y, x] * proj[14, g] + given[1, y, x] * proj[15, g]
            h += given[2, y, x] * proj[16, g]
            gd = wp.float32(0.0)
            if full > 0:
                d = proj[6, g] + proj[7, g] * dx + proj[8, g] * dy
                gd = given[4, y, x] + wp.float32(0.0)
                h += gd * d + given[5, y, x] * proj[9, g] + given[6, y, x] * proj[10, g] + given[7, y, x] * proj[11, g]
            left = left - w * h
            dp = (trans * h - left / (1.0 - alpha)) * alpha
            if raw >= _TOP:
                dp = 0.0
            wd = w * gd
            if full > 0 and trans > 0.5 and trans - w <= 0.5:
                wd += given[8, y, x]
            trans = trans - w
            along = dp * (ka * dx + kb * dy) - proj[7, g] * wd
            down = dp * (kb * dx + kc * dy) - proj[8, g] * wd
            wp.atomic_add(grad, 0, g, along)
            wp.atomic_add(grad, 1, g, down)
            wp.atomic_add(grad, 2, g, -0.5 * dp * dx * dx)
            wp.atomic_add(grad, 3, g, -dp * dx * dy)
            wp.atomic_add(grad, 4, g, -0.5 * dp * dy * dy)
            wp.atomic_add(grad, 5, g, dp / proj[5, g])
            if full > 0:
                wp.atomic_add(grad, 6, g, wd)
                wp.atomic_add(grad, 7, g, wd * dx)
                wp.atomic_add(grad, 8, g, wd * dy)
                wp.atomic_add(grad, 9, g, w * given[5, y, x])
                wp.atomic_add(grad, 10, g, w * given[6, y, x])
                wp.atomic_add(grad, 11, g, w * given[7, y, x])
            wp.atomic_add(grad, 12, g, w * given[0, y, x])
            wp.atomic_add(grad, 13, g, w * given[1, y, x])
            wp.atomic_add(grad, 14, g, w * given[2, y, x])


def available(device: str) -> bool:
    """Whether Warp can run on ``device`` ("cpu", "cuda", "cuda:0" ...)."""
    return any(str(found) == device or (device == "cuda" and found.is_cuda) for found in wp.get_devices())


def composite(rows: torch.Tensor, height: int, width: int, full: bool) -> tuple[torch.Tensor, Lists]:
    """(4 or 9, H, W) planes of ``kernels.py``, and the lists that :func:`pull_back` wants. rows: (17, n) float32, front
    to back."""
    planes = torch.zeros((kernels.N_PLANES if full else 4, height, width), device=rows.device)
    planes[3] = 1
    if full:
        planes[5] = torch.nan
    start, items, tiles_x = lists_by_tile(rows, width, height)
    if rows.shape[1]:
        arrays = [wp.from_torch(rows), wp.from_torch(start), wp.from_torch(items), tiles_x, int(full)]
        with _stream(rows.device):
            image = wp.from_torch(planes)
            wp.launch(_forward, dim=(height, width), device=image.device, inputs=[*arrays, image])
    return planes, (start, items, tiles_x)


def pull_back(rows: torch.Tensor, lists: Lists, given: torch.Tensor, planes: torch.Tensor) -> torch.Tensor:
    """(15, n) gradients of :func:`composite`. given: (4 or 9, H, W) dL/d of colour, alpha, sum w d, sum w n, median
    depth. planes: as drawn."""
    count, height, width = given.shape
    full = count == 9
    rest = (given[:3] * planes[:3]).sum(0) + given[3] * (1 - planes[3])
    if full:
        rest = rest + given[4] * planes[4] + (given[5:8] * planes[6:9]).sum(0)
    grad = torch.zeros((15, rows.shape[1]), device=rows.device)
    if rows.shape[1]:
        arrays = [wp.from_torch(rows), wp.from_torch(lists[0]), wp.from_torch(lists[1]), lists[2], int(full)]
        with _stream(rows.device):
            out = wp.from_torch(grad)
            inputs = [*arrays, wp.from_torch(given), wp.from_torch(rest.contiguous()), out]
            wp.launch(_backward, dim=(height, width), device=out.device, inputs=inputs)
    return grad


def _stream(device: torch.device) -> AbstractContextManager:
    """Warp's launches in the stream that torch works in: neither waits for the other."""
    if device.type != "cuda":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))
