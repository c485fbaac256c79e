"""The pairs as an editable layer: what the computer proposes, what a person locked, and every tree left single."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from shapely.geometry import LineString

from ..core import layer_files
from ..core.errors import InputError
from ..core.geopackage import atomic_geopackage
from .tree_reading import text_of

#: Layers inside ``pairs.gpkg``.
PAIRS, SUGGESTED, FIELD, MEASURED, PLOTS = "pairs", "suggested", "field_trees", "measured_trees", "plots"
#: The columns by which a layer of that name is known as ours.
OWN_LAYERS = {
    PAIRS: frozenset({"plot_id", "field_id", "tree_id", "field_cm", "dbh_cm", "pair_status"}),
    SUGGESTED: frozenset({"field_id", "tree_id", "pair_status"}),
    FIELD: frozenset({"plot_id", "field_id", "dbh_cm"}),
    MEASURED: frozenset({"tree_id", "dbh_cm", "paired", "in_plot"}),
    PLOTS: frozenset({"plot_id", "status", "offset_e_m", "n_pairs"}),
}
STATUSES = ("auto", "ok", "moved", "rejected")
LOCKED = ("ok", "moved", "rejected")
#: Columns of ``pairs`` and ``suggested`` (docs/technician/pairing.md).
PAIR_COLUMNS = (
    "plot_id", "field_id", "tree_id", "field_cm", "dbh_cm", "delta_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag", "meas_cm",
    "rev_flag", "dist_m", "margin", "pair_status", "note",
)  # fmt: skip
_TEXTS = {"plot_id", "field_id", "qc_flag", "rev_flag", "pair_status", "note"}
#: Columns of ``plots``.
PLOT_COLUMNS = (
    "plot_id", "status", "reason", "offset_e_m", "offset_n_m", "rot_deg", "ratio", "margin", "residual_m", "share",
    "n_field", "n_measured", "n_pairs", "n_sugg", "radius_m", "x", "y",
)  # fmt: skip
#: A line's end belongs to the tree within this distance of it.
SNAP_M = 0.5


@dataclass
class Locked:
    """What a person decided in an earlier version of the file.

    pairs: rows of ``pairs`` with a locked status and both ends' coordinates ``fx, fy, mx, my``. plots: plot_id ->
    (offset_e, offset_n, rotation_deg) of plots whose status a person set to ``ok``. field_xy: drawn positions of field
    trees, (plot_id, field_id) -> (x, y).
    """

    pairs: list[dict] = field(default_factory=list)
    plots: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    field_xy: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)


@dataclass
class Matched:
    """Everything that goes into ``pairs.gpkg``, and sentences for the user.

    pairs, suggested: dicts of :data:`PAIR_COLUMNS` with ``line`` ((fx, fy), (mx, my)). field_trees: with ``x, y`` where
    the tree is drawn (co-registered), ``x_field, y_field`` as surveyed, ``paired``. measured: points with ``paired``.
    plots: dicts of :data:`PLOT_COLUMNS`, ``x, y`` the co-registered centre.
    """

    pairs: list[dict]
    suggested: list[dict]
    field_trees: pd.DataFrame
    measured: gpd.GeoDataFrame
    plots: list[dict]
    warnings: list[str]


def write_pairs(path: Path, found: Matched, crs: pyproj.CRS) -> Path:
    """Write the GeoPackage whole or not at all, styled; an existing one keeps its place, even while QGIS shows it.

    Raises:
        InputError: not a .gpkg name. OutputError: the file is locked by an edit session, or cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".gpkg":
        raise InputError(
            f"{path}: ends in {path.suffix!r}, expected .gpkg (the pairs are several layers); rename the output."
        )
    with atomic_geopackage(path, OWN_LAYERS) as temporary:
        for name, rows in ((PAIRS, found.pairs), (SUGGESTED, found.suggested)):
            table = layer_files.typed(pd.DataFrame(rows, columns=list(PAIR_COLUMNS)), {"tree_id"}, _TEXTS, {}, 3)
            shapes = gpd.GeoSeries([LineString(row["line"]) for row in rows], crs=crs)
            layer_files.add_layer(temporary, name, gpd.GeoDataFrame(table, geometry=shapes, crs=crs), "LineString")
        field = found.field_trees
        points = gpd.GeoDataFrame(field, geometry=gpd.points_from_xy(field["x"], field["y"]), crs=crs)
        layer_files.add_layer(temporary, FIELD, points, "Point")
        layer_files.add_layer(temporary, MEASURED, found.measured)
        table = pd.DataFrame(found.plots, columns=list(PLOT_COLUMNS))
        circles = gpd.GeoSeries.from_xy(table["x"], table["y"]).buffer(table["radius_m"], 32)
        layer_files.add_layer(temporary, PLOTS, gpd.GeoDataFrame(table, geometry=circles, crs=crs), "Polygon")
    return path


