"""What points say for and against a cone, counted by cells of its surface."""

from __future__ import annotations

import numpy as np
from numba import njit

from ...geometry.cone_kernels import distance
from ...geometry.section_kernels import SECTORS

ROW_M = 0.25
#: Rows, sectors and cells with less than this share of the usual number of points hold strays and no bark.
LEAST_OF_USUAL = 0.05


@njit(cache=True, nogil=True)
def stands_at(axes, x, y, h, share, least_m, beyond_m):  # pragma: no cover - compiled
    """Does one of (K, 9) ``axes`` (:attr:`.cone.Cone.vector`, h_ref) at height h pass (x, y) closer than ``share`` of
    its radius or ``least_m``, and ``beyond_m`` on top?"""
    for k in range(axes.shape[0]):
        a, t = axes[k], h - axes[k, 8]
        gap = np.hypot(a[0] + (a[2] + 0.5 * a[6] * t) * t - x, a[1] + (a[3] + 0.5 * a[7] * t) * t - y)
        if gap < max(share * (a[4] + a[5] * t), least_m) + beyond_m:
            return True
    return False


@njit(cache=True, nogil=True)
def count_evidence(band, vector, h_ref, tolerance, noise, solid, lowest, rows, need):  # pragma: no cover - compiled
    """Points on the bark, share of rows that show it, their arc in degrees, and in units of cells (row x sector): cells
    with bark, what lies inside, just outside, within twice the noise and within two to six times the noise.

    A cell counts for as much as its points are of the bark's there (or of the usual bark cell, where that holds more),
    at most for one: neither a dense side outvotes the rest, nor does a stray point weigh more where there are more
    points. Cells and rows below ``LEAST_OF_USUAL`` of the usual number are strays; ``need`` points make a row."""
    count = np.zeros((5, rows, SECTORS))
    for m in range(band.shape[0]):
        h = band[m, 2]
        e = distance(band[m, 0], band[m, 1], h, vector, h_ref)
        away = abs(e)
        if e >= tolerance + 0.10 and away >= 6 * noise:
            continue
        row = min(max(int(np.floor((h - lowest) / ROW_M)), 0), rows - 1)
        t = h - h_ref
        turn = np.arctan2(
            band[m, 1] - vector[1] - (vector[3] + 0.5 * vector[7] * t) * t,
            band[m, 0] - vector[0] - (vector[2] + 0.5 * vector[6] * t) * t,
        )
        sector = int(np.floor((turn + np.pi) / (2 * np.pi) * SECTORS)) % SECTORS
        if e < tolerance if solid else away < tolerance:
            count[0, row, sector] += 1
        if e < -tolerance - 0.01 and not solid:
            count[1, row, sector] += 1
        if tolerance <= e < tolerance + 0.10:
            count[2, row, sector] += 1
        if away < 2 * noise:
            count[3, row, sector] += 1
        elif away < 6 * noise:
            count[4, row, sector] += 1
    per_row, per_sector = count[0].sum(axis=1), count[0].sum(axis=0)
    points = per_row.sum()
    if points == 0:
        return 0, 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0
    share = (per_row >= max(need, LEAST_OF_USUAL * usual(per_row))).mean()
    arc = 360 / SECTORS * (per_sector >= max(1.0, LEAST_OF_USUAL * usual(per_sector))).sum()
    typical = usual(count[0].ravel())
    least = max(1.0, LEAST_OF_USUAL * typical)
    cells = 0
    counted = np.zeros(5)
    mean = 0.0
    for row in range(rows):
        for sector in range(SECTORS):
            if count[0, row, sector] >= least:
                cells += 1
                mean += count[0, row, sector]
    mean /= max(cells, 1)
    for row in range(rows):
        for sector in range(SECTORS):
            here = max(count[0, row, sector], mean)
            for kind in range(1, 5):
                counted[kind] += min(count[kind, row, sector] / here, 1.0)
    return int(points), share, arc, cells, counted[1], counted[2], counted[3], counted[4]


@njit(cache=True, nogil=True)
def usual(count):  # pragma: no cover - compiled
    """The number of points in the cell of a typical point: the mean of ``count`` (K,) weighted by itself."""
    total, square = 0.0, 0.0
    for n in count:
        total += n
        square += n * n
    return square / total if total > 0 else 0.0
