"""``review``: a person's decisions on trees, kept beside the measured values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import TABLES, TREE_LAYERS, param


@dataclass(frozen=True, kw_only=True)
class ReviewSettings:
    """Options of ``review``."""

    trees: Path = param(
        help="tree layer that the decisions are written into, in columns of their own", suffixes=TREE_LAYERS
    )
    decisions: Path = param(
        help="CSV with tree_id, decision (accept, reject, dbh, merge, stem or undo) and, where needed, dbh_cm, "
        "same_as, x, y, note, by, at",
        suffixes=TABLES,
    )
    dbh_unit: str = param(
        "auto", choices=("auto", "cm", "mm", "m", "in"), help="unit of the DBH column (auto: from a name like dbh_cm)"
    )


def run(settings: ReviewSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, decide, write."""
    from ..inventory.review.apply import review_trees
    from ..inventory.reviewed import reviewed
    from ..inventory.tree_reading import read_trees

    outcome = review_trees(settings.trees, settings.decisions, dbh_unit=settings.dbh_unit)
    reporter.tell(outcome.sentences)
    made = ", ".join(f"{n} {word}" for word, n in outcome.counts.items())
    more = f"; trees {', '.join(map(str, outcome.added))} are new" if outcome.added else ""
    reporter.info(f"{settings.trees.name}: {made or 'no decision'}{more}.")
    result = {"output": str(settings.trees), "n_decisions": sum(outcome.counts.values()), "n_added": len(outcome.added)}
    if settings.trees.suffix.lower() != ".csv":
        counted, review = reviewed(read_trees(settings.trees), settings.trees)
        reporter.tell(notes=review.sentences(settings.trees.name))
        open_ = counted["qc_flag"].isin(["check", "reject"]) & ~counted["sure"]
        result |= {"n_reviewed": review.total, "n_open": int(open_.sum())}
    return result


COMMAND = Command(
    name="review",
    title="Apply decisions from a table",
    group="3 Check",
    summary="Write a person's decisions on trees into the tree layer, beside the measured values.",
    help=(
        "Decisions: accept (tree and DBH count as measured), reject (no tree stands here), dbh (the taped diameter "
        "counts), merge (the same tree as same_as, which counts), stem (a stem stands here, its DBH is not known; "
        "without tree_id: at x, y of the layer's CRS), undo. They go into the columns rev_flag, rev_dbh_cm, rev_note, "
        "rev_by and rev_at; what was measured stays as it is. All decisions of a table are written or none. Pairing, "
        "evaluation and stand table use them and say how many; measuring again into the same layer keeps them. In QGIS "
        "the panel Review trees does the same by mouse."
    ),
    settings=ReviewSettings,
    run=run,
    main=("trees", "decisions"),
    example="treedgs review --trees trees.gpkg --decisions decisions.csv",
    outputs={
        "output": "tree layer",
        "n_decisions": "decisions written",
        "n_added": "stems added",
        "n_reviewed": "trees that a person decided on, in all",
        "n_open": "trees to check, or without a DBH, that nobody decided on yet",
    },
)
