"""The terrain model: ground heights on a grid, asked for in project (or local) coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyproj
from numba import njit

from ..core.crs import check_projected
from ..core.errors import CRSError, InputError
from ..core.files import atomic_path
from ..core.frames import heights_named, horizontal, vertical_of
from ..core.frames import transform as convert
from ..core.map_scale import zone_hint
from ..core.progress import Reporter
from ..pointcloud.file_crs import odd_height_unit, same_place

if TYPE_CHECKING:
    from affine import Affine

    from ..core.crs import LocalFrame

#: Values that files use for "nothing here" without saying so.
_SILENT_NODATA = (-9999.0, -99999.0, -32768.0, 3.4028234663852886e38, -3.4028234663852886e38)

#: A DTM that lies farther than this from the ground that the data themselves show is reported.
GROUND_WARN_M = 0.15
#: A given terrain model that lies farther than this from the ground that the data show is not of their heights.
OTHER_HEIGHTS_M = 3.0
#: The steepest slope that is believed under a stem, m/m.
STEEPEST = 1.0


@dataclass(frozen=True)
class Dtm:
    """Ground heights on a regular grid.

    heights: (rows, cols) float64 metres, NaN where nothing is known. transform: affine, (col, row) of a cell *corner*
    -> grid coordinates. crs: of the coordinates it is asked in (``None`` = local metres). support: (rows, cols) metres
    to the nearest ground point, where known. origin: (3,) subtracted from coordinates and heights, see
    :meth:`shifted`. grid_crs: the grid's own CRS when it differs from ``crs``. scale: metres of ``crs`` for one metre
    that it is asked in, see :meth:`local`.

    Examples:
        >>> import numpy as np
        >>> import treedgs_geo as tg
        >>> from rasterio.transform import from_origin
        >>> dtm = tg.Dtm(np.array([[100.0, 101.0], [100.0, 101.0]]), from_origin(0, 2, 1, 1))
        >>> dtm.height(np.array([1.0]), np.array([1.0])).tolist()
        [100.5]
    """

    heights: np.ndarray
    transform: Affine
    crs: pyproj.CRS | None = None
    support: np.ndarray | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    grid_crs: pyproj.CRS | None = None
    scale: float = 1.0

    def height(self, x: np.ndarray, y: np.ndarray, method: str = "bilinear") -> np.ndarray:
        """Ground height at (N,) x, y, metres; NaN outside the grid and where nothing is known.

        ``nearest`` is the paper's query. ``bilinear`` leaves missing corners out when the nearest cell is known, so
        that it is NaN exactly where ``nearest`` is.
        """
        return self._sample(self.heights, x, y, method) - self.origin[2]

    __call__ = height

    def support_m(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Distance to the nearest ground point that the model rests on, metres; NaN where unknown."""
        if self.support is None:
            return np.full(np.broadcast(x, y).shape, np.nan)
        return self._sample(self.support, x, y, "nearest")

    def slope_deg(self, x: np.ndarray, y: np.ndarray, reach_m: float = 1.0) -> np.ndarray:
        """Steepest slope of the ground around (N,) x, y over ``2 * reach_m``, degrees; NaN where unknown."""
        x, y = np.asarray(x, float), np.asarray(y, float)
        east = (self.height(x + reach_m, y) - self.height(x - reach_m, y)) / (2 * reach_m)
        north = (self.height(x, y + reach_m) - self.height(x, y - reach_m)) / (2 * reach_m)
        return np.degrees(np.arctan(np.hypot(east, north)))

    def uphill(self, xy: np.ndarray, radius_m: float) -> float:
        """Ground height on the uphill side of a stem of ``radius_m`` at (2,) ``xy``, metres; NaN where unknown."""
        slope = float(np.nan_to_num(self.slope_deg(*xy)))
        return float(self.height(*xy)) + radius_m * min(float(np.tan(np.radians(slope))), STEEPEST)

    def covers(self, xy: np.ndarray) -> np.ndarray:
        """(N,) bool: a ground height is known at (N, 2) positions."""
        xy = np.atleast_2d(np.asarray(xy, float))
        return np.isfinite(self.height(xy[:, 0], xy[:, 1], "nearest"))

    def shifted(self, origin: np.ndarray) -> Dtm:
        """The same ground, asked for and answering in coordinates relative to ``origin`` (3,)."""
        moved = np.asarray(self.origin, float) + np.asarray(origin, float)
        return replace(self, origin=(float(moved[0]), float(moved[1]), float(moved[2])))

    def local(self, frame: LocalFrame) -> Dtm:
        """The same ground in the local coordinates of ``frame``; call it with x, y."""
        return replace(self.shifted(frame.origin), scale=frame.scale)

    def moved(self, offset: np.ndarray) -> Dtm:
        """The ground displaced by ``offset`` (3,): made near zero, put where it belongs."""
        from affine import Affine

        t, (x, y, z) = self.transform, np.asarray(offset, float).tolist()
        return replace(self, transform=Affine(t.a, t.b, t.c + x, t.d, t.e, t.f + y), heights=self.heights + z)

    @property
    def resolution_m(self) -> float:
        """Cell size."""
        return float(abs(self.transform.a))

    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """(rows, cols) x and y of the cell centres, in grid coordinates."""
        rows, cols = self.heights.shape
        col, row = np.meshgrid(np.arange(cols) + 0.5, np.arange(rows) + 0.5)
        t = self.transform
        return t.a * col + t.b * row + t.c, t.d * col + t.e * row + t.f

    def _sample(self, grid: np.ndarray, x: np.ndarray, y: np.ndarray, method: str) -> np.ndarray:
        """Values of a grid at x, y (any shape)."""
        if method not in ("nearest", "bilinear"):
            raise ValueError(f"method {method!r}: expected nearest or bilinear")
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        if self.scale != 1.0:
            x, y = x * self.scale, y * self.scale
        east, north, move = x.ravel(), y.ravel(), self.origin[:2]
        if self.grid_crs is not None and self.crs is not None:
            to_grid = pyproj.Transformer.from_crs(self.crs, self.grid_crs, always_xy=True)
            east, north = to_grid.transform(east + move[0], north + move[1])
            move = 0.0, 0.0
        t = ~self.transform
        # No copy: the grid may lie on disk.
        inverse = (float(t.a), float(t.b), float(t.c), float(t.d), float(t.e), float(t.f))
        found = _sampled(np.asarray(grid), east, north, float(move[0]), float(move[1]), inverse, method == "bilinear")
        return found.reshape(x.shape)


