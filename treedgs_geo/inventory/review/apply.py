"""Decisions from a table into a tree layer: into columns of their own, nothing that was measured is touched."""

from __future__ import annotations

import datetime
import getpass
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import shapely

from ...core.columns import columns, line_of, numbers
from ...core.errors import InputError
from ...core.folder_lock import one_writer
from ...core.plausible import refuse_odd_diameters
from ...core.tables import read_table
from ...core.wrong_units import wrong_unit
from ...report.blocks import known
from ...stems.quality.priors import BREAST_HEIGHT_M
from ...stems.quality.tree import TREE_FIELDS
from ..double_sampling.other_trees import of_other_trees
from ..field_trees import dbh_in_cm
from ..reviewed import COLUMNS, DECISIONS, MAX_TAPED_CM, MIN_TAPED_CM, NO_TREE, decided
from ..tree_layer import check_output, write_table
from ..tree_reading import read_trees, text_of, typed
from ..written import kept_place, merge_note, merged_into

#: Takes a decision back.
UNDO = "undo"
#: Other words for the decisions.
_WORDS = {"ok": "accept", "yes": "accept", "no": "reject", "tape": "dbh", "taped": "dbh", "clear": UNDO}


@dataclass(frozen=True)
class Decision:
    """One row. tree: its number, ``None`` for a stem at ``x, y`` (project CRS) that the layer does not have.

    word: a key of ``reviewed.DECISIONS``, or :data:`UNDO`. dbh_cm: of ``dbh`` (and of a stem whose DBH is known).
    same_as: of ``merge``. by, at: who and when (ISO 8601), empty where the table does not say. line: in the file.
    """

    line: int
    word: str
    tree: int | None = None
    dbh_cm: float | None = None
    same_as: int | None = None
    x: float | None = None
    y: float | None = None
    note: str = ""
    by: str = ""
    at: str = ""


def read_decisions(path: Path, dbh_unit: str = "auto") -> list[Decision]:
    """Read a CSV with ``tree_id, decision`` and, where needed, ``dbh_cm`` (``dbh_in`` ...), ``same_as``, ``x, y``,
    ``note, by, at``.

    Raises:
        InputError: line, what was found, what was expected.
    """
    path = Path(path)
    table = read_table(path)
    has = columns(table, "field_id", "easting", "northing", "dbh", "girth")
    if "decision" not in table or not ("field_id" in has or {"easting", "northing"} <= set(has)):
        raise InputError(
            f"{path}: found columns {', '.join(table.columns)}; expected tree_id (or x and y) and decision "
            f"({', '.join(DECISIONS)} or {UNDO})."
        )
    rows = pd.DataFrame({"dbh": dbh_in_cm(path, table, dbh_unit)})
    for key, own in (("tree", "field_id"), ("x", "easting"), ("y", "northing"), ("same_as", "")):
        name = has[own].name if own in has else key
        rows[key] = numbers(path, table, name) if name in table else np.nan
    for name in ("decision", "note", "by", "at"):
        rows[name] = table[name].map(text_of) if name in table else ""
    found = [_decision(path, row) for row in rows.itertuples()]
    again = rows["tree"].notna() & rows["tree"].duplicated()
    if again.any():
        tree = rows["tree"][again].iloc[0]
        first = line_of(rows["tree"] == tree)
        raise InputError(
            f"{path}, {line_of(again)}: tree {tree:.0f} is decided on {first} already; give each tree one row."
        )
    return found


