"""The compositing kernels for a GPU, through NVIDIA Warp (no compiler on the user's machine): the formulas of
``kernels.py``, one thread for a pixel or two, on Gaussians listed by tile, in the memory of torch tensors.

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
# Divisions and exponentials to seven digits: those of the CPU's kernels are no better.
wp.set_module_options({"fast_math": True})
# Arrays are made from tensors' memory before the first kernel is launched.
wp.init()
_TILE = wp.constant(TILE_PX)
_TILE_PIXELS = wp.constant(TILE_PX**2)
_TOP = wp.constant(float(kernels.ALPHA_MAX))
#: The 15 gradients of a Gaussian, filled up to a power of two.
_Row = wp.types.vector(length=16, dtype=wp.float32)
#: The numbers of a Gaussian (rows of :func:`.project.projected_rows`).
_Drawn = wp.types.vector(length=17, dtype=wp.float32)
#: What pulls at two pixels.
_Pulled = wp.types.matrix(shape=(2, 9), dtype=wp.float32)


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __any_sync(0xffffffffu, here);
#else
    return here;
#endif
""")
def _anywhere(here: bool) -> bool:
    """``here`` of any pixel of this warp of 32."""


#: Halves of a warp swap halves of what they hold; written out, so that all of it stays in registers.
_HALVE = "".join(
    f"""
    #pragma unroll
    for (int k = 0; k < {half}; ++k) {{
        const bool upper = lane & {2 * half};
        const float sent = upper ? values.c[k] : values.c[k + {half}];
        values.c[k] = (upper ? values.c[k + {half}] : values.c[k]) + __shfl_xor_sync(0xffffffffu, sent, {2 * half});
    }}"""
    for half in (8, 4, 2, 1)
)


@wp.func_native(f"""
#if defined(__CUDA_ARCH__)
    const int lane = threadIdx.x % 32;{_HALVE}
    values.c[0] += __shfl_xor_sync(0xffffffffu, values.c[0], 1);
    if (lane % 2 == 0) wp::atomic_add(grad, g, lane / 2, values.c[0]);
#else
    for (int k = 0; k < 16; ++k) wp::atomic_add(grad, g, k, values.c[k]);
#endif
""")
def _add(grad: wp.array2d(dtype=wp.float32), g: int, values: _Row):
    """Add the values of a warp's 32 threads to grad[g]: halved until every second one holds one sum, and all are
    added in one access to memory."""


