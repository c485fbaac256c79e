"""Trees as a person left them: decisions in the columns ``rev_*`` of a tree layer, and what counts after them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd

from ..core.errors import InputError
from ..core.intervals import HALF_WIDTH_SE
from ..core.shown import count_of
from ..core.wrong_units import wrong_unit
from .tree_reading import text_of, texts_of

#: decision (``rev_flag``) -> what it means
DECISIONS = {
    "accept": "the tree and its DBH count as measured; without a DBH: a tree stands here",
    "reject": "no tree stands here; it counts nowhere",
    "dbh": "the tree counts with the DBH in rev_dbh_cm",
    "merge": "the same tree as another one, which counts; this one counts nowhere",
    "stem": "a stem stands here, its DBH is not known",
}
#: Columns of a tree layer that hold a decision.
COLUMNS = ("rev_flag", "rev_dbh_cm", "rev_note", "rev_by", "rev_at")
#: Decisions by which a row is no tree, and those by which a tree stands there for certain.
NO_TREE, A_TREE = ("reject", "merge"), ("accept", "dbh", "stem")
#: Standard error of a DBH by tape or calliper, cm.
TAPE_SE_CM = 0.3
#: Diameters that a tape can have read, cm.
MIN_TAPED_CM, MAX_TAPED_CM = 0.5, 500.0

_Table = TypeVar("_Table", bound=pd.DataFrame)


@dataclass(frozen=True)
class Reviewed:
    """How many trees of a layer a person decided on, by decision. left_out: numbers of those that count nowhere. by:
    who decided, where the layer says it."""

    accepted: int = 0
    rejected: int = 0
    taped: int = 0
    merged: int = 0
    stems: int = 0
    left_out: frozenset[int] = frozenset()
    by: tuple[str, ...] = ()

    @property
    def total(self) -> int:
        """All of them."""
        return sum(self.counts().values())

    def counts(self) -> dict[str, int]:
        """By decision, for ``summary.json`` and the like."""
        names = ("accepted", "rejected", "taped", "merged", "stems")
        return {name: getattr(self, name) for name in names}

    def sentences(self, name: str) -> list[str]:
        """One sentence for the user; none where nobody decided anything. name: of the layer."""
        if not self.total:
            return []
        parts = (
            (self.accepted, "accepted"),
            (self.taped, f"with a taped DBH (standard error {TAPE_SE_CM:g} cm)"),
            (self.stems, "with a stem but no DBH"),
            (self.rejected, "rejected"),
            (self.merged, "merged into another"),
        )
        said = [f"{n} {words}" for n, words in parts if n]
        if self.rejected + self.merged:
            said[-1] += " (rejected and merged ones count nowhere)"
        return [f"A person decided on {count_of(self.total, 'tree')} of {name}: {'; '.join(said)}."]


def reviewed(table: _Table, name: str | Path = "the tree layer") -> tuple[_Table, Reviewed]:
    """The trees that count, with the values that count, after what a person decided.

    table: a tree layer (:func:`treedgs_geo.inventory.tree_reading.read_trees`), with or without the columns
    :data:`COLUMNS`. name: for messages.

    Returns:
        the table without rejected and merged rows, ``dbh_cm``, its error and interval, ``qc_flag``, ``qc_reason`` and
        ``ba_m2`` as decided, and three more columns: ``meas_cm`` (the DBH as measured), ``taped`` (the DBH is by tape)
        and ``sure`` (a person says that a tree stands there); and the numbers of decisions.

    Raises:
        InputError: an unknown decision, one without its DBH, or a DBH that no tape can have read.

    Examples:
        >>> import treedgs_geo as tg
        >>> both = [tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.0), tg.Tree(2, 500004.0, 5.2e6, dbh_cm=24.0)]
        >>> trees = tg.tree_table(both, "EPSG:32632")
        >>> trees["rev_flag"], trees["rev_dbh_cm"] = ["dbh", "reject"], [29.4, None]
        >>> counted, review = tg.reviewed(trees)
        >>> counted[["tree_id", "dbh_cm", "meas_cm"]].values.tolist(), review.rejected
        ([[1, 29.4, 31.0]], 1)
    """
    made = table.copy()
    made["meas_cm"] = pd.to_numeric(made["dbh_cm"]).astype(float)
    made["sure"] = made["taped"] = False
    if not {"rev_flag", "rev_dbh_cm"} & set(made.columns):
        return made, Reviewed()
    flag, taped = decided(made, name)
    made["sure"] = flag.isin(A_TREE).to_numpy()
    made["taped"] = flag.eq("dbh").to_numpy()
    rows = made["taped"].to_numpy()
    cm, half = taped[rows], HALF_WIDTH_SE * TAPE_SE_CM
    _put(
        made, rows, dbh_cm=cm, dbh_se_cm=TAPE_SE_CM, dbh_lo_cm=np.maximum(cm - half, 0.0), dbh_hi_cm=cm + half,
        ba_m2=np.pi / 4e4 * cm**2, qc_flag="ok", qc_reason="",
    )  # fmt: skip
    none = dict.fromkeys(("dbh_cm", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm", "ba_m2"), np.nan)
    _put(made, flag.eq("stem").to_numpy(), **none, qc_flag="reject")
    has = made["dbh_cm"].notna()
    made.loc[(flag.eq("accept") & has).to_numpy(), "qc_flag"] = "ok"
    counts = flag.value_counts()
    out = flag.isin(NO_TREE).to_numpy()
    n = {word: int(counts.get(word, 0)) for word in DECISIONS}
    gone = frozenset(int(tree) for tree in made.loc[out, "tree_id"])
    by = tuple(sorted(set(texts_of(made["rev_by"][flag.ne("")]).dropna()))) if "rev_by" in made else ()
    review = Reviewed(n["accept"], n["reject"], n["dbh"], n["merge"], n["stem"], gone, by)
    return made[~out].reset_index(drop=True), review


def decided(table: pd.DataFrame, name: str | Path) -> tuple[pd.Series, np.ndarray]:
    """Decision of each row ('' where there is none), and (N,) taped DBH, cm, NaN where there is none.

    Raises:
        InputError: see :func:`reviewed`.
    """
    taped = _taped(table, name)
    nothing = pd.Series([None] * len(table), index=table.index, dtype=object)
    flag = table.get("rev_flag", nothing).map(lambda cell: text_of(cell).lower())
    # A DBH that was written into the table by hand is a decision too.
    flag = flag.where(~(np.isfinite(taped) & flag.isin(["", "accept"]).to_numpy()), "dbh")
    for row, (word, cm) in enumerate(zip(flag, taped, strict=True)):
        tree = table["tree_id"].iloc[row]
        if word and word not in DECISIONS:
            raise InputError(
                f"{name}: tree {tree} has rev_flag {word!r}, expected {', '.join(DECISIONS)} or nothing; correct it."
            )
        if word == "dbh" and not np.isfinite(cm):
            raise InputError(f"{name}: tree {tree} has rev_flag 'dbh' but no rev_dbh_cm; give the DBH, or clear both.")
        if word and word != "dbh" and np.isfinite(cm):
            raise InputError(
                f"{name}: tree {tree} has rev_flag {word!r} and a rev_dbh_cm of {cm:g}; clear one of them (a taped "
                "DBH has rev_flag 'dbh')."
            )
    return flag, taped


def _taped(table: pd.DataFrame, name: str | Path) -> np.ndarray:
    if "rev_dbh_cm" not in table:
        return np.full(len(table), np.nan)
    taped = pd.to_numeric(table["rev_dbh_cm"], errors="coerce").to_numpy(float)
    written = table["rev_dbh_cm"].map(text_of).ne("").to_numpy(bool)
    bad = written & ~((taped >= MIN_TAPED_CM) & (taped <= MAX_TAPED_CM))
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        raise InputError(
            f"{name}: tree {table['tree_id'].iloc[row]} has a rev_dbh_cm of {table['rev_dbh_cm'].iloc[row]}, expected "
            f"{MIN_TAPED_CM:g} to {MAX_TAPED_CM:g} cm; correct it."
        )
    # What the verb or the panel wrote, they looked at.
    by_hand = taped if "rev_at" not in table else np.where(table["rev_at"].isna(), taped, np.nan)
    slip = wrong_unit(by_hand, pd.to_numeric(table["dbh_cm"]).to_numpy(float))
    if slip is not None:
        row = int(np.flatnonzero(slip.rows)[0])
        raise InputError(
            f"{name}: tree {table['tree_id'].iloc[row]} has a rev_dbh_cm of {taped[row]:g}: {slip.text()}; write "
            "centimetres of diameter, or give the taped DBHs by the verb review with --dbh-unit."
        )
    return taped


def _put(made: pd.DataFrame, rows: np.ndarray, **values: object) -> None:
    """Values into the columns that are there, in place; numbers may go into a column of texts."""
    for column, value in values.items():
        if column in made:
            made[column] = made[column] if isinstance(value, str) else pd.to_numeric(made[column]).astype(float)
            made.loc[rows, column] = value
