"""The list of trees that tapes are drawn from: every tree of the layer that can count, with its plot."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.columns import columns
from ...core.errors import InputError
from ...core.shown import count_of
from ...core.tables import is_table, read_table
from ..stand.sample import SamplePlot, read_sample
from ..stand.searched_part import as_searched
from ..stand.treelist import from_layer, on_the_map, settle_status
from ..stand.values import BA
from ..tree_reading import read_trees, texts_of


@dataclass
class Frame:
    """trees: ``tree_id, plot_id`` (None: in no plot), ``x, y, dbh_cm, dbh_se_cm, dbh_lo_cm, dbh_hi_cm, qc_flag, bh_m``
    and ``size`` (basal area, m2; of a stem without a DBH the median). plots: where trees are drawn (empty: everywhere).
    """

    trees: pd.DataFrame
    crs: pyproj.CRS
    plots: list[SamplePlot]
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def mark(self) -> str:
        """Short hash of numbers and diameters: whether a layer is still the one that was drawn from."""
        text = ";".join(
            f"{row.tree_id}:{row.dbh_cm:.1f}" for row in self.trees.sort_values("tree_id").itertuples(index=False)
        )
        return hashlib.sha256(text.encode()).hexdigest()[:8]

    def members(self) -> dict[object, int]:
        """Plot -> trees of the frame in it."""
        return self.trees["plot_id"].value_counts().to_dict()


def read_frame(path: Path, crs: pyproj.CRS | None, plots: Path | None) -> Frame:
    """Trees of a layer, without those that are dead; of the plots only, where ``plots`` or the layer name any.

    Raises:
        InputError: not readable, no tree in any plot. CRSError: no CRS, or no projected one in metres.
    """
    path = Path(path)
    found = from_layer(path, crs)
    settle_status(found)
    used = on_the_map(found, path, crs).crs
    assert used is not None
    # Read once more for what a tree list does not keep: the plot and the interval.
    more = _more(path).reindex(found.trees["tree_id"].to_numpy())
    trees = found.trees.assign(
        plot_id=more["plot_id"].to_numpy(object),
        dbh_lo_cm=more["dbh_lo_cm"].to_numpy(float),
        dbh_hi_cm=more["dbh_hi_cm"].to_numpy(float),
    )
    frame = Frame(trees, used, [], found.notes, found.warnings)
    if plots is not None:
        place = trees[["x", "y"]].to_numpy(float)
        frame.plots, warnings, notes = as_searched(read_sample(plots, used), found.searched, place, path.name)
        frame.warnings += warnings
        frame.notes += notes
        trees["plot_id"] = None
        for plot in reversed(frame.plots):
            trees.loc[plot.contains(place[:, 0], place[:, 1]), "plot_id"] = plot.plot_id
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


def _more(path: Path) -> pd.DataFrame:
    """``plot_id, dbh_lo_cm, dbh_hi_cm`` by tree_id."""
    table = read_table(path) if is_table(path) else pd.DataFrame(read_trees(path))
    key = columns(table, "field_id")["field_id"].name
    found = pd.DataFrame(index=pd.to_numeric(table[key]).astype(int))
    plot = table["plot_id"] if "plot_id" in table else pd.Series(None, table.index, dtype=object)
    found["plot_id"] = texts_of(plot).to_numpy(object)
    for name in ("dbh_lo_cm", "dbh_hi_cm"):
        values = pd.to_numeric(table[name], errors="coerce") if name in table else np.nan
        found[name] = np.asarray(values, float) if name in table else np.nan
    return found