def _decision(path: Path, row: Any) -> Decision:
    line, where = int(row.Index), f"{path}, line {row.Index}"
    dbh, x, y = known(row.dbh), known(row.x), known(row.y)
    tree, same_as = _whole(where, "tree_id", row.tree), _whole(where, "same_as", row.same_as)
    word = row.decision.lower() or ("dbh" if dbh is not None else "")
    word = _WORDS.get(word, word)
    if word not in DECISIONS and word != UNDO:
        raise InputError(f"{where}: the decision is {row.decision!r}, expected {', '.join(DECISIONS)} or {UNDO}.")
    if tree is None and (word not in ("stem", "dbh") or x is None or y is None):
        raise InputError(
            f"{where}: has no tree_id; give it (a stem that the layer does not have: decision stem or dbh, with x "
            "and y)."
        )
    if word == "merge" and (same_as is None or same_as == tree):
        raise InputError(f"{where}: 'merge' needs same_as, the number of the other tree that this one is.")
    if word == "dbh" and dbh is None:
        raise InputError(f"{where}: 'dbh' needs the taped diameter in dbh_cm (or dbh_in, dbh_mm).")
    if dbh is not None and word not in ("dbh", "stem"):
        raise InputError(f"{where}: has a DBH but the decision {word!r}; write 'dbh', or empty the cell.")
    if dbh is not None and not MIN_TAPED_CM <= dbh <= MAX_TAPED_CM:
        raise InputError(f"{where}: a DBH of {dbh:g} cm, expected {MIN_TAPED_CM:g} to {MAX_TAPED_CM:g} cm.")
    word = "dbh" if word == "stem" and dbh is not None else word
    placed = (x, y) if tree is None else (None, None)
    return Decision(line, word, tree, dbh, same_as, *placed, row.note, row.by, row.at)


def _whole(where: str, name: str, value: float) -> int | None:
    if not np.isfinite(value):
        return None
    if value != int(value):
        raise InputError(f"{where}: {name} is {value:g}, expected a whole number as in the tree layer.")
    return int(value)


#: A stem that a person adds is no other tree's from this distance on, m; and no farther from the layer's trees.
BESIDE_M, FAR_M = 0.3, 500.0
#: A taped DBH that differs more than this share from the measured one is worth a second look.
_APART = 0.25


@dataclass(frozen=True)
class Outcome:
    """counts: decisions that were made, by word. added: numbers of the trees that were added. sentences: to look at."""

    counts: dict[str, int]
    added: list[int]
    sentences: list[str]


def review_trees(
    trees: str | Path, decisions: str | Path | list[Decision], by: str | None = None, dbh_unit: str = "auto"
) -> Outcome:
    """Write a person's decisions into a tree layer: the verb ``review``.

    Args:
        trees: the tree layer (.gpkg, .shp, .geojson, .csv); it is changed in place, all decisions or none.
        decisions: a CSV (:func:`read_decisions`), or its rows.
        by: who decided, where the table does not say; ``None`` = the user of this machine.
        dbh_unit: unit of the table's DBHs where its column does not say it.

    Returns:
        what was decided.

    Raises:
        InputError: a decision about a tree that the layer does not have, or that cannot be. OutputError: the layer
            cannot be written.

    Examples:
        >>> import treedgs_geo as tg
        >>> path = tg.write_trees(work / "seen.gpkg", [tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.0)], "EPSG:32632")
        >>> _ = (work / "decisions.csv").write_text("tree_id,decision,dbh_cm\\n1,dbh,29.4\\n")
        >>> tg.review_trees(path, work / "decisions.csv").counts
        {'dbh': 1}
        >>> tg.read_trees(path)[["dbh_cm", "rev_flag", "rev_dbh_cm"]].values.tolist()
        [[31.0, 'dbh', 29.4]]
    """
    path = Path(trees)
    rows = decisions if isinstance(decisions, list) else read_decisions(Path(decisions), dbh_unit)
    check_output(path)
    source = path if isinstance(decisions, list) else Path(decisions)
    with one_writer(path.absolute().parent):
        table = read_whole(path)
        if dbh_unit == "auto":
            _refuse_odd(table, rows, source)
        with suppress(OSError, KeyError, ImportError):
            by = by or getpass.getuser()
        made, outcome = decide(table, rows, by or "", source, path)
        write_table(path, made)
    return outcome