@wp.func
def _pixel(thread: int, threads: int, tiles_x: int):
    """x, y and tile of one of so many threads a tile: they follow each other, so that a warp draws the same
    Gaussians."""
    tile = thread / threads
    place = thread - tile * threads
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
    x, y, tile = _pixel(wp.tid(), _TILE_PIXELS, tiles_x)
    if x >= image.shape[2] or y >= image.shape[1]:
        return
    px, py = float(x) + 0.5, float(y) + 0.5
    red, green, blue, trans = wp.float32(0.0), wp.float32(0.0), wp.float32(0.0), wp.float32(1.0)
    depth, nx, ny, nz = wp.float32(0.0), wp.float32(0.0), wp.float32(0.0), wp.float32(0.0)
    median = image[wp.min(full, 1) * 5, y, x] + wp.float32(0.0)
    for at in range(start[tile], start[tile + 1]):
        g = items[at]
        dx, dy = px - proj[g, 0], py - proj[g, 1]
        reach = proj[g, 2] * dx * dx + 2.0 * proj[g, 3] * dx * dy + proj[g, 4] * dy * dy
        if reach <= proj[g, 13]:
            alpha = wp.min(proj[g, 5] * wp.exp(-0.5 * reach), _TOP)
            w = alpha * trans
            red += w * proj[g, 14]
            green += w * proj[g, 15]
            blue += w * proj[g, 16]
            if full > 0:
                d = proj[g, 6] + proj[g, 7] * dx + proj[g, 8] * dy
                depth += w * d
                if trans > 0.5:
                    median = d
                nx += w * proj[g, 9]
                ny += w * proj[g, 10]
                nz += w * proj[g, 11]
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
    proj: wp.array(dtype=_Drawn),
    start: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    tiles_x: int,
    full: int,
    given: wp.array3d(dtype=wp.float32),
    rest: wp.array2d(dtype=wp.float32),
    grad: wp.array2d(dtype=wp.float32),
):
    # Two pixels a thread, half a tile apart, so that a warp's sums are those of a tile.
    x, y, tile = _pixel(wp.tid(), _TILE_PIXELS / 2, tiles_x)
    px, py = float(x) + 0.5, float(y) + 0.5
    # A pixel beyond the border goes along, for the warp's sums, and adds nothing.
    solid, left, trans = wp.vec2(), wp.vec2(), wp.vec2(1.0, 1.0)
    # Read once: the compiler cannot know that adding to grad leaves it as it is.
    pulled = _Pulled()
    for part in range(2):
        below = y + part * (_TILE / 2)
        if x < rest.shape[1] and below < rest.shape[0]:
            solid[part] = 1.0
            left[part] = rest[below, x]
            for k in range(9):
                if k < given.shape[0]:
                    pulled[part, k] = given[k, below, x]
    # The next Gaussian is read while this one is worked at: adding to grad would make it wait.
    first, last = start[tile], start[tile + 1]
    following = _Drawn()
    if first < last:
        following = proj[items[first]]
    for at in range(first, last):
        g, row = items[at], following
        following = proj[items[wp.min(at + 1, last - 1)]]
        dx, top = px - row[0], py - row[1]
        ka, kb, kc = row[2], row[3], row[4]
        reach, bottom = wp.vec2(), top + float(_TILE / 2)
        reach[0] = ka * dx * dx + 2.0 * kb * dx * top + kc * top * top
        reach[1] = ka * dx * dx + 2.0 * kb * dx * bottom + kc * bottom * bottom
        if _anywhere(wp.min(reach[0], reach[1]) <= row[13]):
            values = _Row()
            for part in range(2):
                dy = top + float(part * (_TILE / 2))
                raw = row[5] * wp.exp(-0.5 * reach[part])
                alpha = wp.min(raw, _TOP) * solid[part]
                if reach[part] > row[13]:
                    alpha = wp.float32(0.0)
                w = alpha * trans[part]
                h = pulled[part, 3] + pulled[part, 0] * row[14] + pulled[part, 1] * row[15] + pulled[part, 2] * row[16]
                if full > 0:
                    d = row[6] + row[7] * dx + row[8] * dy
                    h += pulled[part, 4] * d + pulled[part, 5] * row[9]
                    h += pulled[part, 6] * row[10] + pulled[part, 7] * row[11]
                left[part] = left[part] - w * h
                dp = (trans[part] * h - left[part] / (1.0 - alpha)) * alpha
                if raw >= _TOP:
                    dp = 0.0
                wd = w * pulled[part, 4]
                if trans[part] > 0.5 and trans[part] - w <= 0.5:
                    wd += pulled[part, 8]
                trans[part] = trans[part] - w
                along = dp * (ka * dx + kb * dy) - row[7] * wd
                down = dp * (kb * dx + kc * dy) - row[8] * wd
                values += _Row(
                    along, down, -0.5 * dp * dx * dx, -dp * dx * dy, -0.5 * dp * dy * dy, dp / row[5],
                    wd, wd * dx, wd * dy, w * pulled[part, 5], w * pulled[part, 6], w * pulled[part, 7],
                    w * pulled[part, 0], w * pulled[part, 1], w * pulled[part, 2], 0.0,
                )  # fmt: skip
            _add(grad, g, values)


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
        arrays = [*_arrays(rows, start, items), tiles_x, int(full)]
        with stream(rows.device):
            image = wp.from_torch(planes)
            _launch(_forward, start, image, [*arrays, image], TILE_PX**2)
    return planes, (start, items, tiles_x)


def pull_back(rows: torch.Tensor, lists: Lists, given: torch.Tensor, planes: torch.Tensor) -> torch.Tensor:
    """(15, n) gradients of :func:`composite`. given: (4 or 9, H, W) dL/d of colour, alpha, sum w d, sum w n, median
    depth. planes: as drawn."""
    full = len(given) == 9
    rest = (given[:3] * planes[:3]).sum(0) + given[3] * (1 - planes[3])
    if full:
        rest = rest + given[4] * planes[4] + (given[5:8] * planes[6:9]).sum(0)
    grad = torch.zeros((rows.shape[1], _Row._length_), device=rows.device)
    if rows.shape[1]:
        proj, *arrays = _arrays(rows, *lists[:2])
        arrays = [proj.view(_Drawn), *arrays, lists[2], int(full)]
        with stream(rows.device):
            out = wp.from_torch(grad)
            inputs = [*arrays, wp.from_torch(given), wp.from_torch(rest.contiguous()), out]
            _launch(_backward, lists[0], out, inputs, TILE_PX**2 // 2)
    return grad.T[:15]


def _arrays(rows: torch.Tensor, start: torch.Tensor, items: torch.Tensor) -> list[Any]:
    """What both kernels read: the numbers of one Gaussian side by side, and the lists."""
    return [wp.from_torch(array) for array in (rows.T.contiguous(), start, items)]


def _launch(kernel: Any, start: torch.Tensor, out: Any, inputs: list[Any], threads: int) -> None:
    """So many threads, one block, a tile. start: (tiles + 1,) of :data:`.project.Lists`."""
    wp.launch(kernel, dim=(len(start) - 1) * threads, inputs=inputs, device=out.device, block_dim=threads)


def stream(device: torch.device) -> AbstractContextManager:
    """Warp's launches in the stream that torch works in: neither waits for the other."""
    if device.type != "cuda":
        return nullcontext()
    return wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(device)))
