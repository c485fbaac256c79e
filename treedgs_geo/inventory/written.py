"""What a person wrote beside the measured trees (species, status, note): it outlives the layer of one run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from scipy.spatial import cKDTree

from ..core.errors import InputError
from ..core.progress import Reporter
from ..core.tables import plain_cell
from .tree_reading import read_trees

#: Columns of a tree layer that are a person's.
COLUMNS = ("species", "status", "note")
#: An entry belongs to the tree within this distance of the one it was written for.
ENTRY_M = 0.5


@dataclass
class Written:
    """entries: ``tree_id, x, y`` and :data:`COLUMNS` of the trees that have any, in ``crs``. kept: which found their
    tree again."""

    path: Path
    entries: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=["tree_id", "x", "y", *COLUMNS]))
    crs: pyproj.CRS | None = None
    kept: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))

    def fill(self, table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        """The tree table with each entry at the nearest tree within :data:`ENTRY_M`, one tree an entry."""
        if not len(self.entries) or not len(table):
            return table
        there = self.entries[["x", "y"]].to_numpy(float)
        tied = [crs is not None and crs.geodetic_crs is not None for crs in (self.crs, table.crs)]
        if all(tied) and self.crs != table.crs:
            there = np.column_stack(
                pyproj.Transformer.from_crs(self.crs, table.crs, always_xy=True).transform(there[:, 0], there[:, 1])
            )
        here = table[["x", "y"]].to_numpy(float)
        if not np.isfinite(there).all():
            return table
        near = cKDTree(here).query_ball_point(there, ENTRY_M)
        pairs = [(float(np.hypot(*(here[j] - there[k]))), k, j) for k, found in enumerate(near) for j in found]
        table, taken = table.copy(), set()
        for _, k, j in sorted(pairs):
            if self.kept[k] or j in taken:
                continue
            taken.add(j)
            self.kept[k] = True
            for name in COLUMNS:
                if self.entries[name].iloc[k] is not None:
                    table.iloc[j, table.columns.get_loc(name)] = self.entries[name].iloc[k]
        return table

    def report(self, reporter: Reporter | None) -> None:
        """Say what was kept, and what found no tree again."""
        if reporter is None or not len(self.entries):
            return
        n = int(self.kept.sum())
        if n:
            reporter.info(
                f"{self.path.name}: species, status or note that a person wrote at {n} tree{'' if n == 1 else 's'} "
                f"{'is' if n == 1 else 'are'} kept (nearest tree within {ENTRY_M:g} m)."
            )
        lost = self.entries[~self.kept]
        if len(lost):
            named = [
                f"{row.tree_id} at {row.x:.1f} {row.y:.1f} "
                f"({', '.join(str(getattr(row, name)) for name in COLUMNS if getattr(row, name) is not None)})"
                for row in lost.head(5).itertuples()
            ]
            reporter.warn(
                f"{self.path.name}: no tree stands within {ENTRY_M:g} m any more of {len(lost)} for which a person "
                f"wrote a species, status or note: {'; '.join(named)}{'; …' if len(lost) > 5 else ''}; what was "
                "written there is not in the new layer."
            )


def read_written(path: Path) -> Written:
    """What a person wrote into the layer that ``path`` holds now; nothing where there is none, or no tree layer."""
    path = Path(path)
    if not path.is_file():
        return Written(path)
    try:
        if path.suffix.lower() == ".csv":
            table, crs = pd.read_csv(path, dtype=str).map(plain_cell), None
            table[["x", "y"]] = table[["x", "y"]].apply(pd.to_numeric)
        else:
            layer = read_trees(path)
            crs = layer.crs
            table = pd.DataFrame(layer.drop(columns="geometry")).assign(x=layer.geometry.x, y=layer.geometry.y)
    except (InputError, OSError, ValueError, KeyError):
        return Written(path)
    found = pd.DataFrame({name: table.get(name) for name in ("tree_id", "x", "y", *COLUMNS)})
    for name in COLUMNS:
        text = found[name].map(lambda value: "" if pd.isna(value) else str(value).strip()).astype(object)
        found[name] = text.where(text != "", None)
    found = found[found[[*COLUMNS]].notna().any(axis=1) & found["x"].notna() & found["y"].notna()]
    return Written(path, found.reset_index(drop=True), crs, np.zeros(len(found), bool))
