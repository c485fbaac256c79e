"""Where breast height is: along the stem, from the ground on its uphill side, at the foot and not below the axis."""

from __future__ import annotations

import numpy as np

from ..images.axis_patches import StemAxis
from ..images.crops import GroundGrid


def breast_height(axis: StemAxis, radius_m: float, ground: GroundGrid) -> tuple[float, float]:
    """``(dq, ground_z)``: how far breast height lies above ``axis.p`` (m), and the ground on the uphill side.

    The axis is followed down to the ground; from the uphill side of that foot, breast height is measured along the
    stem. A fit that does not lean on flat ground gives 0.
    """
    q = -axis.bh_m
    for _ in range(5):
        x, y, _ = axis.at(np.array([q + axis.bh_m]))[0]
        z = float(ground.at(np.array([x]), np.array([y]))[0])
        q = z - axis.ground_z - axis.bh_m
    reach = 0.5
    around = ground.at(np.array([x + reach, x - reach, x, x]), np.array([y, y, y + reach, y - reach]))
    slope = min(float(np.hypot(around[0] - around[1], around[2] - around[3])) / (2 * reach), 1.0)
    uphill = z + slope * radius_m
    upright = 1.0 / np.sqrt(1.0 + float(axis.s @ axis.s))
    dq = uphill + axis.bh_m * upright - (axis.ground_z + axis.bh_m)
    # More means that axis and ground do not belong together.
    return float(np.clip(dq, -0.8, 0.8)), uphill


def moved(axis: StemAxis, dq: float) -> StemAxis:
    """The same axis with its reference point ``dq`` higher."""
    p = axis.p + axis.s * dq + axis.c * dq * dq
    return StemAxis(p, axis.s + 2 * axis.c * dq, axis.c, axis.ground_z + dq, axis.bh_m)
