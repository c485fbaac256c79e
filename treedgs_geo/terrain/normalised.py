"""Clouds whose z is height above ground: told by their lowest points, which lie near zero everywhere."""

from __future__ import annotations

import numpy as np

from .surface import cell_quantile

#: The lowest points of such a cloud: with its ground, or cut so far above it at most, metres.
CUT_M = (-0.3, 1.1)
#: In blocks of this side; those with stems or low plants have points up to ``LOW_M`` above the cloud's lowest, and such
#: a share of them begins within ``LEVEL_M`` of it. A slope or relief spreads over ``LOW_M``.
BLOCK_M, LOW_M, LEVEL_M, LEVEL_SHARE = 3.0, 2.0, 0.25, 0.7
#: So many blocks tell a plot; fewer are one tree.
MIN_BLOCKS = 4
#: Standard error of heights that another program's ground was taken off from, metres.
NORMALISED_SE_M = 0.1


def lowest_height(xyz: np.ndarray) -> float | None:
    """z of the lowest points of (N, 3) ``xyz`` where it looks like height above ground, else ``None``.

    The ground may be in the cloud or cut off at one height. A cloud of one tree says little about its slope, but there
    zero and the lowest points are hardly a metre apart.
    """
    lows = cell_quantile(xyz, BLOCK_M, 0.0)[:, 2]
    low = float(np.partition(xyz[:, 2], min(10, len(xyz) - 1))[min(10, len(xyz) - 1)])
    if not CUT_M[0] <= low <= CUT_M[1]:
        return None
    near = lows[lows < low + LOW_M]
    level = len(near) < MIN_BLOCKS or np.mean(near < low + LEVEL_M) >= LEVEL_SHARE
    return low if level else None
