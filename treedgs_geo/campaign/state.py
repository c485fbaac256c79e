"""The campaign's folder: identity, plot numbers, the plan on disk, and whether the last start came to its end."""

from __future__ import annotations

import hashlib
import json
import os
import uuid
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..core.costs import CostModel
from ..core.errors import InputError
from ..core.files import atomic_path, read_json, write_json
from ..core.progress import Reporter
from .manifest import Checker, PlotRow
from .places import CAMPAIGN, PLAN, plot_folder

#: Settings of a row that are paths: their content counts, not their place.
_PATHS = {"photos", "input", "geotags", "gcp", "calibration", "dtm", "plots"}


class Campaign:
    """``campaign.json``: uuid, series of starts, whether one is open, plot numbers."""

    def __init__(self, workspace: Path) -> None:
        self.workspace = Path(workspace)
        self._file = self.workspace / CAMPAIGN
        if self._file.exists():
            self.record = read_json(self._file)
            if not isinstance(self.record, dict) or not {"uuid", "series", "open", "numbers"} <= set(self.record):
                raise InputError(f"{self._file}: is not a campaign's record; choose an empty folder as workspace.")
        else:
            self.record = {"uuid": uuid.uuid4().hex, "series": 0, "open": False, "numbers": {}}

    def begin(self, plot_ids: Iterator[str]) -> None:
        """Open a series of starts, or go on with the one that was broken off; give new plots their numbers."""
        if not self.record["open"]:
            self.record["series"] += 1
            self.record["open"] = True
        numbers = self.record["numbers"]
        following = max(numbers.values(), default=0) + 1
        for plot_id in plot_ids:
            if plot_id not in numbers:
                numbers[plot_id] = following
                following += 1
        self.record["version"] = __version__
        write_json(self._file, self.record)

    def end(self) -> None:
        """Every plot is settled: the next start is a new decision, with new attempts."""
        self.record["open"] = False
        write_json(self._file, self.record)

    @property
    def series(self) -> int:
        """Number of the series of starts."""
        return int(self.record["series"])

    @property
    def uuid(self) -> str:
        """Identity of the campaign, checked by every worker."""
        return str(self.record["uuid"])

    def number(self, plot_id: str) -> int:
        """The plot's number, the same in every start."""
        return int(self.record["numbers"][plot_id])


@dataclass
class Plan:
    """The checked rows on disk. file: one JSON object a line, in the manifest's order. offsets: where each begins.
    seconds, memory_gb, disk_gb: predicted. crs: of the layer. n_outside: plots larger than any the costs rest on."""

    file: Path
    offsets: array
    seconds: np.ndarray
    memory_gb: np.ndarray
    disk_gb: np.ndarray
    routes: dict[str, int]
    totals: dict[str, float]
    crs: str
    n_outside: int

    def __len__(self) -> int:
        return len(self.offsets)

    def entry(self, index: int) -> dict[str, Any]:
        """One plot's line."""
        with open(self.file, "rb") as stream:
            stream.seek(self.offsets[index])
            return json.loads(stream.readline())

    def entries(self) -> Iterator[dict[str, Any]]:
        """All, one at a time, in the manifest's order."""
        with open(self.file, encoding="utf-8") as stream:
            for line in stream:
                yield json.loads(line)


def make_plan(
    manifest: Path, crs: str | None, folder: Path, model: CostModel, reporter: Reporter, run_programs: bool = False
) -> Plan:
    """Check every row and write the plan; nothing is kept in memory but a few numbers a plot.

    Raises:
        InputError: rows that cannot be used, with their lines and reasons. CRSError: rows in different CRS and no
            ``crs`` to bring them to.
    """
    checker = Checker(manifest, crs, run_programs)
    offsets, seconds, memory, disk = array("q"), array("d"), array("d"), array("d")
    routes: dict[str, int] = {}
    totals = dict.fromkeys(("photos", "megapixels", "points_m", "gigabytes"), 0.0)
    seen: dict[str, int] = {}
    outside = 0
    with atomic_path(folder / PLAN) as temporary:
        with open(temporary, "wb") as stream:
            for checked in checker.rows():
                row, inputs = checked.row, checked.inputs
                need = model.predict(row.route, inputs.to_json())
                offsets.append(stream.tell())
                line = {
                    "row": row.to_json(),
                    "inputs": inputs.to_json(),
                    "settings": settings_hash(row),
                    "seconds": need.seconds,
                    "memory_gb": need.memory_gb,
                    "disk_gb": need.disk_gb,
                }
                stream.write(json.dumps(line).encode() + b"\n")
                seconds.append(need.seconds)
                memory.append(need.memory_gb)
                disk.append(need.disk_gb)
                outside += need.outside
                routes[row.route] = routes.get(row.route, 0) + 1
                for name in totals:
                    totals[name] += getattr(inputs, name)
                if len(seen) < 50:
                    seen.setdefault(inputs.crs, row.line)
                if len(offsets) % 200 == 0:
                    reporter.progress(0.5, f"{len(offsets)} rows checked")
        _one_crs(checker, seen, crs)
        checker.conclude()
    layer = _layer_crs(seen, crs)
    return Plan(
        folder / PLAN, offsets, np.array(seconds), np.array(memory), np.array(disk), routes, totals, layer, outside
    )


def settings_hash(row: PlotRow) -> str:
    """Changes when a setting or the version changes; files count by their content, in another hash."""
    plain = {name: value for name, value in row.values.items() if name not in _PATHS}
    described = json.dumps(
        [__version__, row.route, row.plot_id, plain, row.pairing, bool(row.plots), bool(row.field)],
        sort_keys=True,
        default=str,
    )
    return hashlib.sha256(described.encode()).hexdigest()[:16]


def job_of(entry: dict[str, Any], campaign: Campaign, turn: int, threads: int, time_limit_min: float) -> dict[str, Any]:
    """What a worker needs to know to run one plot."""
    plot_id = entry["row"]["plot_id"]
    return {
        "plot_id": plot_id,
        "folder": str(plot_folder(campaign.workspace.resolve(), plot_id)),
        "workspace": str(campaign.workspace.resolve()),
        "campaign": campaign.uuid,
        "version": __version__,
        "series": campaign.series,
        "settings": entry["settings"],
        "stamp": entry["inputs"]["stamp"],
        "row": entry["row"],
        "threads": threads,
        "need_gb": entry["memory_gb"],
        "disk_gb": entry["disk_gb"],
        "time_limit_min": time_limit_min,
        "turn": f"{os.getpid()}-{turn}",
    }


def _layer_crs(seen: dict[str, int], crs: str | None) -> str:
    from .inputs import crs_name

    if "local" in seen:
        return "local"
    return crs_name(crs) if crs else next(iter(seen))


def _one_crs(checker: Checker, seen: dict[str, int], crs: str | None) -> None:
    """One layer has one CRS: rows in several need ``--crs``, and local metres cannot be mixed with anything."""
    if len(seen) < 2 or (crs and "local" not in seen):
        return
    listed = ", ".join(f"{_short(name)} (line {line})" for name, line in list(seen.items())[:4])
    hint = (
        "clouds in local metres have no place on the map, run them as a campaign of their own"
        if "local" in seen
        else "give --crs EPSG:… for the layer (trees are brought there), or split the manifest"
    )
    checker.n_bad += 1
    checker.problems.append(
        f"the rows are in {len(seen)} coordinate reference systems: {listed}; one layer has one: {hint}"
    )


def _short(crs: str) -> str:
    return crs if len(crs) < 40 else "a CRS without EPSG code"
