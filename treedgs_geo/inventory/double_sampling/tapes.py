"""The tape table: what tape-sample draws and prints, and what comes back from the field in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio

from ...core.columns import line_of, numbers
from ...core.errors import InputError
from ...core.shown import count_of, some
from ...core.tables import is_table, read_table, refuse_other_formats
from ...core.wrong_units import wrong_unit
from ..tree_reading import text_of, texts_of
from .estimators import Tapes, without_unanswered

#: Layer of the GeoPackage that tape-sample writes.
LAYER = "tapes"
#: What is filled in: columns of a diameter or girth -> centimetres of diameter in one of its unit.
_CM = {"cm": 1.0, "mm": 0.1, "in": 2.54}
TAPED = {f"taped_{unit}": cm for unit, cm in _CM.items()} | {f"girth_{unit}": cm / np.pi for unit, cm in _CM.items()}
#: In front of these: a second tape of the same tree.
SECOND = "second_"
#: What a crew writes into ``state`` -> what it means: the tree was taped; no tree stands there; it is dead; it was not
#: reached, so that nothing is known of it.
STATES = {
    "": "",
    **dict.fromkeys(("taped", "ok", "live", "alive", "lebend", "gemessen", "vivo", "medido", "vivant"), "taped"),
    **dict.fromkeys(("none", "no tree", "no_tree", "false", "kein baum", "sin árbol", "pas d'arbre"), "none"),
    **dict.fromkeys(("dead", "snag", "tot", "abgestorben", "muerto", "mort", "martwe", "kuollut"), "dead"),
    **dict.fromkeys(("not reached", "not_reached", "not found", "not_found", "skipped"), "not reached"),
}
#: Columns of the draw, without which no total can be corrected.
DRAWN = ("stratum", "prob", "n_frame")
#: Chances that a spreadsheet rounded make up all trees within this share.
_ROUNDING = 0.02
#: A drawn tree is the layer's tree of that number within this distance.
SAME_M = 0.5


@dataclass
class Taped:
    """trees: drawn trees, ``tree_id, plot_id, taped_cm`` (NaN: none), ``second_cm`` (by a second tape), ``state``
    (``taped``, ``none``, ``dead`` or ``not reached``), ``note, stratum, prob, x, y, dbh_cm`` (as measured when drawn).
    extra: trees that the layer lacks, ``plot_id, near_id, taped_cm, note``. n_frame: trees that were drawn from (0: the
    table does not say it). frame: mark of that list."""

    trees: pd.DataFrame
    extra: pd.DataFrame
    n_frame: int
    frame: str
    path: Path

    @property
    def answered(self) -> np.ndarray:
        """(n,) whether something is known of the drawn tree."""
        return (self.trees["state"] != "not reached").to_numpy()

    def remarks(self) -> tuple[list[str], list[str]]:
        """Warnings and notes: drawn trees that were not taped, and what was found beside them."""
        warnings, open_ = [], self.trees["tree_id"][~self.answered]
        if len(open_):
            warnings.append(
                f"Not taped: {count_of(len(open_), 'drawn tree')} ({some(open_, 10)}); the others of their stratum "
                "stand for them, which is right only if what kept the crew away has nothing to do with the error."
            )
        if len(self.extra):
            return warnings, [f"Trees that the map lacks, found by the crew: {len(self.extra)}."]
        return warnings, [
            "No tree that the map lacks was written down: it is taken that the crew looked for them and found none. If "
            "nobody looked, trees that the flight missed are missing in every total."
        ]

    def repeatability(self) -> dict[str, Any]:
        """``n_twice``: trees taped twice; ``tape_sd_cm``: standard deviation of one tape from them (Bland and Altman
        1996), ``None`` where there are none."""
        difference = (self.trees["taped_cm"] - self.trees["second_cm"]).dropna()
        sd = float(np.sqrt(np.mean(difference**2) / 2)) if len(difference) else None
        return {"n_twice": len(difference), "tape_sd_cm": sd}

    def sample(self) -> Tapes:
        """The trees that were answered for, with their probabilities.

        Raises:
            InputError: the table does not hold the draw, or a stratum went without a tape.
        """
        if not self.n_frame:
            raise InputError(
                f"{self.path}: lacks {', '.join(DRAWN)}, the chances with which the trees were drawn; fill in the "
                "table that tape-sample wrote, and leave its columns."
            )
        drawn = Tapes(self.trees["prob"].to_numpy(float), self.trees["stratum"].to_numpy(object))
        try:
            return without_unanswered(drawn, self.answered)
        except InputError as problem:
            raise InputError(f"{self.path}: {problem}") from None


def read_taped(path: Path, dbh_cm: pd.Series | None = None) -> Taped:
    """Read the filled-in table: CSV (commas or semicolons), or the GeoPackage of tape-sample.

    dbh_cm: by ``tree_id``, for a table that does not say what was measured.

    Raises:
        InputError: not readable, not a tape table, nothing filled in, numbers that no tape reads, unknown states.
    """
    path = Path(path)
    table = read_cells(path)
    if "tree_id" not in table or not (set(TAPED) & set(table.columns)):
        raise InputError(
            f"{path}: found columns {', '.join(table.columns)}; expected tree_id and taped_cm (or {', '.join(TAPED)}): "
            "give the table that tape-sample wrote, filled in."
        )
    found = pd.DataFrame({"tree_id": numbers(path, table, "tree_id")})
    found["taped_cm"] = _diameters(path, table)
    second = {SECOND + name: name for name in TAPED if SECOND + name in table}
    found["second_cm"] = _diameters(path, table[["tree_id", *second]].rename(columns=second))
    found["state"] = _states(path, table, found)
    for name, column in (("plot_id", "plot_id"), ("note", "tape_note"), ("stratum", "stratum"), ("frame", "frame")):
        found[name] = texts_of(table[column]) if column in table else None
    for name in ("prob", "n_frame", "x", "y", "dbh_cm", "near_id"):
        found[name] = numbers(path, table, name) if name in table else np.nan
    empty = found["tree_id"].isna() & (found["state"] == "not reached") & found["note"].isna()
    found = found[~empty]
    extra = found[found["tree_id"].isna()]
    trees = found[found["tree_id"].notna()].copy()
    trees["tree_id"] = trees["tree_id"].astype(int)
    if dbh_cm is not None:
        trees["dbh_cm"] = trees["tree_id"].map(dbh_cm).astype(float)
    _check(path, trees, extra)
    whole = trees["prob"].between(0, 1, inclusive="right") & trees["stratum"].notna() & trees["n_frame"].notna()
    return Taped(
        trees.reset_index(drop=True),
        extra[["plot_id", "near_id", "taped_cm", "note"]].reset_index(drop=True),
        int(trees["n_frame"].iloc[0]) if whole.all() else 0,
        str(trees["frame"].iloc[0] or ""),
        path,
    )


def read_cells(path: Path) -> pd.DataFrame:
    """The table's cells as they are, without the places of a layer.

    Raises:
        InputError: not readable, no row.
    """
    if is_table(path):
        return read_table(path)
    refuse_other_formats(path, layers=True)
    try:
        names = [str(name) for name, _ in pyogrio.list_layers(path)]
        table = gpd.read_file(path, engine="pyogrio", layer=LAYER if LAYER in names else names[0])
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a tape table ({problem}); give a CSV or a GeoPackage.") from None
    if not len(table):
        raise InputError(f"{path}: holds no row, expected one row a taped tree.")
    table.index = pd.RangeIndex(1, len(table) + 1)
    return pd.DataFrame(table.drop(columns=table.geometry.name)) if "geometry" in table else pd.DataFrame(table)


def _diameters(path: Path, table: pd.DataFrame) -> pd.Series:
    found = pd.Series(np.full(len(table), np.nan), table.index)
    for name, factor in TAPED.items():
        if name not in table:
            continue
        values = numbers(path, table, name) * factor
        both = values.notna() & found.notna()
        if both.any():
            raise InputError(f"{path}: {_which(table, both)} has two diameters ({name} and another); leave one.")
        bad = values.notna() & ~values.between(0.5, 500)
        if bad.any():
            raise InputError(
                f"{path}: {_which(table, bad)} has {name} of {values[bad].iloc[0] / factor:g}, which is "
                f"{values[bad].iloc[0]:.3g} cm across, expected 0.5 to 500; correct it (leave it empty where nothing "
                "was taped)."
            )
        found = found.where(found.notna(), values)
    return found


def _states(path: Path, table: pd.DataFrame, found: pd.DataFrame) -> pd.Series:
    said = table["state"].map(lambda value: text_of(value).lower()) if "state" in table else pd.Series("", table.index)
    odd = ~said.isin(list(STATES))
    if odd.any():
        raise InputError(
            f"{path}: {_which(table, odd)} has state {said[odd].iloc[0]!r}, expected taped, none (no tree stands "
            "there), dead, not reached, or nothing."
        )
    state = said.map(STATES)
    has = found["taped_cm"].notna()
    for wrong, text in (
        (has & state.isin(["none", "not reached"]), "a diameter, and a state that says that none was taped"),
        (~has & (state == "taped"), "state taped, and no diameter"),
    ):
        if wrong.any():
            raise InputError(f"{path}: {_which(table, wrong)} has {text}; correct one of them.")
    return state.where(state != "", np.where(has, "taped", "not reached"))


def _check(path: Path, trees: pd.DataFrame, extra: pd.DataFrame) -> None:
    twice = trees["tree_id"].duplicated()
    if twice.any():
        raise InputError(f"{path}: tree {trees['tree_id'][twice.idxmax()]} appears twice; leave one row a tree.")
    if not (trees["state"] != "not reached").any():
        raise InputError(f"{path}: no tree is filled in; write the diameters into taped_cm.")
    if extra["taped_cm"].isna().any():
        raise InputError(
            f"{path}: a row without tree_id has no diameter: rows without tree_id are trees that the map lacks; tape "
            "them, or delete the row."
        )
    if (extra["plot_id"].isna() & extra["near_id"].isna()).any():
        raise InputError(
            f"{path}: a tree that the map lacks has no plot_id and no near_id; write the plot that was searched, or "
            "the drawn tree that it stands nearest to."
        )
    alone = trees["second_cm"].notna() & trees["taped_cm"].isna()
    if alone.any():
        raise InputError(
            f"{path}: tree {trees['tree_id'][alone].iloc[0]} has a second tape and no first; write the only one into "
            "taped_cm."
        )
    _check_draw(path, trees)
    slip = wrong_unit(trees["taped_cm"].to_numpy(float), trees["dbh_cm"].to_numpy(float))
    if slip is not None:
        raise InputError(
            f"{path}: taped diameters: {slip.text()} (tree {some(trees['tree_id'][slip.rows], 8)}); correct "
            "them, or name the column of another unit taped_in, taped_mm or girth_cm."
        )


def _check_draw(path: Path, trees: pd.DataFrame) -> None:
    """Where every tree of a stratum had the same chance, the drawn ones stand for exactly all: else rows are missing,
    or chances were changed."""
    known = trees[["prob", "n_frame"]].notna().all(axis=None) and (trees["prob"] > 0).all()
    if not known or (trees.groupby(trees["stratum"].astype(str))["prob"].transform("std").fillna(0) > 1e-6).any():
        return
    stands_for, n_frame = float((1 / trees["prob"]).sum()), float(trees["n_frame"].iloc[0])
    if abs(stands_for - n_frame) > max(_ROUNDING * n_frame, 0.5):
        raise InputError(
            f"{path}: by their chances (prob) its {len(trees)} rows stand for {stands_for:,.0f} trees, expected the "
            f"{n_frame:,.0f} that were drawn from (n_frame): rows were deleted or chances changed; leave every drawn "
            "row (a tree that was not taped stays empty) and these columns as tape-sample wrote them."
        )


def _which(table: pd.DataFrame, bad: pd.Series) -> str:
    name = table["tree_id"][np.asarray(bad)].iloc[0]
    return line_of(bad, table) + (f" (tree {name})" if text_of(name) else "")


#: Diameters that differ by no more are the same number, written with fewer digits, cm.
SAME_CM = 0.06


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
    same = _same(then, now)
    by_tape = placed & ~same & _same(drawn["taped_cm"], now)
    dbh[rows] = np.where(placed & same | by_tape, then, now)
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
    typed = np.full(len(rows), False) if "meas_cm" not in trees else ~_same(now, trees["meas_cm"].to_numpy(float)[rows])
    other = typed & np.isfinite(now) & drawn["taped_cm"].notna().to_numpy() & ~_same(drawn["taped_cm"], now)
    if other.any():
        pairs = zip(drawn["tree_id"][other], drawn["taped_cm"][other], now[other], strict=True)
        named = some((f"tree {tree}: {_cm(tape)} and {_cm(typed_cm)}" for tree, tape, typed_cm in pairs), 5)
        notes.append(
            f"{count_of(int(other.sum()), 'tree')} with one diameter in {taped.path.name} and another typed into the "
            f"layer ({named}): the table's corrects the totals; take the wrong one back."
        )
    if by_tape.any():
        notes.append(
            f"{int(by_tape.sum())} of the taped DBHs stand in the tree layer too: there the measured ones count, so "
            "that the tapes speak for the trees that were not taped as well."
        )
    return rows, dbh, notes


def _same(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.isclose(a, b, rtol=0, atol=SAME_CM, equal_nan=True)


def _cm(value: float) -> str:
    return f"{value:.1f} cm" if np.isfinite(value) else "no DBH"
