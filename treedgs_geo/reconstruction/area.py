"""Where stems are looked for: one or several circles on the ground, in the local frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import Point, union_all
from shapely.geometry.base import BaseGeometry

from .cameras import View

#: Where no plot is given, stems are looked for this far from a camera, m, or so many of its heights above the ground.
AMONG_STEMS_M, HEIGHTS_AWAY = 10.0, 3.0
#: About breast height, at which a place has to be in the photo, m.
BREAST_M = 1.3


@dataclass(frozen=True)
class Area:
    """Circles on the ground. centres: (K, 2) local metres; radii_m: (K,) metres."""

    centres: np.ndarray
    radii_m: np.ndarray

    @classmethod
    def circle(cls, x: float, y: float, radius_m: float) -> Area:
        """One circle."""
        return cls(np.array([[x, y]], float), np.array([radius_m], float))

    @classmethod
    def circles(cls, centres: np.ndarray, radii_m: np.ndarray) -> Area:
        """Several circles: centres (K, 2), radii (K,)."""
        return cls(np.asarray(centres, float).reshape(-1, 2), np.asarray(radii_m, float).reshape(-1))

    def contains(self, xy: np.ndarray, margin_m: float = 0.0) -> np.ndarray:
        """(N, 2) -> (N,) bool: inside any circle grown by ``margin_m``."""
        xy = np.asarray(xy, float).reshape(-1, 2)
        distance = np.linalg.norm(xy[:, None] - self.centres[None], axis=2)
        return (distance <= self.radii_m[None] + margin_m).any(axis=1)

    def bounds(self, margin_m: float = 0.0) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max of the circles grown by ``margin_m``."""
        low = (self.centres - self.radii_m[:, None]).min(axis=0) - margin_m
        high = (self.centres + self.radii_m[:, None]).max(axis=0) + margin_m
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def shape(self, margin_m: float = 0.0) -> BaseGeometry:
        """The ground of the circles grown by ``margin_m``, each place once."""
        discs = zip(self.centres, self.radii_m + margin_m, strict=True)
        return union_all([Point(*centre).buffer(radius) for centre, radius in discs])

    def outline(self, margin_m: float = 0.0, corners: int = 24) -> np.ndarray:
        """(K * corners, 2) points on the circles grown by ``margin_m``."""
        angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
        ring = np.column_stack([np.cos(angle), np.sin(angle)])
        return (self.centres[:, None] + (self.radii_m[:, None, None] + margin_m) * ring[None]).reshape(-1, 2)


def area_seen(
    views: list[View], ground_z: float, n_views: int = 6, cell_m: float = 1.0, min_sin_nadir: float = 0.3
) -> Area:
    """The ground that at least ``n_views`` oblique photos see, as circles of one cell each merged into a few.

    Used where the user gives no plot. Views count at a cell when breast height there is inside the photo, seen at a
    nadir angle with a sine of ``min_sin_nadir`` or more, and no farther away than :data:`AMONG_STEMS_M` or
    :data:`HEIGHTS_AWAY` heights of the camera above the ground. ground_z: a typical ground height, local metres.

    Returns an area without circles where no cell is seen often enough.
    """
    aims = []
    for view in views:
        down = view.rotation[2]
        slant = (ground_z - view.centre[2]) / down[2] if down[2] < -0.2 else 0.0
        aims.append((view.centre + down * slant)[:2])
    if not aims:
        return Area(np.empty((0, 2)), np.empty(0))
    low, high = np.min(aims, axis=0) - 40, np.max(aims, axis=0) + 40
    x = np.arange(low[0], high[0] + cell_m, cell_m)
    y = np.arange(low[1], high[1] + cell_m, cell_m)
    grid = np.column_stack([a.ravel() for a in np.meshgrid(x, y)])
    points = np.column_stack([grid, np.full(len(grid), ground_z + BREAST_M)]).reshape(len(y), len(x), 3)
    count = np.zeros((len(y), len(x)), int)
    for view in views:
        part = _window(view, ground_z, x, y)
        some = points[part].reshape(-1, 3)
        pixels, _ = view.project(some)
        offset = some - view.centre
        flat = np.hypot(offset[:, 0], offset[:, 1])
        near = flat <= max(AMONG_STEMS_M, HEIGHTS_AWAY * (view.centre[2] - ground_z))
        sine = flat / np.linalg.norm(offset, axis=1)
        count[part] += (view.contains(pixels) & (sine >= min_sin_nadir) & near).reshape(count[part].shape)
    return _cover(count >= n_views, x, y)


def _window(view: View, ground_z: float, x: np.ndarray, y: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns of a grid that the photo can show; all of them where it sees the horizon."""
    camera = view.camera
    u, v = np.meshgrid(np.linspace(0, camera.width, 5), np.linspace(0, camera.height, 5))
    rays = view.rays(np.column_stack([u.ravel(), v.ravel()]))
    if view.centre[2] <= ground_z or (rays[:, 2] > -0.05).any():
        return slice(None), slice(None)
    hits = view.centre[:2] + rays[:, :2] / -rays[:, 2:] * (view.centre[2] - ground_z)
    low, high = hits.min(axis=0), hits.max(axis=0)
    low, high = low - 0.1 * (high - low) - 1.0, high + 0.1 * (high - low) + 1.0
    columns, rows = np.searchsorted(x, [low[0], high[0]]), np.searchsorted(y, [low[1], high[1]])
    return slice(*rows), slice(*columns)


def _cover(seen: np.ndarray, x: np.ndarray, y: np.ndarray) -> Area:
    """Greedy cover of the True cells by inscribed circles, largest first, down to three cells of radius."""
    from scipy.ndimage import distance_transform_edt

    centres: list[tuple[float, float]] = []
    radii: list[float] = []
    depth = distance_transform_edt(np.pad(seen, 1))
    cell = float(x[1] - x[0]) if len(x) > 1 else 1.0
    x0, y0 = float(x[0]) - cell, float(y[0]) - cell
    best = depth.copy()
    while True:
        row, column = np.unravel_index(int(best.argmax()), best.shape)
        reach = float(best[row, column])
        if reach < 1:
            break
        centres.append((x0 + column * cell, y0 + row * cell))
        radii.append(reach * cell)
        if reach < 3:
            break
        rows = slice(max(int(row - reach), 0), int(row + reach) + 2)
        columns = slice(max(int(column - reach), 0), int(column + reach) + 2)
        part = best[rows, columns]
        i, j = np.ogrid[rows.start : rows.start + part.shape[0], columns.start : columns.start + part.shape[1]]
        part[np.hypot(i - row, j - column) <= reach] = 0.0
    return Area.circles(np.array(centres).reshape(-1, 2), np.array(radii))
