"""A point cloud: coordinates, attributes and the CRS they are in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyproj
from numba import njit

from ..core.frames import horizontal


@dataclass(frozen=True)
class PointCloud:
    """Points with attributes.

    xyz: (N, 3) float64, project coordinates in metres. crs: of the file (may be compound), ``None`` = local metres.
    attributes: name -> (N,) array: ``intensity``, ``classification``, returns, colours and any extra dimension.
    layout: laspy's header of the LAS file that it came from, so that it is written alike.

    Raises:
        ValueError: xyz of another shape, or an attribute of another length.

    Examples:
        >>> import numpy as np
        >>> import treedgs_geo as tg
        >>> cloud = tg.PointCloud(np.array([[0, 0, 0.1], [0, 0, 1.3]]), attributes={"intensity": np.array([7, 9])})
        >>> len(cloud.select(cloud.xyz[:, 2] > 1))
        1
    """

    xyz: np.ndarray
    crs: pyproj.CRS | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)
    layout: Any = None

    def __post_init__(self) -> None:
        if self.xyz.ndim != 2 or self.xyz.shape[1] != 3:
            raise ValueError(f"xyz has shape {self.xyz.shape}, expected (N, 3)")
        for name, values in self.attributes.items():
            if len(values) != len(self.xyz):
                raise ValueError(f"attribute {name!r} has {len(values)} values for {len(self.xyz)} points")

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def horizontal_crs(self) -> pyproj.CRS | None:
        """The horizontal part of a compound CRS, or the CRS itself."""
        return horizontal(self.crs) if self.crs is not None else None

    def select(self, mask: np.ndarray) -> PointCloud:
        """The points of a mask or an index array, attributes with them."""
        return replace(
            self, xyz=self.xyz[mask], attributes={name: values[mask] for name, values in self.attributes.items()}
        )

    def with_attribute(self, name: str, values: np.ndarray) -> PointCloud:
        """A copy with one attribute added or replaced."""
        return replace(self, attributes={**self.attributes, name: np.asarray(values)})


def usable(cloud: PointCloud) -> np.ndarray:
    """(N,) bool: not withheld and not classified as noise (7 low, 18 high), where the file says so.

    Points flagged synthetic, key-point or overlap stay: they are points of another origin, chosen ones, and those of a
    second flight line, which shows stems from one more side."""
    keep = np.ones(len(cloud), bool)
    if "classification" in cloud.attributes:
        keep &= ~np.isin(cloud.attributes["classification"], (7, 18))
    if "withheld" in cloud.attributes:
        keep &= cloud.attributes["withheld"] == 0
    return keep


def concatenate(clouds: Iterable[PointCloud]) -> PointCloud:
    """One cloud from pieces that share CRS; only attributes that every piece has are kept. Pieces that nobody else
    holds (of a generator) are let go of one by one, so that the coordinates are never held twice.

    Raises:
        ValueError: no piece at all.
    """
    pieces = list(clouds)
    if not pieces:
        raise ValueError("nothing to concatenate")
    if len(pieces) == 1:
        return pieces[0]
    crs, layout = pieces[0].crs, pieces[0].layout
    names = [name for name in pieces[0].attributes if all(name in piece.attributes for piece in pieces)]
    columns = {name: [piece.attributes[name] for piece in pieces] for name in names}
    parts = [piece.xyz for piece in pieces]
    del pieces
    attributes = {name: np.concatenate(columns.pop(name)) for name in names}
    xyz = np.empty((sum(map(len, parts)), 3))
    end = len(xyz)
    while parts:
        part = parts.pop()
        xyz[end - len(part) : end] = part
        end -= len(part)
    return PointCloud(xyz, crs, attributes, layout)


def thin(xyz: np.ndarray, cell_m: float, max_points: int = 1) -> np.ndarray:
    """Index, sorted, of at most ``max_points`` points a voxel of side ``cell_m`` (lattice at zero), spread over their
    order: with more than one, what is dense stays dense."""
    if len(xyz) <= max_points:
        return np.arange(len(xyz))
    low, high = extent(xyz)
    first = np.floor(low / cell_m)
    span = (np.floor(high / cell_m) - first).astype(np.int64) + 1
    return _spread(np.ascontiguousarray(xyz, dtype=float), first * cell_m, cell_m, span, max_points)


def grouped(label: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """``(numbers, groups)``: the (K,) different numbers above 0 in (N,) integers, ascending, and where each of them is,
    ascending too."""
    owned = np.flatnonzero(label > 0)
    order = owned[np.argsort(label[owned], kind="stable")]
    numbers, starts = np.unique(label[order], return_index=True)
    return numbers, np.split(order, starts[1:]) if len(numbers) else []


def slices(count: int, most: int = 2_000_000) -> Iterator[slice]:
    """Parts of ``count`` rows in their order, for work on large clouds in the memory of one part."""
    return (slice(start, min(start + most, count)) for start in range(0, count, most))


def evenly(numbers: np.ndarray) -> np.ndarray:
    """(N,) of (N,) uint64, from 0 to 1: equal where these are, and even over any stretch of a file however they follow
    one another (multiples of the golden ratio)."""
    return (numbers * np.uint64(0x9E3779B97F4A7C15)).astype(float) / 2.0**64


def extent(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(K,) minimum and (K,) maximum of (N, K) points, column by column: many times faster than ``min(axis=0)``."""
    if points.ndim == 2 and points.dtype == np.float64 and len(points):
        return _extent(points)
    columns = points.T
    return np.array([column.min() for column in columns]), np.array([column.max() for column in columns])


