"""Stems that a field crew knows, in ``segment-stems``: where to look harder, and what became of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyproj

from ..core.errors import InputError
from ..core.field_stems import FieldStems, read_field_stems
from ..core.map_scale import zone_that_fits
from ..core.progress import Reporter
from ..core.tables import write_csv
from ..stems.cloud.propose.field_stems import FAR_M, FIELD_MATCH_M, Answer, answer_stems, named
from ..stems.cloud.propose.segment import StemMap
from ..stems.quality.reasons import explain

#: What is said of field stems that were not found, by their answer.
_NOT_FOUND = {
    "unsure": "have a stem near that may be another's",
    "refused": "are seen, but cannot be measured",
    "missing": "were not found at their places",
}


def read_places(path: Path | None, crs: pyproj.CRS | None, low: np.ndarray, high: np.ndarray) -> FieldStems | None:
    """The field stems in the cloud's CRS, ``None`` without a file. low, high: (2,) corners of the cloud.

    Raises:
        InputError: none of them stands in the cloud.
    """
    if path is None:
        return None
    field = read_field_stems(path, crs)

    def inside(xy: np.ndarray) -> bool:
        return bool(((xy >= low - FIELD_MATCH_M) & (xy <= high + FIELD_MATCH_M)).all(axis=1).any())

    if not inside(field.xy):
        zone = zone_that_fits(crs, field.xy, inside)
        hint = f"; in EPSG:{zone.to_epsg()}, {zone.name}, they would" if zone is not None else ""
        raise InputError(
            f"{path}: none of its {len(field.xy)} stems stands in the cloud (the first is at {field.xy[0, 0]:.1f}, "
            f"{field.xy[0, 1]:.1f}{hint}); give positions in the cloud's CRS."
        )
    return field


def name_stems(
    stems: StemMap, field: FieldStems | None, output: Path, reporter: Reporter
) -> tuple[np.ndarray, dict[str, Any]]:
    """``((S + 1,) new ids by old ones, facts)``, 0 = seen, but refused; of field stems the facts are counts and the
    table of their answers, written beside ``output``."""
    seen = np.array([False, *(stem.refused not in ("", "not_round") for stem in stems.stems)])
    ids, facts = np.cumsum(np.r_[False, ~seen[1:]]).astype(np.int32), {}
    if field is not None:
        answers = answer_stems(stems, field)
        ids = named(stems, field, answers)
        facts = _answered(field, answers, output, reporter)
    ids[seen] = 0
    if seen.any():
        reasons = ", ".join(sorted({stem.refused for stem in stems.stems} - {"", "not_round"}))
        reporter.info(f"{seen.sum()} more are seen, but cannot be measured ({reasons}); their points carry no tree_id.")
    return ids, facts


def _answered(field: FieldStems, answers: list[Answer], output: Path, reporter: Reporter) -> dict[str, Any]:
    """Says what became of each field stem; writes the table beside the output."""
    if field.counted:
        pairs = list(zip(field.names, field.ids, strict=True))
        some = ", ".join(f"{name} = {number}" for name, number in pairs[:3])
        reporter.info(f"The field stems' names are no whole numbers: tree_id counts them as in the file ({some} ...).")
    by = {kind: [one for one in answers if one.answer == kind] for kind in ("found", *_NOT_FOUND)}
    reporter.info(f"{len(by['found'])} of {len(answers)} field stems found.")
    for kind, text in _NOT_FOUND.items():
        if by[kind]:
            listed = ", ".join(f"{one.name} ({one.reason or f'{one.gap_m:.2f} m'})" for one in by[kind][:8])
            reporter.warn(f"{len(by[kind])} field stems {text}: {listed}{' ...' if len(by[kind]) > 8 else ''}.")
    far = [one for one in by["found"] if one.gap_m is not None and one.gap_m >= FAR_M]
    if far:
        listed = ", ".join(f"{one.name} ({one.gap_m:.2f} m)" for one in far[:8])
        reporter.warn(f"{len(far)} field stems are found {FAR_M:g} m off or more, check their names: {listed}.")
    rows = [
        (int(number), one.name, *xy, one.answer, one.reason, explain(one.reason), one.gap_m)
        for number, xy, one in zip(field.ids, field.xy, answers, strict=True)
    ]
    table = output.with_name(f"{output.stem}_field.csv")
    columns = ["tree_id", "name", "x", "y", "answer", "qc_reason", "why", "gap_m"]
    write_csv(table, pd.DataFrame(rows, columns=columns), float_format="%.3f")
    return {"field_table": str(table), "field_stems": {kind: len(ones) for kind, ones in by.items()}}
