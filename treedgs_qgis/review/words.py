"""What the panel says of a tree. Plain text: what stands in a layer is shown as it is, never as markup."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal
from typing import Any

from ..i18n import tr
from .rules import merged_into, own_note
from .trees import Row

#: decision -> how the panel says it, as the layer's form does
DECISIONS = {
    "accept": "accepted",
    "reject": "no tree stands here",
    "dbh": "taped",
    "merge": "the same tree as another",
    "stem": "a stem stands here, DBH unknown",
}
#: flag -> how the headline says it
TITLES = {
    "ok": "measured",
    "check": "measured, to be checked",
    "reject": "no DBH",
}
#: Which trees are shown: key -> label.
SHOWN = {
    "open": "to be checked, or without a DBH",
    "check": "to be checked",
    "reject": "without a DBH",
    "ok": "measured, nothing against them",
    "decided": "decided by a person",
    "all": "all",
}
#: Which trees are shown: key -> their flags.
FLAGS = {"open": ("check", "reject"), "check": ("check",), "reject": ("reject",), "ok": ("ok",)}


def shown(value: Any) -> str:
    """A number of the layer with one decimal, as map tips, sheets and pages show it (``core.shown``)."""
    return str(Decimal(repr(float(value))).quantize(Decimal("0.1"), ROUND_HALF_UP))


def headline(row: Row) -> str:
    """``Tree 17, plot A: measured, to be checked``."""
    plot = row.values.get("plot_id")
    place = ", " + tr("plot {plot}").format(plot=plot) if plot else ""
    return f"{tr('Tree')} {row.tree_id}{place}: {tr(TITLES.get(row.flag, row.flag))}"


def numbers(row: Row) -> str:
    """DBH with error and interval, photos, lean: one fact a line."""
    v = row.values
    lines = []
    if v.get("dbh_cm") is None:
        lines.append(tr("No DBH was measured."))
    else:
        dbh = f"{tr('DBH')} {shown(v['dbh_cm'])}"
        dbh += f" ± {shown(v['dbh_se_cm'])} cm" if v.get("dbh_se_cm") is not None else " cm"
        if v.get("dbh_lo_cm") is not None and v.get("dbh_hi_cm") is not None:
            dbh += f" (90 %: {shown(v['dbh_lo_cm'])} – {shown(v['dbh_hi_cm'])} cm)"
        lines.append(dbh)
    facts = []
    if v.get("n_views") is not None:
        facts.append(tr("{count} photos see it").format(count=int(v["n_views"])))
    if v.get("n_slices") is not None:
        facts.append(tr("{count} slices").format(count=int(v["n_slices"])))
    if v.get("lean_deg") is not None and v.get("dbh_cm") is not None:
        facts.append(tr("leans {angle}°").format(angle=f"{float(v['lean_deg']):.0f}"))
    if v.get("height_m") is not None:
        facts.append(tr("{height} m tall").format(height=shown(v["height_m"])))
    return "\n".join([*lines, ", ".join(facts)]).strip()


def meaning(row: Row) -> str:
    """``taped (31.5 cm)``, ``the same tree as another (Tree 5)``; '' without a decision."""
    word = row.decision
    text = tr(DECISIONS.get(word, word))
    if word == "dbh" and row.values.get("rev_dbh_cm") is not None:
        text += f" ({shown(row.values['rev_dbh_cm'])} cm)"
    other = merged_into(row.note) if word == "merge" else None
    if other is not None:
        text += f" ({tr('Tree')} {other})"
    return text


def decision(row: Row) -> str:
    """What was decided, by whom and when, and the note."""
    if not row.decision:
        return tr("Not decided yet.") + (f"\n{row.note}" if row.note else "")
    text = tr("Decided: {meaning}").format(meaning=meaning(row))
    who = ", ".join(str(row.values[name]) for name in ("rev_by", "rev_at") if row.values.get(name))
    note = own_note(row.note)
    return "\n".join(part for part in (text, note, who) if part)
