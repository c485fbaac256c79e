"""Volume of stems to a top diameter from their measured curves (``sections`` of the tree layer), where long enough."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ...core.layer_files import read_if_there
from ..side_layers import SECTIONS

#: Columns of trees.
CURVES = ("stem_m3", "stem_se_m3")
#: Height of the stump, m; the lowest section may lie this high, and sections this far apart.
STUMP_M, LOWEST_M, GAP_M = 0.3, 1.0, 2.0
#: A curve that does not reach the top diameter is continued to the tip of a tree of known height from this share of it,
#: d ~ (tip - h)^p, between a cone (1) and a paraboloid (0.5); error of the volume so continued, share.
LONG, POWER, TOP_SE = 0.5, 0.75, 0.2


def stem_volume(
    heights_m: np.ndarray, d_cm: np.ndarray, se_cm: np.ndarray, height_m: float, top_cm: float
) -> tuple[float, float]:
    """m3 of a stem from its stump to where it is ``top_cm`` thick, and its standard error (what the sections share is
    not averaged out). (NaN, NaN) where the curve is not long enough.

    heights_m, d_cm, se_cm: (S,) sections, upwards. height_m: of the tree, NaN unknown.
    """
    none = np.nan, np.nan
    if len(heights_m) < 3 or heights_m[0] > LOWEST_M or np.diff(heights_m).max() > GAP_M or d_cm[0] <= top_cm:
        return none
    h, d, se = np.r_[STUMP_M, heights_m], np.r_[d_cm[0], d_cm], np.r_[se_cm[0], se_cm]
    measured = len(h)
    if d.min() > top_cm:
        if not np.isfinite(height_m) or h[-1] < LONG * height_m or h[-1] >= height_m:
            return none
        more = np.linspace(h[-1], height_m, 40)[1:]
        h = np.r_[h, more]
        d = np.r_[d, d[-1] * ((height_m - more) / (height_m - heights_m[-1])) ** POWER]
        se = np.r_[se, np.zeros(len(more))]
    thin = int(np.argmax(d <= top_cm))
    share = (d[thin - 1] - top_cm) / (d[thin - 1] - d[thin])
    h = np.r_[h[:thin], h[thin - 1] + share * (h[thin] - h[thin - 1])]
    d, se = np.r_[d[:thin], top_cm], se[: thin + 1]
    length = np.diff(h)
    part = np.pi / 12 * 1e-4 * length * (d[:-1] ** 2 + d[:-1] * d[1:] + d[1:] ** 2)
    error = np.pi / 4 * 1e-4 * length * (d[:-1] * se[:-1] + d[1:] * se[1:])
    continued = part[max(measured - 1, 0) :].sum()
    return float(part.sum()), float(np.hypot(error.sum(), TOP_SE * continued))


def add_stem_volumes(trees: pd.DataFrame, layer: Path, top_cm: float) -> str:
    """Fill ``stem_m3`` and ``stem_se_m3`` of the trees that are as thick as the layer's sections say; returns a
    sentence on how many, empty where the layer has no sections (and the table then no such columns)."""
    columns = ["height_m", "d_cm", "d_se_cm"]
    if (table := read_if_there(layer, SECTIONS, ["tree_id", *columns])) is None:
        return ""
    trees[list(CURVES)] = np.nan
    of_tree = {int(tree): rows[columns] for tree, rows in table.sort_values("height_m").groupby("tree_id")}
    ids = pd.to_numeric(trees["tree_id"], errors="coerce")
    for row in trees.index[ids.notna() & ~ids.duplicated(keep=False) & trees["dbh_cm"].notna()]:
        own = of_tree.get(int(ids[row]))
        if own is None:
            continue
        heights, widths, errors = own.to_numpy(float).T
        # A person's tape or another tree's number: the curve is not this tree's.
        bh_m = trees.loc[row, "bh_m"] if pd.notna(trees.loc[row, "bh_m"]) else 1.37
        if abs(np.interp(bh_m, heights, widths) / trees.loc[row, "dbh_cm"] - 1) > 0.15:
            continue
        top_m = float(trees.loc[row, "height_m"])
        trees.loc[row, list(CURVES)] = stem_volume(heights, widths, errors, top_m, top_cm)
    return (
        f"Stem volume to {top_cm:g} cm top diameter by measured stem curves: {int(trees['stem_m3'].notna().sum())} of "
        f"{int(trees['dbh_cm'].notna().sum())} trees (trees table)."
    )
