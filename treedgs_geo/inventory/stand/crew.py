"""What the field crew knows of the measured trees, by the pairs layer: species, status, heights, and who is no tree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.errors import InputError
from ...core.shown import count_of, some
from ..pairs_layer import FIELD, LOCKED, MEASURED, PAIRS, PLOTS, STATUSES, read_layer, refuse_moved
from ..reviewed import TAPE_SE_CM
from .species import species_of
from .treelist import TreeList, from_layer, is_dead, settle_status


def measured_trees(path: Path, crs: pyproj.CRS | None, pairs: Path | None, tally: pd.DataFrame | None) -> TreeList:
    """The trees of a layer; species, status and heights as written there, where nothing is written by the crew's.

    Raises:
        InputError: not readable; a pairs layer of other trees, or edited since match-plots wrote it.
    """
    found = from_layer(path, crs)
    if pairs is not None:
        _from_pairs(found, pairs, tally)
    elif tally is not None:
        found.warnings.append(
            "The field table is not used: without --pairs (from match-plots) nothing says which of its trees is which."
        )
    settle_status(found)
    return found


def _from_pairs(found: TreeList, path: Path, tally: pd.DataFrame | None) -> None:
    """Fill in species, status, heights, DBHs of stems without one, co-registered plot centres, and what was tallied.

    What a person wrote in the tree layer stays.

    Raises:
        InputError: a pairs layer of other trees, or edited since match-plots wrote it.
    """
    pairs, crew, plots = read_layer(path, PAIRS), read_layer(path, FIELD), read_layer(path, PLOTS)
    if pairs["pair_status"].isna().any() or set(pairs["pair_status"]) - set(STATUSES):
        raise InputError(f"{path}: a pair has an unknown status or none; run match-plots again onto this file.")
    used = pairs[(pairs["pair_status"] != "rejected") & pairs["tree_id"].notna()]
    rows = {int(tree): k for k, tree in enumerate(found.trees["tree_id"])}
    known = {(str(r["plot_id"]), str(r["field_id"])): r for _, r in crew.iterrows()}
    heights = _heights(plots, tally)
    n_heights, taped, differ = 0, 0, []
    for _, pair in used.iterrows():
        key, row = (str(pair["plot_id"]), str(pair["field_id"])), rows.get(int(pair["tree_id"]))
        if row is None and int(pair["tree_id"]) in found.review.left_out:
            raise InputError(
                f"{path}: pairs tree {int(pair['tree_id'])}, which a person rejected or merged since; run match-plots "
                "again onto this file."
            )
        if row is None:
            raise InputError(
                f"{path}: pairs tree {int(pair['tree_id'])}, which is not in the tree layer; give the layer "
                "that was paired, or run match-plots again."
            )
        if pair.geometry is not None and not pair.geometry.is_empty:
            refuse_moved(path, pair, tuple(found.trees.loc[row, ["x", "y"]]))
        found.trees.loc[row, "paired"] = True
        partner = known.get(key)
        if partner is not None:
            differ += _take(found.trees, row, partner)
            taped += _tape(found.trees, row, partner["dbh_cm"])
        height = heights.get(key, np.nan)
        if pd.isna(found.trees.loc[row, "height_m"]) and pd.notna(height):
            found.trees.loc[row, "height_m"] = height
            n_heights += 1
    found.notes.append(
        f"Species and status of {len(used)} trees come from the field crew, by {path.name}"
        + (f"; {n_heights} heights too." if n_heights else ".")
    )
    if taped:
        found.notes.append(
            f"{count_of(taped, 'stem')} without a measured DBH {'has' if taped == 1 else 'have'} the crew's "
            f"(standard error {TAPE_SE_CM:g} cm)."
        )
    if differ:
        found.warnings.append(
            f"The tree layer and the field crew differ on {len(differ)} entries ({some(differ, 5, '; ')}): the tree "
            "layer's count."
        )
    n_hand = int(used["pair_status"].isin(LOCKED).sum())
    if n_hand:
        found.notes.append(f"Checked or drawn by a person: {n_hand} of these pairs.")
    for _, plot in plots.iterrows():
        if plot["status"] != "check":
            found.centres[str(plot["plot_id"])] = (float(plot["x"]), float(plot["y"]))
    found.tallied = _tallied(read_layer(path, MEASURED), crew, set(found.centres))


def _heights(plots: pd.DataFrame, tally: pd.DataFrame | None) -> dict[tuple[str, str], float]:
    """(plot_id, field_id) -> height, m."""
    if tally is None:
        return {}
    only = plots["plot_id"].iloc[0] if len(plots) == 1 else None
    return {
        (str(r["plot_id"] if r["plot_id"] is not None else only), str(r["field_id"])): r["height_m"]
        for _, r in tally.iterrows()
    }


def _take(trees: pd.DataFrame, row: int, partner: pd.Series) -> list[str]:
    """The crew's species and status where the layer has none; what differs, in words."""
    differ = []
    for name, same in (("species", lambda entry: species_of(entry).symbol.upper()), ("status", is_dead)):
        own, theirs = trees.loc[row, name], partner.get(name)
        if theirs is None or pd.isna(theirs):
            continue
        if own is None:
            trees.loc[row, name] = theirs
        elif same(own) != same(theirs):
            differ.append(f"tree {trees.loc[row, 'tree_id']}: {own}, crew {theirs}")
    return differ


def _tape(trees: pd.DataFrame, row: int, dbh_cm: float) -> bool:
    """The crew's DBH for a stem that has none; whether it was taken."""
    if pd.notna(trees.loc[row, "dbh_cm"]) or not dbh_cm > 0:
        return False
    trees.loc[row, ["dbh_cm", "dbh_se_cm"]] = float(dbh_cm), TAPE_SE_CM
    said = trees.loc[row, "note"]
    trees.loc[row, "note"] = "DBH by the field crew" + ("" if said is None else f"; {said}")
    return True


def _tallied(measured: pd.DataFrame, crew: pd.DataFrame, placed: set[str]) -> dict[str, float]:
    """plot_id -> chance that a tree of the plot would be among its pairs.

    It has to be in the tally (share of the measured trees inside the plot that have a partner), and to be found there
    (share of the tally that has one).
    """
    found = {}
    inside = measured[(measured["in_plot"] == "in") & measured["dbh_cm"].notna()]
    listed = crew[~crew["paired"].isin(["rejected", "unsearched"])]
    for plot in placed:
        mine, theirs = inside[inside["plot_id"] == plot], listed[listed["plot_id"] == plot]
        if len(mine) and len(theirs):
            found[plot] = float((mine["paired"] == "yes").mean() * (theirs["paired"] == "yes").mean())
    return found
