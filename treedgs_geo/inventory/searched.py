"""Where stems were looked for: the layer ``searched`` of a tree file, written while measuring, read by what counts."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Sequence
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import shapely
from shapely.geometry import MultiPolygon, Point, box
from shapely.geometry.base import BaseGeometry

from ..core.layer_files import read_if_there
from ..core.plots import Plot
from ..core.shown import some

#: Name of the layer, and the columns by which it is known as ours.
SEARCHED = "searched"
COLUMNS = ("plot_id", "x", "y", "radius_m", "area_m2", "share")
#: A plot searched by this share is searched all over: the rest is rounding.
WHOLE = 0.995
#: Below this share of a plot it is worth a warning, above it a note.
ALMOST = 0.95
#: Sides of a quarter circle, as plots have them.
_SEGMENTS = 512
_NOTHING = MultiPolygon()


def searched_table(
    seen: BaseGeometry, plots: Sequence[Plot], crs: pyproj.CRS | str, flown: datetime.date | None = None
) -> gpd.GeoDataFrame:
    """One row a plot: centre and radius asked for, the area in it that was searched (m2) and its share of the plot;
    without plots one row of all that was searched. And the day on which it was ``flown``, where known.

    seen: what photos or points show, project coordinates.
    """
    rows, shapes = [], []
    for plot in plots:
        disc = Point(plot.x, plot.y).buffer(plot.radius_m, _SEGMENTS)
        part = disc.intersection(seen)
        rows.append((plot.plot_id, plot.x, plot.y, plot.radius_m, part.area, part.area / disc.area))
        shapes.append(_polygons([part]))
    if not plots:
        middle = seen.centroid
        at = (np.nan, np.nan) if middle.is_empty else (middle.x, middle.y)
        rows.append((SEARCHED, *at, np.nan, seen.area, np.nan))
        shapes.append(_polygons([seen]))
    table = pd.DataFrame(rows, columns=list(COLUMNS)).round({"x": 3, "y": 3, "area_m2": 2, "share": 4})
    table["flown"] = pd.Series(None if flown is None else flown.isoformat(), index=table.index, dtype=object)
    return gpd.GeoDataFrame(table, geometry=gpd.GeoSeries(shapes, crs=crs), crs=crs)


def covered(mask: np.ndarray, corner: tuple[float, float], cell_m: float) -> BaseGeometry:
    """The area of the True cells of a grid. mask: (rows, columns), rows northwards. corner: south-west one of the first
    cell."""
    strips = []
    for row in np.flatnonzero(mask.any(axis=1)):
        steps = np.flatnonzero(np.diff(np.concatenate([[0], mask[row].astype(np.int8), [0]])))
        low = corner[1] + row * cell_m
        strips += [
            box(corner[0] + a * cell_m, low, corner[0] + b * cell_m, low + cell_m)
            for a, b in zip(steps[::2], steps[1::2], strict=True)
        ]
    return shapely.union_all(strips) if strips else _NOTHING


def read_searched(path: Path) -> gpd.GeoDataFrame | None:
    """The layer of a tree file; ``None`` where it has none (another format, an older version, another program)."""
    return read_if_there(path, SEARCHED, COLUMNS)


def flown_days(path: Path) -> list[datetime.date]:
    """The day on which a tree layer's photos or points were taken, plot by plot, in order; none where it does not
    say."""
    table = read_searched(path)
    if table is None or "flown" not in table:
        return []
    return sorted(day.date() for day in pd.to_datetime(table["flown"], errors="coerce").dropna())


def flown_on(path: Path) -> datetime.date | None:
    """The middle one of these days; ``None`` where there is none."""
    days = flown_days(path)
    return days[len(days) // 2] if days else None


def searched_area(path: Path, crs: pyproj.CRS | None) -> BaseGeometry | None:
    """All that was searched, in ``crs`` (None: as stored); ``None`` where the file does not say."""
    table = read_searched(path)
    if table is None:
        return None
    if crs is not None and table.crs is not None and table.crs != crs:
        table = table.to_crs(crs)
    return _polygons(shape.buffer(0) for shape in table.geometry if shape is not None and not shape.is_empty)


def not_seen(table: gpd.GeoDataFrame) -> str:
    """``4 % (A 9 %, B 0 %)``: the share of the plots that was not searched, all together and, of several, the worst."""
    asked = np.pi * table["radius_m"].to_numpy(float) ** 2
    missing = 1 - table["share"].to_numpy(float)
    text = _percent(float(np.average(missing, weights=asked)))
    if len(table) > 1:
        shares = sorted(zip(missing, table["plot_id"], strict=True), reverse=True)
        text += f" ({', '.join(f'{name} {_percent(share)}' for share, name in shares[:8])}"
        text += ", the others less)" if len(shares) > 8 else ")"
    return text


def partly_searched(table: gpd.GeoDataFrame, why: str) -> list[str]:
    """A sentence where plots were searched in part only. why: what the rest lacks."""
    part = table[table["share"].notna() & (table["share"] < ALMOST)].sort_values("share")
    if not len(part):
        return []
    named = some((f"{row.plot_id} ({_percent(row.share)} searched)" for row in part.itertuples()), 8)
    return [
        f"{len(part)} of {len(table)} plots {'was' if len(part) == 1 else 'were'} searched in part only: {named}; "
        f"{why}. The layer says so, and stand tables divide by the part that was searched."
    ]


def _polygons(shapes: Iterable[BaseGeometry]) -> MultiPolygon:
    """Their union without what has no area."""
    whole = shapely.union_all(list(shapes))
    parts = [part for part in getattr(whole, "geoms", [whole]) if part.geom_type in ("Polygon", "MultiPolygon")]
    flat = [piece for part in parts for piece in getattr(part, "geoms", [part]) if not piece.is_empty]
    return MultiPolygon(flat)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if not 0 < share < 0.01 else "less than 1 %"
