"""The first step of ``trial``: what was measured, how, and what has to hold is sealed; the form shows no diameter."""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd

from ... import __version__
from ...core.crs import project_crs
from ...core.errors import InputError
from ...core.files import read_json, write_json
from ...core.progress import Reporter
from ...core.shown import count_of, some
from ...core.workspace import read_record
from ...report.pdf import ensure_pages
from ..declination import parse_date
from ..double_sampling.designs import Draw
from ..reviewed import reviewed
from ..taping.form import walk
from ..taping.sample import OWN_LAYERS, keep_tapes, mark_of, read_frame, tape_table, write_field_files
from ..tree_reading import read_trees

#: The record of a trial.
RECORD = "trial.json"
#: Columns of the layer that are sealed; species, notes and the like may be written later.
SEALED = (
    "tree_id", "x", "y", "dbh_cm", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag", "qc_reason", "rev_flag",
    "rev_dbh_cm",
)  # fmt: skip
#: Trees that are drawn at least: of fewer no interval is known.
MIN_TREES = 2


def seal_trial(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``TrialSettings`` without ``taped``. Writes the record and everything for the field.

    Raises:
        InputError: inputs that do not fit, a layer with taped diameters, a folder with a trial or with tapes.
    """
    folder = Path(settings.output)
    if (folder / RECORD).exists():
        raise InputError(f"{folder / RECORD}: is a sealed trial; open it with --taped, or give another folder.")
    ensure_pages(folder, RECORD, "tapes.gpkg", OWN_LAYERS)
    keep_tapes(folder)
    with reporter.stage("read", 0.0, 0.3):
        layer = read_trees(settings.trees)
        _, review = reviewed(layer, settings.trees)
        if review.taped:
            raise InputError(
                f"{settings.trees}: holds {count_of(review.taped, 'taped diameter')} (rev_flag dbh), expected measured "
                "ones; give the layer as it was before the review."
            )
        frame = read_frame(settings.trees, project_crs(settings.crs) if settings.crs else None, settings.plots)
    assert frame.crs is not None
    reporter.tell(frame.warnings, frame.notes)
    n_all = len(frame.trees)
    n = min(settings.n or n_all, n_all)
    if n < MIN_TREES:
        raise InputError(f"--n: {count_of(n, 'tree')} to tape, expected at least {MIN_TREES}.")
    # A simple random sample: every tree counts alike, as in evaluate.
    index = np.sort(np.random.default_rng(settings.seed).choice(n_all, n, replace=False))
    draw = Draw(index, np.full(n, n / n_all), np.full(n, "all", object))
    # What the crew sees says nothing of any diameter.
    hidden = replace(frame, trees=frame.trees.assign(dbh_cm=np.nan, qc_flag=None))
    day = parse_date(settings.field_date, "--field-date").isoformat() if settings.field_date else ""
    trees = walk(hidden, draw, settings, day, settings.trees)
    record: dict[str, Any] = {
        "sealed_at": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "trees": str(settings.trees.resolve()),
        "sealed": {
            "version": __version__,
            "limit_cm": settings.limit_cm,
            "n": settings.n,
            "n_frame": n_all,
            "seed": settings.seed,
            "run": run_settings(settings.trees),
            "drawn": {str(tree): plot for tree, plot in zip(trees["tree_id"], trees["plot_id"], strict=True)},
            "rows": row_marks(layer),
        },
        "opened": [],
    }
    record["marks"] = {name: _sha256(value) for name, value in record["sealed"].items()}
    record["seal"] = _sha256(record["marks"])
    with reporter.stage("write", 0.3, 1.0):
        table = tape_table(trees, n_all, mark_of(hidden.trees), "simple random")
        subtitle = (
            f"{n} of {n_all} trees, drawn at random, seed {settings.seed}; {frame.crs.name}. Limit of the mean error: "
            f"{settings.limit_cm:g} cm. Seal: {record['seal'][:16]}. Nobody of the crew looks at the measured "
            "diameters. Write what you read into tapes.csv or tapes.gpkg, then run trial with --taped."
        )
        write_field_files(folder, hidden, trees, table, subtitle, settings)
        write_json(folder / RECORD, record)
    if record["sealed"]["run"] is None:
        reporter.info(f"No run.json beside {settings.trees.name}: its rows are sealed, how they were measured is not.")
    reporter.info(f"{count_of(n, 'tree')} of {n_all} to tape; seal {record['seal'][:16]}.")
    return {
        "output": str(folder),
        "page": str(folder / "tape_form.html"),
        "layer": str(folder / "tapes.gpkg"),
        "seal": record["seal"],
        "n": n,
    }


def unsealed(settings: Any) -> tuple[dict[str, Any], gpd.GeoDataFrame]:
    """settings: ``TrialSettings`` with ``taped``. The record of its folder, and the trees as they were sealed, by
    ``tree_id``, with what a person decided.

    Raises:
        InputError: no trial, or something is not as it was sealed: what.
    """
    path = Path(settings.output) / RECORD
    record = read_json(path)
    if not isinstance(record, dict) or not {"sealed", "marks", "seal", "trees", "opened"} <= set(record):
        raise InputError(f"{path}: is not the record of a trial; give the folder of trial's first step.")
    sealed = record["sealed"]
    changed = [name for name in {**record["marks"], **sealed} if record["marks"].get(name) != _sha256(sealed.get(name))]
    if changed or record["seal"] != _sha256(record["marks"]):
        raise InputError(
            f"{path}: was changed after it was sealed ({some(changed or ['its seal'], 5)}); restore the file, or seal "
            "and tape anew."
        )
    for name in ("limit_cm", "n"):
        given = getattr(settings, name)
        if given is not None and given != sealed[name]:
            raise InputError(
                f"--{name.replace('_', '-')}: {given:g}, but {path} was sealed with {sealed[name]}; leave it out."
            )
    trees = Path(settings.trees or record["trees"])
    if not trees.exists():
        raise InputError(f"{trees}: the layer that was sealed is not there; say with --trees where it is now.")
    layer = read_trees(trees)
    for file, before, now, what in (
        (trees, sealed["rows"], row_marks(layer), "tree"),
        (trees.parent / "run.json", sealed["run"], run_settings(trees), "stage"),
    ):
        if before is not None and now is not None and (differ := _differences(before, now, what)):
            raise InputError(
                f"{file}: is not as it was sealed: {'; '.join(differ)}; restore it, or seal and tape anew."
            )
    return record, reviewed(layer, trees)[0].set_index("tree_id", drop=False)


def row_marks(layer: gpd.GeoDataFrame) -> dict[str, str]:
    """``tree_id`` -> SHA-256 of what is sealed of the row, the first 16 characters."""
    cells = pd.DataFrame(layer).reindex(columns=SEALED).astype(object)
    cells = cells.where(cells.notna(), None).map(lambda cell: float(cell) if isinstance(cell, int) else cell or None)
    return {str(int(row[0])): _sha256(row)[:16] for row in cells.itertuples(index=False)}


def run_settings(trees: Path) -> dict[str, Any] | None:
    """Settings of the run beside the layer, by stage, with its version; ``None`` where there is none."""
    record = None
    with suppress(InputError):  # another program's run.json
        record = read_record(trees.resolve().parent)
    if record is None:
        return None
    # Where the layer was written to says nothing of how it was measured.
    stages = {name: entry.get("settings") for name, entry in record["stages"].items() if name != "write"}
    return {"version": record.get("version"), **json.loads(json.dumps(stages))}


def _differences(before: dict[str, Any], now: dict[str, Any], what: str) -> list[str]:
    """What differs by key, in words. what: a key is called."""
    found = {
        "changed": [key for key in before if key in now and now[key] != before[key]],
        "gone": [key for key in before if key not in now],
        "new": [key for key in now if key not in before],
    }
    return [f"{count_of(len(keys), what)} {word} ({some(keys, 8)})" for word, keys in found.items() if keys]


def _sha256(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True, ensure_ascii=True).encode()).hexdigest()
