"""The compositing and point-query kernels for a GPU, through NVIDIA Warp (no compiler on the user's machine).

The formulas of ``kernels.py`` and ``point_kernels.py``, one thread a pixel or a point, on Gaussians listed by tile.
``WarpRasteriser`` takes numpy parameters and projects on the CPU (a hundredth of the work); ``on_torch`` projects on
the tensors' device and hands :func:`draw` its tensors. Warp also runs these kernels on one CPU core, which is how they
are tested; they have not been run on a GPU. Import needs ``warp-lang``; ask :func:`available` first.
"""

# Warp reads annotations when a kernel is made: no postponed annotations in this file, and mypy cannot know its types.
# mypy: disable-error-code="valid-type,misc,attr-defined"
from typing import Any

import numpy as np
import warp as wp

from . import kernels
from .field import N_PARAMETERS
from .point_kernels import TILE_PX, list_by_tile
from .project import CropCamera, project_backward_kernel
from .raster import ALPHA_MIN, Pass, project

wp.config.quiet = True
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


@wp.kernel
def _query(
    proj: wp.array2d(dtype=wp.float32),
    start: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    tiles: wp.array(dtype=wp.int32),
    points: wp.array2d(dtype=wp.float32),
    base: float,
    low: float,
    opacity: wp.array(dtype=wp.float32),
    drawn: wp.array(dtype=wp.int32),
):
    p = wp.tid()
    u, v, r = points[0, p], points[1, p], points[2, p]
    left = wp.float32(1.0)
    met = wp.int32(0)
    for at in range(start[tiles[p]], start[tiles[p] + 1]):
        g = items[at]
        dx, dy = u - proj[0, g], v - proj[1, g]
        flat = 0.5 * (proj[2, g] * dx * dx + proj[4, g] * dy * dy) + proj[3, g] * dx * dy
        full = proj[5, g] * wp.exp(-flat)
        if full >= low and flat < 8.0:
            met += 1
            # Distances relative to a common one: float32 stays exact at any flying height.
            gap = r - (proj[6, g] - base + proj[7, g] * dx + proj[8, g] * dy)
            fall = 0.5 * proj[12, g] * gap * gap
            bent = flat
            if gap < 0.0:
                bent = wp.min(flat + fall, 8.0)
            alpha = wp.min(proj[5, g] * wp.exp(-bent), _TOP)
            if alpha >= low:
                left = left * (1.0 - alpha)
    opacity[p] = 1.0 - left
    drawn[p] = met


def available(device: str) -> bool:
    """Whether Warp can run on ``device`` ("cpu", "cuda", "cuda:0" ...)."""
    wp.init()
    return any(str(found) == device or (device == "cuda" and found.is_cuda) for found in wp.get_devices())