@njit(cache=True, nogil=True)
def _sampled(grid, x, y, east, north, inverse, bilinear):  # pragma: no cover - compiled
    """(N,) values of the grid at x + east, y + north: the nearest cell's, or blended from the known ones of four.

    inverse: of the grid's affine transform, coordinates -> (col, row)."""
    rows, cols = grid.shape
    a, b, c, d, e, f = inverse
    found = np.full(x.shape[0], np.nan)
    for k in range(x.shape[0]):
        col, row = a * (x[k] + east) + b * (y[k] + north) + c, d * (x[k] + east) + e * (y[k] + north) + f
        if not (0 <= col <= cols and 0 <= row <= rows):
            continue
        near = grid[min(int(row), rows - 1), min(int(col), cols - 1)]
        found[k] = near
        if not bilinear or not np.isfinite(near):
            continue
        u, v = min(max(col - 0.5, 0.0), cols - 1.0), min(max(row - 0.5, 0.0), rows - 1.0)
        j0, i0 = min(int(u), max(cols - 2, 0)), min(int(v), max(rows - 2, 0))
        j1, i1 = min(j0 + 1, cols - 1), min(i0 + 1, rows - 1)
        fu, fv = u - j0, v - i0
        total, blended = 0.0, 0.0
        for i, j, weight in (
            (i0, j0, (1 - fu) * (1 - fv)),
            (i0, j1, fu * (1 - fv)),
            (i1, j0, (1 - fu) * fv),
            (i1, j1, fu * fv),
        ):
            if np.isfinite(grid[i, j]):
                total += weight
                blended += weight * grid[i, j]
        if total > 1e-9:
            found[k] = blended / total
    return found


def grid_over(xy_min: np.ndarray, xy_max: np.ndarray, resolution_m: float) -> tuple[Affine, int, int]:
    """``(transform, rows, cols)`` of a north-up grid that holds the box, edges on multiples of the cell size.

    Raises:
        InputError: the grid would have more than 400 million cells.
    """
    from affine import Affine

    west, south = np.floor(np.asarray(xy_min, float) / resolution_m) * resolution_m
    cols = max(int(np.ceil((xy_max[0] - west) / resolution_m)), 1)
    rows = max(int(np.ceil((xy_max[1] - south) / resolution_m)), 1)
    if rows * cols > 4e8:
        raise InputError(
            f"--resolution-m: {resolution_m:g} m over {cols * resolution_m:.0f} x {rows * resolution_m:.0f} m makes "
            f"{rows * cols / 1e6:.0f} million cells, expected at most 400 million; give a coarser resolution or clip."
        )
    return Affine(resolution_m, 0, west, 0, -resolution_m, south + rows * resolution_m), rows, cols


