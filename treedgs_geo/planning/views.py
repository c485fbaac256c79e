"""How likely each photo shows each stem's breast height free: a gap-fraction model through crowns and stems.

A ray from the stem to the camera passes leaves with the chance ``exp(-clumping * depth ** power)`` (Beer-Lambert
with clumped leaves, Nilson 1971; depth: leaf area times its shadow, along the ray) and stems not at all. A view is
*clear* when at least 70 % of the camera-facing band from 1.0 to 1.8 m shows (the simulator's and the benchmarks'
definition); the share that shows scatters about its mean as a beta distribution. Both constants are from simulated
stands: ``docs/evidence/planning.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from scipy.stats import beta

from ..core.files import read_json
from .stand import CELL_M, Scene

#: A view is clear with this share of the band showing, from no steeper than this (sine of the angle to the stem).
CLEAR_SHARE, MIN_SINE = 0.7, 0.35
#: The band of a stem whose visibility counts, m above the ground.
BAND_M = (1.0, 1.8)
#: Stems farther from the one looked at are no longer in a ray's way below the canopy, m.
_NEAR_M = 18.0


@dataclass(frozen=True)
class ViewModel:
    """clumping, power: leaves in tufts hide ``clumping * depth ** power`` of optical depth where as many, spread
    evenly, would hide ``depth`` (dense crowns lose more to overlap). spread: precision of the beta distribution of
    the share that shows. background: optical depth of twigs and shrubs along every ray."""

    clumping: float
    power: float
    spread: float
    background: float

    @staticmethod
    def load() -> ViewModel:
        """The shipped constants (``docs/results/planning_views.json`` has the stands and commit)."""
        return ViewModel(**read_json(Path(__file__).with_name("view_model.json"))["model"])

    def clear_chance(self, shown: np.ndarray) -> np.ndarray:
        """Chance that a view is clear, from the mean share that shows (any shape, 0 to 1)."""
        grid = np.linspace(0, 1, 201)
        mean = np.clip(grid, 1e-4, 1 - 1e-4)
        table = beta.sf(CLEAR_SHARE, mean * self.spread, (1 - mean) * self.spread)
        table[0] = 0.0
        return np.interp(shown, grid, table)


def shown_share(
    scene: Scene, stems: np.ndarray, cameras: np.ndarray, framed: np.ndarray, model: ViewModel
) -> np.ndarray:
    """Mean share of each stem's band that each camera sees through crowns and past stems.

    stems: (S,) rows of ``scene.stems``. cameras: (P, 3) in the scene's frame. framed: (S, P) bool, others are not
    computed.

    Returns:
        (S, P) float32, 0 where not framed.
    """
    return _shown(
        scene.low, scene.leaves, scene.stems, np.asarray(stems, np.int64), np.asarray(cameras, float),
        np.asarray(framed, bool), model.clumping, model.power, model.background,
    )  # fmt: skip


@numba.njit(parallel=True, cache=True)
def _shown(low, leaves, stems, rows, cameras, framed, clumping, power, background):
    out = np.zeros((len(rows), len(cameras)), np.float32)
    # Below the lowest leaf there is nothing to add up.
    lowest = 0
    while lowest < leaves.shape[2] and not leaves[:, :, lowest].any():
        lowest += 1
    for s in numba.prange(len(rows)):
        me = rows[s]
        x0, y0, r0, z0 = stems[me, 0], stems[me, 1], stems[me, 2], stems[me, 4]
        near = np.empty(len(stems), np.int64)
        n_near = 0
        for k in range(len(stems)):
            away = np.hypot(stems[k, 0] - x0, stems[k, 1] - y0)
            if k != me and away < _NEAR_M and away > 0.5 * r0:
                near[n_near] = k
                n_near += 1
        hiding = np.empty(len(stems), np.int64)
        for p in range(len(cameras)):
            if not framed[s, p]:
                continue
            dx, dy = cameras[p, 0] - x0, cameras[p, 1] - y0
            flat = np.hypot(dx, dy)
            if flat < 1e-6:
                continue
            ux, uy = dx / flat, dy / flat
            # Stems that may stand between: few of those nearby.
            n_hiding = 0
            for n in range(n_near):
                k = near[n]
                ex, ey = stems[k, 0] - x0, stems[k, 1] - y0
                if ex * ux + ey * uy > 0.0 and abs(ex * uy - ey * ux) < 1.5 * stems[k, 2] + r0:
                    hiding[n_hiding] = k
                    n_hiding += 1
            total = 0.0
            for h in range(3):
                z = z0 + 1.0 + 0.4 * h
                rise = (cameras[p, 2] - z) / flat
                bottom = max(0.0, low[2] + lowest * CELL_M - z) / max(rise, 1e-6)
                away = r0 + bottom
                depth = _leaf_depth(low, leaves, x0 + away * ux, y0 + away * uy, z + rise * bottom, ux, uy, rise)
                free = np.exp(-clumping * depth**power - background)
                for side in range(3):
                    off = (side - 1) * 0.75 * r0
                    if not _behind_stem(stems, hiding, n_hiding, x0 - off * uy, y0 + off * ux, z, ux, uy, rise):
                        total += free
            out[s, p] = total / 9.0
    return out


@numba.njit(cache=True)
def _leaf_depth(low, leaves, x, y, z, ux, uy, rise):
    """Optical depth of the leaves along a ray that climbs ``rise`` metres a level metre, until it leaves the grid."""
    length = np.sqrt(1.0 + rise * rise)
    step = CELL_M / length
    cx, cy, cz = ux * step, uy * step, rise * step
    nx, ny, nz = leaves.shape
    depth = 0.0
    while True:
        i, j, k = int((x - low[0]) / CELL_M), int((y - low[1]) / CELL_M), int((z - low[2]) / CELL_M)
        if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
            return depth
        depth += leaves[i, j, k] * CELL_M
        x, y, z = x + cx, y + cy, z + cz


@numba.njit(cache=True)
def _behind_stem(stems, near, n_near, x, y, z, ux, uy, rise):
    """Whether another stem stands in the ray's way."""
    for n in range(n_near):
        k = near[n]
        dx, dy = stems[k, 0] - x, stems[k, 1] - y
        along = dx * ux + dy * uy
        if along <= 0.0:
            continue
        up = z + rise * along - stems[k, 4]
        if up >= stems[k, 3] or up < 0.0:
            continue
        radius = stems[k, 2] * ((stems[k, 3] - up) / max(stems[k, 3] - 1.3, 0.5)) ** 0.6
        if abs(dx * uy - dy * ux) < radius:
            return True
    return False


