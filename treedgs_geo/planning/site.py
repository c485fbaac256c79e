"""The place to be flown: plots, ground, canopy and trees in one frame, from the files and numbers that were given."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
from scipy.ndimage import binary_erosion, gaussian_filter, maximum_filter
from scipy.spatial import cKDTree
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from ..core.crs import check_projected, grid_convergence_deg, project_crs
from ..core.errors import CRSError, InputError
from ..core.frames import heights_named, moved
from ..core.map_scale import check_place
from ..core.progress import Reporter
from ..inventory.searched import searched_area
from ..inventory.stand.sample import SamplePlot, as_searched, crs_of_plots, read_sample
from ..inventory.stand.treelist import measured_trees
from ..terrain.dtm import Dtm, read_dtm
from .missions import Target
from .settings import PlanFlightSettings, StandNumberSettings
from .stand import LEAF_SHADOW, REACH_M, StandNumbers, Trees, dressed_trees

#: Leaf area index where nothing says more, and the tallest tree over the mean one.
USUAL_LAI, TALLEST = 2.5, 1.25
#: Ground this far beyond the terrain model is taken from its edge, m; a metre beyond, it may rise by this at least.
MAX_BEYOND_M, MIN_RISE = 150.0, 0.1
#: Places of the terrain model at which its slope is looked at, about.
_SLOPES = 20_000
#: Endings of the kinds of file that --stand takes.
_RASTERS, _CLOUDS = (".tif", ".tiff"), (".las", ".laz", ".copc")


@dataclass(frozen=True)
class PlanSite:
    """crs: of the plan. origin: (2,) its planning frame. plots, targets: what is photographed. numbers: of the stand.
    mapped: trees that somebody mapped. mapped_area: ground on which all trees are (None: not known). dtm: terrain.
    canopy: its top where measured. level_m: height of the ground without a terrain model. datum: of the heights, in
    words. notes: sentences for the user."""

    crs: pyproj.CRS
    origin: np.ndarray
    plots: list[SamplePlot]
    targets: list[Target]
    numbers: StandNumbers
    mapped: Trees | None
    mapped_area: BaseGeometry | None
    dtm: Dtm | None
    canopy: Canopy | None
    datum: str
    notes: list[str] = field(default_factory=list)

    def ground(self, xy: np.ndarray) -> np.ndarray:
        """(N,) height of the ground at planning coordinates (N, 2): beyond the terrain model that of its edge, NaN
        farther than :data:`MAX_BEYOND_M` from it."""
        return self.ground_and_margin(xy)[0]

    def known(self, xy: np.ndarray) -> np.ndarray:
        """(N,) bool: the terrain model, where there is one, covers the place."""
        xy = np.asarray(xy, float) + self.origin
        return np.ones(len(xy), bool) if self.dtm is None else self.dtm.covers(xy)

    def ground_and_margin(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) height of the ground, and by how much it may be higher: 0 on the terrain model."""
        xy = np.asarray(xy, float)
        if self.dtm is None:
            return np.zeros(xy.shape[:-1]), np.zeros(xy.shape[:-1])
        places = (xy + self.origin).reshape(-1, 2)
        height, margin = self.dtm.height(*places.T), np.zeros(len(places))
        beyond = ~np.isfinite(height)
        if beyond.any():
            tree, edge, rise = self._edge
            away, nearest = tree.query(places[beyond], distance_upper_bound=MAX_BEYOND_M)
            height[beyond] = np.append(edge, np.nan)[nearest]
            margin[beyond] = rise * away
        return height.reshape(xy.shape[:-1]), margin.reshape(xy.shape[:-1])

    @cached_property
    def _edge(self) -> tuple[cKDTree, np.ndarray, float]:
        """Cells at the rim of the terrain model and of its gaps: where they are, their heights (E,), m, and how much
        the ground may rise for each metre beyond: the model's steepest tenth."""
        assert self.dtm is not None
        heights = np.asarray(self.dtm.heights)
        seen = np.isfinite(heights)
        rim = seen & ~binary_erosion(seen)
        xy = moved(np.column_stack([values[seen] for values in self.dtm.centres()]), self.dtm.grid_crs, self.crs)
        x, y = xy[:: max(len(xy) // _SLOPES, 1)].T
        slope = np.tan(np.radians(self.dtm.slope_deg(x, y, 5.0)))
        rise = float(np.nanpercentile(slope, 90)) if np.isfinite(slope).any() else MIN_RISE
        at_rim = rim[seen]
        edge = cKDTree(xy[at_rim])
        return edge, heights[rim] - self.dtm.origin[2], max(rise, MIN_RISE)

    def canopy_top(self, xy: np.ndarray) -> np.ndarray:
        """(N,) height of the canopy's top: as measured nearby, else that of the tallest trees of the stand; beyond the
        terrain model on ground as high as it may be there."""
        ground = np.add(*self.ground_and_margin(xy))
        tallest = TALLEST * self.numbers.height_m
        if self.canopy is None:
            return ground + tallest
        measured = self.canopy.highest(np.asarray(xy, float) + self.origin)
        return ground + np.where(np.isfinite(measured), measured, tallest)

    def lonlat(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) planning coordinates -> longitude and latitude, WGS 84, degrees."""
        return moved(np.atleast_2d(np.asarray(xy, float)) + self.origin, self.crs, pyproj.CRS(4326))

    @property
    def convergence_deg(self) -> float:
        """True azimuth less grid azimuth at the origin."""
        return float(grid_convergence_deg(self.crs, *self.lonlat(np.zeros(2))[0]))


def read_site(settings: PlanFlightSettings, reporter: Reporter) -> PlanSite:
    """Everything that is given, checked.

    Raises:
        InputError: one sentence about the file or number and what would do. CRSError: no CRS in metres.
    """
    crs = project_crs(settings.crs) if settings.crs else None
    dtm = read_dtm(settings.dtm, crs, reporter) if settings.dtm else None
    crs = crs or (dtm.crs if dtm is not None else None) or crs_of_plots(settings.plots)
    if crs is None:
        raise CRSError(f"{settings.plots}: names no CRS in metres; give the plan's with --crs.")
    check_projected(crs, str(settings.plots))
    plots = read_sample(settings.plots, crs)
    centres = np.array([[plot.x, plot.y] for plot in plots])
    check_place(crs, centres, str(settings.plots))
    origin = np.round(centres.mean(axis=0))
    targets = [Target(plot.plot_id, at - origin, plot.reach_m) for plot, at in zip(plots, centres, strict=True)]
    notes = []
    if dtm is None:
        notes.append("No terrain model was given: the ground is taken as level, check heights on site.")
    canopy, trees, area = None, None, None
    measured: dict[str, float] = {}
    ending = settings.stand.suffix.lower() if settings.stand else ""
    if settings.stand and ending in (*_RASTERS, *_CLOUDS):
        if ending in _RASTERS:
            canopy = canopy_of_raster(settings.stand, crs)
        else:
            canopy = canopy_of_cloud(settings.stand, crs, dtm, centres, max(t.radius_m for t in targets))
        measured = canopy.numbers()
    elif settings.stand:
        trees, searched = _mapped_trees(settings.stand, crs)
        measured = _numbers_of_trees(*trees, plots, searched, settings.stand.name, notes)
        area = translate(searched, *-origin) if searched is not None else None
    numbers = _numbers(settings, measured, notes)
    mapped = _trees_of_canopy(canopy, numbers, origin) if canopy is not None else None
    if trees is not None:
        xy, dbh_m, height = trees
        mapped = dressed_trees(xy - origin, dbh_m, numbers, height)
    datum = "level ground at the take-off"
    if dtm is not None:
        named = heights_named(dtm.crs) or heights_named(dtm.grid_crs) or "its datum is not named in the file"
        datum = f"heights of {Path(str(settings.dtm)).name} ({named})"
    site = PlanSite(crs, origin, plots, targets, numbers, mapped, area, dtm, canopy, datum, notes)
    for target in targets:
        if not site.known(np.vstack([target.centre, target.rim(30)])).all():
            place = target.centre + origin
            raise InputError(
                f"{settings.dtm}: plot {target.plot_id} at {place[0]:.0f}, {place[1]:.0f} lies outside it or on a gap; "
                "give a DTM that reaches 100 m beyond the plots, or correct the plot."
            )
    return site


def _trees_of_canopy(canopy: Canopy, numbers: StandNumbers, origin: np.ndarray) -> Trees | None:
    """Trees at the canopy's tops. They stand for all others too: they carry all leaves and cover all that is
    covered."""
    xy, height = canopy.tops()
    found = canopy.numbers().get("stems_per_ha")
    if not found:
        return None
    reach = canopy.crown_radius_m(found, numbers.crown_base_m)
    # Thick trees are tall: DBH with the square of the height, as heights go with its root.
    dbh_m = numbers.dbh_mean_cm / 100 * np.clip(height / numbers.height_m, 0.4, 1.6) ** 2
    return dressed_trees(xy - origin, dbh_m, replace(numbers, stems_per_ha=found, crown_radius_m=reach), height)


def _mapped_trees(path: Path, crs: pyproj.CRS) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], BaseGeometry | None]:
    """(N, 2) project coordinates, (N,) DBH m, (N,) height m (NaN unknown) of living trees with a place; and the ground
    that was searched for them, where the layer says it."""
    found = measured_trees(path, crs)
    table = found.trees[~found.trees["dead"].to_numpy(bool)]
    xy = table[["x", "y"]].to_numpy(float)
    placed = np.isfinite(xy).all(axis=1)
    if not placed.any():
        raise InputError(f"{path}: no living tree has a place, expected a tree layer; give the five numbers instead.")
    xy = moved(xy, found.crs, crs)
    dbh = table["dbh_cm"].to_numpy(float)
    dbh = np.where(np.isfinite(dbh), dbh, np.nanmedian(dbh)) / 100
    return (xy[placed], dbh[placed], table["height_m"].to_numpy(float)[placed]), searched_area(path, crs)


def _numbers_of_trees(
    xy: np.ndarray, dbh: np.ndarray, height: np.ndarray, plots: list[SamplePlot], searched: BaseGeometry | None,
    name: str, notes: list[str],
) -> dict[str, float]:  # fmt: skip
    """What mapped trees say of the stand; what of them could not be used goes to the notes."""
    measured = {"dbh_mean_cm": 100 * float(dbh.mean()), "dbh_sd_cm": 100 * float(dbh.std())}
    if searched is None or any(plot.outline is not None and plot.outline.intersects(searched) for plot in plots):
        # The plan's plots may reach beyond those of the earlier visit, or be others.
        known, _, said = as_searched(plots, searched, xy, name)
        notes += said
        if inside := sum(int(plot.contains(xy[:, 0], xy[:, 1]).sum()) for plot in known):
            measured["stems_per_ha"] = inside / sum(plot.area_ha for plot in known)
    if np.isfinite(height).any():
        measured["tree_height_m"] = float(np.nanmean(height))
    return measured


def _numbers(settings: PlanFlightSettings, measured: dict[str, float], notes: list[str]) -> StandNumbers:
    """The stand's numbers: as given, else as measured."""
    given = {each.name: getattr(settings, each.name) for each in fields(StandNumberSettings)}
    found: dict[str, Any] = {name: measured.get(name) if value is None else value for name, value in given.items()}
    if found["leaf_area_index"] is None:
        found["leaf_area_index"] = USUAL_LAI
        notes.append(f"Leaf area index taken as {USUAL_LAI:g}: a LiDAR cloud or --leaf-area-index says more.")
    missing = [f"--{name.replace('_', '-')}" for name, value in found.items() if value is None]
    if missing:
        bare = "without --stand the stand has to be described by"
        said = f"{settings.stand} does not say" if settings.stand else bare
        raise InputError(f"{said} {', '.join(missing)}; give {'it' if len(missing) == 1 else 'them'}.")
    if found["crown_base_m"] >= found["tree_height_m"]:
        raise InputError(
            f"--crown-base-m: found {found['crown_base_m']:g} m, expected below the trees' height "
            f"({found['tree_height_m']:.1f} m); correct one of them."
        )
    made = {name: float(value) for name, value in found.items()}
    return StandNumbers(height_m=made.pop("tree_height_m"), **made)


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
        return moved(np.column_stack([x[at], y[at]]), self.grid.grid_crs, self.grid.crs), self.grid.heights[at]

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
    col, row = np.floor((xyz[:, :2] - low) / _CELL_M).astype(int).T
    shape = tuple(int(np.ceil((high[k] - low[k]) / _CELL_M)) for k in (1, 0))
    keep = (row >= 0) & (col >= 0) & (row < shape[0]) & (col < shape[1])
    top = np.full(shape, -np.inf)
    np.maximum.at(top, (shape[0] - 1 - row[keep], col[keep]), height[keep])
    # Cells between the pulses take what is next to them.
    top = np.where(np.isfinite(top), top, maximum_filter(top, size=3))
    transform = from_origin(low[0], low[1] + shape[0] * _CELL_M, _CELL_M, _CELL_M)
    grid = Dtm(np.where(np.isfinite(top), np.maximum(top, 0), np.nan), transform, crs)
    gap = max(float((height < 2).mean()), 0.02)
    measured = {
        "leaf_area_index": float(np.clip(-np.log(gap) / (LEAF_SHADOW * CLUMPING), 0.2, 8)),
        "crown_base_m": float(np.percentile(height[height > 2], 5)),
    }
    return Canopy(grid, measured)