def read_dtm(
    path: Path, crs: pyproj.CRS | None = None, reporter: Reporter | None = None, over_ground: bool = False
) -> Dtm:
    """Read a terrain raster to be asked in the project CRS.

    crs: the project CRS; a raster in another projected CRS is asked through a coordinate transformation, and when both
    name a vertical datum its heights are turned into the project's. A raster without CRS is taken to be in ``crs``.
    Band 1 holds heights in metres; a second band described ``support`` is kept. Numbers that stand for "nothing here"
    without being declared so are unknown heights; what is not a usual one of those (0 among heights of 100 m) is said.
    over_ground: heights are over the ground (a canopy), where 0 is a height like any other.

    Raises:
        InputError: not a raster, or no height in it. CRSError: geographic or not in metres.

    Examples:
        >>> import treedgs_geo as tg
        >>> tg.read_dtm(plot / "dtm.tif").crs.to_epsg()
        6344
    """
    import rasterio

    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: not found; give a terrain raster (GeoTIFF) with --dtm.")
    try:
        with rasterio.open(path) as source:
            band = source.read(1, masked=True)
            transform, wkt, nodata = source.transform, source.crs and source.crs.to_wkt(), source.nodata
            units = (source.units[0] or "").lower()
            support = None
            if source.count > 1 and source.descriptions[1] == "support":
                support = source.read(2, masked=True).astype(float).filled(np.nan)
    except rasterio.errors.RasterioError as problem:
        why = problem.__cause__ or problem
        raise InputError(f"{path}: is not a raster that can be read ({why}); give a terrain GeoTIFF.") from None
    heights = band.astype(float).filled(np.nan)
    heights[~np.isfinite(heights) | np.isin(heights, _SILENT_NODATA) | (np.abs(heights) > 12_000)] = np.nan
    if nodata is not None:
        heights[heights == nodata] = np.nan
    if not over_ground:
        heights = _without_fillings(heights, abs(float(transform.a)), path, reporter or Reporter())
    if not np.isfinite(heights).any():
        raise InputError(f"{path}: holds no ground height (every cell is nodata); give a DTM with heights in metres.")
    if units in ("ft", "foot", "feet", "us survey foot", "us-ft"):
        raise CRSError(f"{path}: heights are in {units}, expected metres; convert the raster to metres.")
    grid_crs = pyproj.CRS.from_wkt(wkt) if wkt else None
    if grid_crs is not None:
        check_projected(horizontal(grid_crs), str(path), transform * (heights.shape[1] / 2, heights.shape[0] / 2))
        if unit := odd_height_unit(grid_crs):
            raise CRSError(f"{path}: heights are in {unit}, expected metres; convert the raster to metres.")
    other = horizontal(grid_crs) if crs and grid_crs and not same_place(crs, grid_crs) else None
    dtm = Dtm(heights, transform, horizontal(crs) if crs is not None else grid_crs, support, grid_crs=other)
    return _same_vertical(dtm, grid_crs, crs, path)


#: A filling value lies at least this far below or above every other height, metres.
_DETACHED_M = 10.0
#: Beside such cells a raster that was resampled holds blends of height and filling: steeper than this, metres a metre.
_STEEP = 2.0
#: No land is this high: where such a number is among zeros, it is the filling and not they.
_NO_LAND_M = 8900.0
#: Different filling values that one raster may hold on each side.
_MAX_VALUES = 3


def _without_fillings(heights: np.ndarray, resolution_m: float, path: Path, reporter: Reporter) -> np.ndarray:
    """(rows, cols) heights, metres, NaN where unknown, with unmarked filling values taken out, which is said.

    A filling value is the lowest or highest number of the raster, held by several cells (or 0, by one), and far from
    every other. Blends of it with real heights, which resampling leaves round the hole, go with it.
    """
    holes = np.zeros(heights.shape, bool)
    values: list[float] = []
    highest = np.max(heights, initial=-np.inf, where=np.isfinite(heights))
    for sign in (-1.0, 1.0) if highest > _NO_LAND_M else (1.0, -1.0):
        for _ in range(_MAX_VALUES):
            known = sign * heights[np.isfinite(heights) & ~holes]
            if known.size == 0:
                break
            lowest = float(known.min())
            rest = known[known > lowest]
            repeated = known.size - rest.size >= 2 or lowest == 0.0
            if rest.size == 0 or not repeated or float(rest.min()) - lowest < _DETACHED_M:
                break
            values.append(sign * lowest + 0.0)
            holes |= heights == sign * lowest
    if not values:
        return heights
    holes |= _blends(np.where(holes, np.nan, heights), holes, resolution_m)
    left = np.where(holes, np.nan, heights)
    low, high, said = np.nanmin(left), np.nanmax(left), " or ".join(f"{value:g}" for value in values)
    reporter.warn(
        f"{path}: {int(holes.sum())} of {heights.size} cells hold {said} m (or a blend with it) among heights of "
        f"{low:.1f} to {high:.1f} m, and the file declares no nodata value for them: they are taken as unknown; set "
        "the raster's nodata value."
    )
    return left


