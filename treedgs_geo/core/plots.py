"""Field plots: where to look for trees. Read from a CSV table with one row a plot."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyproj
from scipy.spatial import cKDTree

from .columns import FoundColumn, columns, line_of, measured, places, plot_ids, require
from .errors import InputError
from .tables import read_table

if TYPE_CHECKING:
    import pandas as pd

#: Centres and radii that differ by less are one plot's, m.
_SAME_M = 0.1


@dataclass(frozen=True)
class Plot:
    """A circular plot. x, y: centre in project coordinates, metres."""

    plot_id: str
    x: float
    y: float
    radius_m: float


def plot_of(plots: list[Plot], x: float, y: float) -> str | None:
    """Id of the (first) plot that a tree at x, y stands in."""
    return next((plot.plot_id for plot in plots if np.hypot(x - plot.x, y - plot.y) <= plot.radius_m), None)


def read_plots(path: Path, crs: pyproj.CRS) -> list[Plot]:
    """Read a radius and a centre a plot: easting, northing (or x, y) with an optional ``epsg``, or lon, lat.

    Coordinates in another CRS are transformed to ``crs``; lon/lat are read on the project CRS's own datum.

    Raises:
        InputError: missing file, columns or numbers, an id or a plot twice. CRSError: unknown ``epsg``.
    """
    path = Path(path)
    table = read_table(path)
    found = columns(table, "plot_id", "radius", "easting", "northing", "lon", "lat", "epsg")
    require(path, table, found, ("radius", ("easting", "lon"), ("northing", "lat")), {"radius": ""})
    radius = measured(path, table, "radius", found["radius"])
    empty = radius.isna()
    if empty.any():
        raise InputError(f"{path}, {line_of(empty)}: has no {found['radius'].name}; write the plot's radius.")
    names = plot_names(path, table, found.get("plot_id"))
    xy = places(path, table, crs)
    plots = [Plot(name, float(x), float(y), float(r)) for name, (x, y), r in zip(names, xy, radius, strict=True)]
    refuse_same(path, names, xy, radius.to_numpy())
    return plots


def plot_names(path: Path, table: pd.DataFrame, column: FoundColumn | None) -> list[str]:
    """Ids of the plots; plots are numbered where a table has none.

    Raises:
        InputError: some have none, or two the same.
    """
    if column is None:
        return [f"plot_{k + 1}" for k in range(len(table))]
    cells = plot_ids(table, column)
    if cells.isna().any():
        raise InputError(f"{path}, {line_of(cells.isna())}: has no {column.name}; give every plot its own id.")
    twice = cells.duplicated()
    if twice.any():
        raise InputError(
            f"{path}, {line_of(twice)}: {column.name} {cells[twice.idxmax()]!r} appears twice; a row is a plot, not a "
            "tree: give every plot its own id."
        )
    return [str(cell) for cell in cells]


def as_in_plots(written: list[str], known: list[str]) -> dict[str, str]:
    """Ids of a tally that the plots table writes otherwise (``01`` and ``1.0`` for ``1``, ``p 1`` for ``P1``) -> its
    own; only where one plot alone is meant, and no other spelling of the tally means it too."""
    plain: dict[str, list[str]] = {}
    for name in known:
        plain.setdefault(_plain_id(name), []).append(name)
    lost = {name: plain.get(_plain_id(name), []) for name in dict.fromkeys(written) if name not in known}
    return {name: found[0] for name, found in lost.items() if len(found) == 1}


def _plain_id(name: str) -> str:
    """Without what a spreadsheet or another hand changes: letters' case, blanks, zeros in front, ``.0`` behind."""
    text = re.sub(r"[\s_\-]+", "", name).casefold()
    return re.sub(r"(?<!\d)0+(?=\d)", "", re.sub(r"^(\d+)\.0+$", r"\1", text))


def refuse_same(path: Path, names: list[str], xy: np.ndarray, radius_m: np.ndarray) -> None:
    """Refuse one circle under two ids: its trees would count twice. xy: (N, 2). radius_m: (N,), NaN is never the same.

    Raises:
        InputError: the two ids.
    """
    some = np.flatnonzero(np.isfinite(xy).all(axis=1) & np.isfinite(radius_m))
    for i, j in sorted(cKDTree(xy[some]).query_pairs(_SAME_M)) if len(some) > 1 else ():
        first, second = some[i], some[j]
        if abs(radius_m[first] - radius_m[second]) < _SAME_M:
            raise InputError(
                f"{path}: plots {names[first]} and {names[second]} are one circle: its trees would count twice; leave "
                "one of them."
            )


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


def short_way(xy: np.ndarray, first: int) -> list[int]:
    """Numbers of (N, 2) places in the order of a short way: always to the nearest that is left."""
    order, left = [first], [k for k in range(len(xy)) if k != first]
    while left:
        order.append(min(left, key=lambda k: float(np.hypot(*(xy[k] - xy[order[-1]])))))
        left.remove(order[-1])
    return order
