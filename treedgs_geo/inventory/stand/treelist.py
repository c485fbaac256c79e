"""The trees of a stand table: from a tree layer (with what the field crew knows of them), or from a field tally."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ...core.errors import InputError
from ..field_trees import NAMES, FieldProtocol, dbh_in_cm, numbers, read_field_trees, read_table
from ..match import read_measured
from ..pairs_layer import FIELD, LOCKED, PAIRS, PLOTS, SNAP_M, STATUSES, read_layer
from .species import species_of

#: Names of a height column; the unit is its last part.
_HEIGHTS = ("height_m", "height_ft", "ht_m", "ht_ft", "height", "ht")
_LIVE = {"", "live", "l", "alive", "living", "a", "1", "ok", "healthy", "nan", "none"}
_DEAD = {"dead", "d", "snag", "2", "standing dead", "mort", "ds"}
COLUMNS = (
    "tree_id",
    "plot_id",
    "x",
    "y",
    "dbh_cm",
    "dbh_se_cm",
    "height_m",
    "species",
    "dead",
    "qc_flag",
    "qc_reason",
    "bh_m",
)


@dataclass
class TreeList:
    """trees: :data:`COLUMNS` (plot_id from the tally only; x, y may be NaN there). from_field: DBHs are the crew's.

    centres: plot_id -> co-registered centre, from a pairs layer. notes, warnings: sentences.
    """

    trees: pd.DataFrame
    crs: pyproj.CRS | None
    from_field: bool
    centres: dict[str, tuple[float, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def from_layer(path: Path, crs: pyproj.CRS | None, pairs: Path | None, tally: pd.DataFrame | None) -> TreeList:
    """Measured trees; species and status by the pairs layer, heights by the tally where the layer has none.

    Raises:
        InputError: not readable; a pairs layer of other trees, or edited since match-plots wrote it.
    """
    measured = read_measured(path, crs)
    trees = pd.DataFrame({name: measured[name] if name in measured else None for name in COLUMNS})
    for name in ("x", "y", "dbh_cm", "dbh_se_cm", "height_m", "bh_m"):
        trees[name] = pd.to_numeric(trees[name]).astype(float)
    _more_columns(Path(path), trees)
    # A negative standard error is a mark for "not known" somewhere, never an error.
    trees["dbh_se_cm"] = trees["dbh_se_cm"].where(trees["dbh_se_cm"] >= 0)
    trees["height_m"] = trees["height_m"].where(trees["height_m"] > 0)
    trees["plot_id"] = None
    trees["species"] = trees["species"].where(trees["species"].notna(), None)
    trees["dead"] = False
    trees.loc[trees["qc_flag"] == "reject", "dbh_cm"] = np.nan
    trees["qc_flag"] = trees["qc_flag"].where(trees["dbh_cm"].notna(), "reject")
    bad = trees["dbh_cm"].notna() & ~((trees["dbh_cm"] > 0) & (trees["dbh_cm"] < 1000))
    if bad.any():
        raise InputError(
            f"{path}: tree {trees['tree_id'][bad.idxmax()]} has a DBH of {trees['dbh_cm'][bad.idxmax()]:g} cm, "
            "expected above 0 and below 1000; correct the layer."
        )
    found = TreeList(trees, measured.crs, False)
    if pairs is not None:
        _from_pairs(found, pairs, tally)
    elif tally is not None:
        found.warnings.append(
            "The field table is not used: without --pairs (from match-plots) nothing says which of its trees is which."
        )
    return found


def _more_columns(path: Path, trees: pd.DataFrame) -> None:
    """What a CSV of measured trees may hold beside DBH and place: species, height_m, qc_reason."""
    if path.suffix.lower() != ".csv":
        return
    table = read_table(path)
    for name in ("species", "qc_reason"):
        if name in table:
            trees[name] = table[name].astype(object).where(table[name].notna(), None)
    if "height_m" in table:
        trees["height_m"] = numbers(path, table, "height_m", required=False)


def from_tally(path: Path, protocol: FieldProtocol, height_unit: str) -> TreeList:
    """The crew's own tally as the tree list.

    Raises:
        InputError: as :func:`read_tally`.
    """
    table = read_tally(path, protocol, height_unit)
    trees = pd.DataFrame({name: table[name] if name in table else None for name in COLUMNS})
    for name in ("x", "y", "dbh_cm", "dbh_se_cm", "height_m", "bh_m"):
        trees[name] = pd.to_numeric(trees[name]).astype(float)
    trees["tree_id"] = table["field_id"].astype(str)
    trees["qc_flag"] = np.where(trees["dbh_cm"].notna(), "ok", "reject")
    trees["qc_reason"] = ""
    found = TreeList(trees, None, True)
    _statuses(found, table["status"])
    found.trees["azimuth_deg"] = table.get("azimuth_deg")
    found.trees["distance_m"] = table.get("distance_m")
    return found


def read_tally(path: Path, protocol: FieldProtocol, height_unit: str = "auto") -> pd.DataFrame:
    """The field table as :func:`~treedgs_geo.inventory.field_trees.read_field_trees` reads it, with ``height_m``.

    A table without positions (no bearing and distance, no coordinates) is read too: it needs ``plot_id, tree_id`` and a
    DBH column.

    Raises:
        InputError: file, line, what was found and what was expected.
    """
    path = Path(path)
    table = read_table(path)
    if {*NAMES["azimuth"], *NAMES["x"]} & set(table.columns):
        found = read_field_trees(path, protocol)
    else:
        found = pd.DataFrame({"dbh_cm": dbh_in_cm(path, table, protocol.dbh_unit)})
        for key in ("plot_id", "field_id", "status", "species"):
            column = next((other for other in NAMES[key] if other in table), None)
            values = table[column].astype(object) if column else pd.Series([None] * len(table), dtype=object)
            found[key] = values.where(values.notna(), None)
        if found["field_id"].isna().all():
            found["field_id"] = [str(k + 1) for k in range(len(found))]
        if found["field_id"].isna().any() or found.duplicated(["plot_id", "field_id"]).any():
            raise InputError(f"{path}: a tree_id is empty or appears twice in its plot; number every tree of a plot.")
    name = next((other for other in _HEIGHTS if other in table), None)
    found["height_m"] = np.nan
    if name:
        unit = name.rpartition("_")[2] if "_" in name else height_unit
        if unit not in ("m", "ft"):
            raise InputError(
                f"{path}: column {name!r} does not say its unit; rename it height_m or height_ft, or give "
                "--height-unit."
            )
        heights = numbers(path, table, name, required=False) * (0.3048 if unit == "ft" else 1.0)
        # Nobody measures a height of 0: tables write it for "not measured".
        found["height_m"] = heights.where(heights > 0)
        tall = found["height_m"] > 120
        if tall.any():
            raise InputError(
                f"{path}, line {int(np.flatnonzero(tall)[0]) + 2}: a height of {found['height_m'][tall].iloc[0]:.0f} "
                "m, expected up to 120; name the right unit in the column's name or with --height-unit."
            )
    return found


def _from_pairs(found: TreeList, path: Path, tally: pd.DataFrame | None) -> None:
    """Species, status, heights and co-registered plot centres, for the trees that have a partner."""
    pairs, crew, plots = read_layer(path, PAIRS), read_layer(path, FIELD), read_layer(path, PLOTS)
    if pairs["pair_status"].isna().any() or set(pairs["pair_status"]) - set(STATUSES):
        raise InputError(f"{path}: a pair has an unknown status or none; run match-plots again onto this file.")
    used = pairs[(pairs["pair_status"] != "rejected") & pairs["tree_id"].notna()]
    rows = {int(tree): k for k, tree in enumerate(found.trees["tree_id"])}
    known = {(str(r["plot_id"]), str(r["field_id"])): r for _, r in crew.iterrows()}
    heights = {}
    if tally is not None:
        only = plots["plot_id"].iloc[0] if len(plots) == 1 else None
        heights = {
            (str(r["plot_id"] if r["plot_id"] is not None else only), str(r["field_id"])): r["height_m"]
            for _, r in tally.iterrows()
        }
    status = pd.Series([None] * len(found.trees), dtype=object)
    n_heights = 0
    for _, pair in used.iterrows():
        key, row = (str(pair["plot_id"]), str(pair["field_id"])), rows.get(int(pair["tree_id"]))
        if row is None:
            raise InputError(
                f"{path}: pairs tree {int(pair['tree_id'])}, which is not in the tree layer; give the layer "
                "that was paired, or run match-plots again."
            )
        _refuse_stale(path, pair, found.trees.iloc[row])
        partner = known.get(key)
        if partner is not None:
            found.trees.loc[row, "species"] = partner.get("species") or found.trees.loc[row, "species"]
            status[row] = partner.get("status")
        height = heights.get(key, np.nan)
        if pd.isna(found.trees.loc[row, "height_m"]) and pd.notna(height):
            found.trees.loc[row, "height_m"] = height
            n_heights += 1
    _statuses(found, status)
    found.notes.append(
        f"Species and status of {len(used)} trees come from the field crew, by {path.name}"
        + (f"; {n_heights} heights too." if n_heights else ".")
    )
    n_hand = int(used["pair_status"].isin(LOCKED).sum())
    if n_hand:
        found.notes.append(f"Checked or drawn by a person: {n_hand} of these pairs.")
    for _, plot in plots.iterrows():
        if plot["status"] != "check":
            found.centres[str(plot["plot_id"])] = (float(plot["x"]), float(plot["y"]))


def _refuse_stale(path: Path, pair: gpd.GeoSeries, tree: pd.Series) -> None:
    """A line that was dragged elsewhere since match-plots wrote it means another tree than its tree_id says."""
    line = pair.geometry
    if line is None or line.is_empty:
        return
    end = np.asarray(line.coords if line.geom_type == "LineString" else line.geoms[0].coords)[-1]
    if np.hypot(end[0] - tree["x"], end[1] - tree["y"]) > SNAP_M:
        raise InputError(
            f"{path}: the line of field tree {pair['plot_id']}/{pair['field_id']} does not end at tree "
            f"{int(pair['tree_id'])}; run match-plots again onto this file, which reads the edit in."
        )


def _statuses(found: TreeList, status: pd.Series) -> None:
    """Mark dead trees; unknown words count as live and are named."""
    words = status.map(lambda value: "" if value is None or pd.isna(value) else str(value).strip().lower())
    found.trees["dead"] = words.isin(_DEAD).to_numpy()
    odd = sorted(set(words) - _LIVE - _DEAD)
    if odd:
        found.warnings.append(
            f"The status {', '.join(map(repr, odd[:5]))} is not known as live or dead; these trees count as live."
        )


def label_species(trees: pd.DataFrame, default: str | None) -> pd.DataFrame:
    """Replace the entries by symbols; ``default`` where there is none."""
    named = trees.copy()
    filled = named["species"].where(named["species"].notna(), default)
    named["species"] = [species_of(entry).symbol for entry in filled]
    return named
