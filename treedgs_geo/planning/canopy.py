"""The canopy as measured: from a canopy height model or a LiDAR cloud."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pyproj
from scipy.ndimage import gaussian_filter, maximum_filter

from ..core.errors import InputError
from ..terrain.dtm import Dtm, read_dtm
from .stand import LEAF_SHADOW, REACH_M

#: Lower tops are shrubs; taller ones no trees, m.
LOWEST_TOP_M, HIGHEST_TOP_M = 5.0, 95.0
#: The canopy's top at a place is the highest within this distance, m: crowns sway, positions err.
AROUND_M = 3.0
#: Leaves in tufts hide this share of what as many would, spread evenly (0.6 to 0.7 in the rendered plots' clouds; of
#: conifers 0.5 to 0.7: Chen et al. 1997).
CLUMPING = 0.62
#: Side of the cells that a cloud's canopy is gridded in, m.
_CELL_M = 0.5


@dataclass(frozen=True)
class Canopy:
    """Heights of the canopy over the ground as a grid that is asked like a terrain model (project coordinates).
    measured: numbers of the stand that the source itself tells (leaf_area_index, crown_base_m)."""

    grid: Dtm
    measured: dict[str, float] = field(default_factory=dict)

    @cached_property
    def around(self) -> Dtm:
        """Highest canopy within :data:`AROUND_M` of each cell, NaN where unknown."""
        cells = max(1, int(np.ceil(AROUND_M / self.grid.resolution_m)))
        known = np.isfinite(self.grid.heights)
        top = maximum_filter(np.where(known, self.grid.heights, -1.0), size=2 * cells + 1)
        return Dtm(np.where(top >= 0, top, np.nan), self.grid.transform, self.grid.crs, grid_crs=self.grid.grid_crs)

    def highest(self, xy: np.ndarray) -> np.ndarray:
        """(N,) highest canopy around project coordinates (N, 2), NaN where unknown."""
        return self.around.height(xy[..., 0], xy[..., 1], "nearest")

    def tops(self) -> tuple[np.ndarray, np.ndarray]:
        """Tree tops: (N, 2) project coordinates and (N,) height. Highest of their surroundings, which grow with height
        (6 % of it and 0.4 m); the canopy is smoothed by 0.5 m."""
        cell = self.grid.resolution_m
        known = np.isfinite(self.grid.heights)
        smooth = gaussian_filter(np.where(known, self.grid.heights, 0.0), 0.5 / cell)
        found = np.zeros(smooth.shape, bool)
        for low, high in ((LOWEST_TOP_M, 12.0), (12.0, 20.0), (20.0, 30.0), (30.0, HIGHEST_TOP_M)):
            reach = 0.4 + 0.06 * (low + min(high, 40.0)) / 2
            peak = smooth == maximum_filter(smooth, size=2 * int(np.ceil(reach / cell)) + 1)
            found |= peak & (smooth >= low) & (smooth < high)
        x, y = self.grid.centres()
        at = found & known
        xy = np.column_stack([x[at], y[at]])
        if self.grid.grid_crs is not None and self.grid.crs is not None:
            to_plan = pyproj.Transformer.from_crs(self.grid.grid_crs, self.grid.crs, always_xy=True)
            xy = np.column_stack(to_plan.transform(xy[:, 0], xy[:, 1]))
        return xy, self.grid.heights[at]

    def crown_radius_m(self, stems_per_ha: float, crown_base_m: float) -> float:
        """Reach of the crowns that cover what is covered: circles at random (Boolean model, ``cover = 1 -
        exp(-area)``)."""
        known = self.grid.heights[np.isfinite(self.grid.heights)]
        cover = float(np.clip((known > 0.8 * crown_base_m).mean(), 0.02, 0.98))
        return float(np.sqrt(-np.log(1 - cover) / (np.pi * stems_per_ha / 1e4)))

    def numbers(self) -> dict[str, float]:
        """What the canopy says of the stand: mean height of its tops, stems a hectare (those that have a top)."""
        _, height = self.tops()
        if not len(height):
            return dict(self.measured)
        area = float(np.isfinite(self.grid.heights).sum()) * self.grid.resolution_m**2
        return {"tree_height_m": float(height.mean()), "stems_per_ha": 1e4 * len(height) / area, **self.measured}


def canopy_of_raster(path: Path, crs: pyproj.CRS) -> Canopy:
    """A canopy height model: heights over the ground, m.

    Raises:
        InputError: not readable, or heights that are none (a surface model, centimetres).
    """
    grid = read_dtm(path, crs, over_ground=True)
    known = grid.heights[np.isfinite(grid.heights)]
    if not len(known) or np.percentile(known, 99.5) > HIGHEST_TOP_M or np.percentile(known, 0.5) < -5:
        found = f"{known.min():.0f} to {known.max():.0f}" if len(known) else "nothing"
        raise InputError(
            f"{path}: holds heights of {found}, expected a canopy height model (metres over the ground, 0 to "
            f"{HIGHEST_TOP_M:.0f}); subtract the terrain from a surface model first."
        )
    return Canopy(grid)


def canopy_of_cloud(path: Path, crs: pyproj.CRS, dtm: Dtm | None, centres: np.ndarray, radius_m: float) -> Canopy:
    """The canopy of a LiDAR cloud about the plots, with its leaf area index and crown base.

    Leaf area: of all returns the share below 2 m is the gap; ``-ln(gap) / (shadow clumping)`` (Beer-Lambert; returns
    near the vertical). Crown base: height above which 95 % of the returns over 2 m lie.

    Raises:
        InputError: no terrain model, no point about the plots.
    """
    from rasterio.transform import from_origin

    from ..pointcloud.cloud import usable
    from ..pointcloud.files import read_cloud

    if dtm is None:
        raise InputError(f"{path}: a cloud needs the ground under it; give --dtm (the verb terrain makes one).")
    reach = radius_m + REACH_M
    low, high = centres.min(axis=0) - reach, centres.max(axis=0) + reach
    cloud = read_cloud(path, (*low, *high), crs.to_string(), attributes=("classification", "withheld"))
    cloud = cloud.select(usable(cloud))
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    use = np.isfinite(height) & (height > -1) & (height < HIGHEST_TOP_M)
    xyz, height = cloud.xyz[use], height[use]
    if len(height) < 500 or (height > 2).sum() < 100:
        raise InputError(f"{path}: {len(height)} points about the plots, expected a forest; check cloud, DTM and CRS.")
    col, row = (np.floor((xyz[:, k] - low[k]) / _CELL_M).astype(int) for k in (0, 1))
    shape = tuple(int(np.ceil((high[k] - low[k]) / _CELL_M)) for k in (1, 0))
    keep = (row >= 0) & (col >= 0) & (row < shape[0]) & (col < shape[1])
    top = np.full(shape, -np.inf)
    np.maximum.at(top, (shape[0] - 1 - row[keep], col[keep]), height[keep])
    known = np.isfinite(top)
    # Cells between the pulses take what is next to them.
    near = maximum_filter(top, size=3)
    top = np.where(known, top, near)
    grid = Dtm(
        np.where(np.isfinite(top), np.maximum(top, 0), np.nan),
        from_origin(low[0], low[1] + shape[0] * _CELL_M, _CELL_M, _CELL_M),
        crs,
    )
    gap = max(float((height < 2).mean()), 0.02)
    measured = {
        "leaf_area_index": float(np.clip(-np.log(gap) / (LEAF_SHADOW * CLUMPING), 0.2, 8)),
        "crown_base_m": float(np.percentile(height[height > 2], 5)),
    }
    return Canopy(grid, measured)
