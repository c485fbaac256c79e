"""Through which places above the ground photos see the ground: nothing stands there.

Photos are draped on the ground. What most of those that can see a place of it show alike is the ground
(:func:`.orthophoto.agreement_of_halves`); a photo that shows it looks through air all the way, one that shows something
else there looks at something that stands on the way. Crowns that move in wind hide the ground all the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from scipy.ndimage import distance_transform_edt

from ..core.machine import EXACT, in_threads
from .cameras import View
from .orthophoto import AGREED, STEP_PX, agreement_of_halves, drape

#: Pixel of the draped photos, metres; so many on each side are a cell.
_PIXEL_M, _CELL_PX = 0.1, STEP_PX // 2
#: A photo that agrees as much as this share of the best one shows the ground.
_SHOWS = 0.5
#: A crown, dense to bare, lets through one of these shares of the rays that air does; no share is surer than this.
THROUGH, _MIN_SHARE = np.array([0.1, 0.25, 0.5, 0.75]), 0.03
#: Photos from side by side tell the same: what each counts for (of 0.2 to 1 the least error, 19 simulated plots).
_WORTH = 0.6


@dataclass(frozen=True)
class GroundSight:
    """Where V photos see the ground.

    corner: (2,) local x, y of the first cell's centre. cell_m: cells are square. ground_z: (R, C) local height.
    sees: (V, R, C) float32, 1 the photo shows the ground there, 0 something in front of it, NaN unknown. centres:
    (V, 3) of the cameras, local metres.
    """

    corner: np.ndarray
    cell_m: float
    ground_z: np.ndarray
    sees: np.ndarray
    centres: np.ndarray

    def hides(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) local points -> (..., T) log of how much more probable what is seen through them is if a crown of
        each of the densities :data:`THROUGH` is there than if air is; 0 where no photo tells.

        What air lets through is a photo's own share of the ground: the way behind the point is as open as elsewhere.
        """
        flat = np.ascontiguousarray(points.reshape(-1, 3), float)
        odds = np.zeros((len(flat), len(THROUGH)))
        if len(self.sees):
            shown = np.isfinite(self.sees)
            air = np.where(shown, self.sees, 0).sum(axis=(1, 2)) / np.maximum(shown.sum(axis=(1, 2)), 1)
            air = air.clip(_MIN_SHARE, 1 - _MIN_SHARE)[:, None]
            crown = np.maximum(THROUGH * air, 0.5 * _MIN_SHARE)
            worth = _WORTH * np.stack([np.log((1 - crown) / (1 - air)), np.log(crown / air)], axis=1)
            _hides(flat, self.centres, self.ground_z, self.sees, worth, self.corner, self.cell_m, odds)
        return odds.reshape(*points.shape[:-1], len(THROUGH))


@njit(parallel=True, **EXACT)
def _hides(points, centres, ground_z, sees, worth, corner, cell, odds):  # pragma: no cover - compiled
    rows, columns = ground_z.shape
    for k in prange(len(points)):
        x, y, z = points[k]
        for v in range(len(centres)):
            cx, cy, cz = centres[v]
            if not cz - z > 1.0:  # nor where the ground is unknown
                continue
            level = z
            row = column = -1
            for _ in range(4):  # where the ray meets the ground: the point's own, then that of the place it meets
                share = (cz - level) / (cz - z)
                column = int(np.round((cx + (x - cx) * share - corner[0]) / cell))
                row = int(np.round((cy + (y - cy) * share - corner[1]) / cell))
                if row < 0 or column < 0 or row >= rows or column >= columns:
                    row = -1
                    break
                level = ground_z[row, column]
            if row >= 0 and not np.isnan(sees[v, row, column]):
                odds[k] += worth[v, int(sees[v, row, column])]  # of every density


def ground_sight(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    box: tuple[float, float, float, float],
    reach_m: float,
) -> GroundSight:
    """Where photos see the ground of a box x0, y0, x1, y1 and so far beside it, local metres.

    ground: local x, y (N,) -> local z, NaN where unknown (there the nearest known height counts).
    """
    cell = _CELL_PX * _PIXEL_M
    x, y = (np.arange(low - reach_m, high + reach_m + cell, cell) for low, high in ((box[0], box[2]), (box[1], box[3])))
    gx, gy = np.meshgrid(x, y)
    z = np.asarray(ground(gx.ravel(), gy.ravel()), float).reshape(gx.shape)
    if not np.isfinite(z).any():
        return GroundSight(np.array([x[0], y[0]]), cell, z, np.empty((0, *z.shape), np.float32), np.empty((0, 3)))
    z = z[tuple(distance_transform_edt(np.isnan(z), return_distances=False, return_indices=True))]
    # Corners of the draped pictures' first and last pixels, half a pixel within the cells' outer edges.
    rim = 0.5 * (cell - _PIXEL_M)
    nodes = np.stack([*np.meshgrid(_spread(x, rim), _spread(y, rim)), z], axis=2)
    middle = np.array([x.mean(), y.mean(), np.median(z)])
    shape = len(y) * _CELL_PX, len(x) * _CELL_PX

    def draped(view: View) -> np.ndarray:
        return drape(view, nodes, shape, max(int(_PIXEL_M * view.camera.fx / np.linalg.norm(middle - view.centre)), 1))

    stack = list(in_threads(draped, views))
    agreement = agreement_of_halves(stack)
    best = agreement.max(axis=0)
    black = np.array(
        [(image[..., 0] == 0).reshape(len(y), _CELL_PX, len(x), _CELL_PX).any(axis=(1, 3)) for image in stack]
    )
    sees = np.where(black | (best < AGREED), np.nan, agreement > _SHOWS * best).astype(np.float32)
    return GroundSight(np.array([x[0], y[0]]), cell, z, sees, np.array([view.centre for view in views]))


def _spread(centres: np.ndarray, rim: float) -> np.ndarray:
    return np.linspace(centres[0] - rim, centres[-1] + rim, len(centres))
