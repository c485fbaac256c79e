"""What a person wrote beside the measured trees (species, status, note, decisions, columns and trees of his own)
outlives the layer of one run."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
from scipy.spatial import cKDTree

from ..core.errors import InputError
from ..core.files import free_name
from ..core.frames import moved
from ..core.progress import Reporter
from ..core.shown import count_of, some
from ..core.tables import read_rows, write_csv
from ..stems.quality.tree import TREE_FIELDS
from .reviewed import A_TREE
from .reviewed import COLUMNS as DECIDED
from .tree_reading import plain_flags, read_trees, texts_of

#: Columns of a tree layer that are a person's, beside the decisions.
COLUMNS = ("species", "status", "note")
#: Columns that a campaign's layer has beside those of a tree layer.
CAMPAIGN = ("plot_tree", "camp_plot")
#: An entry belongs to the tree within this distance of the one it was written for.
ENTRY_M = 0.5
_NUMBERS = ("x", "y", "z_ground", "dbh_cm", "bh_m", "rev_dbh_cm")


@dataclass
class Written:
    """entries: ``tree_id`` (text; empty for a tree that a person drew), ``plot_id, x, y, z_ground, dbh_cm, bh_m``,
    :data:`COLUMNS`, the decision's columns and ``own`` of the trees that have any, in ``crs``. own: columns that a
    person added. places: tree_id -> (x, y) of all trees. kept: which entries found their tree again. sentences:
    sentences about decisions that did not stay as they were. unread: why nothing could be read of a file that holds
    something."""

    path: Path
    entries: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=["tree_id", "x", "y", *COLUMNS]))
    crs: pyproj.CRS | None = None
    places: dict[str, tuple[float, float]] = field(default_factory=dict)
    kept: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    sentences: list[str] = field(default_factory=list)
    own: list[str] = field(default_factory=list)
    unread: str = ""

    def into(self, table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        """The tree table with each entry at the nearest tree within :data:`ENTRY_M`, one tree an entry; and rows for
        trees that a person says stand there and that found no tree again."""
        if not len(self.entries):
            return table
        there = self._moved(self.entries[["x", "y"]].to_numpy(float), table.crs)
        here, known = table[["x", "y"]].to_numpy(float), np.flatnonzero(np.isfinite(there).all(axis=1))
        near = cKDTree(here).query_ball_point(there[known], ENTRY_M) if len(here) else []
        pairs = [
            (float(np.hypot(*(here[j] - there[k]))), k, j)
            for k, found in zip(known.tolist(), near, strict=False)
            for j in found
        ]
        table, taken = table.copy(), dict[int, int]()
        for _, k, j in sorted(pairs):
            if self.kept[k] or j in taken:
                continue
            taken[j] = k
            self.kept[k] = True
            entry = self.entries.iloc[k]
            values = {name: entry[name] for name in COLUMNS if entry[name] is not None}
            if entry[["rev_at", "rev_flag", "rev_dbh_cm"]].notna().any():
                found, said = carried_decision(entry, table.iloc[j], self._new_id(entry["rev_note"], table))
                values |= found
                self.sentences += [said] if said else []
            for name, value in values.items():
                table.iloc[j, table.columns.get_loc(name)] = value
        rows = [taken.get(j, -1) for j in range(len(table))]
        for name in (name for name in self.own if name not in table):
            table.insert(
                table.columns.get_loc("geometry"), name, self.entries[name].reindex(rows).set_axis(table.index)
            )
        added, numbers = [], set(table["tree_id"])
        for k in map(int, np.flatnonzero(~self.kept & np.isfinite(there).all(axis=1))):
            entry = self.entries.iloc[k]
            if entry["rev_flag"] not in A_TREE and pd.isna(entry["rev_dbh_cm"]) and entry["tree_id"]:
                continue
            own = int(entry["tree_id"] or 0)
            number = own if own and own not in numbers else max(numbers, default=0) + 1
            numbers.add(number)
            self.kept[k] = True
            added.append(kept_place(entry, number, *there[k].tolist()) | {name: entry[name] for name in self.own})
        if not added:
            return table
        self.sentences.append(
            f"{count_of(len(added), 'place')} where a person says that a tree stands gave no tree "
            "in this run: kept in the layer without a measured DBH (not_found), as tree "
            f"{some((row['tree_id'] for row in added), 10)}."
        )
        made = pd.DataFrame(added).reindex(columns=[name for name in table if name != "geometry"])
        made = made.astype({name: kind for name, kind in table.dtypes.items() if name != "geometry"})
        points = gpd.points_from_xy(made["x"], made["y"], made["z_ground"].fillna(0.0))
        return pd.concat([table, gpd.GeoDataFrame(made, geometry=points, crs=table.crs)], ignore_index=True)

    def report(self, reporter: Reporter | None) -> None:
        """Say what was kept, and what found no tree again."""
        if reporter is None or not len(self.entries):
            return
        n = int(self.kept.sum())
        if n:
            reporter.info(
                f"{self.path.name}: what a person wrote ({', '.join(('species, status, note, decisions', *self.own))}) "
                f"at {count_of(n, 'tree')} is kept (nearest tree within {ENTRY_M:g} m)."
            )
        for sentence in self.sentences:
            reporter.warn(f"{self.path.name}: {sentence}")
        lost = self.entries[~self.kept]
        if len(lost):
            said = (*COLUMNS, "rev_flag", "rev_dbh_cm", "rev_note", *self.own)
            named = [
                f"{row['tree_id']} at {row['x']:.1f} {row['y']:.1f} ({', '.join(map(str, row[[*said]].dropna()))})"
                for _, row in lost.iterrows()
            ]
            kept = free_name(self.path.with_name(f"{self.path.stem}.lost.csv"))
            write_csv(kept, lost)
            reporter.warn(
                f"{self.path.name}: no tree stands within {ENTRY_M:g} m any more of {len(lost)} for which a person "
                f"wrote something: {some(named, 5, '; ')}; what was written there is not in "
                f"the new layer, but in {kept.name}."
            )

    def _moved(self, xy: np.ndarray, crs: pyproj.CRS | None) -> np.ndarray:
        """(N, 2) of the old layer in the new one's CRS."""
        tied = [found is not None and found.geodetic_crs is not None for found in (self.crs, crs)]
        return moved(xy, self.crs, crs) if all(tied) else xy

    def _new_id(self, note: str | None, table: gpd.GeoDataFrame) -> int | None:
        """The number that the tree named by a merge has now; ``None`` where it is gone."""
        old = merged_into(note)
        if old is None or str(old) not in self.places:
            return None
        x, y = self._moved(np.array([self.places[str(old)]], float), table.crs)[0]
        away = np.hypot(table["x"].to_numpy(float) - x, table["y"].to_numpy(float) - y)
        return int(table["tree_id"].iloc[int(away.argmin())]) if away.min() <= ENTRY_M else None


