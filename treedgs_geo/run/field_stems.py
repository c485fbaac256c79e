"""Stems that a field crew knows, in a photo run: where to look, and what became of each."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.field_stems import FieldStems, read_field_stems
from ..core.progress import Reporter
from ..core.shown import count_of
from ..core.tables import write_csv
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.targeted_fit import GivenStems, partners
from ..stems.quality.tree import Tree
from .context import PhotoJob, Site

COLUMNS = ("field_id", "answer", "tree_id", "gap_m", "dbh_cm", "qc_flag", "qc_reason")


@dataclass(frozen=True)
class Answer:
    """Of one field stem. answer: ``measured`` or ``refused`` (both have a tree), ``merged`` (a tree that another field
    stem is stands there) or ``outside`` (not in the measured plots). gap_m: to the tree."""

    name: str
    answer: str
    tree: Tree | None = None
    gap_m: float = 0.0

    def row(self) -> list[Any]:
        """Of ``COLUMNS``, ready for a CSV."""
        tree = self.tree
        if tree is None:
            return [self.name, self.answer, "", "", "", "", "merged" if self.answer == "merged" else ""]
        dbh = "" if tree.dbh_cm is None else f"{tree.dbh_cm:.2f}"
        return [self.name, self.answer, tree.tree_id, f"{self.gap_m:.2f}", dbh, tree.qc_flag, tree.qc_reason]


def field_stems(job: PhotoJob) -> FieldStems | None:
    """The field stems in project coordinates, ``None`` where none are given."""
    path = job.settings.field_stems
    return None if path is None else read_field_stems(path, job.place.frame.crs)


def given_stems(xy: np.ndarray, site: Site, reach_m: float) -> GivenStems:
    """(K, 2) project coordinates as the search takes them."""
    raised = np.column_stack([xy, np.full(len(xy), site.frame.origin[2])])
    return GivenStems(site.frame.to_local(raised)[:, :2], reach_m)


def answers_of(
    field: FieldStems, given: GivenStems, site: Site, fits: list[PhotoFit], trees: list[Tree], margin_m: float
) -> list[Answer]:
    """What became of each. fits: of the run; ``trees``: theirs. margin_m: how far beyond the plots was searched."""
    inside = site.area.contains(given.xy, margin_m)
    of_fit = {tree.tree_id: tree for tree in trees}
    answers = []
    for k, (name, partner) in enumerate(zip(field.names, partners(given, fits), strict=True)):
        if partner is None:
            answers.append(Answer(name, "merged" if inside[k] else "outside"))
            continue
        tree, gap = of_fit[partner + 1], float(np.hypot(*(fits[partner].axis.p - given.xy[k])))
        answers.append(Answer(name, "refused" if tree.dbh_cm is None else "measured", tree, gap))
    return answers


def report_answers(answers: list[Answer], path: Path | None, reporter: Reporter) -> dict[str, int]:
    """Say what became of the field stems in ``path``; returns how many have which answer."""
    counts, stems = Counter(answer.answer for answer in answers), count_of(len(answers), "field stem")
    said = [f"{counts['measured']} measured"]
    if counts["refused"]:
        said.append(f"{counts['refused']} refused, each with its reason in the layer")
    if counts["merged"]:
        said.append(f"{counts['merged']} at a tree that is another field stem's")
    reporter.info(f"{path}: {stems}: {', '.join(said)}.")
    outside = [" ".join(answer.name.split()) for answer in answers if answer.answer == "outside"]
    if outside:
        reporter.warn(
            f"{path}: {len(outside)} of {stems} lie outside the measured plots and are not looked for: "
            f"{', '.join(outside[:10])}{', …' if len(outside) > 10 else ''}; check their coordinates, CRS and the "
            "plots."
        )
    return {word: counts[word] for word in ("measured", "refused", "merged", "outside")}


def write_answers(path: Path, answers: list[Answer]) -> None:
    """``field_stems.csv`` in the workspace."""
    rows = [answer.row() for answer in answers]
    write_csv(path, pd.DataFrame(rows, columns=list(COLUMNS), dtype=object), lineterminator="\n")
