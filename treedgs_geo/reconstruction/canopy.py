"""Height of the canopy from the photos: the highest places that neighbouring photos show alike.

From the top down, a level at a time: where the photos agree, something stands, and what lies below it is not looked
at. That finds thin leaders and bare crowns that semi-global matching smooths away (``docs/evidence/heights.md``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from ..core.progress import Reporter
from .multi_view_correlation import Pictures

#: Correlation from which something stands there. In the air the largest within 0.8 m of a tip is 0.05 to 0.18.
STANDS = 0.2
#: The same in finer pictures where coarser ones have found something.
CONFIRMS = 0.12
#: Cell and level, metres.
CELL_M = 0.2
#: Smallest height that counts as canopy, metres.
MIN_M = 2.0
#: Blur over the cells of a level, cells.
_BLUR = 0.8
#: Round a tip: reach across, below and above it, and step, metres; blur, steps.
_REACH_M, _BELOW_M, _ABOVE_M, _STEP_M, _TIP_BLUR = 0.9, 1.0, 3.0, 0.1, 0.7
#: From one level to the next the leader moves so far at most, and a gap as high as this ends it, metres.
_STRAY_M, _GAP_M = 0.35, 0.45


@dataclass(frozen=True)
class Canopy:
    """Height of the canopy above the ground on a grid. x: (C,), y: (R,) local metres of the cell centres, y from south
    to north. ground_z: (R, C) local height of the ground. height_m: (R, C), NaN where nothing was seen to stand."""

    x: np.ndarray
    y: np.ndarray
    ground_z: np.ndarray
    height_m: np.ndarray


def alike_in(pictures: list[Pictures], points: np.ndarray) -> np.ndarray:
    """(N, 3) local points -> (N,) mean of :meth:`.multi_view_correlation.Pictures.alike` over pictures of several
    sizes."""
    return np.mean([each.alike(points) for each in pictures], axis=0)


def canopy_of(
    pictures: list[Pictures],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    box: tuple[float, float, float, float],
    highest_m: float,
    reporter: Reporter | None = None,
) -> Canopy:
    """The canopy in a box.

    Args:
        pictures: the coarsest first, which finds; the others confirm. ground: local x, y (N,) -> local z, NaN where
            unknown (nothing is looked for there). box: x0, y0, x1, y1. highest_m: above the ground, where the search
            begins.
    """
    reporter = reporter or Reporter()
    coarse, *fine = pictures
    x, y = (np.arange(low + CELL_M / 2, high, CELL_M) for low, high in ((box[0], box[2]), (box[1], box[3])))
    gx, gy = np.meshgrid(x, y)
    z = np.asarray(ground(gx.ravel(), gy.ravel()), float).reshape(gx.shape)
    known = np.isfinite(z)
    found, above = np.full(gx.shape, np.nan), np.zeros(gx.shape, np.float32)
    levels = np.arange(highest_m, MIN_M, -CELL_M)
    for number, level in enumerate(levels):
        reporter.progress(number / len(levels))
        # One level below what stands still counts in the mean of its neighbours' cells.
        open_cells = known & ~(found > level + 2 * CELL_M)
        looked = cv2.dilate(open_cells.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & known
        here = np.zeros(gx.shape, np.float32)
        here[looked] = coarse.alike(np.column_stack([gx[looked], gy[looked], z[looked] + level]))
        here = cv2.GaussianBlur(here, (0, 0), _BLUR)
        stands = known & np.isnan(found) & ((here + above) / 2 > STANDS)
        stands &= _confirmed(fine, stands, np.dstack([gx, gy, z + level + CELL_M / 2]))
        found[stands] = level + CELL_M / 2
        above = here
    return Canopy(x, y, z, found)


def _confirmed(fine: list[Pictures], stands: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(R, C) bool: finer pictures agree too, at the cell and those beside it. places: (R, C, 3) local."""
    near = cv2.dilate(stands.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    near &= np.isfinite(places[..., 2])
    if not fine or not near.any():
        return stands
    alike, weight = np.zeros(stands.shape, np.float32), near.astype(np.float32)
    alike[near] = alike_in(fine, places[near])
    weight = np.maximum(cv2.GaussianBlur(weight, (0, 0), _BLUR), 1e-6)
    return stands & (cv2.GaussianBlur(alike, (0, 0), _BLUR) / weight > CONFIRMS)


def finer_tip(pictures: list[Pictures], tip: np.ndarray, ground_z: float) -> float:
    """Height above ``ground_z`` (local metres) where the leader of ``tip`` (x, y, height) ends: from below the tip up
    while pictures of several sizes agree, within a step's stray of the level below."""
    across = np.arange(-_REACH_M, _REACH_M + _STEP_M / 2, _STEP_M)
    levels = np.arange(tip[2] - _BELOW_M, tip[2] + _ABOVE_M, _STEP_M)
    dx, dy, h = np.meshgrid(across, across, levels, indexing="ij")
    points = np.column_stack([(tip[0] + dx).ravel(), (tip[1] + dy).ravel(), (ground_z + h).ravel()])
    alike = alike_in(pictures, points).reshape(dx.shape)
    alike = np.stack([cv2.GaussianBlur(alike[:, :, k], (0, 0), _TIP_BLUR) for k in range(len(levels))], axis=2)
    alike[:, :, 1:-1] = (alike[:, :, :-2] + alike[:, :, 1:-1] + alike[:, :, 2:]) / 3
    at, end = np.zeros(2), float(tip[2])
    seen = -np.inf
    for k in range(1, len(levels) - 1):
        near = np.hypot(dx[:, :, 0] - at[0], dy[:, :, 0] - at[1]) <= _STRAY_M + (0.15 if levels[k] <= tip[2] else 0.0)
        level = np.where(near, alike[:, :, k], -1.0)
        best = np.unravel_index(int(level.argmax()), level.shape)
        if level[best] > STANDS:
            seen, at = float(levels[k]), np.array([dx[best[0], best[1], 0], dy[best[0], best[1], 0]])
        elif levels[k] > tip[2] and levels[k] - max(seen, tip[2] - _BELOW_M) > _GAP_M:
            break
    return seen if np.isfinite(seen) else end
