"""Taped trees and the tree layer that they were drawn from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ...core.errors import InputError
from .tapes import SAME_M, Taped

#: Diameters that differ by no more are the same number, written with fewer digits, cm.
_SAME_CM = 0.06


def join(trees: pd.DataFrame, taped: Taped, path: Path) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Which rows of ``trees`` (``tree_id, x, y, dbh_cm``) were drawn.

    Returns:
        (n,) row of each drawn tree; the DBHs of all trees as they were when drawn (a tape that somebody wrote into the
        layer since would make the drawn trees right and leave the others wrong, and the correction would be lost);
        sentences.

    Raises:
        InputError: a drawn tree is not in the layer, stands elsewhere, or was measured anew.
    """
    rows = {int(tree): k for k, tree in enumerate(trees["tree_id"])}
    dbh = trees["dbh_cm"].to_numpy(float).copy()
    found, written, changed = [], 0, []
    for tree in taped.trees.itertuples():
        row = rows.get(int(tree.tree_id))
        if row is None:
            raise InputError(
                f"{taped.path}: tree {tree.tree_id}, which was drawn, is not among the living trees of {path}; give "
                "the layer that was drawn from, and say what was found there in the tape table (state none or dead), "
                "not in the layer."
            )
        away = np.hypot(tree.x - trees["x"].iloc[row], tree.y - trees["y"].iloc[row])
        if away > SAME_M:
            raise InputError(
                f"{taped.path}: tree {tree.tree_id} stands {away:,.1f} m from tree {tree.tree_id} of {path}; give the "
                "layer that the trees were drawn from."
            )
        found.append(row)
        if not np.isfinite(tree.x):
            continue
        same = np.isclose(tree.dbh_cm, dbh[row], rtol=0, atol=_SAME_CM, equal_nan=True)
        if same:
            dbh[row] = tree.dbh_cm
            continue
        if np.isclose(tree.taped_cm, dbh[row], rtol=0, atol=_SAME_CM):
            dbh[row], written = tree.dbh_cm, written + 1
        else:
            changed.append(f"tree {tree.tree_id}: {_cm(tree.dbh_cm)} when drawn, {_cm(dbh[row])} now")
    if changed:
        raise InputError(
            f"{path}: {len(changed)} drawn trees have another DBH than when they were drawn ({'; '.join(changed[:3])}"
            f"{'; …' if len(changed) > 3 else ''}); give the layer that was drawn from, or draw and tape anew."
        )
    notes = []
    if written:
        notes.append(
            f"{written} of the taped DBHs stand in the tree layer too: there the measured ones count, so that the "
            "tapes speak for the trees that were not taped as well."
        )
    return np.array(found, int), dbh, notes


def _cm(value: float) -> str:
    return f"{value:.1f} cm" if np.isfinite(value) else "no DBH"
