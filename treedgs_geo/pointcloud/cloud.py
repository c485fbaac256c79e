"""A point cloud: coordinates, attributes and the CRS they are in."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyproj


@dataclass(frozen=True)
class PointCloud:
    """Points with attributes.

    xyz: (N, 3) float64, project coordinates in metres. crs: of the file (may be compound), ``None`` = local metres.
    attributes: name -> (N,) array: ``intensity``, ``classification``, returns, colours and any extra dimension.
    layout: how the file that it came from stores points (:class:`.files.Layout`), so that it is written alike.
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
        return horizontal(self.crs)

    def select(self, mask: np.ndarray) -> PointCloud:
        """The points of a mask or an index array, attributes with them."""
        return replace(self, xyz=self.xyz[mask],
                       attributes={name: values[mask] for name, values in self.attributes.items()})

    def with_attribute(self, name: str, values: np.ndarray) -> PointCloud:
        """A copy with one attribute added or replaced."""
        return replace(self, attributes={**self.attributes, name: np.asarray(values)})


def horizontal(crs: pyproj.CRS | None) -> pyproj.CRS | None:
    """The horizontal part of a compound CRS, or the CRS itself."""
    return crs.sub_crs_list[0] if crs is not None and crs.is_compound else crs


def usable(cloud: PointCloud) -> np.ndarray:
    """(N,) bool: not withheld and not classified as noise (7 low, 18 high), where the file says so."""
    keep = np.ones(len(cloud), bool)
    if "classification" in cloud.attributes:
        keep &= ~np.isin(cloud.attributes["classification"], (7, 18))
    if "withheld" in cloud.attributes:
        keep &= cloud.attributes["withheld"] == 0
    return keep


def concatenate(clouds: Iterable[PointCloud]) -> PointCloud:
    """One cloud from pieces that share CRS; only attributes that every piece has are kept.

    Raises:
        ValueError: no piece at all.
    """
    pieces = list(clouds)
    if not pieces:
        raise ValueError("nothing to concatenate")
    names = [name for name in pieces[0].attributes if all(name in piece.attributes for piece in pieces)]
    return PointCloud(
        np.concatenate([piece.xyz for piece in pieces]), pieces[0].crs,
        {name: np.concatenate([piece.attributes[name] for piece in pieces]) for name in names}, pieces[0].layout)


def thin(xyz: np.ndarray, cell_m: float) -> np.ndarray:
    """Index of one point a voxel of side ``cell_m`` (the first in each), sorted; bounded by N log N."""
    if len(xyz) == 0:
        return np.empty(0, int)
    cells = np.floor((xyz - xyz.min(axis=0)) / cell_m).astype(np.int64)
    span = cells.max(axis=0) + 1
    key = (cells[:, 0] * span[1] + cells[:, 1]) * span[2] + cells[:, 2]
    return np.sort(np.unique(key, return_index=True)[1])
