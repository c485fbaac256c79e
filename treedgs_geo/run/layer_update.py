"""New trees in a tree layer that is there already: all other rows stay as they are, to the last column."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import geopandas as gpd
import numpy as np
import pandas as pd

from ..core import workspace as names
from ..core.errors import InputError, OutputError
from ..core.geopackage import is_whole
from ..core.progress import Reporter
from ..inventory.review.apply import BESIDE_M, read_whole, with_row
from ..inventory.reviewed import NO_TREE, decided
from ..inventory.searched import read_searched
from ..inventory.side_layers import add_layers, read_readings
from ..inventory.tree_layer import tree_table, write_table
from ..inventory.tree_reading import LAYER
from ..inventory.written import COLUMNS, DECIDED, carried_decision
from ..stems.quality.tree import Tree
from .context import PhotoJob

if TYPE_CHECKING:
    from pyproj import CRS

#: A point belongs to a tree up to this far from its bark, m.
_BARK_M = 0.1


@dataclass(frozen=True)
class Held:
    """A row of the layer, project coordinates. dbh_cm: what counts, ``None`` without a diameter. word: what a person
    decided, or empty. of_run: the run (or an earlier ``--at``) measured it; asked: a person put it there."""

    tree_id: int
    x: float
    y: float
    dbh_cm: float | None
    flag: str
    word: str
    of_run: bool
    asked: bool

    @property
    def set_aside(self) -> bool:
        """A person says that no tree of its own stands there."""
        return self.word in NO_TREE

    @property
    def open(self) -> bool:
        """Has no diameter, and nobody said that it needs none."""
        return self.dbh_cm is None and not self.set_aside

    @property
    def beside_m(self) -> float:
        """Points this near are meant for it, m."""
        return max(BESIDE_M, (self.dbh_cm or 0.0) / 200 + _BARK_M)

    def away(self, xy: np.ndarray) -> float:
        """Metres from (2,) a place."""
        return float(np.hypot(self.x - xy[0], self.y - xy[1]))

    def sentence(self, xy: np.ndarray) -> str:
        """``tree 7 (31.2 cm, ok), 0.12 m away, which the layer holds``."""
        dbh = "no DBH" if self.dbh_cm is None else f"{self.dbh_cm:.1f} cm"
        word = f", decided: {self.word}" if self.word else ""
        far = f"{self.away(xy):.2f} m away"
        return f"tree {self.tree_id} ({dbh}, {self.flag}{word}), {far}, which the layer holds already"


def _layer(job: PhotoJob, trees: list[Tree]) -> tuple[Path, gpd.GeoDataFrame]:
    """The layer that new trees go into: the output if it is there, else the run's own, else ``trees``, as measured."""
    for path in (job.settings.output, job.path(names.TREES)):
        if path.exists():
            return path, read_whole(path)
    return job.settings.output, tree_table(trees, job.place.frame.crs)


def held_trees(job: PhotoJob, trees: list[Tree]) -> list[Held]:
    """The rows of the layer that new trees go into. trees: of the run.

    Raises:
        InputError: it is the layer of another run, or no tree layer.
    """
    path, table = _layer(job, trees)
    runs = table["run_id"] if "run_id" in table else pd.Series([job.run_id] * len(table), index=table.index)
    others = sorted({value for value in runs.dropna().astype(str) if value.strip()} - {job.run_id})
    if others:
        raise InputError(
            f"{path}: holds trees of another run ({others[0]}), expected those of {job.settings.workspace} "
            f"({job.run_id}); give another output, or the workspace of that run."
        )
    word, taped = decided(table, path)
    dbh = np.where(np.isfinite(taped), taped, pd.to_numeric(table["dbh_cm"], errors="coerce").to_numpy(float))
    reason = table.get("qc_reason", pd.Series("", index=table.index))
    own = {tree.tree_id for tree in trees}
    return [
        Held(
            tree_id=(number := int(float(table["tree_id"].iloc[row]))),
            x=point.x,
            y=point.y,
            dbh_cm=float(dbh[row]) if np.isfinite(dbh[row]) else None,
            flag=str(table["qc_flag"].iloc[row]),
            word=str(word.iloc[row]),
            of_run=number in own and not pd.isna(runs.iloc[row]),
            asked=reason.iloc[row] == "not_found",
        )
        for row, point in enumerate(table.geometry)
    ]


def merge_layers(job: PhotoJob, changed: list[tuple[Tree, Held | None]], trees: list[Tree], reporter: Reporter) -> None:
    """The changed trees, each in place of the row beside it, into the output and into the run's own layer; nothing else
    in them changes.

    trees: of the run, for a layer that is not there yet.

    Raises:
        OutputError: the output cannot be written; nothing has changed then.
    """
    output, copy, crs = job.settings.output, job.path(names.TREES), job.place.frame.crs
    searched, readings = (read_searched(copy), read_readings(copy)) if copy.exists() else (None, None)

    def write(path: Path, table: gpd.GeoDataFrame) -> None:
        beside = partial(add_layers, trees=table, searched=searched, readings=readings)
        write_table(path, table, beside, job.path(names.SHEETS))

    table, sentences = _merged(_layer(job, trees)[1], changed, crs)
    for sentence in sentences:
        reporter.warn(f"{output.name}: {sentence}")
    write(output, table)
    if output.resolve() == copy.resolve():
        return
    try:
        own = read_whole(copy) if copy.exists() and is_whole(copy, LAYER) else tree_table(trees, crs)
        write(copy, _merged(own, changed, crs)[0])
    except (OutputError, InputError) as problem:  # the result itself is written
        reporter.warn(str(problem))


def _merged(
    table: gpd.GeoDataFrame, changed: list[tuple[Tree, Held | None]], crs: CRS
) -> tuple[gpd.GeoDataFrame, list[str]]:
    """The table with the changed trees, and sentences about decisions that did not stay as they were."""
    made, sentences = table.copy(), []
    for name in DECIDED:
        if name in made and made[name].dtype.kind != "f":
            made[name] = made[name].astype(object).where(made[name].notna(), None)
    fresh = tree_table([tree for tree, _ in changed], crs)
    for (tree, instead), values in zip(changed, fresh.itertuples(index=False), strict=True):
        row = {name: None if pd.isna(value) else value for name, value in values._asdict().items()}
        point = row.pop("geometry")
        number = tree.tree_id if instead is None else instead.tree_id
        there = pd.to_numeric(made["tree_id"]).astype(int) == number
        for _, old in made[there].iterrows():
            kept = {name: old[name] for name in COLUMNS if name in made}
            if DECIDED[0] in made and not pd.isna(old[DECIDED[0]]):
                # As a new run does it: a decision about a diameter that is another one now is a question again.
                decision, said = carried_decision(old, pd.Series({**row, **dict.fromkeys(DECIDED)}), None)
                kept |= decision
                sentences += [said] if said else []
            row |= kept
        made = with_row(made[~there], {name: value for name, value in row.items() if name in made}, point)
    return made, sentences
