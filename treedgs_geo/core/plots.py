"""Field plots: where to look for trees. Read from a CSV table with one row a plot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj

from .errors import CRSError, InputError
from .tables import csv_rows


@dataclass(frozen=True)
class Plot:
    """A circular plot. x, y: centre in project coordinates, metres."""

    plot_id: str
    x: float
    y: float
    radius_m: float


def read_plots(path: Path, crs: pyproj.CRS) -> list[Plot]:
    """Read ``plot_id, radius_m`` and a centre: ``easting, northing`` (with optional ``epsg``) or ``lon, lat``.

    Coordinates in another CRS are transformed to ``crs``; lon/lat are read on the project CRS's own datum.

    Raises:
        InputError: missing file, columns or numbers, doubled ids. CRSError: unknown ``epsg``.
    """
    path = Path(path)
    rows = csv_rows(path, "a plots table")
    if not rows:
        raise InputError(f"{path}: holds no plot, expected one row a plot with plot_id, easting, northing, radius_m.")
    columns = set(rows[0])
    metric = {"easting", "northing"} <= columns
    if "radius_m" not in columns or not (metric or {"lon", "lat"} <= columns):
        raise InputError(
            f"{path}: found columns {', '.join(sorted(map(str, columns)))}; expected plot_id, radius_m and "
            "easting, northing (with epsg) or lon, lat."
        )
    plots: list[Plot] = []
    for number, row in enumerate(rows, start=2):
        try:
            first, second = ("easting", "northing") if metric else ("lon", "lat")
            position = float(row[first]), float(row[second])
            radius = float(row["radius_m"])
            if not np.isfinite(position).all():
                raise ValueError
        except (TypeError, ValueError):
            raise InputError(
                f"{path}, line {number}: a coordinate or radius_m is not a number; correct the row."
            ) from None
        if not 0 < radius <= 1000:
            raise InputError(f"{path}, line {number}: radius_m is {radius:g}, expected metres above 0 and up to 1000.")
        source = source_crs(path, number, row, crs, metric)
        if source is not None:
            place = pyproj.Transformer.from_crs(source, crs, always_xy=True).transform(*position)
            if not np.isfinite(place).all():
                raise InputError(
                    f"{path}, line {number}: {first} {position[0]:g}, {second} {position[1]:g} has no place in "
                    f"{crs.name}; correct the row, or its epsg."
                )
            position = place
        name = str(row.get("plot_id") or f"plot_{number - 1}")
        if any(plot.plot_id == name for plot in plots):
            raise InputError(f"{path}, line {number}: plot_id {name!r} appears twice; give every plot its own id.")
        plots.append(Plot(name, position[0], position[1], radius))
    return plots


def plot_cells(plots: list[Plot], cell_m: float = 0.5, most: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    """Middles of square cells inside the plots: ``((N, 2) project metres, (N,) number of the plot)``.

    Cells lie on whole multiples of their side, which grows where there would be more than ``most``.
    """
    area = sum(np.pi * plot.radius_m**2 for plot in plots)
    side = max(cell_m, float(np.sqrt(area / most)))
    parts, owners = [], []
    for number, plot in enumerate(plots):
        low = np.floor((np.array([plot.x, plot.y]) - plot.radius_m) / side)
        axes = [side * (low[k] + 0.5 + np.arange(int(2 * plot.radius_m / side) + 2)) for k in (0, 1)]
        grid = np.column_stack([axis.ravel() for axis in np.meshgrid(*axes)])
        inside = grid[np.hypot(grid[:, 0] - plot.x, grid[:, 1] - plot.y) <= plot.radius_m]
        parts.append(inside if len(inside) else np.array([[plot.x, plot.y]]))
        owners.append(np.full(len(parts[-1]), number))
    return np.concatenate(parts), np.concatenate(owners)


def source_crs(path: Path, number: int, row: dict, crs: pyproj.CRS, metric: bool) -> pyproj.CRS | None:
    """The CRS of a row of a table when it differs from the project's. row: may have ``epsg``. metric: the row has
    easting and northing, not lon and lat.

    Raises:
        CRSError: unknown ``epsg``.
    """
    if not metric:
        return crs.geodetic_crs.to_2d() if crs.geodetic_crs else None
    code = str(row.get("epsg") or "").strip()
    if not code:
        return None
    try:
        found = pyproj.CRS.from_epsg(int(float(code)))
    except (ValueError, OverflowError, pyproj.exceptions.CRSError):
        raise CRSError(
            f"{path}, line {number}: epsg {code!r} is unknown; give the EPSG code of easting and northing."
        ) from None
    return None if found == crs else found
