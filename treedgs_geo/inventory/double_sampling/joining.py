"""Taped trees and the tree layer that they were drawn from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ...core.errors import InputError
from ...core.shown import some
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
    drawn = taped.trees
    rows = pd.Index(trees["tree_id"].astype(int)).get_indexer(drawn["tree_id"])
    if (rows < 0).any():
        raise InputError(
            f"{taped.path}: tree {drawn['tree_id'][rows < 0].iloc[0]}, which was drawn, is not among the living trees "
            f"of {path}; give the layer that was drawn from, and say what was found there in the tape table (state "
            "none or dead), not in the layer."
        )
    away = np.hypot(*(drawn[["x", "y"]].to_numpy(float) - trees[["x", "y"]].to_numpy(float)[rows]).T)
    if (away > SAME_M).any():
        tree = drawn["tree_id"][away > SAME_M].iloc[0]
        raise InputError(
            f"{taped.path}: tree {tree} stands {away[away > SAME_M][0]:,.1f} m from tree {tree} of {path}; give the "
            "layer that the trees were drawn from."
        )
    dbh = trees["dbh_cm"].to_numpy(float).copy()
    now, then = dbh[rows], drawn["dbh_cm"].to_numpy(float)
    # A table without places does not say what was measured either.
    placed = np.isfinite(drawn["x"].to_numpy(float))
    same = np.isclose(then, now, rtol=0, atol=_SAME_CM, equal_nan=True)
    by_tape = placed & ~same & np.isclose(drawn["taped_cm"], now, rtol=0, atol=_SAME_CM)
    dbh[rows] = np.where(placed & same | by_tape, then, now)
    written = int(by_tape.sum())
    changed = [
        f"tree {drawn['tree_id'].iloc[k]}: {_cm(then[k])} when drawn, {_cm(now[k])} now"
        for k in np.flatnonzero(placed & ~same & ~by_tape)
    ]
    if changed:
        raise InputError(
            f"{path}: {len(changed)} drawn trees have another DBH than when they were drawn "
            f"({some(changed, 3, '; ')}); give the layer that was drawn from, or draw and tape anew."
        )
    notes = []
    if written:
        notes.append(
            f"{written} of the taped DBHs stand in the tree layer too: there the measured ones count, so that the "
            "tapes speak for the trees that were not taped as well."
        )
    return rows, dbh, notes


def _cm(value: float) -> str:
    return f"{value:.1f} cm" if np.isfinite(value) else "no DBH"
