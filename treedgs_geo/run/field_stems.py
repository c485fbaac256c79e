"""Stems that a field crew knows, in a photo run: where to look, and what became of each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.field_stems import FieldStems, read_field_stems
from ..core.files import atomic_path
from ..core.progress import Reporter
from ..core.tables import SafeWriter
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.targeted_fit import GivenStems, partners
from ..stems.quality.tree import Tree
from .context import Site

COLUMNS = ("field_id", "answer", "tree_id", "gap_m", "dbh_cm", "qc_flag", "qc_reason")
#: What became of a field stem.
MEASURED, REFUSED, MERGED, OUTSIDE = "measured", "refused", "merged", "outside"


@dataclass(frozen=True)
class Answer:
    """Of one field stem. answer: :data:`MEASURED` or :data:`REFUSED` (both have a tree), :data:`MERGED` (a tree that
    another field stem is stands there) or :data:`OUTSIDE` (not in the measured plots). gap_m: to the tree."""

    name: str
    answer: str
    tree: Tree | None = None
    gap_m: float | None = None

    def row(self) -> list[Any]:
        """Of ``COLUMNS``, ready for a CSV."""
        tree, reason = self.tree, "merged" if self.answer == MERGED else ""
        gap = "" if self.gap_m is None else f"{self.gap_m:.2f}"
        if tree is None:
            return [self.name, self.answer, "", gap, "", "", reason]
        dbh = "" if tree.dbh_cm is None else f"{tree.dbh_cm:.2f}"
        return [self.name, self.answer, tree.tree_id, gap, dbh, tree.qc_flag, tree.qc_reason]


@dataclass(frozen=True)
class Answers:
    """One for each field stem, in their order."""

    found: list[Answer]

    def report(self, path: Path | None, reporter: Reporter) -> dict[str, Any]:
        """Say what became of them; returns the facts for the stage's result."""
        counts = {
            word: sum(answer.answer == word for answer in self.found) for word in (MEASURED, REFUSED, MERGED, OUTSIDE)
        }
        said = {
            f"{counts[MEASURED]} measured": True,
            f"{counts[REFUSED]} refused, each with its reason in the layer": counts[REFUSED],
            f"{counts[MERGED]} at a tree that is another field stem's": counts[MERGED],
        }
        stems = "1 field stem" if len(self.found) == 1 else f"{len(self.found)} field stems"
        reporter.info(f"{path}: {stems}: {', '.join(text for text, n in said.items() if n)}.")
        outside = [" ".join(answer.name.split()) for answer in self.found if answer.answer == OUTSIDE]
        if outside:
            reporter.warn(
                f"{path}: {len(outside)} of {stems} lie outside the measured plots and are not looked for: "
                f"{', '.join(outside[:10])}{', …' if len(outside) > 10 else ''}; check their coordinates, CRS and the "
                "plots."
            )
        return {"field_stems": counts}


def read_places(path: Path | None, site: Site) -> FieldStems | None:
    """The field stems in project coordinates, ``None`` where none are given."""
    return None if path is None else read_field_stems(path, site.frame.crs)


def local_places(xy: np.ndarray, site: Site) -> np.ndarray:
    """(K, 2) project coordinates -> local ones."""
    return site.frame.to_local(np.column_stack([xy, np.full(len(xy), site.frame.origin[2])]))[:, :2]


def places_of(field: FieldStems, site: Site, error_m: float) -> GivenStems:
    """The field stems as the search takes them."""
    return GivenStems(local_places(field.xy, site), error_m)


def answers_of(
    field: FieldStems, given: GivenStems, site: Site, fits: list[PhotoFit], trees: list[Tree], margin_m: float
) -> Answers:
    """What became of each. fits: of the run; ``trees``: theirs. margin_m: how far beyond the plots was searched."""
    inside = site.area.contains(given.xy, margin_m)
    of_fit = {tree.tree_id: tree for tree in trees}
    answers = []
    for k, partner in enumerate(partners(given, fits)):
        name = field.names[k]
        if partner is None:
            answers.append(Answer(name, MERGED if inside[k] else OUTSIDE))
            continue
        tree = of_fit[partner + 1]
        gap = float(np.hypot(*(fits[partner].axis.p - given.xy[k])))
        answers.append(Answer(name, REFUSED if tree.dbh_cm is None else MEASURED, tree, gap))
    return Answers(answers)


def write_answers(path: Path, answers: Answers) -> None:
    """``field_stems.csv`` in the workspace."""
    with atomic_path(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as stream:
        writer = SafeWriter(stream, COLUMNS)
        writer.header()
        for answer in answers.found:
            writer.row(answer.row())