def read_written(path: Path, *more: Path) -> Written:
    """What a person wrote into the layer that ``path`` holds now; nothing where there is none, or no tree layer.

    more: other copies of the layer; where both hold entries for a tree, the first one's stay.
    """
    found = _read(Path(path))
    for other in map(_read, map(Path, more)):
        if not len(other.entries) or len(found.entries) and found.crs != other.crs:
            continue
        near = np.zeros(len(other.entries), bool)
        if len(found.entries):
            xy = found.entries[["x", "y"]].to_numpy(float)
            near = cKDTree(xy).query(other.entries[["x", "y"]].to_numpy(float))[0] < 0.01
        entries = pd.concat([found.entries, other.entries[~near]] if len(found.entries) else [other.entries])
        places = other.places | found.places
        own = [*dict.fromkeys(found.own + other.own)]
        found = Written(
            found.path, entries.reset_index(drop=True), found.crs or other.crs, places, np.zeros(len(entries), bool),
            own=own, unread=found.unread,
        )  # fmt: skip
    return found


def _read(path: Path) -> Written:
    if not path.is_file():
        return Written(path)
    try:
        if path.suffix.lower() == ".csv" and not read_rows(path)[1]:
            return Written(path)
        layer = read_trees(path, as_written=True)
        with suppress(InputError):  # a flag in words is a decision; what else stands there is kept all the same
            layer = plain_flags(path, layer)
        table, points = pd.DataFrame(layer.drop(columns="geometry")), layer.geometry.centroid
        for name, at in (("x", points.x), ("y", points.y)):
            said = pd.to_numeric(layer.get(name, pd.Series(np.nan, layer.index)), errors="coerce")
            table[name] = at.fillna(said)
        names = ("tree_id", "plot_id", *_NUMBERS[:-1], *COLUMNS, *DECIDED)
        found = pd.DataFrame({name: table.get(name) for name in names})
        for name in _NUMBERS:
            found[name] = pd.to_numeric(found[name], errors="coerce").astype(float)
        numbers = pd.to_numeric(found["tree_id"], errors="coerce")
        found["tree_id"] = ["" if pd.isna(value) else str(int(value)) for value in numbers]
    except (InputError, OSError, ValueError, KeyError, TypeError) as problem:
        return Written(path, unread=str(problem))
    ours = {*TREE_FIELDS, *DECIDED, *CAMPAIGN, "geometry"}
    own = [name for name in table if name not in ours and table[name].notna().any()]
    for name in own:
        # Whole numbers with gaps would become fractions.
        found[name] = table[name].astype("Int64") if table[name].dtype.kind in "iu" else table[name]
    texts = [name for name in ("plot_id", *COLUMNS, *DECIDED) if name not in _NUMBERS]
    for name in texts:
        found[name] = texts_of(found[name])
    # A tree that a person drew has no number yet; a DBH beside it is a person's.
    drawn = found["tree_id"].eq("")
    taped = drawn & found["dbh_cm"].notna() & found["rev_dbh_cm"].isna()
    found.loc[taped, "rev_dbh_cm"], found.loc[taped, "rev_flag"] = found["dbh_cm"][taped], "dbh"
    placed = found[["x", "y"]].notna().all(axis=1)
    places = {row.tree_id: (row.x, row.y) for row in found[placed].itertuples()}
    found = found[found[[*COLUMNS, *DECIDED, *own]].notna().any(axis=1) | drawn & placed]
    return Written(path, found.reset_index(drop=True), layer.crs, places, np.zeros(len(found), bool), own=own)


