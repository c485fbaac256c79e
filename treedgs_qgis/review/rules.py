"""Words and limits of a decision: those of the verb ``review`` (``parameters.json`` has them from the engine)."""

from __future__ import annotations

import datetime
import getpass
import json
import math
import re
from functools import lru_cache
from typing import Any

from ..i18n import tr
from ..words import DECLARATIONS

#: Columns that hold a decision; nothing else in a tree layer is ever written by the panel.
COLUMNS = ("rev_flag", "rev_dbh_cm", "rev_note", "rev_by", "rev_at")
#: Decisions by which a row is no tree of its own.
NO_TREE = ("reject", "merge")
#: A taped DBH that differs more than this share from the measured one is asked about before it is kept.
ASK = 0.5
#: A taped DBH that differs more than this share from the measured one is worth a second look.
APART = 0.25
_MERGED = re.compile(r"^same tree as (\d+)(?:; )?")


class Refused(Exception):
    """A decision that cannot be; the text is one sentence for the user."""


@lru_cache(maxsize=1)
def known() -> dict[str, Any]:
    """``decisions`` (word -> meaning), ``reasons`` (key -> meaning, what to do), ``least_taped_cm``, ``most_taped_cm``,
    ``beside_m``, ``far_m``."""
    return json.loads(DECLARATIONS.read_text(encoding="utf-8"))["review"]


def taped_cm(text: str) -> float:
    """A diameter as typed: a point or a comma, ``cm`` behind it or not.

    Raises:
        Refused: no number, or none that a tape can have read.
    """
    plain = text.strip().lower().removesuffix("cm").strip().replace(",", ".")
    low, high = known()["least_taped_cm"], known()["most_taped_cm"]
    try:
        value = float(plain)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise Refused(
            tr("Taped DBH: found '{text}', expected {low} to {high} cm.").format(
                text=text.strip(), low=f"{low:g}", high=f"{high:g}"
            )
        )
    return value


def refuse_other_unit(tree: int, cm: float, measured: float | None, others: list[float]) -> None:
    """Refuse a taped DBH ten times too large or small for its tree, or, without a measured one, far too large for the
    layer: the engine's tests (``single_cm``, ``near``, ``large_cm``, ``gap``).

    Raises:
        Refused: see above.
    """
    limits = known()
    low, high = limits["single_cm"]
    if measured:
        tenfold = abs(abs(math.log(cm / measured)) - math.log(10)) < math.log1p(limits["near"])
        wrong, beside = tenfold and not low < cm < high, measured
    else:
        beside = max(others, default=math.inf)
        wrong = cm >= limits["large_cm"] and cm >= limits["gap"] * beside
    if wrong:
        text = tr(
            "Tree {tree}: {taped} cm, but {known} cm in the layer; these look like millimetres, or the decimal point "
            "is elsewhere: type the diameter in centimetres."
        )
        raise Refused(text.format(tree=tree, taped=f"{cm:g}", known=f"{beside:.1f}"))


def merge_note(tree: int, note: str = "") -> str:
    """``rev_note`` of a tree that is the same as ``tree``; the engine reads the number from it, so it is not
    translated."""
    return f"same tree as {tree}" + (f"; {note}" if note else "")


def merged_into(note: str) -> int | None:
    """The tree that a :func:`merge_note` names."""
    found = _MERGED.match(note or "")
    return int(found.group(1)) if found else None


def own_note(note: str) -> str:
    """What a person wrote, without the words of a merge."""
    return _MERGED.sub("", note or "", count=1)


def reasons_in_words(reasons: str) -> list[tuple[str, str]]:
    """``few_views,lean`` -> (what it means, what to do) each, in the user's language; unknown keys as they are."""
    out = []
    for key in (part.strip() for part in (reasons or "").split(",")):
        if key:
            meaning, action = known()["reasons"].get(key, (key, ""))
            out.append((tr(meaning), tr(action)))
    return out


def user() -> str:
    """Who decides: the user of this machine, as the verb ``review`` says it."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""


def now() -> str:
    """The moment, UTC, ISO 8601."""
    return datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
