"""Draw a Gaussian field into a crop, and pull gradients back to its parameters: one thread, the kernels release the
GIL, safe to use from several Python threads at once."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

import numpy as np

from . import kernels
from .field import N_PARAMETERS
from .project import N_ROWS, CropCamera, gather_columns, project_backward_kernel, project_kernel

#: Fainter than this a Gaussian is not drawn (one grey level of 255).
ALPHA_MIN = 1 / 255


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
class Pass:
    """One forward pass, kept for its backward: the sorted projection and the raw planes (see ``kernels.py``)."""

    camera: CropCamera
    projected: np.ndarray
    index: np.ndarray
    planes: np.ndarray
    dilation: float


def draw(
    parameters: np.ndarray,
    camera: CropCamera,
    full: bool = False,
    dilation_px2: float = 0.0,
    alpha_min: float = ALPHA_MIN,
) -> Pass:
    """Project, sort front to back by distance and composite.

    parameters: (N, 14) float64. full: depth and normals too. dilation_px2: variance added to each ellipse, with the
    opacity lowered so that its integral stays (Mip-Splatting's 2D filter); 0 draws the Gaussians as they are.
    alpha_min: fainter than this a Gaussian is not drawn.
    """
    projected, index = project(parameters, camera, dilation_px2, alpha_min)
    height, width, count = camera.height, camera.width, kernels.N_PLANES if full else 4
    cells = _scratch.take("cells", (height, -(-width // kernels.LANES), count, kernels.LANES))
    cells[:] = 0
    cells[:, :, 3] = 1
    if full:
        cells[:, :, 5] = np.nan
    cells = cells.reshape(-1)
    (kernels.forward_full if full else kernels.forward_colour)(projected, len(index), height, width, cells)
    return Pass(camera, projected, index, kernels.from_cells(cells, count, height, width), dilation_px2)


def pull_back(parameters: np.ndarray, done: Pass, given: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient with respect to the parameters, (N, 14) float64, and to each centre in the picture, (N, 2) float32 per
    pixel.

    given: (4, H, W) or (9, H, W) float32: dL/d of colour (3) and alpha, then of sum w d and sum w n (3) as in
    ``done.planes``, then of the median depth.
    """
    planes, n, camera = done.planes, len(done.index), done.camera
    full, height, width = len(given) == 9, camera.height, camera.width
    state = _scratch.take("state", (len(given) + 2, height, width))
    state[0], state[2:] = 1, given
    state[1] = np.einsum("chw,chw->hw", state[2:5], planes[:3]) + state[5] * (1 - planes[3])
    if full:
        state[1] += state[6] * planes[4] + np.einsum("chw,chw->hw", state[7:10], planes[6:9])
    count = len(state)
    cells = kernels.to_cells(state, _scratch.take("cells", (height, -(-width // kernels.LANES), count, kernels.LANES)))
    grad = _scratch.take("grad", (15, max(n, 1)))
    grad[:] = 0
    (kernels.backward_full if full else kernels.backward_colour)(done.projected, n, height, width, cells, grad)
    pull = np.zeros((len(parameters), 2), np.float32)
    pull[done.index] = grad[:2, :n].T
    out = np.zeros((len(parameters), N_PARAMETERS))
    pose = camera.intrinsics, camera.rotation, camera.translation
    project_backward_kernel(parameters, *pose, done.dilation, done.index, grad, out)
    return out, pull


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
