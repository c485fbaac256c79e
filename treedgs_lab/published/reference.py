"""The trees that measured ones are held against: field trees of confirmed pairs, or the truth of a simulated plot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.tables import COUNTED
from treedgs_geo.inventory.pairs_layer import PAIRS, line_ends, read_layer


@dataclass(frozen=True)
class Reference:
    """Stems of known DBH. plot, tree: (K,) names. xy: (K, 2) project coordinates of the stem. dbh_cm: (K,)."""

    plot: np.ndarray
    tree: np.ndarray
    xy: np.ndarray
    dbh_cm: np.ndarray

    def __len__(self) -> int:
        return len(self.dbh_cm)

    @classmethod
    def from_truth(cls, path: Path, plot_id: str) -> Reference:
        """In-plot stems of a simulated plot."""
        truth = pd.read_csv(path)
        truth = truth[truth["in_plot"].astype(str).str.lower() == "true"]
        return cls(
            np.full(len(truth), plot_id),
            truth["tree_id"].astype(str).to_numpy(),
            truth[["E_bh", "N_bh"]].to_numpy(float),
            truth["dbh_cm"].to_numpy(float),
        )

    @classmethod
    def from_pairs(cls, path: Path) -> Reference:
        """Field trees with a confirmed pair; a stem stands where its line ends."""
        pairs = read_layer(path, PAIRS)
        pairs = pairs[pairs["pair_status"].isin(COUNTED) & pairs["field_cm"].notna()]
        ends = [line_ends(shape)[1] for shape in pairs.geometry]
        return cls(
            pairs["plot_id"].astype(str).to_numpy(),
            pairs["field_id"].astype(str).to_numpy(),
            np.array(ends, float).reshape(-1, 2),
            pairs["field_cm"].to_numpy(float),
        )


def reference_of(plot: PlotFiles) -> Reference:
    """A plot's stems of known DBH."""
    if plot.pairs is not None:
        return Reference.from_pairs(plot.pairs)
    assert plot.truth is not None
    return Reference.from_truth(plot.truth, plot.name)


def pooled_reference(parts: list[Reference]) -> Reference:
    """The stems of all plots, one after the other."""
    return Reference(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("plot", "tree", "xy", "dbh_cm")))