def decide(
    table: gpd.GeoDataFrame, decisions: list[Decision], by: str, source: Path, path: Path
) -> tuple[gpd.GeoDataFrame, Outcome]:
    """The table with the decisions, each checked. source, path: of the decisions and of the layer, for messages."""
    made, now = table.copy(), datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    for name in COLUMNS:
        column = made[name] if name in made else pd.Series([None] * len(made), index=made.index)
        made[name] = column.astype(object).where(column.notna(), None)
    numbers = pd.to_numeric(made["tree_id"]).astype(int)
    if numbers.duplicated().any():
        raise InputError(f"{path}: tree_id {numbers[numbers.duplicated()].iloc[0]} appears twice; give each its own.")
    row_of, added, said = {int(number): row for row, number in enumerate(numbers)}, [], []
    for decision in decisions:
        tree = decision.tree
        if tree is None:
            tree = _at_place(made, decision, source, path)
            if tree is None:
                made, tree = _with_place(made, decision)
                row_of[tree] = len(made) - 1
                added.append(tree)
        if tree not in row_of:
            raise InputError(f"{source}, line {decision.line}: tree {tree} is not in {path}; correct the number.")
        values: dict[str, Any] = {
            "rev_flag": None if decision.word == UNDO else decision.word,
            "rev_dbh_cm": decision.dbh_cm,
            "rev_note": decision.note or None,
            "rev_by": decision.by or by,
            "rev_at": decision.at or now,
        }
        if decision.same_as is not None and decision.word == "merge":
            if decision.same_as not in row_of:
                raise InputError(
                    f"{source}, line {decision.line}: same_as is {decision.same_as}, which is not in {path}."
                )
            values["rev_note"] = merge_note(decision.same_as, decision.note)
        for name, value in values.items():
            made.iloc[row_of[tree], made.columns.get_loc(name)] = value
        said += _odd(made.iloc[row_of[tree]], tree, decision)
    _check_merges(made, source, path)
    made["rev_dbh_cm"] = pd.to_numeric(made["rev_dbh_cm"]).astype(float)
    return made, Outcome(dict(Counter(decision.word for decision in decisions)), added, said)


def _refuse_odd(table: gpd.GeoDataFrame, decisions: list[Decision], source: Path) -> None:
    """Refuse taped DBHs in another unit than their column says, of other trees, and, of trees without a measured one,
    those that none of the layer's trees makes likely."""
    given = [decision for decision in decisions if decision.dbh_cm is not None and decision.tree is not None]
    known = dict(zip(pd.to_numeric(table["tree_id"]), pd.to_numeric(table["dbh_cm"]), strict=True))
    taped = np.array([decision.dbh_cm for decision in given], float)
    measured = np.array([known.get(decision.tree, np.nan) for decision in given], float)
    slip = wrong_unit(taped, measured)
    if slip is not None:
        first = given[int(np.flatnonzero(slip.rows)[0])]
        raise InputError(
            f"{source}, line {first.line}: a DBH of {first.dbh_cm:g} cm, but {known[first.tree]:.1f} cm were measured "
            f"at tree {first.tree}: {slip.text()}; correct it, or name the unit (column dbh_in, or --dbh-unit)."
        )
    names = np.array([f"line {decision.line}" for decision in given], object)
    others = of_other_trees(taped, measured, np.full(len(given), np.nan), names) if given else None
    if others is not None and others.certain:
        raise InputError(f"{source}: {others.why}; hold the DBHs against the form and correct them.")
    open_ = [one for one in decisions if one.dbh_cm is not None and not known.get(one.tree, np.nan) > 0]
    refuse_odd_diameters(
        np.array([*(one.dbh_cm for one in open_), *known.values()], float),
        lambda odd: f"{source}, line {open_[int(np.flatnonzero(odd)[0])].line}",
        "give --dbh-unit if it is right",
        len(open_),
    )


def _odd(row: pd.Series, tree: int, decision: Decision) -> list[str]:
    """What is worth a second look."""
    measured = pd.to_numeric(row["dbh_cm"])
    if decision.word == "accept" and pd.isna(measured):
        return [f"Tree {tree} has no DBH: it is accepted as a tree without one; give 'dbh' with its taped diameter."]
    taped = decision.dbh_cm if decision.word == "dbh" else None
    if taped is None or pd.isna(measured) or abs(measured - taped) <= _APART * taped:
        return []
    return [
        f"Tree {tree}: taped {taped:.1f} cm, measured {measured:.1f} cm; check the number, the unit and that it is "
        "this tree."
    ]