def _lists(projected: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Gaussians by tile, front to back within each: start (tiles + 1,), items, tiles along x."""
    tiles_x, tiles_y = (width - 1) // TILE_PX + 1, (height - 1) // TILE_PX + 1
    start = np.zeros(tiles_x * tiles_y + 1, np.int64)
    list_by_tile(projected, projected.shape[1], tiles_x, tiles_y, start, start, False)
    start = np.cumsum(start)
    items = np.empty(max(int(start[-1]), 1), np.int64)
    list_by_tile(projected, projected.shape[1], tiles_x, tiles_y, start.copy(), items, True)
    return start.astype(np.int32), items.astype(np.int32), tiles_x


class WarpRasteriser:
    """As ``raster.Rasteriser``, on a Warp device."""

    def __init__(self, device: str = "cuda", dilation_px2: float = 0.0, alpha_min: float = ALPHA_MIN) -> None:
        self.device, self.dilation, self.alpha_min = device, float(dilation_px2), float(alpha_min)

    def close(self) -> None:
        """Nothing to stop."""

    def _array(self, value: np.ndarray) -> Any:
        return wp.array(np.ascontiguousarray(value), device=self.device)

    def forward(self, parameters: np.ndarray, camera: CropCamera, full: bool = False) -> Pass:
        """See ``raster.Rasteriser.forward``; ``pairs`` counts the pairs that are looked at, in whole tiles."""
        projected, index = project(parameters, camera, self.dilation, self.alpha_min)
        planes = np.zeros((kernels.N_PLANES if full else 4, camera.height, camera.width), np.float32)
        planes[3] = 1
        if full:
            planes[5] = np.nan
        if len(index) == 0:
            return Pass(camera, projected, index, planes, 0, self.dilation)
        start, items, tiles_x = _lists(projected, camera.width, camera.height)
        image = self._array(planes)
        draw(self._array(projected), self._array(start), self._array(items), tiles_x, image)
        return Pass(camera, projected, index, image.numpy(), int(start[-1]) * TILE_PX**2, self.dilation)

    def backward(
        self,
        parameters: np.ndarray,
        done: Pass,
        given: np.ndarray,
        out: np.ndarray | None = None,
        pull: np.ndarray | None = None,
    ) -> np.ndarray:
        """See ``raster.Rasteriser.backward``."""
        planes, n = done.planes, len(done.index)
        whole = np.zeros((9 if len(given) >= 8 else 4, *given.shape[1:]), np.float32)
        whole[: len(given)] = given
        rest = np.einsum("chw,chw->hw", whole[:3], planes[:3]) + whole[3] * (1 - planes[3])
        if len(whole) == 9:
            rest += whole[4] * planes[4] + np.einsum("chw,chw->hw", whole[5:8], planes[6:9])
        out = np.zeros((len(parameters), N_PARAMETERS)) if out is None else out
        if n == 0:
            return out
        camera = done.camera
        start, items, tiles_x = _lists(done.projected, camera.width, camera.height)
        grad = self._array(np.zeros((15, n), np.float32))
        lists = self._array(start), self._array(items), tiles_x
        pull_back(self._array(done.projected), *lists, self._array(whole), self._array(rest.astype(np.float32)), grad)
        if pull is not None:
            pull[done.index] = grad.numpy()[:2].T
        project_backward_kernel(
            parameters,
            camera.intrinsics,
            camera.rotation,
            camera.translation,
            done.dilation,
            done.index,
            grad.numpy(),
            out,
        )
        return out


def draw(projected: Any, start: Any, items: Any, tiles_x: int, image: Any) -> None:
    """Composite into ``image`` (4 or 9, H, W), all arrays of one Warp device. projected: (17, n) float32, front to
    back. start, items: int32, the Gaussians by tile."""
    planes, height, width = image.shape
    full = int(planes == kernels.N_PLANES)
    given = [projected, start, items, tiles_x, full, image]
    wp.launch(_forward, dim=(height, width), device=image.device, inputs=given)


def pull_back(projected: Any, start: Any, items: Any, tiles_x: int, given: Any, rest: Any, grad: Any) -> None:
    """Gradients of :func:`draw` added to ``grad`` (15, n). given: (4 or 9, H, W)
    dL/d of colour, alpha, sum w d, sum w n, median depth. rest: (H, W) the sum of given x drawn."""
    planes, height, width = given.shape
    inputs = [projected, start, items, tiles_x, int(planes == 9), given, rest, grad]
    wp.launch(_backward, dim=(height, width), device=given.device, inputs=inputs)


def opacity_before(
    projected: np.ndarray,
    width: int,
    height: int,
    points: np.ndarray,
    alpha_min: float = ALPHA_MIN,
    device: str = "cuda",
) -> tuple[np.ndarray, np.ndarray]:
    """Point query: points (3, M) u, v, distance inside the crop -> (M,) opacity in front, (M,) Gaussians met."""
    start, items, tiles_x = _lists(projected, width, height)
    base = float(np.median(points[2])) if points.shape[1] else 0.0
    tiles = (points[1] // TILE_PX).astype(np.int32) * np.int32(tiles_x) + (points[0] // TILE_PX).astype(np.int32)
    near = np.array(points, float)
    near[2] -= base

    def put(value: np.ndarray) -> Any:
        return wp.array(np.ascontiguousarray(value), device=device)

    opacity = wp.empty(points.shape[1], dtype=wp.float32, device=device)
    drawn = wp.empty(points.shape[1], dtype=wp.int32, device=device)
    wp.launch(
        _query,
        dim=points.shape[1],
        device=device,
        inputs=[
            put(projected),
            put(start),
            put(items),
            put(tiles),
            put(near.astype(np.float32)),
            base,
            float(alpha_min),
            opacity,
            drawn,
        ],
    )
    return opacity.numpy(), drawn.numpy()
