"""Decisions on their way into the layer of a new run: what they still say of a tree that was measured again."""

from __future__ import annotations

import re
from typing import Any

import pandas as pd

from .reviewed import COLUMNS as DECIDED

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
