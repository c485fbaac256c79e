"""The plots of one evaluation: their files, and what was measured there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ...core.errors import InputError
from ...core.tables import read_table
from ..reviewed import reviewed
from ..tree_reading import read_trees
from .tables import PairsEvidence, evidence_from_pairs, evidence_from_truth

#: Columns of the table of plots that hold paths.
FILES = ("pairs", "trees", "truth", "lidar", "splats", "dtm", "workspace_in")


@dataclass(frozen=True)
class PlotFiles:
    """Files of one plot, or of several in one pairs layer.

    pairs: layer of match-plots; or trees and truth: a tree layer and ``truth/trees.csv`` of a simulated plot. lidar,
    splats: clouds (with ``tree_id`` they count as segmented). dtm: their terrain. workspace_in: of photos-to-dbh.
    plot_id: name in the tables; empty: that of the pairs, or the simulated plot's folder.
    """

    plot_id: str = ""
    pairs: Path | None = None
    trees: Path | None = None
    truth: Path | None = None
    lidar: Path | None = None
    splats: Path | None = None
    dtm: Path | None = None
    workspace_in: Path | None = None

    @property
    def has_experiments(self) -> bool:
        """Whether there is more than a layer of trees."""
        return any((self.lidar, self.splats, self.workspace_in))

    @property
    def scored(self) -> list[Path]:
        """The files that trees and reference come from."""
        return [path for path in (self.pairs, self.trees, self.truth) if path is not None]

    @property
    def name(self) -> str:
        """What the plot is called where its files do not say so."""
        if self.plot_id or self.truth is None:
            return self.plot_id or "plot"
        return self.truth.resolve().parent.parent.name if self.truth.parent.name == "truth" else "plot"

    def check(self, what: str) -> None:
        """Refuse a plot without reference, or with two; what: for the sentence."""
        if (self.pairs is None) == (self.trees is None) or (self.trees is None) != (self.truth is None):
            raise InputError(f"{what}: give either pairs (from match-plots), or both trees and truth (simulated plot).")

    def evidence(self, min_dbh_cm: float) -> PairsEvidence:
        """What was measured beside what is true."""
        if self.pairs is not None:
            return evidence_from_pairs(self.pairs, min_dbh_cm)
        assert self.trees is not None and self.truth is not None
        trees, _ = reviewed(read_trees(self.trees), self.trees)
        return evidence_from_truth(trees, self.truth, self.name)


def read_plot_files(path: Path) -> list[PlotFiles]:
    """Read a CSV with a row a plot; columns: ``plot_id`` and :data:`FILES`, paths from the folder of the CSV.

    Raises:
        InputError: unknown or missing columns, no rows, a plot twice, a file that is not there.
    """
    table = read_table(path)
    if unknown := [name for name in table if name not in ("plot_id", *FILES)]:
        raise InputError(f"{path}: columns {', '.join(unknown)} found, expected plot_id, {', '.join(FILES)}.")
    found = [_plot_of(path, line, row.dropna()) for line, row in table.iterrows()]
    names = [plot.name for plot in found if plot.pairs is None]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: plot {name!r} is in two rows; give each its own plot_id.")
    return found


def _plot_of(path: Path, line: object, row: pd.Series) -> PlotFiles:
    given = {name: path.parent / row[name] for name in FILES if row.get(name)}
    for name, file in given.items():
        if not file.exists():
            raise InputError(f"{path}, line {line}: {name} {row[name]} is not there; paths count from the table.")
    plot = PlotFiles(plot_id=str(row.get("plot_id") or ""), **given)
    plot.check(f"{path}, line {line}")
    return plot


def pooled_evidence(parts: list[PairsEvidence]) -> PairsEvidence:
    """All plots as one.

    Raises:
        InputError: two plots of one name, or field and true diameters mixed.
    """
    kinds = sorted({part.reference for part in parts})
    if len(kinds) > 1:
        raise InputError(f"The plots have different references ({' and '.join(kinds)}): evaluate them one by one.")
    false: dict[str, int] = {}
    seen: set[str] = set()
    for part in parts:
        own = set(part.trees["plot_id"].astype(str))
        if both := sorted(own & seen):
            raise InputError(f"Plot {both[0]!r} is in two of the layers: give each plot once.")
        seen |= own
        false |= part.n_false
    notes = list(dict.fromkeys(note for part in parts for note in part.notes))
    trees = pd.concat([part.trees for part in parts], ignore_index=True)
    return PairsEvidence(trees, false, kinds[0], notes)
