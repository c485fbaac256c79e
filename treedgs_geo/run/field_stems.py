"""Stems that a field crew knows, in a photo run: where to look, and what became of each."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pandas as pd

from ..core import workspace as names
from ..core.field_stems import FieldStems, read_field_stems
from ..core.progress import Reporter
from ..core.shown import count_of
from ..core.tables import write_csv
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.targeted_fit import GivenStems, partners
from ..stems.quality.tree import Tree
from .context import PhotoJob, Site

COLUMNS = ("field_id", "answer", "tree_id", "gap_m", "dbh_cm", "qc_flag", "qc_reason")


def field_stems(job: PhotoJob) -> FieldStems | None:
    """The field stems in project coordinates, ``None`` where none are given."""
    path = job.settings.field_stems
    return None if path is None else read_field_stems(path, job.place.frame.crs)


def given_stems(xy: np.ndarray, site: Site, reach_m: float) -> GivenStems:
    """(K, 2) project coordinates as the search takes them."""
    raised = np.column_stack([xy, np.full(len(xy), site.frame.origin[2])])
    return GivenStems(site.frame.to_local(raised)[:, :2], reach_m)


def answer_field_stems(
    job: PhotoJob, field: FieldStems, given: GivenStems, fits: list[PhotoFit], trees: list[Tree], reporter: Reporter
) -> dict[str, int]:
    """Say what became of the field stems, and write ``field_stems.csv`` in the workspace; how many have which answer.

    The answers: ``measured`` or ``refused`` (both have a tree), ``merged`` (a tree that another field stem is stands
    there) or ``outside`` (not in the measured plots). fits: of the run; trees: theirs.
    """
    asked, inside = job.settings.field_stems, job.place.area.contains(given.xy, job.preset.stems.margin_m)
    of_fit = {tree.tree_id: tree for tree in trees}
    rows: list[list[Any]] = []
    for k, (name, partner) in enumerate(zip(field.names, partners(given, fits), strict=True)):
        if partner is None:
            rows.append([name, "merged" if inside[k] else "outside", "", "", "", "", "merged" if inside[k] else ""])
            continue
        tree, gap_m = of_fit[partner + 1], float(np.hypot(*(fits[partner].axis.p - given.xy[k])))
        answer, dbh = ("refused", "") if tree.dbh_cm is None else ("measured", f"{tree.dbh_cm:.2f}")
        rows.append([name, answer, tree.tree_id, f"{gap_m:.2f}", dbh, tree.qc_flag, tree.qc_reason])
    table = pd.DataFrame(rows, columns=list(COLUMNS), dtype=object)
    write_csv(job.path(names.FIELD_STEMS), table, lineterminator="\n")
    counts, stems = Counter(row[1] for row in rows), count_of(len(rows), "field stem")
    said = [f"{counts['measured']} measured"]
    if counts["refused"]:
        said.append(f"{counts['refused']} refused, each with its reason in the layer")
    if counts["merged"]:
        said.append(f"{counts['merged']} at a tree that is another field stem's")
    reporter.info(f"{asked}: {stems}: {', '.join(said)}.")
    outside = [" ".join(row[0].split()) for row in rows if row[1] == "outside"]
    if outside:
        reporter.warn(
            f"{asked}: {len(outside)} of {stems} lie outside the measured plots and are not looked for: "
            f"{', '.join(outside[:10])}{', …' if len(outside) > 10 else ''}; check their coordinates, CRS and the "
            "plots."
        )
    return {word: counts[word] for word in ("measured", "refused", "merged", "outside")}
