"""What points say for and against a cone, counted by voxels of its surface."""

from __future__ import annotations

import numpy as np
from numba import njit

from .cone_kernels import distance

ROW_M = 0.25
SECTORS = 24


@njit(cache=True)
def stands_at(axes, x, y, h, share, least_m, beyond_m):  # pragma: no cover - compiled
    """Does one of (K, 9) ``axes`` (:attr:`.cone.Cone.vector`, h_ref) at height h pass (x, y) closer than ``share`` of
    its radius or ``least_m``, and ``beyond_m`` on top?"""
    for k in range(axes.shape[0]):
        a, t = axes[k], h - axes[k, 8]
        gap = np.hypot(a[0] + (a[2] + 0.5 * a[6] * t) * t - x, a[1] + (a[3] + 0.5 * a[7] * t) * t - y)
        if gap < max(share * (a[4] + a[5] * t), least_m) + beyond_m:
            return True
    return False


@njit(cache=True)
def count_evidence(band, vector, h_ref, tolerance, noise, solid, lowest, rows,
                   need):  # pragma: no cover - compiled
    """Points on the bark, share of rows with ``need`` of them, their arc in degrees, and voxels (row x sector) with
    points on it, inside, just outside, within twice the noise and within two to six times the noise."""
    seen = np.zeros((5, rows, SECTORS), np.bool_)
    per_row = np.zeros(rows, np.int64)
    for m in range(band.shape[0]):
        h = band[m, 2]
        e = distance(band[m, 0], band[m, 1], h, vector, h_ref)
        away = abs(e)
        if e >= tolerance + 0.10 and away >= 6 * noise:
            continue
        row = min(max(int(np.floor((h - lowest) / ROW_M)), 0), rows - 1)
        t = h - h_ref
        turn = np.arctan2(band[m, 1] - vector[1] - (vector[3] + 0.5 * vector[7] * t) * t,
                          band[m, 0] - vector[0] - (vector[2] + 0.5 * vector[6] * t) * t)
        sector = int(np.floor((turn + np.pi) / (2 * np.pi) * SECTORS)) % SECTORS
        if e < tolerance if solid else away < tolerance:
            per_row[row] += 1
            seen[0, row, sector] = True
        if e < -tolerance - 0.01 and not solid:
            seen[1, row, sector] = True
        if tolerance <= e < tolerance + 0.10:
            seen[2, row, sector] = True
        if away < 2 * noise:
            seen[3, row, sector] = True
        elif away < 6 * noise:
            seen[4, row, sector] = True
    arc = 0.0
    for sector in range(SECTORS):
        if seen[0, :, sector].any():
            arc += 360 / SECTORS
    cells, inside, outside, sharp, blurred = seen[0].sum(), seen[1].sum(), seen[2].sum(), seen[3].sum(), seen[4].sum()
    return per_row.sum(), (per_row >= need).mean(), arc, cells, inside, outside, sharp, blurred
