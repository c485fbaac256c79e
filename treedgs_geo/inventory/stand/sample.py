"""Sample plots: shape, horizontal area, which trees stand in them, what the stand's edge does to their weight, and as
far as stems were searched for: nothing is divided by ground that nobody looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pyproj
import shapely
from shapely import affinity, contains_xy
from shapely.geometry import Point, box
from shapely.geometry.base import BaseGeometry

from ...core.columns import FoundColumn, columns, line_of, measured, places, require, table_crs
from ...core.errors import CRSError, InputError
from ...core.plots import plot_names, refuse_same
from ...core.shown import shorten
from ...core.tables import column_name, is_table, read_table, refuse_other_formats
from ..searched import ALMOST, SEARCHED, WHOLE

#: What a table or layer of plots may hold.
_PLACE = ("easting", "northing", "lon", "lat", "epsg")
_MEASURES = ("radius", "width", "length", "area", "slope", "azimuth", "aspect")
#: Segments a quarter circle, where a circle has to be a polygon (area 1e-6 too small).
_SEGMENTS = 512
#: Plots that share this much of the ground of both are one; less than this, m2, is two lines that touch.
_ONE_PLOT, _TOUCH_M2 = 0.985, 1.0
#: A plot's size and the area beside it agree within this (logarithm).
_CONTRADICTS = 0.15


@dataclass(frozen=True)
class SamplePlot:
    """One plot. area_ha: horizontal. shape: circle, ellipse, rectangle, polygon, or ``area`` (no place on the map).

    x, y: centre (NaN for ``area``). outline: the plot on the ground. inside: share of it inside the stand (1 without a
    boundary). weight_area_ha: the area that its trees are divided by. edge: what was found about the stand's edge.
    searched: share in which stems were searched for; the others are then this part (:func:`as_searched`).
    """

    plot_id: str
    shape: str
    area_ha: float
    x: float = np.nan
    y: float = np.nan
    radius_m: float = np.nan
    outline: BaseGeometry | None = None
    slope_deg: float = 0.0
    inside: float = 1.0
    weight_area_ha: float = np.nan
    edge: str = "no boundary given"
    searched: float = 1.0

    @property
    def reach_m(self) -> float:
        """Radius of the circle about the plot's centre that holds it."""
        if self.shape == "circle" or self.outline is None:
            return float(self.radius_m)
        corners = np.asarray(self.outline.convex_hull.exterior.coords)[:, :2]
        return float(np.hypot(*(corners - [self.x, self.y]).T).max())

    def moved(self, x: float, y: float) -> SamplePlot:
        """The same with its centre there."""
        return replace(self, x=x, y=y, outline=affinity.translate(self.outline, x - self.x, y - self.y))

    def contains(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """True for positions in the plot; on the line counts as in."""
        x, y = np.asarray(x, float), np.asarray(y, float)
        if self.shape == "circle":
            # To a micrometre: coordinates of six digits carry that much rounding.
            return np.hypot(x - self.x, y - self.y) <= self.radius_m + 1e-6
        assert self.outline is not None
        return contains_xy(self.outline.buffer(1e-6), x, y)


def read_sample(path: Path, crs: pyproj.CRS | None, along: str = "horizontal", on_map: bool = True) -> list[SamplePlot]:
    """Plots from a CSV table or a layer of polygons or points.

    Centre: ``easting, northing`` (with ``epsg``), ``lon, lat`` or ``x, y``. Shape: ``radius_m`` (or ``_ft``), or
    ``width_m, length_m`` with ``azimuth_deg`` of the length (grid north, default 0), or an area alone (``area_m2,
    area_ha, area_ac``) where on_map is not needed. along: radii and sides were laid out ``horizontal`` or along the
    ``slope`` (``slope_pct`` or ``slope_deg``; a circle then needs ``aspect_deg`` to know which trees are in it).

    Raises:
        InputError: file, line and what is wrong. CRSError: no CRS to place the plots in.
    """
    path = Path(path)
    tabular = is_table(path)
    table = read_table(path) if tabular else _read_layer(path, crs)
    has = columns(table, "plot_id", *_PLACE, *_MEASURES)
    sizes = next((keys for keys in (("radius",), ("width", "length"), ("area",)) if set(keys) <= set(has)), ())
    if tabular:
        place = (("easting", "lon"), ("northing", "lat")) if on_map else ()
        slope = ("slope",) if along == "slope" else ()
        size = ("radius", "width") if on_map else ("radius", "width", "area")
        require(path, table, has, (*place, *(() if sizes else (size,)), *slope), dict.fromkeys((*sizes, *slope), ""))
    # What else a layer or table holds may be called the same and mean something else.
    has = {key: column for key, column in has.items() if key not in _MEASURES or column.unit}
    values = {key: measured(path, table, key, has.get(key)).to_numpy() for key in _MEASURES}
    values["slope"] = _slopes_deg(path, table, has.get("slope"))
    if tabular:
        values["x"], values["y"] = places(path, table, crs, required=on_map).T
    else:
        values["x"], values["y"] = table.geometry.centroid.get_coordinates().to_numpy().T
    plots: list[SamplePlot] = []
    for k, name in enumerate(plot_names(path, table, has.get("plot_id"))):
        where = f"{path}, line {table.index[k]}" if tabular else f"{path}, plot {name}"
        outline = None if tabular else table.geometry.iloc[k]
        made = _plot(where, name, {key: float(of[k]) for key, of in values.items()}, outline, along, on_map)
        area = float(values["area"][k])
        if tabular and np.isfinite(area) and abs(np.log(area / 1e4 / made.area_ha)) > _CONTRADICTS:
            raise InputError(
                f"{where}: its size makes {1e4 * made.area_ha:,.0f} m², but {has['area'].name} is "
                f"{table[has['area'].name].iloc[k]}; correct one of them."
            )
        plots.append(replace(made, weight_area_ha=made.area_ha))
    centres = np.column_stack([values["x"], values["y"]])
    refuse_same(path, [plot.plot_id for plot in plots], centres, np.array([plot.radius_m for plot in plots]))
    for one, other, share in overlaps(plots):
        if share > _ONE_PLOT:
            raise InputError(
                f"{path}: plots {one.plot_id} and {other.plot_id} are the same ground: its trees would count twice; "
                "leave one of them."
            )
    return plots


def crs_of_plots(path: Path) -> pyproj.CRS | None:
    """What a table (the first ``epsg``) or layer of plots says of its CRS.

    Raises:
        InputError: not readable.
    """
    if is_table(path):
        return table_crs(path)
    try:
        code = pyogrio.read_info(path).get("crs")
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a plots table or layer ({problem}).") from None
    return pyproj.CRS.from_user_input(code) if code else None


def first_plot(plots: Sequence[SamplePlot], xy: np.ndarray) -> np.ndarray:
    """(N,) number of the first plot that each place (N, 2) is in, -1: none."""
    found = np.full(len(xy), -1)
    for k in reversed(range(len(plots))):
        found[plots[k].contains(*xy.T)] = k
    return found


def overlaps(plots: list[SamplePlot]) -> list[tuple[SamplePlot, SamplePlot, float]]:
    """Pairs of plots on the same ground, with the share that both have of what either has."""
    some = [plot for plot in plots if plot.outline is not None]
    outlines = [plot.outline for plot in some]
    found = []
    for i, j in shapely.STRtree(outlines).query(outlines, predicate="intersects").T if len(some) > 1 else ():
        both = outlines[i].intersection(outlines[j]).area if i < j else 0.0
        if both > _TOUCH_M2:
            found.append((some[i], some[j], both / (outlines[i].area + outlines[j].area - both)))
    return found


def read_boundary(path: Path, crs: pyproj.CRS | None) -> BaseGeometry:
    """The stand's outline (one or more polygons) in ``crs``.

    Raises:
        InputError: not readable or no polygon in it. CRSError: no CRS.
    """
    path = Path(path)
    try:
        layer = gpd.read_file(path, engine="pyogrio")
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a polygon layer ({problem}).") from None
    layer = layer[layer.geometry.notna() & layer.geometry.geom_type.isin(["Polygon", "MultiPolygon"])]
    if not len(layer):
        raise InputError(f"{path}: holds no polygon; give the stand's outline.")
    layer = _in_crs(path, layer, crs)
    outline = layer.geometry.make_valid().union_all()
    if outline.area <= 0:
        raise InputError(f"{path}: the stand's outline has no area; correct it.")
    return outline


def census(boundary: BaseGeometry, name: str = "stand") -> SamplePlot:
    """The whole stand as one plot: every tree in it is counted, nothing is sampled."""
    centre = boundary.centroid
    area = boundary.area / 1e4
    return SamplePlot(name, "polygon", area, centre.x, centre.y, np.nan, boundary, weight_area_ha=area, edge="census")


def at_the_edge(
    plots: list[SamplePlot], boundary: BaseGeometry | None, rule: str
) -> tuple[list[SamplePlot], list[str]]:
    """Find plots that reach over the boundary, drop those whose centre is outside, set the area that counts.

    Returns:
        the plots, and sentences about what was found.
    """
    if boundary is None:
        return plots, []
    kept, notes = [], []
    over: dict[str, list[str]] = {}
    for plot in plots:
        if plot.edge == "census":
            kept.append(plot)
        elif plot.outline is None:
            kept.append(replace(plot, edge="not on the map"))
        elif not boundary.covers(Point(plot.x, plot.y)):
            notes.append(f"Plot {plot.plot_id}: its centre is outside the stand's boundary; left out.")
        elif (share := plot.outline.intersection(boundary).area / plot.outline.area) >= 1 - 1e-4:
            kept.append(replace(plot, edge="inside"))
        else:
            chosen = _rule_for(plot, rule)
            area = plot.area_ha * share if chosen == "area" else plot.area_ha
            kept.append(replace(plot, inside=share, weight_area_ha=area, edge=f"slopover, {chosen}"))
            over.setdefault(chosen, []).append(f"{plot.plot_id} ({100 * (1 - share):.0f} %)")
    for chosen, names in over.items():
        notes.append(
            f"{len(names)} plot{'s reach' if len(names) > 1 else ' reaches'} over the stand's edge: "
            f"{shorten(names, 12)}. Rule: {_RULE_TEXT[chosen]}."
        )
    return kept, notes


_RULE_TEXT = {
    "zone": "each tree weighs by the part of the plot-sized zone around it that is inside",
    "walkthrough": "walkthrough, a tree counts twice where the point as far beyond it as the centre is outside",
    "area": "only the area inside the stand counts",
    "none": "only flagged: its whole area and all its trees count",
}


def _rule_for(plot: SamplePlot, rule: str) -> str:
    """Walking through needs a plot that is the same on both sides of its centre; others take the zone."""
    return "zone" if rule == "walkthrough" and plot.shape == "polygon" else rule


def weights(plot: SamplePlot, x: np.ndarray, y: np.ndarray, boundary: BaseGeometry | None, rule: str) -> np.ndarray:
    """How often each tree of the plot counts: 0 outside the stand, else 1 or more near its edge.

    A tree is in the sample when a plot's centre falls into the plot-sized zone around it; near the edge a part of that
    zone is outside, where no centre can fall. ``zone`` weighs by what is left of it, which makes the estimate unbiased
    for any outline (Gregoire and Valentine 2008, ch. 7). ``walkthrough`` counts a tree twice where the point as far
    beyond it as the centre is outside (Ducey, Gove and Valentine 2004, Forest Science 50(4): 427-435), a little too low
    in corners and narrow strips. Both hold for plots inside too, not only for those that reach over the edge.
    """
    x, y, rule = np.asarray(x, float), np.asarray(y, float), _rule_for(plot, rule)
    count = np.ones(len(x))
    if boundary is None or plot.outline is None or plot.edge == "census" or rule == "none" or not len(x):
        return count
    inside = contains_xy(boundary.buffer(1e-6), x, y)
    if rule == "walkthrough":
        beyond = ~contains_xy(boundary, 2 * x - plot.x, 2 * y - plot.y)
        count = np.where(beyond, 2.0, 1.0)
    elif rule == "zone":
        # Where a centre has to be for the plot to hold the tree: the plot turned by 180 degrees, around the tree.
        zone = affinity.scale(plot.outline.simplify(1e-3), -1, -1, origin=(plot.x, plot.y))
        reach = replace(plot, shape="polygon", outline=zone).reach_m
        near = inside & (shapely.distance(boundary.boundary, shapely.points(x, y)) < reach)
        for k in np.flatnonzero(near):
            moved = affinity.translate(zone, x[k] - plot.x, y[k] - plot.y)
            count[k] = zone.area / moved.intersection(boundary).area
    return np.where(inside, count, 0.0)


def _plot(
    where: str, name: str, row: dict[str, float], geometry: BaseGeometry | None, along: str, on_map: bool
) -> SamplePlot:
    """row: :data:`_MEASURES` (m, m2, degrees) and ``x, y``, NaN where there is none."""
    slope, circle, x, y = (row[key] for key in ("slope", "radius", "x", "y"))
    if along == "slope" and not np.isfinite(slope):
        raise InputError(f"{where}: has no slope_pct or slope_deg, which a plot laid out along the slope needs.")
    shrink = float(np.cos(np.radians(slope))) if along == "slope" else 1.0
    slope = slope if np.isfinite(slope) else 0.0
    if geometry is not None and geometry.geom_type != "Point" and not np.isfinite(circle):
        if geometry.area <= 0:
            raise InputError(f"{where}: its outline has no area; correct it.")
        return SamplePlot(name, "polygon", geometry.area / 1e4, x, y, np.nan, geometry, slope)
    if np.isfinite(circle):
        area = np.pi * circle**2 * shrink / 1e4
        if not np.isfinite(x):
            return SamplePlot(name, "area", area, radius_m=circle, slope_deg=slope)
        disc = Point(x, y).buffer(circle, _SEGMENTS)
        if shrink > 1 - 1e-9:
            return SamplePlot(name, "circle", area, x, y, circle, disc, slope)
        aspect = row["aspect"]
        if on_map and not np.isfinite(aspect):
            raise InputError(
                f"{where}: has no aspect_deg (where the slope faces), which a round plot on a slope needs."
            )
        # On the map a circle laid out along the ground is an ellipse, short downhill.
        flat = affinity.rotate(affinity.scale(disc, 1.0, shrink), -aspect if np.isfinite(aspect) else 0.0)
        return SamplePlot(name, "ellipse", area, x, y, circle, flat, slope)
    width, length, turn = row["width"], row["length"], row["azimuth"]
    if np.isfinite([width, length]).all():
        area = width * length * shrink / 1e4
        if not np.isfinite(x):
            return SamplePlot(name, "area", area, slope_deg=slope)
        if shrink < 1 - 1e-9 and on_map:
            raise InputError(f"{where}: a rectangle laid out along the slope cannot be drawn; give horizontal sides.")
        shape = box(x - width / 2, y - length / 2, x + width / 2, y + length / 2)
        shape = affinity.rotate(shape, -turn if np.isfinite(turn) else 0.0, origin=(x, y))
        return SamplePlot(name, "rectangle", area, x, y, np.nan, shape, slope)
    if row["area"] > 0 and not on_map:
        return SamplePlot(name, "area", row["area"] * shrink / 1e4, x, y, slope_deg=slope)
    wanted = "radius_m, or width_m and length_m" + ("" if on_map else ", or area_m2, area_ha or area_ac")
    raise InputError(f"{where}: has no size; expected {wanted}.")


def _slopes_deg(path: Path, table: pd.DataFrame, column: FoundColumn | None) -> np.ndarray:
    """(N,) slopes in degrees, above 0 either way."""
    slope = np.abs(measured(path, table, "slope", column))
    if column is not None and column.unit == "pct":
        slope = np.degrees(np.arctan(slope / 100))
    if (slope > 60).any():
        raise InputError(
            f"{path}, {line_of(slope > 60)}: slope of {slope[slope > 60].iloc[0]:.0f} degrees, expected up to 60; "
            "check its unit."
        )
    return slope.to_numpy()


def _read_layer(path: Path, crs: pyproj.CRS | None) -> gpd.GeoDataFrame:
    refuse_other_formats(path, layers=True)
    try:
        layers = [str(name) for name, kind in pyogrio.list_layers(path) if kind is not None]
        if not layers:
            raise ValueError("no layer with geometry")
        chosen = next((name for name in ("plots", "stand_plots", SEARCHED) if name in layers), layers[0])
        layer = gpd.read_file(path, layer=chosen, engine="pyogrio")
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a plots table or layer ({problem}).") from None
    layer.columns = [name if name == "geometry" else column_name(str(name)) for name in layer.columns]
    layer = layer[layer.geometry.notna() & ~layer.geometry.is_empty].reset_index(drop=True)
    shapes = layer.geometry.force_2d()
    single = (shapes.geom_type == "MultiPoint") & (shapes.count_geometries() == 1)
    layer = layer.set_geometry(shapes.where(~single, shapes.centroid))
    kinds = set(layer.geometry.geom_type) - {"Point", "Polygon", "MultiPolygon"}
    if kinds or not len(layer):
        raise InputError(
            f"{path}: holds {', '.join(sorted(kinds)) or 'nothing'}, expected plots as polygons or points."
        )
    return _in_crs(path, layer, crs)


def _in_crs(path: Path, layer: gpd.GeoDataFrame, crs: pyproj.CRS | None) -> gpd.GeoDataFrame:
    if crs is None or layer.crs == crs:
        return layer
    if layer.crs is None:
        raise CRSError(f"{path}: holds no CRS; set it (it has to be laid over trees in {crs.name}).")
    return layer.to_crs(crs)


#: Less searched ground than this is none, m2: no tree has room on it.
_MIN_M2 = 1.0
#: Plots that share more than this of what was searched of them are one plot in other words.
_SAME_GROUND = 0.5
#: Chance below which an empty rim of the plots is none, and that of one plot, whose trees may stand in a clump.
_CHANCE, _CHANCE_ONE = 1e-4, 1e-6


def as_searched(
    plots: Sequence[SamplePlot], searched: BaseGeometry | None, xy: np.ndarray, name: str
) -> tuple[list[SamplePlot], list[str], list[str]]:
    """``(plots, warnings, notes)``: each plot as its part in which stems were searched for, those without any left out.

    searched: all ground that was (:func:`.searched.searched_area`), ``None`` where the tree layer does not say: its
    plots are then taken as searched all over, and a note says so. xy: (N, 2) its trees. name: of the layer, for the
    sentences.

    Raises:
        InputError: no plot was searched, or the same searched ground is asked for twice.
    """
    if searched is None:
        said = (
            f"{name} does not say where stems were searched for (another format, an older version, or edited): every "
            "plot is taken as searched all over"
        )
        inside = {
            plot.plot_id: np.hypot(*(xy[plot.contains(*xy.T)] - [plot.x, plot.y]).T) / plot.radius_m
            for plot in plots
            if plot.shape == "circle"
        }
        empty = empty_rim(inside)
        return list(plots), [f"{said}, but {empty}"] if empty else [], [] if empty else [f"{said}."]
    kept: list[SamplePlot] = []
    missing, part_of = [], []
    for plot in plots:
        if plot.outline is None:
            kept.append(plot)
            continue
        part = plot.outline.intersection(searched)
        share = part.area / plot.outline.area
        if part.area < _MIN_M2:
            missing.append(plot.plot_id)
        elif share >= WHOLE:
            kept.append(plot)
        else:
            area = plot.area_ha * share
            kept.append(replace(plot, shape="polygon", outline=part, area_ha=area, weight_area_ha=area, searched=share))
            part_of.append((plot, kept[-1]))
    if not kept:
        raise InputError(
            f"{name}: stems were searched for in none of the {len(plots)} plots ({shorten(missing, 8)}); check their "
            "coordinates and epsg, or measure them."
        )
    _refuse_same_ground(part_of, name)
    warnings = []
    if missing:
        warnings.append(
            f"{name}: {len(missing)} of {len(plots)} plots {'was' if len(missing) == 1 else 'were'} not searched for "
            f"stems and {'is' if len(missing) == 1 else 'are'} left out: {shorten(missing, 8)}."
        )
    larger = [
        f"{made.plot_id} ({1e4 * made.area_ha:,.0f} of {1e4 * plot.area_ha:,.0f} m²{_like_feet(plot, made)})"
        for plot, made in part_of
    ]
    notes: list[str] = []
    if larger:
        sentence = (
            f"{name}: {len(larger)} of {len(plots)} plots {'asks' if len(larger) == 1 else 'ask'} for more ground than "
            f"stems were searched for on: {shorten(larger, 8)}. Only the searched part counts, and the trees in it."
        )
        least = min(made.searched for _, made in part_of)
        (warnings if least < ALMOST else notes).append(sentence)
    return kept, warnings, notes


def empty_rim(reached: dict[str, np.ndarray]) -> str:
    """What is odd where no tree stands in the outer part of the round plots, of all or of one; '' where chance can
    leave it empty. reached: plot -> its trees' distances from the centre, in radii of the plot."""
    every = ("", np.concatenate([*reached.values(), []]), _CHANCE)
    for plot, trees, chance in (every, *((f" of plot {name}", found, _CHANCE_ONE) for name, found in reached.items())):
        inner = trees[np.isfinite(trees)] ** 2
        if not len(inner) or inner.max() >= ALMOST or inner.max() ** len(inner) > chance:
            continue
        share = np.sqrt(inner.max())
        diameter = " or a diameter is given as the radius" if 0.42 < share <= 0.5 else ""
        return (
            f"of {len(inner)} trees{plot} none stands in their outer {100 * (1 - inner.max()):.0f} %: if only the "
            f"inner {100 * share:.0f} % of the radius was searched{diameter}, every figure per hectare is too low by "
            "that share; give the plots as they were measured, or measure again."
        )
    return ""


def _refuse_same_ground(part_of: list[tuple[SamplePlot, SamplePlot]], name: str) -> None:
    """Plots so large that what was searched of them is the same ground are no plots of their own."""
    for (plot, one), (_, other) in combinations(part_of, 2):
        assert one.outline is not None and other.outline is not None
        both = one.outline.intersection(other.outline).area
        if both > _SAME_GROUND * min(one.outline.area, other.outline.area):
            raise InputError(
                f"{name}: plots {one.plot_id} and {other.plot_id} ask for the same searched ground ({both:,.0f} m²; "
                f"{one.plot_id} is to have {1e4 * plot.area_ha:,.0f} m²); correct the plots' sizes and their unit."
            )


def _like_feet(plot: SamplePlot, made: SamplePlot) -> str:
    """A hint where the radius is that of the searched circle in feet."""
    circle = np.sqrt(1e4 * made.area_ha / np.pi)
    return ": a radius in feet?" if abs(np.log(plot.radius_m / circle * 0.3048)) < 0.03 else ""
