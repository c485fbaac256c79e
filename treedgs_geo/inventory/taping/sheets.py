"""The drawn trees in the order of a walk, with what a crew needs to find each of them; and the pages of the form."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.plots import Plot
from ..double_sampling.designs import Draw
from ..field_trees import Bearings, bearing_to_grid_deg
from .frame import Frame

#: Trees of a page where there are no plots.
PER_PAGE = 14
#: The size that the form shows is rounded to this, so that nobody reads the tape towards it.
ABOUT_CM = 5.0


@dataclass(frozen=True)
class Sheet:
    """One page: the drawn trees of a plot (``trees``: rows of :func:`walk`), or of a piece of the walk."""

    title: str
    plot_id: str | None
    x: float
    y: float
    reach_m: float
    trees: pd.DataFrame


def walk(frame: Frame, draw: Draw, protocol: Bearings, day: str, path: Path) -> pd.DataFrame:
    """The drawn trees: ``walk`` (1 is first), ``tree_id, plot_id, about_cm`` (NaN: no DBH), ``qc_flag, azim_deg,
    dist_m`` (from the plot's centre; NaN without plots), ``x, y, lon, lat`` (WGS 84), ``stratum, prob, dbh_cm``.

    Plot after plot, in each clockwise from north; without plots from tree to nearest tree.

    Raises:
        InputError: magnetic bearings without a date or declination.
    """
    trees = frame.trees.iloc[draw.index].reset_index(drop=True)
    made = trees[["tree_id", "plot_id", "qc_flag", "x", "y", "dbh_cm"]].copy()
    made["stratum"], made["prob"] = draw.stratum, draw.prob
    # Whole numbers: a point in them would stand beside the commas that a crew may type.
    made["about_cm"] = (np.round(made["dbh_cm"] / ABOUT_CM) * ABOUT_CM).astype("Int64")
    made["azim_deg"] = made["dist_m"] = np.nan
    for plot in frame.plots:
        mine = (made["plot_id"] == plot.plot_id).to_numpy()
        if not mine.any():
            continue
        east, north = made.loc[mine, "x"] - plot.x, made.loc[mine, "y"] - plot.y
        turn = bearing_to_grid_deg(Plot(plot.plot_id, plot.x, plot.y, 1.0), frame.crs, protocol, day, path)
        made.loc[mine, "azim_deg"] = (np.degrees(np.arctan2(east, north)) + turn) % 360
        made.loc[mine, "dist_m"] = np.hypot(east, north)
    made["lon"], made["lat"] = _lonlat(frame.crs, made)
    made = made.iloc[_order(made, frame)].reset_index(drop=True)
    made.insert(0, "walk", np.arange(1, len(made) + 1))
    return made


def sheets(frame: Frame, trees: pd.DataFrame) -> list[Sheet]:
    """The form's pages, in the order of the walk."""
    if trees["plot_id"].notna().all():
        centres = {plot.plot_id: plot for plot in frame.plots}
        made = []
        for name in trees["plot_id"].unique():
            mine = trees[trees["plot_id"] == name]
            known = centres.get(name)
            around = frame.trees[frame.trees["plot_id"] == name]
            x, y = (known.x, known.y) if known else (float(around["x"].mean()), float(around["y"].mean()))
            reach = float(np.hypot(around["x"] - x, around["y"] - y).max()) + 1.0
            if known is not None and np.isfinite(known.radius_m):
                reach = max(reach, known.radius_m)
            made.append(Sheet(f"Plot {name}", str(name), x, y, reach, mine))
        return made
    made = []
    for first in range(0, len(trees), PER_PAGE):
        mine = trees.iloc[first : first + PER_PAGE]
        x, y = (float((mine[axis].min() + mine[axis].max()) / 2) for axis in "xy")
        reach = max(float(np.abs(mine["x"] - x).max()), float(np.abs(mine["y"] - y).max())) + 8.0
        made.append(
            Sheet(f"Trees {mine['walk'].iloc[0]} to {mine['walk'].iloc[-1]} of the walk", None, x, y, reach, mine)
        )
    return made


def _order(trees: pd.DataFrame, frame: Frame) -> np.ndarray:
    if trees["plot_id"].notna().all():
        names = [plot.plot_id for plot in frame.plots] or sorted(trees["plot_id"].unique())
        rank = trees["plot_id"].map({name: k for k, name in enumerate(names)}).to_numpy(float)
        middle = frame.trees.groupby("plot_id")[["x", "y"]].mean().reindex(trees["plot_id"]).to_numpy()
        turn = np.degrees(np.arctan2(*(trees[["x", "y"]].to_numpy(float) - middle).T)) % 360
        bearing = np.where(trees["azim_deg"].notna(), trees["azim_deg"], turn)
        return np.lexsort([bearing, rank])
    place = trees[["x", "y"]].to_numpy(float)
    left = list(range(len(place)))
    order = [min(left, key=lambda k: place[k].sum())]
    left.remove(order[0])
    while left:
        last = place[order[-1]]
        order.append(min(left, key=lambda k: float(np.hypot(*(place[k] - last)))))
        left.remove(order[-1])
    return np.array(order)


def _lonlat(crs: pyproj.CRS, trees: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """WGS 84 degrees; NaN where the CRS is not tied to the earth."""
    nothing = np.full(len(trees), np.nan)
    if crs.geodetic_crs is None:
        return nothing, nothing
    to_wgs84 = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    lon, lat = to_wgs84.transform(trees["x"].to_numpy(float), trees["y"].to_numpy(float))
    known = np.isfinite(lon) & np.isfinite(lat)
    return np.where(known, lon, np.nan), np.where(known, lat, np.nan)
