"""Small clouds with one thing wrong, made from a plot of known stems."""

from __future__ import annotations

import laspy
import numpy as np
from synthetic_cloud import plot_cloud

STEMS = [(3.0, 3.0, 20.0), (8.0, 5.0, 30.0), (4.0, 9.0, 25.0)]


def stand(seed: int = 5, tall_m: float = 22.0) -> np.ndarray:
    """(N, 3) a plot of 12 m, coordinates from zero, ground near 0.5 m, tops near ``tall_m``."""
    rng = np.random.default_rng(seed)
    xyz = plot_cloud(rng, STEMS, shrubs=200) - (0.0, 0.0, 99.5)
    crowns = np.column_stack([rng.uniform(0, 12, (4000, 2)), rng.uniform(12, tall_m, 4000)])
    return np.vstack([xyz, crowns])


def turned(xyz: np.ndarray, axis: int) -> np.ndarray:
    """Up along x (0) or y (1), right-handed."""
    x, y, z = xyz.T
    return np.column_stack([x, z, -y] if axis == 1 else [z, y, -x])


def write_las(path, xyz: np.ndarray, scale=(0.001, 0.001, 0.001), version: str = "1.4", point_format: int = 6) -> None:
    """LAS or LAZ by the ending, without CRS."""
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = scale, np.floor(xyz.min(axis=0))
    data = laspy.LasData(header)
    data.x, data.y, data.z = xyz.T
    data.write(str(path))


def claim(path, count: int) -> None:
    """Write another number of points into the header."""
    raw = bytearray(path.read_bytes())
    raw[107:111] = (count if raw[25] < 4 else 0).to_bytes(4, "little")
    if raw[25] >= 4:
        raw[247:255] = count.to_bytes(8, "little")
    path.write_bytes(bytes(raw))