def read_layer(path: Path, layer: str) -> gpd.GeoDataFrame:
    """One layer of a pairs file (:func:`treedgs_geo.core.layer_files.read_layer`)."""
    return layer_files.read_layer(path, layer, OWN_LAYERS[layer], "match-plots")


def line_ends(shape: Any) -> np.ndarray:
    """(2, 2): where a pair's line begins, at the field tree, and where it ends, at the measured one."""
    return np.asarray(getattr(shape, "geoms", [shape])[0].coords)[[0, -1], :2]


def refuse_moved(path: Path, pair: pd.Series, place: tuple[float, float]) -> None:
    """Refuse a line that was dragged elsewhere since match-plots wrote it: it means another tree than its tree_id says.

    place: of that tree.
    """
    end = line_ends(pair.geometry)[1]
    if np.hypot(end[0] - place[0], end[1] - place[1]) > SNAP_M:
        raise InputError(
            f"{path}: the line of field tree {pair['plot_id']}/{pair['field_id']} no longer ends at tree "
            f"{int(pair['tree_id'])}; run match-plots again onto this file, which reads the edit in."
        )


def read_locked(path: Path) -> Locked:
    """What a person locked in an existing output; empty where there is none.

    Raises:
        InputError: the file is there but is no pairs file (it is not overwritten), or holds an unknown status.
    """
    path = Path(path)
    locked = Locked()
    if not path.exists():
        return locked
    table = read_layer(path, PAIRS)
    unknown = sorted(set(table["pair_status"].dropna()) - set(STATUSES))
    if unknown:
        raise InputError(f"{path}: pair_status {unknown[0]!r} is unknown, expected {', '.join(STATUSES)}; correct it.")
    for _, row in table.iterrows():
        drawn = pd.isna(row["pair_status"])  # a line that a person drew and left without a status
        if not drawn and row["pair_status"] not in LOCKED or row.geometry is None or row.geometry.is_empty:
            continue
        locked.pairs.append(
            {
                **{name: text_of(row.get(name)) or None for name in ("plot_id", "field_id", "note")},
                "tree_id": None if pd.isna(row["tree_id"]) else int(row["tree_id"]),
                "pair_status": "moved" if drawn else row["pair_status"],
                **dict(zip(("fx", "fy", "mx", "my"), line_ends(row.geometry).ravel(), strict=True)),
            }
        )
    for _, row in read_layer(path, PLOTS).iterrows():
        if row["status"] == "ok" and pd.notna(row["offset_e_m"]) and pd.notna(row["offset_n_m"]):
            turn = row["rot_deg"] if pd.notna(row["rot_deg"]) else 0.0
            locked.plots[str(row["plot_id"])] = (float(row["offset_e_m"]), float(row["offset_n_m"]), float(turn))
    for _, row in read_layer(path, FIELD).iterrows():
        if row.geometry is not None:
            locked.field_xy[(str(row["plot_id"]), str(row["field_id"]))] = (row.geometry.x, row.geometry.y)
    return locked
