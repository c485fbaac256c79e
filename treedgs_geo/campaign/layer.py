"""The campaign's one trees layer: every finished plot's trees, a few plots at a time, renamed into place at the end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from ..core.errors import OutputError
from ..core.files import atomic_path, ensure_writable
from ..core.geopackage import atomic_geopackage, ensure_unlocked
from ..core.layer_files import add_layer
from ..core.plots import read_plots
from ..core.progress import Reporter
from ..core.tables import safe_frame
from .places import TREES

#: A tree's number is its plot's number times this, plus its number in the plot: it stays when other plots come or go.
IDS_PER_PLOT = 100_000
#: Trees, and plots, held in memory before they are written: a table of three trees takes as much as one of a hundred.
_BATCH, _BATCH_PLOTS = 5000, 40
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
    ensure_writable(path)
    if path.suffix.lower() == ".gpkg":
        from ..inventory.tree_layer import OWN_LAYERS

        ensure_unlocked(path, OWN_LAYERS)


def write_layer(path: Path, plots: Iterable[dict[str, Any]], crs: str, reporter: Reporter | None = None) -> int:
    """Write the layer; returns the number of trees.

    plots: ``plot_id, number, folder, crs, table`` (whether the row has a plots table) per finished plot, in order;
    taken one by one. crs: of the layer; trees of plots in another one are transformed, heights stay.

    Columns are those of a tree layer; ``tree_id`` is unique in the campaign, ``plot_tree`` is the number in the plot's
    own folder, ``camp_plot`` the manifest's plot_id. ``plot_id`` is NULL for trees outside the plot's circle. What a
    person wrote (species, status, note, decisions) into a plot's layer, or into the merged one that is replaced, goes
    on with its tree; of two decisions the newer one.
    """
    import pandas as pd

    from ..inventory.readings import add_readings, read_readings
    from ..inventory.searched import add_searched, read_searched
    from ..inventory.written import read_written

    total = 0
    held: list[Any] = []
    waiting = 0
    written, numbers = read_written(path), set()
    searched, silent, readings = [], [], []
    with _target(path) as temporary:
        for plot in plots:
            table = _plot_trees(plot, crs)
            found = read_searched(Path(plot["folder"]) / TREES)
            read = read_readings(Path(plot["folder"]) / TREES)
            if read is not None:
                readings.append(read.assign(tree_id=read["tree_id"] + plot["number"] * IDS_PER_PLOT))
            if found is None:
                silent.append(plot["plot_id"])
            else:
                searched.append(_searched(found, plot, crs))
            numbers.update(table["tree_id"])
            total += len(table)
            waiting += len(table)
            if len(table) or not held:
                held.append(table)
            if waiting >= _BATCH or len(held) >= _BATCH_PLOTS:
                _append(temporary, written.fill(pd.concat(held, ignore_index=True)))
                held, waiting = [], 0
        if held or not temporary.exists():
            _append(temporary, written.fill(pd.concat(held, ignore_index=True)) if held else _empty(crs))
        left = written.left(_empty(crs), numbers)
        if len(left):
            total += len(left)
            _append(temporary, left)
        if path.suffix.lower() == ".gpkg":
            if readings:
                add_readings(temporary, pd.concat(readings, ignore_index=True))
            # What was searched of some plots only would make the others unsearched.
            if searched and not silent:
                add_searched(temporary, pd.concat(searched, ignore_index=True))
    if silent and searched and reporter is not None:
        reporter.warn(
            f"{path.name} does not say where stems were searched for, since {len(silent)} plots do not "
            f"({', '.join(map(str, silent[:5]))}{', …' if len(silent) > 5 else ''}, measured by an older version): "
            "measure them again."
        )
    written.report(reporter)
    return total


@contextmanager
def _target(path: Path) -> Iterator[Path]:
    from ..inventory.tree_layer import OWN_LAYERS

    with atomic_geopackage(path, OWN_LAYERS) if path.suffix.lower() == ".gpkg" else atomic_path(path) as temporary:
        yield temporary


def _append(target: Path, table: Any) -> None:
    import pandas as pd

    from ..inventory.tree_reading import LAYER

    table = table.sort_values("tree_id", kind="stable")
    if target.suffix.lower() == ".csv":
        safe_frame(pd.DataFrame(table.drop(columns="geometry"))).to_csv(
            target, mode="a", header=not target.exists(), index=False
        )
    else:
        add_layer(target, LAYER, table, "Point Z")


def _plot_trees(plot: dict[str, Any], crs: str) -> Any:
    """One plot's trees with the campaign's ids."""
    import geopandas as gpd

    from ..inventory.tree_reading import read_trees

    table = read_trees(Path(plot["folder"]) / TREES)
    table = _typed(table)
    table["plot_tree"] = table["tree_id"]
    table["tree_id"] = table["tree_id"] + plot["number"] * IDS_PER_PLOT
    table["camp_plot"] = plot["plot_id"]
    if not plot["table"]:
        table["plot_id"] = plot["plot_id"]
    elif len(table) and table["plot_id"].isna().all():
        # The cloud route knows no circles: they are applied here.
        table["plot_id"] = _circles(table, Path(plot["folder"]) / "plots.csv")
    if plot["crs"] == crs or not len(table):
        return table.set_crs(table.crs if plot["crs"] == crs else _crs(crs), allow_override=True)
    mover = pyproj.Transformer.from_crs(_crs(plot["crs"]), _crs(crs), always_xy=True)
    x, y = mover.transform(table["x"].to_numpy(), table["y"].to_numpy())
    table["x"], table["y"] = np.round(x, 3), np.round(y, 3)
    heights = table.geometry.z.to_numpy()
    points = gpd.points_from_xy(table["x"], table["y"], heights)
    return table.set_geometry(gpd.GeoSeries(points, index=table.index, crs=_crs(crs)))


def _searched(table: Any, plot: dict[str, Any], crs: str) -> Any:
    """What was searched of one plot, named and placed as its trees are."""
    if len(table) == 1:
        table["plot_id"] = plot["plot_id"]
    table["camp_plot"] = plot["plot_id"]
    if plot["crs"] == crs:
        return table.set_crs(_crs(crs), allow_override=True)
    table = table.set_crs(_crs(plot["crs"]), allow_override=True).to_crs(_crs(crs))
    middle = table.geometry.centroid
    return table.assign(x=middle.x.round(3), y=middle.y.round(3))


def _typed(table: Any) -> Any:
    """Integers stay integers where some are missing; an all-missing column keeps its type, so that plots agree."""
    import pandas as pd

    from ..inventory.tree_layer import tree_table

    like = tree_table([], table.crs)
    for name, kind in like.dtypes.items():
        if name == "geometry":
            continue
        if name not in table:
            table[name] = pd.Series([None] * len(table), dtype=kind)
        elif kind.name == "Int64":
            table[name] = pd.array(pd.to_numeric(table[name]), dtype="Int64")
        elif kind.kind == "f":
            table[name] = pd.to_numeric(table[name]).astype(float)
        else:
            table[name] = table[name].astype(object).where(table[name].notna(), None)
    return table[[*like.columns]]


def _circles(table: Any, plots: Path) -> list[str | None]:
    found: list[str | None] = [None] * len(table)
    for plot in read_plots(plots, table.crs):
        for row in np.flatnonzero(np.hypot(table["x"] - plot.x, table["y"] - plot.y) <= plot.radius_m):
            found[row] = found[row] or plot.plot_id
    return found


def _empty(crs: str) -> Any:
    from ..inventory.tree_layer import tree_table

    table = tree_table([], _crs(crs))
    table["plot_tree"], table["camp_plot"] = table["tree_id"], table["plot_id"]
    return table


def _crs(text: str) -> pyproj.CRS:
    from ..pointcloud.file_crs import LOCAL_CRS

    return LOCAL_CRS if text == "local" else pyproj.CRS.from_user_input(text)


def twins(plots: list[tuple[str, Path, tuple[float, float, float, float]]]) -> list[tuple[str, str, int]]:
    """Pairs of plots that measured the same trees: ``(plot, plot, trees in both)``.

    plots: plot id, folder, bounds of its trees. Only plots whose bounds meet are read.
    """
    from scipy.spatial import cKDTree
    from shapely import STRtree, box

    from ..inventory.tree_reading import read_trees

    if len(plots) < 2:
        return []
    boxes = [box(b[0] - DUPLICATE_M, b[1] - DUPLICATE_M, b[2] + DUPLICATE_M, b[3] + DUPLICATE_M) for *_, b in plots]
    first, second = STRtree(boxes).query(boxes)
    found = []
    for one, other in zip(first, second, strict=True):
        if one >= other:
            continue
        trees = [read_trees(plots[k][1] / TREES) for k in (one, other)]
        trees = [table[table["dbh_cm"].notna()] for table in trees]
        if not len(trees[0]) or not len(trees[1]):
            continue
        here, there = (table[["x", "y"]].to_numpy(float) for table in trees)
        both = int((cKDTree(there).query(here, distance_upper_bound=DUPLICATE_M)[0] < DUPLICATE_M).sum())
        if both:
            found.append((plots[one][0], plots[other][0], both))
    return found