def _check_merges(made: gpd.GeoDataFrame, source: Path, path: Path) -> None:
    """Every merged tree's partner counts."""
    flag, _ = decided(made, path)
    by_number = dict(zip(pd.to_numeric(made["tree_id"]).astype(int), flag, strict=True))
    for tree, word, note in zip(made["tree_id"], flag, made["rev_note"], strict=True):
        other = merged_into(note) if word == "merge" else None
        if other is not None and by_number.get(other) in NO_TREE:
            raise InputError(
                f"{source}: tree {tree} is merged into tree {other}, which is itself '{by_number[other]}': one of "
                "the two has to count; correct the decisions."
            )


def _at_place(made: gpd.GeoDataFrame, decision: Decision, source: Path, path: Path) -> int | None:
    """The tree that a person added at this place before; ``None`` where there is none. Refused: a place where another
    tree stands, or that is not of this layer."""
    if not len(made):
        return None
    assert decision.x is not None and decision.y is not None
    away = np.hypot(made.geometry.x - decision.x, made.geometry.y - decision.y).to_numpy()
    nearest = int(np.nanargmin(away))
    if away[nearest] > FAR_M:
        raise InputError(
            f"{source}, line {decision.line}: the stem at {decision.x:g} {decision.y:g} lies {away[nearest]:,.0f} m "
            f"from the nearest tree of {path}; give x and y in metres of the layer's CRS."
        )
    if away[nearest] > BESIDE_M:
        return None
    tree = int(float(made["tree_id"].iloc[nearest]))
    if str(made["qc_reason"].iloc[nearest] if "qc_reason" in made else "") != "not_found":
        raise InputError(
            f"{source}, line {decision.line}: tree {tree} of {path} stands {away[nearest]:.2f} m from this place; "
            "decide about that tree (by its tree_id)."
        )
    return tree


def _with_place(made: gpd.GeoDataFrame, decision: Decision) -> tuple[gpd.GeoDataFrame, int]:
    """The table with one more row, for a stem that nothing measured, and its number."""
    assert decision.x is not None and decision.y is not None
    number = int(pd.to_numeric(made["tree_id"]).max()) + 1 if len(made) else 1
    heights = pd.to_numeric(made["bh_m"]).dropna() if "bh_m" in made else []
    entry = pd.Series(dict.fromkeys((*TREE_FIELDS, *COLUMNS)), dtype=object)
    entry["bh_m"] = float(np.median(heights)) if len(heights) else BREAST_HEIGHT_M
    row = {name: value for name, value in kept_place(entry, number, decision.x, decision.y).items() if name in made}
    return with_row(made, row, shapely.Point(decision.x, decision.y, 0.0)), number


def with_row(made: gpd.GeoDataFrame, row: dict[str, Any], point: shapely.Point) -> gpd.GeoDataFrame:
    """The table with one more row; columns that it does not name are empty, and every column keeps its kind."""
    geometry, kinds = made.geometry.name, made.dtypes
    extra = pd.DataFrame([row], dtype=object).reindex(columns=made.columns)
    extra[geometry] = [point]
    both = pd.concat([pd.DataFrame(made).astype(object), extra], ignore_index=True)
    for name, kind in kinds.items():
        if name == geometry:
            continue
        # A gap makes fractions of plain whole numbers.
        gap = kind.kind in "iu" and both[name].isna().any()
        both[name] = both[name].astype("Int64" if gap else kind)
    return gpd.GeoDataFrame(both, geometry=gpd.GeoSeries(both[geometry], crs=made.crs))


def read_whole(path: Path) -> gpd.GeoDataFrame:
    """A tree layer with every column as it is in the file, to be written back.

    Raises:
        InputError: not readable, no tree layer, or a tree without a number.
    """
    table = read_trees(path, as_written=True)
    if pd.to_numeric(table["tree_id"], errors="coerce").isna().any():
        raise InputError(f"{path}: a tree has no tree_id; give every tree its own number.")
    if path.suffix.lower() == ".csv":
        return table
    table = typed(path, table)
    layer = {"layer": "trees"} if path.suffix.lower() == ".gpkg" else {}
    info = pyogrio.read_info(path, **layer)
    for name, kind in zip(info["fields"], info["dtypes"], strict=True):
        # Whole numbers with gaps would be read as fractions.
        if str(kind).startswith("int") and str(table[name].dtype).startswith("float"):
            table[name] = table[name].astype("Int64")
    return table