#: A person looked at a diameter; one that is this much off in a new run is another, cm.
CHANGED_CM = 1.0
_MERGED = re.compile(r"^same tree as (\d+)")


def merge_note(tree: int, note: str | None = None) -> str:
    """``rev_note`` of a tree that is the same as ``tree``."""
    return f"same tree as {tree}" + (f"; {note}" if note else "")


def merged_into(note: str | None) -> int | None:
    """The tree that a :func:`merge_note` names."""
    found = _MERGED.match(note or "")
    return int(found.group(1)) if found else None


def carried_decision(entry: pd.Series, tree: pd.Series, partner: int | None) -> tuple[dict[str, Any], str]:
    """Columns of the decision for a tree of a new run, and a sentence where it does not stay as it was.

    entry: what the old layer holds (columns ``rev_*``, ``tree_id, dbh_cm`` as measured then). tree: of the new one.
    partner: the number that the tree named by a merge has now.

    A person accepted, or set aside, the diameter that stood there: another one is a new question. The newer of two
    decisions (campaigns: in the plot's layer and in the merged one) stays.
    """
    if not pd.isna(tree["rev_at"]) and not (entry["rev_at"] or "") > str(tree["rev_at"]):
        return {}, ""
    values = {name: None if pd.isna(entry[name]) else entry[name] for name in DECIDED}
    old, new, number = entry["dbh_cm"], tree["dbh_cm"], tree["tree_id"]
    if values["rev_flag"] in ("accept", "stem") and pd.notna(new) and not abs(old - new) <= CHANGED_CM:
        was = "no DBH" if pd.isna(old) else f"{old:.1f} cm"
        word = "accepted" if values["rev_flag"] == "accept" else "set aside"
        return {**values, "rev_flag": None}, (
            f"tree {number} was {word} with {was} and reads {new:.1f} cm now: the decision is withdrawn, look again."
        )
    if values["rev_flag"] == "accept" and pd.isna(new) and pd.notna(old):
        return values, (
            f"tree {number} was accepted with {old:.1f} cm and is without a DBH now ({tree['qc_reason']}): it stays a "
            "tree, look again."
        )
    if values["rev_flag"] == "merge":
        before = merged_into(values["rev_note"])
        if before is not None and partner is None:
            return {**values, "rev_flag": None}, (
                f"tree {number} was merged into tree {before}, which is gone: the decision is withdrawn, look again."
            )
        if partner is not None:
            values["rev_note"] = _MERGED.sub(merge_note(partner), str(values["rev_note"]))
    return values, ""


def kept_place(entry: pd.Series, number: int, x: float, y: float) -> dict[str, Any]:
    """A row for a tree that a person says stands there and that a new run did not find."""
    values = {name: None if pd.isna(entry[name]) else entry[name] for name in DECIDED}
    values["rev_flag"] = "dbh" if values["rev_dbh_cm"] is not None else "stem"
    return {
        "tree_id": number,
        "plot_id": entry["plot_id"],
        "x": x,
        "y": y,
        "z_ground": entry["z_ground"],
        "bh_m": entry["bh_m"],
        "method": None,
        "qc_flag": "reject",
        "qc_reason": "not_found",
        "run_id": None,
        **{name: entry[name] for name in ("species", "status", "note")},
        **values,
    }
