"""Draw a Gaussian field into a crop, and pull gradients back to its parameters.

``Rasteriser`` runs the strips of ``kernels.py`` on a thread pool of its own (the kernels release the GIL): no
threading layer to install, the same result for any number of threads, safe to use from several Python threads at once.
"""

from __future__ import annotations

import math
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from . import kernels
from .field import N_PARAMETERS
from .project import N_ROWS, CropCamera, gather_columns, project_backward_kernel, project_kernel

#: Fainter than this a Gaussian is not drawn (one grey level of 255).
ALPHA_MIN = 1 / 255
#: Strips a thread gets, so that an uneven picture still fills all of them; and the least rows of one.
_STRIPS_A_THREAD, _MIN_ROWS = 4, 8


class _Scratch(threading.local):
    """Working memory that each thread keeps: asking the system for fresh pages took as long as the drawing."""

    def __init__(self) -> None:
        self._held: dict[tuple[str, type], np.ndarray] = {}

    def take(self, name: str, shape: tuple[int, ...], dtype: type = np.float32) -> np.ndarray:
        """An array of this shape with anything in it; valid until the same name is taken again."""
        size = math.prod(shape)
        held = self._held.get((name, dtype))
        if held is None or held.size < size:
            held = self._held[name, dtype] = np.empty(size, dtype)
        return held[:size].reshape(shape)


_scratch = _Scratch()


@dataclass(frozen=True)
class Render:
    """What one view shows.

    colour: (H, W, 3) float32, sum of w c (no background). alpha: (H, W). depth: (H, W) expected distance from the
    camera centre, sum w d / sum w, NaN where nothing is drawn. median_depth: (H, W) distance where the transmittance
    passes 0.5, NaN where it does not. normals: (H, W, 3) unit, camera axes, facing the camera; NaN where nothing is
    drawn. pairs: pixel-Gaussian pairs composited.
    """

    colour: np.ndarray
    alpha: np.ndarray
    depth: np.ndarray | None
    median_depth: np.ndarray | None
    normals: np.ndarray | None
    pairs: int


@dataclass(frozen=True)
class Pass:
    """One forward pass, kept for its backward: the sorted projection and the raw planes (see ``kernels.py``)."""

    camera: CropCamera
    projected: np.ndarray
    index: np.ndarray
    planes: np.ndarray
    pairs: int
    dilation: float


