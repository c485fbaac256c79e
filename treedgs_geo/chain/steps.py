"""Stages in order, each kept when nothing it depends on has changed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import __version__
from ..core.files import fingerprint
from ..core.progress import Reporter
from ..core.workspace import Workspace

#: Share of the whole run per stage, measured on plot_a with 2 cores; only the progress bar depends on it.
SHARES = {"geotag": 0.02, "reconstruct": 0.46, "ground": 0.01, "measure": 0.50, "write": 0.01}


class Collector(Reporter):
    """Passes everything on and remembers the warnings, for the report and for a resumed run."""

    def __init__(self, inner: Reporter) -> None:
        super().__init__()
        self._inner = inner
        self.warnings: list[str] = []

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "warn":
            self.warnings.append(body["message"])
        if kind != "progress":
            self._inner._emit(kind, body)
        else:
            self._inner.progress(body["fraction"], body["message"])


class Steps:
    """Runs stages one after the other; the key of a stage covers everything before it."""

    def __init__(self, space: Workspace, reporter: Reporter) -> None:
        self.space, self.reporter = space, reporter
        self._key, self._at = "", 0.0
        self._left = dict(SHARES)
        self.warnings: list[str] = []

    def weigh(self, name: str, factor: float) -> None:
        """The stage ``name``, still to come, takes ``factor`` times longer than usual: the progress bar knows it."""
        self._left[name] *= factor

    def run(
        self,
        name: str,
        settings: dict[str, Any],
        inputs: list[Path],
        outputs: list[Path],
        work: Callable[[Collector], dict[str, Any]],
        always: bool = False,
    ) -> dict[str, Any]:
        """Do ``work(reporter)`` as stage ``name`` unless it is done already; returns its (JSON) result.

        settings: whatever changes the outcome. inputs: files whose content changes it. outputs: files that must exist
        for the stage to count as done. always: never keep an earlier result.
        """
        share = self._left.pop(name)
        high = min(self._at + (1.0 - self._at) * share / (share + sum(self._left.values())), 1.0)
        described = json.dumps([__version__, self._key, settings, fingerprint(inputs)], sort_keys=True, default=str)
        self._key = hashlib.sha256(described.encode()).hexdigest()[:16]
        plain = json.loads(json.dumps(settings, default=str))
        with self.reporter.stage(name, self._at, high):
            if not always and self.space.is_done(name, self._key, outputs):
                self.reporter.info(f"{name}: unchanged since the last run, kept")
                found = self.space.result(name)
            else:
                collector = Collector(self.reporter)
                with self.space.running(name, self._key, plain) as found:
                    found.update(work(collector))
                    found["warnings"] = list(dict.fromkeys(collector.warnings))
        self._at = high
        self.warnings += found["warnings"]
        return found

    @property
    def run_id(self) -> str:
        """Names the run by its inputs and settings so far: the same inputs give the same id."""
        return self._key
