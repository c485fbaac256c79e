"""The campaign's one trees layer: the trees of every finished plot."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from scipy.spatial import cKDTree
from shapely import STRtree, box

from ..core.errors import OutputError
from ..core.frames import moved
from ..core.plots import read_plots
from ..core.progress import Reporter
from ..core.shown import some
from ..inventory import tree_layer
from ..inventory.searched import SEARCHED, read_searched
from ..inventory.side_layers import READINGS, add_tables, read_readings
from ..inventory.tree_layer import tree_table, typed_trees, write_table
from ..inventory.tree_reading import read_trees
from ..inventory.written import read_written
from ..pointcloud.file_crs import LOCAL_CRS
from ..stems.quality.tree import TREE_FIELDS
from .places import TREES

#: A tree's number is its plot's number times this, plus its number in the plot: it stays when other plots come or go.
IDS_PER_PLOT = 100_000
#: Trees of two plots nearer than this are one tree.
DUPLICATE_M = 0.4
SUFFIXES = (".gpkg", ".csv")


def check_output(path: Path) -> None:
    """Prove that the layer can be written, before hours of work.

    Raises:
        OutputError: another ending, a folder that cannot be written, or a layer that is being edited.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise OutputError(f"{path}: ends in {path.suffix!r}, expected .gpkg or .csv; rename the output.")
    tree_layer.check_output(path)


def write_layer(path: Path, plots: Iterable[dict[str, Any]], crs: str, reporter: Reporter | None = None) -> int:
    """Write the layer; returns the number of trees.

    plots: ``plot_id, number, folder, crs, table`` (whether the row has a plots table) per finished plot, in order.
    crs: of the layer; trees of plots in another one are transformed, heights stay.

    Columns are those of a tree layer; ``tree_id`` is unique in the campaign, ``plot_tree`` is the number in the plot's
    own folder, ``camp_plot`` the manifest's plot_id. ``plot_id`` is NULL for trees outside the plot's circle. What a
    person wrote (species, status, note, decisions) into a plot's layer, or into the merged one that is replaced, goes
    on with its tree; of two decisions the newer one.
    """
    trees, searched, silent, readings = [], [], [], []
    for plot in plots:
        file = Path(plot["folder"]) / TREES
        trees.append(_plot_trees(plot, crs))
        if (read := read_readings(file)) is not None:
            readings.append(read.assign(tree_id=read["tree_id"] + plot["number"] * IDS_PER_PLOT))
        if (found := read_searched(file)) is None:
            silent.append(plot["plot_id"])
        else:
            searched.append(_searched(found, plot, crs))
    empty = tree_table([], _crs(crs))
    empty["plot_tree"], empty["camp_plot"] = empty["tree_id"], empty["plot_id"]
    table = pd.concat([part for part in trees if len(part)] or [empty], ignore_index=True)
    written = read_written(path)
    table = written.into(table.sort_values("tree_id", kind="stable", ignore_index=True))

    def beside(geopackage: Path) -> None:
        # What was searched of some plots only would make the others unsearched.
        parts = {SEARCHED: [] if silent else searched, READINGS: readings}
        add_tables(geopackage, {name: pd.concat(of, ignore_index=True) for name, of in parts.items() if of})

    write_table(path, table, beside)
    if silent and searched and reporter is not None:
        reporter.warn(
            f"{path.name} does not say where stems were searched for, since {len(silent)} plots do not "
            f"({some(silent, 5)}, measured by an older version): measure them again."
        )
    written.report(reporter)
    return len(table)


def _plot_trees(plot: dict[str, Any], crs: str) -> gpd.GeoDataFrame:
    """One plot's trees with the campaign's ids."""
    table = typed_trees(read_trees(Path(plot["folder"]) / TREES).reindex(columns=[*TREE_FIELDS, "geometry"]))
    table["plot_tree"] = table["tree_id"]
    table["tree_id"] = table["tree_id"] + plot["number"] * IDS_PER_PLOT
    table["camp_plot"] = plot["plot_id"]
    if not plot["table"]:
        table["plot_id"] = plot["plot_id"]
    elif len(table) and table["plot_id"].isna().all():
        # The cloud route knows no circles: they are applied here.
        for circle in reversed(read_plots(Path(plot["folder"]) / "plots.csv", table.crs)):
            inside = np.hypot(table["x"] - circle.x, table["y"] - circle.y) <= circle.radius_m
            table.loc[inside, "plot_id"] = circle.plot_id
    if plot["crs"] == crs or not len(table):
        return table.set_crs(table.crs if plot["crs"] == crs else _crs(crs), allow_override=True)
    table[["x", "y"]] = np.round(moved(table[["x", "y"]].to_numpy(float), _crs(plot["crs"]), _crs(crs)), 3)
    return table.set_geometry(gpd.points_from_xy(table["x"], table["y"], table.geometry.z), crs=_crs(crs))


def _searched(table: gpd.GeoDataFrame, plot: dict[str, Any], crs: str) -> gpd.GeoDataFrame:
    """What was searched of one plot, named and placed as its trees are."""
    if len(table) == 1:
        table["plot_id"] = plot["plot_id"]
    table["camp_plot"] = plot["plot_id"]
    table = table.set_crs(_crs(plot["crs"]), allow_override=True)
    if plot["crs"] == crs:
        return table
    table = table.to_crs(_crs(crs))
    middle = table.geometry.centroid
    return table.assign(x=middle.x.round(3), y=middle.y.round(3))


def _crs(text: str) -> pyproj.CRS:
    return LOCAL_CRS if text == "local" else pyproj.CRS.from_user_input(text)


def twins(plots: list[tuple[str, Path, tuple[float, float, float, float]]]) -> list[tuple[str, str, int]]:
    """Pairs of plots that measured the same trees: ``(plot, plot, trees in both)``.

    plots: plot id, folder, bounds of its trees. Only plots whose bounds meet are read.
    """
    if len(plots) < 2:
        return []
    boxes = [box(b[0] - DUPLICATE_M, b[1] - DUPLICATE_M, b[2] + DUPLICATE_M, b[3] + DUPLICATE_M) for *_, b in plots]
    found = []
    for one, other in zip(*STRtree(boxes).query(boxes), strict=True):
        if one >= other:
            continue
        trees = [read_trees(plots[k][1] / TREES) for k in (one, other)]
        here, there = (table.loc[table["dbh_cm"].notna(), ["x", "y"]].to_numpy(float) for table in trees)
        both = len(there) and int((cKDTree(there).query(here, distance_upper_bound=DUPLICATE_M)[0] < DUPLICATE_M).sum())
        if both:
            found.append((plots[one][0], plots[other][0], both))
    return found
