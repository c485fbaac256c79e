"""The compositing kernels for a GPU, through NVIDIA Warp (no compiler on the user's machine): the formulas of
``kernels.py``, one thread a pixel, on Gaussians listed by tile, in the memory of torch tensors.

Warp also runs these kernels on one CPU core, which is how they are tested; for a GPU they are compiled in the tests. On
an NVIDIA H200 both agree. Import needs ``warp-lang``; ask :func:`available` first.
"""

# Warp reads annotations when a kernel is made: no postponed annotations in this file, and mypy cannot know its types.
# mypy: disable-error-code="valid-type,misc,attr-defined,arg-type,empty-body"
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import torch
import warp as wp

from .. import kernels
from .project import TILE_PX, Lists, lists_by_tile

wp.config.quiet = True
# Arrays are made from tensors' memory before the first kernel is launched.
wp.init()
_TILE = wp.constant(TILE_PX)
_TILE_PIXELS = wp.constant(TILE_PX**2)
_TOP = wp.constant(float(kernels.ALPHA_MAX))


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __any_sync(0xffffffffu, here);
#else
    return here;
#endif
""")
def _anywhere(here: bool) -> bool:
    """``here`` of any pixel of this warp of 32."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    for (int step = 16; step > 0; step /= 2) value += __shfl_down_sync(0xffffffffu, value, step);
    if (threadIdx.x % 32 != 0) return;
#endif
    wp::atomic_add(grad, row, g, value);
""")
def _add(grad: wp.array2d(dtype=wp.float32), row: int, g: int, value: wp.float32):
    """Add the values of a warp's 32 pixels to grad[row, g], in one access to memory."""


@wp.func
def _pixel(thread: int, tiles_x: int):
    """x, y and tile of a thread: those of a tile follow each other, so that a warp draws the same Gaussians."""
    tile = thread / _TILE_PIXELS
    place = thread - tile * _TILE_PIXELS
    return (tile % tiles_x) * _TILE + place % _TILE, (tile / tiles_x) * _TILE + place / _TILE, tile


@wp.kernel(enable_backward=False)
def _forward(
    proj: wp.array2d(dtype=wp.float32),
    start: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    tiles_x: int,
    full: int,
    image: wp.array3d(dtype=wp.float32),
):
    x, y, tile = _pixel(wp.tid(), tiles_x)
    if x >= image.shape[2] or y >= image.shape[1]:
        return
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


@wp.kernel(enable_backward=False)
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
    x, y, tile = _pixel(wp.tid(), tiles_x)
    inside = x < rest.shape[1] and y < rest.shape[0]
    # A pixel beyond the border goes along, for the warp's sums, and adds nothing.
    x, y = wp.min(x, rest.shape[1] - 1), wp.min(y, rest.shape[0] - 1)
    px, py = float(x) + 0.5, float(y) + 0.5
    trans = wp.float32(1.0)
    left = rest[y, x] + wp.float32(0.0)
    for at in range(start[tile], start[tile + 1]):
        g = items[at]
        dx, dy = px - proj[0, g], py - proj[1, g]
        ka, kb, kc = proj[2, g], proj[3, g], proj[4, g]
        reach = ka * dx * dx + 2.0 * kb * dx * dy + kc * dy * dy
        drawn = inside and reach <= proj[13, g]
        if _anywhere(drawn):
            raw = proj[5, g] * wp.exp(-0.5 * reach)
            alpha = wp.min(raw, _TOP)
            if not drawn:
                alpha = wp.float32(0.0)
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
            _add(grad, 0, g, along)
            _add(grad, 1, g, down)
            _add(grad, 2, g, -0.5 * dp * dx * dx)
            _add(grad, 3, g, -dp * dx * dy)
            _add(grad, 4, g, -0.5 * dp * dy * dy)
            _add(grad, 5, g, dp / proj[5, g])
            if full > 0:
                _add(grad, 6, g, wd)
                _add(grad, 7, g, wd * dx)
                _add(grad, 8, g, wd * dy)
                _add(grad, 9, g, w * given[5, y, x])
                _add(grad, 10, g, w * given[6, y, x])
                _add(grad, 11, g, w * given[7, y, x])
            _add(grad, 12, g, w * given[0, y, x])
            _add(grad, 13, g, w * given[1, y, x])
            _add(grad, 14, g, w * given[2, y, x])


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
            _launch(_forward, start, image, [*arrays, image])
    return planes, (start, items, tiles_x)


def pull_back(rows: torch.Tensor, lists: Lists, given: torch.Tensor, planes: torch.Tensor) -> torch.Tensor:
    """(15, n) gradients of :func:`composite`. given: (4 or 9, H, W) dL/d of colour, alpha, sum w d, sum w n, median
    depth. planes: as drawn."""
    full = len(given) == 9
    rest = (given[:3] * planes[:3]).sum(0) + given[3] * (1 - planes[3])
    if full:
        rest = rest + given[4] * planes[4] + (given[5:8] * planes[6:9]).sum(0)
    grad = torch.zeros((15, rows.shape[1]), device=rows.device)
    if rows.shape[1]:
        arrays = [wp.from_torch(rows), wp.from_torch(lists[0]), wp.from_torch(lists[1]), lists[2], int(full)]
        with _stream(rows.device):
            out = wp.from_torch(grad)
            inputs = [*arrays, wp.from_torch(given), wp.from_torch(rest.contiguous()), out]
            _launch(_backward, lists[0], out, inputs)
    return grad


def _launch(kernel: Any, start: torch.Tensor, out: Any, inputs: list[Any]) -> None:
    """One thread a pixel, one block a tile. start: (tiles + 1,) of :data:`.project.Lists`."""
    wp.launch(kernel, dim=(len(start) - 1) * TILE_PX**2, inputs=inputs, device=out.device, block_dim=TILE_PX**2)


def _stream(device: torch.device) -> AbstractContextManager:
    """Warp's launches in the stream that torch works in: neither waits for the other."""
    if device.type != "cuda":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))
