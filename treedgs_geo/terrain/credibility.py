"""How well a cloud shows its ground: whether a surface lies between the stems, and stands out from what grows on it.

A ground model alone does not say that. Where the lowest metres of a cloud are missing (clipped, filtered, hidden), the
model runs through the feet of the stems or over the shrubs, as smooth as any. Real ground is seen between the stems,
almost everywhere, and holds more points than the layer above it. The limits were set on terrestrial and drone clouds of
the shared data (``docs/results/ground_cut.json``): whole, shares of 0.51 to 1 and contrasts of 2.8 and
more (a lone spruce with branches down to the ground: 1.3); cut 0.5 to 4 m above the ground, shares of 0 to 0.42, and
contrasts of at most 1.3 where they reach 0.25, of 3.3 where they reach 0.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..pointcloud.cloud import extent, slices
from .dtm import Dtm

#: Cells in which points are counted; points within ``LAYER_M`` of the model are at the ground, those up to ``ABOVE_M``
#: over it are what the ground is read from (a layer as thick).
CELL_M, LAYER_M, ABOVE_M = 0.25, 0.10, 0.30
#: The ground is looked for this near a stem.
NEAR_M = 2.0
#: A surface: share of the cells with ground points, and how many times the points of the layer above it holds. The
#: second pair is for sparse or shaded ground, with at least so many points.
MIN_SHARE, MIN_CONTRAST = 0.25, 2.0
SPARSE_SHARE, SPARSE_CONTRAST, SPARSE_POINTS = 0.10, 4.0, 30
#: Standard error of the ground's height, m: seen round the stem; a surface that does not stand out from what grows on
#: it and is whole; is not, but other stems of the cloud have seen ground; and otherwise.
SEEN_SE_M, WHOLE_SE_M, COVER_SE_M, ONLY_COVER_SE_M = 0.03, 0.3, 0.5, 1.0
#: A surface is whole from these on (share of cells, contrast): the cut clouds reach a share of 0.42 at a contrast of 1.
WHOLE_SHARE, WHOLE_CONTRAST = 0.5, 1.0
#: Ground that is seen elsewhere is carried on to a stem along a plane through so many places; roughness of forest
#: ground about such a plane (1 sd, m), what each metre of distance adds, and the slopes that are expected (1 sd).
CARRIED_PLACES, ROUGH_M, ROUGH_M_PER_M, SLOPE_SD = 12, 0.05, 0.03, 0.3
#: Places that are looked round at once.
_BATCH = 2000
#: What is said where nothing shows the ground.
NO_GROUND_M = 99.0


@dataclass(frozen=True)
class GroundLayer:
    """Points at the ground and just above it, counted in cells of :data:`CELL_M`.

    corner: (2,) lower left corner of the cells. ground, above: (rows, cols) counts, row 0 in the south. open: (rows,
    cols) bool, cells that are looked at: all but those of stems.
    """

    corner: np.ndarray
    ground: np.ndarray
    above: np.ndarray
    open: np.ndarray

    @classmethod
    def of(cls, xyz: np.ndarray, dtm: Dtm) -> GroundLayer:
        """Counted from (N, 3) points and the ground model that was made from them; unknown heights are not counted."""
        least, most = extent(xyz[:, :2])
        corner = np.floor(least / CELL_M) * CELL_M
        cols, rows = np.floor((most - corner) / CELL_M).astype(int) + 1
        counts = np.zeros((2, rows * cols), np.int32)
        for points in (xyz[part] for part in slices(len(xyz))):
            height = points[:, 2] - dtm.height(*points[:, :2].T)
            low = np.flatnonzero((height > -LAYER_M) & (height < ABOVE_M))
            cell = np.floor((points[low, :2] - corner) / CELL_M).astype(np.int64)
            col, row = np.clip(cell, 0, (cols - 1, rows - 1)).T
            at_ground = height[low] < LAYER_M
            for kind, chosen in enumerate((at_ground, ~at_ground)):
                counts[kind] += np.bincount((row * cols + col)[chosen], minlength=rows * cols).astype(np.int32)
        ground, above = counts.reshape(2, rows, cols)
        return cls(corner, ground, above, np.ones((rows, cols), bool))

    @property
    def area_m2(self) -> float:
        """Area of the cells that are looked at."""
        return float(self.open.sum()) * CELL_M**2

    def without(self, xy: np.ndarray, clear_m: np.ndarray) -> GroundLayer:
        """The same without the cells nearer than (K,) ``clear_m`` to (K, 2) stems: their feet are no ground."""
        if not len(xy):
            return self
        left = self.open.copy()
        row, col, away = self._around(xy, float(np.max(clear_m)) + CELL_M)
        taken = away < np.asarray(clear_m, float)[:, None]
        left[row[taken], col[taken]] = False
        return replace(self, open=left)

    def evidence(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``(share, contrast, points)`` within :data:`NEAR_M` of (K, 2) places: share of the cells that hold ground
        points, ground points over those just above, number of ground points."""
        xy = np.asarray(xy, float).reshape(-1, 2)
        found = np.zeros((4, len(xy)))
        for start in range(0, len(xy), _BATCH):
            part = slice(start, start + _BATCH)
            row, col, away = self._around(xy[part], NEAR_M)
            used = (away < NEAR_M) & self.open[row, col]
            ground = np.where(used, self.ground[row, col], 0)
            above = np.where(used, self.above[row, col], 0)
            found[:, part] = used.sum(axis=1), (ground > 0).sum(axis=1), ground.sum(axis=1), above.sum(axis=1)
        cells, filled, points, over = found
        return filled / np.maximum(cells, 1), points / (over + 1.0), points

    def seen(self, xy: np.ndarray) -> np.ndarray:
        """(K,) bool: a ground surface shows within :data:`NEAR_M` of (K, 2) places."""
        share, contrast, points = self.evidence(xy)
        clear = (share >= MIN_SHARE) & (contrast >= MIN_CONTRAST)
        sparse = (share >= SPARSE_SHARE) & (contrast >= SPARSE_CONTRAST) & (points >= SPARSE_POINTS)
        return clear | sparse

    def se_m(self, xy: np.ndarray, dtm: Dtm) -> np.ndarray:
        """(K,) standard error of the height of the model ``dtm``, made from these points, at (K, 2) places, metres;
        :data:`NO_GROUND_M` where nothing tells it.

        Where no ground is seen round a place, that of the rest of the cloud is carried there; the model, which runs
        through whatever lies lowest, is off by as much as it differs from it.
        """
        xy = np.asarray(xy, float).reshape(-1, 2)
        near = self.seen(xy)
        share, contrast, _ = self.evidence(xy)
        whole = (share >= WHOLE_SHARE) & (contrast >= WHOLE_CONTRAST)
        cover = COVER_SE_M if near.any() else ONLY_COVER_SE_M
        se_m = np.select([near, whole, share >= MIN_SHARE], [SEEN_SE_M, WHOLE_SE_M, cover], NO_GROUND_M)
        if near.all():
            return se_m
        places = self.places()
        places = places[self.seen(places)]
        z = dtm.height(*places.T)
        known = np.isfinite(z)
        carried, error = carry_ground(np.column_stack([places, z])[known], xy[~near])
        gap = np.hypot(error, dtm.height(*xy[~near].T) - carried)
        se_m[~near] = np.fmin(se_m[~near], gap)
        return se_m

    def places(self) -> np.ndarray:
        """(K, 2) places all over the cloud, :data:`NEAR_M` apart: where it has no points, none are seen either."""
        rows, cols = self.ground.shape
        x = self.corner[0] + np.arange(NEAR_M / 2, cols * CELL_M, NEAR_M)
        y = self.corner[1] + np.arange(NEAR_M / 2, rows * CELL_M, NEAR_M)
        return np.column_stack([part.ravel() for part in np.meshgrid(x, y)])

    def _around(self, xy: np.ndarray, reach_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(K, M) row, column and distance (inf outside the grid) of the cells near (K, 2) places."""
        rows, cols = self.ground.shape
        steps = np.arange(-int(reach_m / CELL_M) - 1, int(reach_m / CELL_M) + 2)
        step = np.column_stack([part.ravel() for part in np.meshgrid(steps, steps)])
        xy = np.asarray(xy, float).reshape(-1, 2)
        cell = np.floor((xy - self.corner) / CELL_M).astype(np.int64)[:, None] + step
        centre = self.corner + (cell + 0.5) * CELL_M
        away = np.hypot(*np.moveaxis(centre - xy[:, None], 2, 0))
        inside = ((cell >= 0) & (cell < (cols, rows))).all(axis=2)
        col, row = np.moveaxis(np.clip(cell, 0, (cols - 1, rows - 1)), 2, 0)
        return row, col, np.where(inside, away, np.inf)


def carry_ground(seen: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``(z, se)``: (K,) height of the ground at (K, 2) places, metres, and its standard error, from (M, 3) places where
    it was seen; NaN without any.

    A plane through the nearest, with a weak prior for its slope: its error grows with the distance, with the roughness
    seen, and where the places lie on one side.
    """
    from scipy.spatial import cKDTree

    if not len(seen) or not len(xy):
        return np.full(len(xy), np.nan), np.full(len(xy), np.nan)
    count = min(CARRIED_PLACES, len(seen))
    away, nearest = cKDTree(seen[:, :2]).query(xy, k=count)
    away, near = away.reshape(len(xy), count), seen[nearest.reshape(len(xy), count)]
    flat = np.concatenate([np.ones((*away.shape, 1)), near[..., :2] - xy[:, None]], axis=2)
    middle = near[..., 2].mean(axis=1)
    rise, noise = near[..., 2] - middle[:, None], np.full(len(xy), ROUGH_M)
    prior = np.diag([0.0, SLOPE_SD**-2, SLOPE_SD**-2])
    for _ in range(2):
        cov = np.linalg.inv(np.swapaxes(flat, 1, 2) @ flat / noise[:, None, None] ** 2 + prior)
        plane = np.einsum("kij,kmj,km->ki", cov, flat, rise) / noise[:, None] ** 2
        noise = np.maximum((rise - np.einsum("kmi,ki->km", flat, plane)).std(axis=1), ROUGH_M)
    se = np.sqrt(cov[:, 0, 0] + noise**2 + (ROUGH_M_PER_M * away[:, 0]) ** 2)
    return middle + plane[:, 0], se
