"""Ground of the synthetic plot: a tilted, rough surface on a square grid, and its triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

#: Standard deviation of the ground about its plane, m.
ROUGHNESS_M = 0.1


@dataclass(frozen=True)
class Ground:
    """Square grid of heights. z: (n, n) float64, rows along y; node (i, j) lies at (low + j step, low + i step)."""

    low: float
    step: float
    z: np.ndarray

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) local x, y -> (N,) height of the very triangles that :meth:`mesh` gives (clamped at the rim)."""
        n = len(self.z)
        q = (np.asarray(xy, float) - self.low) / self.step
        cell = np.clip(np.floor(q).astype(int), 0, n - 2)
        f = np.clip(q - cell, 0, 1)
        j, i = cell[:, 0], cell[:, 1]
        a, b, c, d = self.z[i, j], self.z[i, j + 1], self.z[i + 1, j], self.z[i + 1, j + 1]
        fx, fy = f[:, 0], f[:, 1]
        lower = a + (b - a) * fx + (d - b) * fy
        upper = a + (d - c) * fx + (c - a) * fy
        return np.where(fx >= fy, lower, upper)

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """(n * n, 3) float64 vertices and (2 (n-1)^2, 3) int64 triangles, normals up."""
        n = len(self.z)
        axis = self.low + self.step * np.arange(n)
        x, y = np.meshgrid(axis, axis)
        vertices = np.column_stack([x.ravel(), y.ravel(), self.z.ravel()])
        node = np.arange(n * n).reshape(n, n)
        a, b, c, d = (node[:-1, :-1].ravel(), node[:-1, 1:].ravel(), node[1:, :-1].ravel(), node[1:, 1:].ravel())
        return vertices, np.concatenate([np.column_stack([a, b, d]), np.column_stack([a, d, c])])

    def normals(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) -> (N, 3) unit upward normals by central differences over one grid step."""
        xy = np.asarray(xy, float)
        ex, ey = np.array([self.step, 0]), np.array([0, self.step])
        gx = (self.height(xy + ex) - self.height(xy - ex)) / (2 * self.step)
        gy = (self.height(xy + ey) - self.height(xy - ey)) / (2 * self.step)
        normal = np.column_stack([-gx, -gy, np.ones(len(xy))])
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def make_ground(
    rng: np.random.Generator, half_m: float, slope_pct: float, roughness_m: float = ROUGHNESS_M, step_m: float = 0.25
) -> Ground:
    """A plane of the given slope (random aspect) plus noise at 8, 2.5 and 0.7 m; height 0 at the origin's plane."""
    n = int(np.ceil(2 * half_m / step_m)) + 1
    low = -step_m * (n - 1) / 2
    axis = low + step_m * np.arange(n)
    x, y = np.meshgrid(axis, axis)
    aspect = rng.uniform(0, 2 * np.pi)
    z = slope_pct / 100 * (x * np.cos(aspect) + y * np.sin(aspect))
    for wavelength, share in ((8.0, 0.92), (2.5, 0.36), (0.7, 0.12)):
        noise = gaussian_filter(rng.standard_normal((n, n)), wavelength / step_m / 4, mode="wrap")
        z += roughness_m * share * noise / noise.std()
    return Ground(low, step_m, z)
