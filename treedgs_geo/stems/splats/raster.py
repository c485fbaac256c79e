"""Composite projected Gaussians into a picture, and pull gradients back to them: one thread, the kernels release the
GIL, safe to use from several Python threads at once."""

from __future__ import annotations

import math
import threading

import numpy as np

from . import kernels

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


def composite(projected: np.ndarray, height: int, width: int, full: bool) -> np.ndarray:
    """(4 or 9, H, W) float32 planes of ``kernels.py``. projected: (17, n) float32 rows of ``on_torch/project.py``,
    front to back."""
    count = kernels.N_PLANES if full else 4
    cells = _scratch.take("cells", (height, -(-width // kernels.LANES), count, kernels.LANES))
    cells[:] = 0
    cells[:, :, 3] = 1
    if full:
        cells[:, :, 5] = np.nan
    cells, n = cells.reshape(-1), projected.shape[1]
    (kernels.forward_full if full else kernels.forward_colour)(projected, n, height, width, cells)
    return kernels.from_cells(cells, count, height, width)


def pull_back(projected: np.ndarray, planes: np.ndarray, given: np.ndarray) -> np.ndarray:
    """(15, n) float32 gradients of :func:`composite`: with respect to U, V, A, B, C, OPACITY, RANGE, SX, SY, NX, NY,
    NZ, RED, GREEN, BLUE.

    planes: as drawn. given: (4, H, W) or (9, H, W) float32: dL/d of colour (3) and alpha, then of sum w d and sum w n
    (3), then of the median depth.
    """
    full, n, (height, width) = len(given) == 9, projected.shape[1], given.shape[1:]
    state = _scratch.take("state", (len(given) + 2, height, width))
    state[0], state[2:] = 1, given
    state[1] = np.einsum("chw,chw->hw", state[2:5], planes[:3]) + state[5] * (1 - planes[3])
    if full:
        state[1] += state[6] * planes[4] + np.einsum("chw,chw->hw", state[7:10], planes[6:9])
    count = len(state)
    cells = kernels.to_cells(state, _scratch.take("cells", (height, -(-width // kernels.LANES), count, kernels.LANES)))
    grad = np.zeros((15, n), np.float32)
    (kernels.backward_full if full else kernels.backward_colour)(projected, n, height, width, cells, grad)
    return grad