def framed_views(
    points: np.ndarray, radius_m: np.ndarray, cameras: np.ndarray, rotations: np.ndarray, focal: np.ndarray,
    size: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Which photo holds which stem's whole band, and how far away it is.

    points: (S, 3) foot of each stem. radius_m: (S,). cameras (P, 3), rotations (P, 3, 3) world -> camera, focal: px.
    size: (2,) width and height, px; the principal point is the middle, the lens without distortion.

    Returns:
        (S, P) bool in the frame and seen from no steeper than :data:`MIN_SINE`; (S, P) depth, m.
    """
    ok = np.ones((len(points), len(cameras)), bool)
    for height in BAND_M:
        away = points[:, None] + [0, 0, height] - cameras[None]
        local = np.einsum("pij,spj->spi", rotations, away)
        depth = np.maximum(local[..., 2], 1e-6)
        margin = focal * radius_m[:, None] / depth
        ok &= (local[..., 2] > 1) & (np.abs(focal * local[..., 0] / depth) + margin < size[0] / 2)
        ok &= np.abs(focal * local[..., 1] / depth) + margin < size[1] / 2
    middle = cameras[None] - points[:, None] - [0, 0, 1.37]
    sine = np.hypot(middle[..., 0], middle[..., 1]) / np.linalg.norm(middle, axis=-1)
    return ok & (sine > MIN_SINE), depth
