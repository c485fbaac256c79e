"""Cells of a terrain raster that hold no height and do not say so: zeros, -32767, whatever the program wrote."""

from __future__ import annotations

import numpy as np

#: A filling value lies at least this far below or above every other height, metres.
_DETACHED_M = 10.0
#: Beside such cells a raster that was resampled holds blends of height and filling: steeper than this, metres a metre.
_STEEP = 2.0
#: No land is this high: where such a number is among zeros, it is the filling and not they.
_NO_LAND_M = 8900.0
#: Different filling values that one raster may hold on each side.
_MAX_VALUES = 3


def unmarked_nodata(heights: np.ndarray, resolution_m: float) -> tuple[np.ndarray, list[float]]:
    """``((rows, cols) bool, values)``: cells of (rows, cols) ``heights`` (metres, NaN = known to be unknown) that
    hold no height though they hold a number, and the filling values found.

    A filling value is the lowest or highest number of the raster, held by several cells (or 0, by one), and far from
    every other. Blends of it with real heights, which resampling leaves round the hole, go with it.
    """
    holes = np.zeros(heights.shape, bool)
    values: list[float] = []
    highest = np.max(heights, initial=-np.inf, where=np.isfinite(heights))
    for sign in (-1.0, 1.0) if highest > _NO_LAND_M else (1.0, -1.0):
        for _ in range(_MAX_VALUES):
            known = sign * heights[np.isfinite(heights) & ~holes]
            if known.size == 0:
                break
            lowest = float(known.min())
            rest = known[known > lowest]
            repeated = known.size - rest.size >= 2 or lowest == 0.0
            if rest.size == 0 or not repeated or float(rest.min()) - lowest < _DETACHED_M:
                break
            values.append(sign * lowest + 0.0)
            holes |= heights == sign * lowest
    if values:
        holes |= _blends(np.where(holes, np.nan, heights), holes, resolution_m)
    return holes, values


def _blends(heights: np.ndarray, holes: np.ndarray, resolution_m: float) -> np.ndarray:
    """(rows, cols) bool: cells joined to the ``holes`` by cells as steep as only a blend is."""
    from scipy.ndimage import binary_propagation

    steep = np.zeros(heights.shape, bool)
    limit = _STEEP * resolution_m + 1.0
    for axis in (0, 1):
        with np.errstate(invalid="ignore"):
            step = np.abs(np.diff(heights, axis=axis)) > limit
        ahead, behind = [slice(None)] * 2, [slice(None)] * 2
        ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
        steep[tuple(ahead)] |= step
        steep[tuple(behind)] |= step
    everywhere = np.ones((3, 3), bool)
    return binary_propagation(holes, everywhere, holes | steep) & ~holes
