"""The ground behind the stems, and how little of it is seen where a stem stands.

Every photo of a flight sees the same ground under the same sun. Its colour there is the median over the photos: what
hides it in one photo hides other places in the next. In each photo the ground then shows through everywhere except
where something stands before it, and along an upright axis that something is a stem: its silhouette, found without any
edge. This is the check that edges cannot give: the lit half of a stem has clear edges but its other half is not ground.
Own method; what it brought is in ``docs/evidence/photos.md``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...quality.priors import START_TAPER
from ..tuned import BLOCK_ROWS, MIN_FLIGHT_VIEWS, REACH_M, ROW_M, STEP_M
from .axis_patches import StemAxis
from .background_kernels import (
    TONES,
    contrast_of,
    grid_contrasts,
    ground_medians,
    likelihoods,
)
from .crops import GroundGrid, PhotoStack


class Backdrop(NamedTuple):
    """Ground colours. mean, spread: (F, rows, columns, 3) float32, NaN = not seen; rows from ``y0``, columns from
    ``x0``, every ``cell`` metres. layer: (V,) int64, which of the F a photo belongs to."""

    x0: float
    y0: float
    cell: float
    mean: np.ndarray
    spread: np.ndarray
    layer: np.ndarray


def make_backdrop(
    stack: PhotoStack, ground: GroundGrid, box: tuple[float, float, float, float], cell: float = 0.05
) -> Backdrop | None:
    """The ground of each flight inside ``box`` (x0, y0, x1, y1); flights with few photos are pooled.

    ``None`` where too few photos show it behind a stem: those that look across see the horizon there.
    """
    if shows_ground_behind(stack, ground, box).sum() < MIN_FLIGHT_VIEWS:
        return None
    flights = np.array([view.flight for view in stack.views], np.int64)
    names, layer, counts = np.unique(flights, return_inverse=True, return_counts=True)
    if (counts < MIN_FLIGHT_VIEWS).any():
        layer, names = np.zeros(len(flights), np.int64), names[:1]
    x = np.arange(box[0], box[2], cell)
    y = np.arange(box[1], box[3], cell)
    gx, gy = (grid.ravel() for grid in np.meshgrid(x, y))
    gz = ground.at(gx, gy)
    mean = np.empty((len(names), len(y), len(x), 3), np.float32)
    spread = np.empty_like(mean)
    for index in range(len(names)):
        members = np.flatnonzero(layer == index)
        members = members[np.unique(np.linspace(0, len(members) - 1, min(len(members), 32)).astype(int))]
        picture = mean[index].reshape(-1, 3), spread[index].reshape(-1, 3)
        ground_medians(stack.arrays_of(members), gx, gy, gz, TONES.lut, MIN_FLIGHT_VIEWS - 2, *picture)
    return Backdrop(float(x[0]), float(y[0]), cell, mean, spread, layer.astype(np.int64))


def shows_ground_behind(
    stack: PhotoStack, ground: GroundGrid, box: tuple[float, float, float, float], top_m: float = 3.0
) -> np.ndarray:
    """(V,) bool: the photo sees the ground of ``box`` behind a stem in its middle, up to ``top_m``."""
    middle = np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])])
    foot_z = float(ground.at(middle[:1], middle[1:])[0])
    above = np.maximum(stack.centre[:, 2] - foot_z - top_m, 1e-6)
    hits = middle + (middle - stack.centre[:, :2]) * (top_m / above)[:, None]
    return ((hits > box[:2]) & (hits < box[2:])).all(axis=1)


class Silhouette(NamedTuple):
    """How little ground is seen around one axis; the compiled kernels take it as it is.

    total: (V, B, U + 1) running sums over the sideways samples of the ground likelihood (log ratio). u0: place of
    the first sample, m. q: (B,) block heights minus breast height. normal: (V, 2) direction across each view. widen:
    (V,) silhouette half width over radius (lean). blind: (V,) photos that do not show the whole strip.
    """

    total: np.ndarray
    u0: float
    q: np.ndarray
    normal: np.ndarray
    widen: np.ndarray
    blind: np.ndarray
    taper: float = START_TAPER

    def contrast(self, vector: np.ndarray) -> float:
        """How much less ground is seen inside than beside a stem (x, y, lx, ly, r relative to the axis): the summed
        square error that the silhouette explains, over all photos and heights."""
        return float(contrast_of(self, np.asarray(vector, float)))

    def peaks(self, radii: np.ndarray, reach_m: float = 0.26, most: int = 6, share: float = 0.3) -> list[np.ndarray]:
        """The best silhouettes of upright stems near the axis, best first: (5,) vectors with no lean."""
        from scipy.ndimage import maximum_filter

        offsets = np.arange(-reach_m, reach_m + 0.01, 0.02)
        score = np.empty((len(offsets), len(offsets), len(radii)), np.float32)
        grid_contrasts(self, offsets, radii, score)
        top = np.argwhere((score >= maximum_filter(score, size=5)) & (score > share * max(float(score.max()), 1e-6)))
        order = np.argsort(-score[tuple(top.T)], kind="stable")[:most]
        return [np.array([offsets[b], offsets[a], 0.0, 0.0, radii[k]]) for a, b, k in top[order]]


def cut_silhouette(
    stack: PhotoStack, backdrop: Backdrop, ground: GroundGrid, axis: StemAxis, band: tuple[float, float]
) -> Silhouette:
    """Ground likelihood in every photo along an axis, in a band of heights above the ground (m)."""
    silhouette, heights, places = blank(len(stack), axis, band)
    likelihoods(stack.arrays, ground, backdrop, TONES, axis.row, heights, places, silhouette)
    return silhouette


def blank(photos: int, axis: StemAxis, band: tuple[float, float]) -> tuple[Silhouette, np.ndarray, np.ndarray]:
    """A silhouette to be filled, the heights of its rows and the sideways places of its samples, metres."""
    heights = np.arange(band[0], band[1], ROW_M)
    heights = heights[: len(heights) // BLOCK_ROWS * BLOCK_ROWS]
    u = np.arange(-REACH_M, REACH_M + STEP_M / 2, STEP_M)
    blocks = len(heights) // BLOCK_ROWS
    q = heights.reshape(blocks, BLOCK_ROWS).mean(axis=1) - axis.bh_m
    total, blind = np.zeros((photos, blocks, len(u) + 1)), np.zeros(photos, np.bool_)
    return Silhouette(total, float(u[0]), q, np.zeros((photos, 2)), np.ones(photos), blind), heights, u
