"""The list of trees that tapes are drawn from: every tree of the layer that can count, with its plot."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.errors import InputError
from ...core.shown import count_of
from ..stand.sample import first_plot, read_sample
from ..stand.treelist import TreeList, from_layer, on_the_map, settle_status
from ..stand.values import BA


def mark_of(trees: pd.DataFrame) -> str:
    """Short hash of numbers and diameters: whether a layer is still the one that was drawn from."""
    text = ";".join(f"{row.tree_id}:{row.dbh_cm:.1f}" for row in trees.sort_values("tree_id").itertuples(index=False))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def read_frame(path: Path, crs: pyproj.CRS | None, plots: Path | None) -> TreeList:
    """Trees of a layer, without those that are dead, with their ``size`` (basal area, m2; of a stem without a DBH the
    median); of the plots only, where ``plots`` or the layer name any.

    Raises:
        InputError: not readable, no tree in any plot. CRSError: no CRS, or no projected one in metres.
    """
    path = Path(path)
    frame = from_layer(path, crs)
    settle_status(frame)
    on_the_map(frame, path, crs)
    trees = frame.trees
    if plots is not None:
        frame.plots = frame.plots_searched(read_sample(plots, frame.crs), path.name)
        names = np.array([*(plot.plot_id for plot in frame.plots), None], object)
        trees["plot_id"] = names[first_plot(frame.plots, trees[["x", "y"]].to_numpy(float))]
    inside = trees["plot_id"].notna()
    keep = ~trees["dead"].to_numpy(bool) & (inside | (not inside.any() and plots is None)).to_numpy(bool)
    if not keep.any():
        raise InputError(
            f"{path}: none of its {len(trees)} trees is alive and in a plot; check the plots and their epsg."
        )
    n_out = int((~inside).sum())
    if inside.any() and n_out:
        frame.notes.append(f"Outside the plots, and not drawn from: {count_of(n_out, 'tree')}.")
    n_dead = int(trees["dead"].sum())
    if n_dead:
        frame.notes.append(f"Dead by their status, and not drawn from: {count_of(n_dead, 'tree')}.")
    trees = trees[keep].reset_index(drop=True)
    area = BA * trees["dbh_cm"].to_numpy(float) ** 2
    middle = float(np.nanmedian(area)) if np.isfinite(area).any() else 1.0
    frame.trees = trees.assign(size=np.where(np.isfinite(area), area, middle))
    return frame