def _blends(heights: np.ndarray, holes: np.ndarray, resolution_m: float) -> np.ndarray:
    """(rows, cols) bool: cells joined to the ``holes`` by cells as steep as only a blend is."""
    from scipy.ndimage import binary_propagation

    steep = np.zeros(heights.shape, bool)
    for axis in (0, 1):
        step = np.abs(np.diff(heights, axis=axis)) > _STEEP * resolution_m + 1.0
        for side in ((1, 0), (0, 1)):
            steep |= np.pad(step, [side if along == axis else (0, 0) for along in (0, 1)])
    return binary_propagation(holes, np.ones((3, 3), bool), holes | steep) & ~holes


def _same_vertical(dtm: Dtm, own: pyproj.CRS | None, wanted: pyproj.CRS | None, path: Path) -> Dtm:
    """Heights turned from the raster's vertical datum into the project's, where both say theirs.

    Raises:
        CRSError: the geoid's grid is not installed.
    """
    have, want = heights_named(own), heights_named(wanted)
    if not have or not want or have == want or own is None or wanted is None:
        return dtm
    x, y = dtm.centres()
    known = np.isfinite(dtm.heights)
    points = np.column_stack([x[known], y[known], dtm.heights[known]])
    flat = horizontal(own)
    vertical = vertical_of(wanted)
    target = pyproj.crs.CompoundCRS(f"{flat.name} + {want}", [flat, vertical]) if vertical is not None else flat.to_3d()
    heights = np.full(dtm.heights.shape, np.nan)
    heights[known] = convert(own, target, points, str(path))[:, 2]
    return replace(dtm, heights=heights)


def write_dtm(path: Path, dtm: Dtm, band: str = "ground") -> None:
    """Write a GeoTIFF (Float32, deflate, nodata -9999): band 1, called ``band``, heights, band 2
    ``support`` where known.

    Written in strips, so that a grid which lies on disk never has to fit into memory.
    """
    import rasterio
    from rasterio.windows import Window

    layers = [dtm.heights] + ([dtm.support] if dtm.support is not None else [])
    own_crs = dtm.grid_crs or dtm.crs
    rows, cols = dtm.heights.shape
    profile = {
        "driver": "GTiff", "width": cols, "height": rows, "count": len(layers), "dtype": "float32", "nodata": -9999.0,
        "transform": dtm.transform, "crs": own_crs.to_wkt() if own_crs is not None else None, "compress": "deflate",
        "predictor": 3, "tiled": min(dtm.heights.shape) >= 256, "BIGTIFF": "IF_SAFER",
    }  # fmt: skip
    step = 256 * max(int(2e7 / (256 * cols)), 1)
    with atomic_path(Path(path)) as temporary:
        with rasterio.open(temporary, "w", **profile) as target:
            target.update_tags(TIFFTAG_SOFTWARE="TreeDGS")
            for index, (layer, name) in enumerate(zip(layers, (band, "support"), strict=False), start=1):
                target.set_band_description(index, name)
                target.set_band_unit(index, "metre")
                for top in range(0, rows, step):
                    part = np.asarray(layer[top : top + step])
                    part = np.where(np.isfinite(part), part, -9999.0).astype(np.float32)
                    target.write(part, index, window=Window(0, top, cols, len(part)))
        # GDAL writes the last blocks when it closes the file, and says nothing when there is no room for them.
        with rasterio.open(temporary) as back:
            for top in range(0, rows, step):
                back.read(window=Window(0, top, cols, min(step, rows - top)))


def require_coverage(dtm: Dtm, xy: np.ndarray, where: str) -> None:
    """Refuse a DTM that does not lie under the plot.

    Raises:
        InputError: known at less than half of the (N, 2) positions.
    """
    share = float(np.mean(dtm.covers(xy))) if len(xy) else 0.0
    if share < 0.5:
        (west, south), (east, north) = np.min(xy, axis=0), np.max(xy, axis=0)
        said = " (it covers these coordinates in {zone})"
        hint = zone_hint(said, dtm.crs, xy, lambda moved: bool(np.mean(dtm.covers(moved)) >= 0.5))
        raise InputError(
            f"{where}: knows the ground at {100 * share:.0f} % of the plot (x {west:.0f} to {east:.0f}, y {south:.0f} "
            f"to {north:.0f}), expected all of it{hint}; give a DTM that covers the plot and is in its CRS."
        )


def height_above(dtm: Dtm, seen: Dtm) -> float:
    """Metres that ``dtm`` lies above the ground that the data show: median over its cells, 0 where they share none."""
    gap = dtm.height(*seen.centres()) - seen.heights
    gap = gap[np.isfinite(gap)]
    return float(np.median(gap)) if gap.size else 0.0
