"""The dry run's look at the ground of a cloud: its lowest points only, the same questions as the run asks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyproj

from ..core.errors import InputError
from ..core.progress import Reporter
from ..pointcloud.cloud import thin
from ..terrain.cloud_ground import found_ground, given_ground
from ..terrain.dtm import Dtm

#: Points up to here above the lowest of their square metre are kept, one a voxel of this side, metres.
_ABOVE_M, _VOXEL_M = 1.0, 0.05
#: Larger clouds (m2) are not looked at before the run: that would take as long as the run's own ground.
_LARGEST_M2 = 20_000.0


class LowPoints:
    """The lowest points of a cloud that is read piece by piece."""

    def __init__(self) -> None:
        self._parts: list[np.ndarray] = []

    def add(self, xyz: np.ndarray) -> None:
        """(N, 3) more points."""
        self._parts.append(_low(xyz))

    def points(self) -> np.ndarray:
        """(M, 3) the lowest points of all pieces."""
        return _low(np.concatenate(self._parts)) if self._parts else np.empty((0, 3))


def _low(xyz: np.ndarray) -> np.ndarray:
    if not len(xyz):
        return xyz
    column = np.floor(xyz[:, :2] - xyz[:, :2].min(axis=0)).astype(np.int64)
    _, cell = np.unique(column[:, 0] * (column[:, 1].max() + 1) + column[:, 1], return_inverse=True)
    lowest = np.full(cell.max() + 1, np.inf)
    np.minimum.at(lowest, cell, xyz[:, 2])
    low = xyz[xyz[:, 2] < lowest[cell] + _ABOVE_M]
    return low[thin(low, _VOXEL_M)]


class _Findings(Reporter):
    """Warnings as the dry run's findings."""

    def __init__(self, note: Callable[[str], None]) -> None:
        super().__init__()
        self._note = note

    def warn(self, message: str) -> None:
        self._note(message)


def check_ground(
    xyz: np.ndarray,
    where: Path,
    crs: pyproj.CRS | None,
    given: Dtm | None,
    given_from: Path | None,
    note: Callable[[str], None],
    problem: Callable[[str], None],
    z_is: str = "auto",
) -> None:
    """Check the ground, by the (N, 3) lowest points, as the run will: what it would warn of goes to ``note``,
    what would end it to ``problem``."""
    if not len(xyz) or float(np.prod(np.ptp(xyz[:, :2], axis=0))) > _LARGEST_M2:
        return
    try:
        if given is not None:
            given_ground(given, xyz, str(given_from), _Findings(note))
        else:
            found_ground(xyz, crs, str(where), _Findings(note), z_is)
    except InputError as refusal:
        problem(str(refusal))
