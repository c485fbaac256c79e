"""The campaign's folder: plot numbers, the plan on disk, and whether the last start came to its end."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..core.costs import CostModel
from ..core.errors import InputError
from ..core.files import atomic_path, read_json, short_hash, write_json
from ..core.progress import Reporter
from .inputs import crs_name
from .manifest import Checker
from .places import CAMPAIGN, PLAN

#: Settings of a row that are paths: their content counts, not their place.
_PATHS = {"photos", "input", "geotags", "gcp", "calibration", "dtm", "plots"}


class Campaign:
    """``campaign.json``: series of starts, whether one is open, who leads it, plot numbers for good."""

    def __init__(self, workspace: Path) -> None:
        self.workspace = Path(workspace)
        self._file = self.workspace / CAMPAIGN
        if self._file.exists():
            self.record = read_json(self._file)
            if not isinstance(self.record, dict) or not {"series", "open", "numbers"} <= set(self.record):
                raise InputError(f"{self._file}: is not a campaign's record; choose an empty folder as workspace.")
        else:
            self.record = {"series": 0, "open": False, "numbers": {}}

    def begin(self, plot_ids: Iterable[str], leader: str) -> None:
        """Open a series of starts, or go on with the one that was broken off; give new plots their numbers. leader:
        key of the campaign's lease."""
        if not self.record["open"]:
            self.record["series"] += 1
            self.record["open"] = True
        numbers = self.record["numbers"]
        following = max(numbers.values(), default=0) + 1
        for number, plot_id in enumerate((name for name in plot_ids if name not in numbers), following):
            numbers[plot_id] = number
        self.record.update(version=__version__, leader=leader)
        write_json(self._file, self.record)

    def end(self) -> None:
        """Every plot is settled: the next start is a new decision, with new attempts."""
        self.record["open"] = False
        write_json(self._file, self.record)


@dataclass
class Plan:
    """The checked rows. entries: ``row``, ``inputs`` (both as JSON), ``settings`` (a hash), and what the plot is
    predicted to take: ``seconds, memory_gb, disk_gb``, ``outside`` (larger than any plot the costs rest on)."""

    entries: list[dict[str, Any]]

    def __len__(self) -> int:
        return len(self.entries)

    def column(self, name: str) -> np.ndarray:
        """(N,) a number of every entry."""
        return np.array([entry[name] for entry in self.entries], float)

    @property
    def routes(self) -> Counter[str]:
        """Route -> plots."""
        return Counter(entry["row"]["route"] for entry in self.entries)

    @classmethod
    def load(cls, workspace: Path) -> Plan:
        """The plan that the leader of the campaign wrote."""
        with open(Path(workspace) / PLAN, encoding="utf-8") as stream:
            return cls([json.loads(line) for line in stream])


def make_plan(manifest: Path, crs: str | None, folder: Path, model: CostModel, reporter: Reporter) -> Plan:
    """Check every row and write the plan: one JSON object a line, in the manifest's order.

    Raises:
        InputError: rows that cannot be used, with their lines and reasons. CRSError: rows in different CRS and no
            ``crs`` to bring them to.
    """
    checker = Checker(manifest, crs)
    entries: list[dict[str, Any]] = []
    for row, found in checker.rows():
        inputs = asdict(found)
        need = asdict(model.predict(row.route, inputs))
        # Changes when a setting or the version changes; files count by their content, in another hash.
        plain = {name: value for name, value in row.values.items() if name not in _PATHS}
        used = (row.route, row.plot_id, plain, row.pairing, bool(row.plots), bool(row.field))
        entries.append({"row": asdict(row), "inputs": inputs, "settings": short_hash(__version__, *used), **need})
        if len(entries) % 200 == 0:
            reporter.progress(0.5, f"{len(entries)} rows checked")
    _one_crs(checker, entries, crs)
    checker.conclude()
    with atomic_path(folder / PLAN) as temporary:
        temporary.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")
    return Plan(entries)


def layer_crs(plan: Plan, crs: str | None) -> str:
    """The CRS of the campaign's layer; ``local`` for local metres."""
    names = [entry["inputs"]["crs"] for entry in plan.entries]
    return "local" if "local" in names else crs_name(crs) if crs else names[0]


def _one_crs(checker: Checker, entries: list[dict[str, Any]], crs: str | None) -> None:
    """One layer has one CRS: rows in several need ``--crs``, and local metres cannot be mixed with anything."""
    seen: dict[str, int] = {}
    for entry in entries:
        seen.setdefault(entry["inputs"]["crs"], entry["row"]["line"])
    if len(seen) < 2 or (crs and "local" not in seen):
        return
    listed = ", ".join(
        f"{name if len(name) < 40 else 'a CRS without EPSG code'} (line {line})"
        for name, line in list(seen.items())[:4]
    )
    hint = (
        "clouds in local metres have no place on the map, run them as a campaign of their own"
        if "local" in seen
        else "give --crs EPSG:… for the layer (trees are brought there), or split the manifest"
    )
    checker.n_bad += 1
    checker.problems.append(
        f"the rows are in {len(seen)} coordinate reference systems: {listed}; one layer has one: {hint}"
    )