class Rasteriser:
    """Forward and backward compositing.

    threads: strips in flight at once; 1 runs in the calling thread. dilation_px2: variance added to each ellipse, with
    the opacity lowered so that its integral stays (Mip-Splatting's 2D filter); 0 draws the Gaussians as they are.
    """

    def __init__(self, threads: int = 1, dilation_px2: float = 0.0, alpha_min: float = ALPHA_MIN) -> None:
        self.threads = max(int(threads), 1)
        self.dilation = float(dilation_px2)
        self.alpha_min = float(alpha_min)
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def close(self) -> None:
        """Stop the worker threads."""
        if self._pool:
            self._pool.shutdown()

    def forward(self, parameters: np.ndarray, camera: CropCamera, full: bool = False) -> Pass:
        """Project, sort front to back by distance and composite. parameters: (N, 14) float64. full: depth and normals
        too.
        """
        projected, index = project(parameters, camera, self.dilation, self.alpha_min)
        height, width, n = camera.height, camera.width, len(index)
        count = kernels.N_PLANES if full else 4
        cells = _scratch.take("cells", (height, -(-width // kernels.LANES), count, kernels.LANES))
        cells[:] = 0
        cells[:, :, 3] = 1
        if full:
            cells[:, :, 5] = np.nan
        cells = cells.reshape(-1)
        kernel = kernels.forward_full if full else kernels.forward_colour
        pairs = sum(self._strips(height, lambda y0, y1: kernel(projected, n, y0, y1, width, cells)))
        planes = kernels.from_cells(cells, count, height, width)
        return Pass(camera, projected, index, planes, pairs, self.dilation)

    def backward(
        self,
        parameters: np.ndarray,
        done: Pass,
        given: np.ndarray,
        out: np.ndarray | None = None,
        pull: np.ndarray | None = None,
    ) -> np.ndarray:
        """Gradient with respect to the parameters.

        given: (4, H, W), (8, H, W) or (9, H, W) float32: dL/d of colour (3) and alpha, then of sum w d and sum w n (3)
        as in ``done.planes``, then of the median depth. Returns (N, 14) float64; ``out`` is accumulated into when
        given. pull: (N, 2) float32, filled with the gradient on each centre in the picture, per pixel.
        """
        planes, n, width = done.planes, len(done.index), done.camera.width
        full = len(given) >= 8
        state = _scratch.take("state", (11 if full else 6, *given.shape[1:]))
        state[0], state[2 : 2 + len(given)], state[2 + len(given) :] = 1, given, 0
        state[1] = np.einsum("chw,chw->hw", state[2:5], planes[:3]) + state[5] * (1 - planes[3])
        if full:
            state[1] += state[6] * planes[4] + np.einsum("chw,chw->hw", state[7:10], planes[6:9])
        kernel = kernels.backward_full if full else kernels.backward_colour
        count, height = len(state), done.camera.height
        cells = kernels.to_cells(
            state, _scratch.take("cells", (height, -(-width // kernels.LANES), count, kernels.LANES))
        )

        def strip(y0: int, y1: int) -> np.ndarray:
            shape = 15, max(n, 1)
            grad = _scratch.take("grad", shape) if self._pool is None else np.empty(shape, np.float32)
            grad[:] = 0
            kernel(done.projected, n, y0, y1, width, cells, grad)
            return grad

        grads = self._strips(height, strip)
        grad = grads[0] if len(grads) == 1 else sum(grads)
        if pull is not None:
            pull[done.index] = grad[:2, :n].T
        if out is None:
            out = np.zeros((len(parameters), N_PARAMETERS))
        project_backward_kernel(
            parameters,
            done.camera.intrinsics,
            done.camera.rotation,
            done.camera.translation,
            done.dilation,
            done.index,
            grad,
            out,
        )
        return out

    def _strips(self, height: int, work):
        if self._pool is None:
            return [work(0, height)]
        rows = max(-(-height // (_STRIPS_A_THREAD * self.threads)), _MIN_ROWS)
        edges = [(y, min(y + rows, height)) for y in range(0, height, rows)]
        return list(self._pool.map(lambda edge: work(*edge), edges))


def project(
    parameters: np.ndarray, camera: CropCamera, dilation: float = 0.0, alpha_min: float = ALPHA_MIN
) -> tuple[np.ndarray, np.ndarray]:
    """(N_ROWS, n) float32 projected Gaussians sorted front to back, and (n,) int64 their numbers."""
    parameters = np.ascontiguousarray(parameters, float)
    out = _scratch.take("projected", (N_ROWS, len(parameters)), np.float64)
    index = _scratch.take("index", (len(parameters),), np.int64)
    n = project_kernel(
        parameters,
        camera.intrinsics,
        np.ascontiguousarray(camera.rotation, float),
        np.ascontiguousarray(camera.translation, float),
        camera.width,
        camera.height,
        dilation,
        alpha_min,
        out,
        index,
    )
    order = np.argsort(out[6, :n], kind="stable")
    projected = np.empty((N_ROWS, n), np.float32)
    gather_columns(out, order, projected)
    return projected, index[order]


def render(
    parameters: np.ndarray, camera: CropCamera, rasteriser: Rasteriser | None = None, full: bool = True
) -> Render:
    """Draw a field (``GaussianField.packed``) as seen by ``camera``."""
    done = (rasteriser or Rasteriser()).forward(parameters, camera, full)
    planes = done.planes
    colour, alpha = np.moveaxis(planes[:3], 0, -1), 1 - planes[3]
    if not full:
        return Render(colour, alpha, None, None, None, done.pairs)
    drawn = alpha > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(drawn, planes[4] / alpha, np.nan)
        normals = np.moveaxis(planes[6:9], 0, -1)
        normals = np.where(drawn[..., None], normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.nan)
    median = np.where(planes[3] <= 0.5, planes[5], np.nan)
    return Render(colour, alpha, depth, median, normals, done.pairs)