@njit(cache=True, nogil=True)
def _extent(points):  # pragma: no cover - compiled
    """:func:`extent` in one pass; NaN where a column holds one."""
    low, high = points[0].copy(), points[0].copy()
    known = np.ones(points.shape[1], np.bool_)
    for m in range(points.shape[0]):
        for axis in range(points.shape[1]):
            value = points[m, axis]
            known[axis] &= value == value
            low[axis] = value if value < low[axis] else low[axis]
            high[axis] = value if value > high[axis] else high[axis]
    for axis in range(points.shape[1]):
        if not known[axis]:
            low[axis], high[axis] = np.nan, np.nan
    return low, high


@njit(cache=True, nogil=True)
def in_box(points, low, high):  # pragma: no cover - compiled
    """(N,) bool: finite, and in the box of (K,) ``low`` to ``high``: many times faster than ``all(axis=1)``."""
    inside = np.empty(points.shape[0], np.bool_)
    for m in range(points.shape[0]):
        kept = True
        for axis in range(points.shape[1]):
            value = points[m, axis]
            kept &= np.isfinite(value) and low[axis] <= value <= high[axis]
        inside[m] = kept
    return inside


@njit(cache=True, nogil=True)
def by_key(key, count):  # pragma: no cover - compiled
    """(M,) indices of the keys from 0 to ``count`` - 1 among (N,), by key and in their order, and (count + 1,) where
    those of each begin."""
    starts = np.zeros(count + 1, np.int64)
    for k in key:
        if k >= 0:
            starts[k + 1] += 1
    starts = np.cumsum(starts)
    place, order = starts.copy(), np.empty(starts[-1], np.uint32)
    for m in range(key.shape[0]):
        if key[m] >= 0:
            order[place[key[m]]] = m
            place[key[m]] += 1
    return order, starts


@njit(cache=True)
def _slot(table, key):  # pragma: no cover - compiled
    """Where ``key`` is, or is to be put, in an open hash table of keys (-1 = free)."""
    size = table.shape[0]
    place = np.int64((np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(20)) & (size - 1)
    while table[place] >= 0 and table[place] != key:
        place = (place + 1) & (size - 1)
    return place


@njit(cache=True)
def _voxel(point, low, cell_m, span):  # pragma: no cover - compiled
    key = np.int64(np.floor((point[0] - low[0]) / cell_m))
    for axis in (1, 2):
        key = key * span[axis] + np.int64(np.floor((point[axis] - low[axis]) / cell_m))
    return key


@njit(cache=True)
def _spread(xyz, low, cell_m, span, most):  # pragma: no cover - compiled
    """Indices of at most ``most`` points a voxel, evenly over each voxel's points in their order."""
    n = xyz.shape[0]
    size = span[0] * span[1] * span[2]
    hashed = size > 2 * n
    if hashed:
        size = 16
        while size < 2 * n:
            size *= 2
    table = np.full(size if hashed else 0, -1, np.int64)
    there, seen = np.zeros(size, np.int32), np.zeros(size, np.int32)
    place = np.empty(n, np.int64)
    for m in range(n):
        key = _voxel(xyz[m], low, cell_m, span)
        place[m] = key
        if hashed:
            place[m] = _slot(table, key)
            table[place[m]] = key
        there[place[m]] += 1
    kept = np.empty(n, np.int64)
    count = 0
    for m in range(n):
        k = place[m]
        share = min(most / there[k], 1.0)
        if np.floor((seen[k] + 1) * share + 1e-9) > np.floor(seen[k] * share + 1e-9):
            kept[count] = m
            count += 1
        seen[k] += 1
    return kept[:count].copy()
