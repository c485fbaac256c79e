"""Stages that are kept in a workspace: done again only where something they depend on has changed."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import __version__
from .errors import InputError, TreeDGSError
from .files import fingerprint
from .geopackage import move_aside
from .progress import Reporter
from .workspace import Workspace, peak_memory_mb


class Collector(Reporter):
    """Passes everything on and remembers the warnings, for the report and for a resumed run.

    held: messages are kept back until it is clear that the work they tell of is used (:meth:`release`).
    """

    def __init__(self, inner: Reporter, held: bool = False) -> None:
        super().__init__()
        self._inner, self._held = inner, held
        self._said: list[tuple[str, str]] = []

    @property
    def warnings(self) -> list[str]:
        """The warnings so far."""
        return [message for kind, message in self._said if kind == "warn"]

    def release(self, reporter: Reporter | None = None) -> None:
        """Pass on the messages that were kept back, in their order; reporter: to this one."""
        for kind, message in self._said if self._held else ():
            getattr(reporter or self._inner, kind)(message)
        self._held = False

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "progress":
            self._inner.progress(body["fraction"], body["message"])
        elif kind in ("info", "warn"):
            self._said.append((kind, body["message"]))
            # A reporter of the user's may have its own words for these.
            if not self._held:
                getattr(self._inner, kind)(body["message"])
        else:
            self._inner._emit(kind, body)


class NotKept(InputError):
    """A stage would have to be done again."""


class Steps:
    """Runs stages one after the other; the key of a stage covers everything before it.

    space: where finished stages are kept; without one nothing is. shares: stage -> share of the run's time. only_kept:
    nothing is done again; a stage that would have to be is an error.
    """

    def __init__(
        self, space: Workspace | None, reporter: Reporter, shares: dict[str, float], only_kept: bool = False
    ) -> None:
        self.space, self.reporter, self.only_kept = space, reporter, only_kept
        self._key, self._at = "", 0.0
        self._left = dict(shares)
        self.warnings: list[str] = []
        #: Stage -> name of the run by its inputs and settings up to there: the same inputs give the same.
        self.run_ids: dict[str, str] = {}
        #: Stage -> seconds and peak memory.
        self.done: dict[str, dict[str, Any]] = {}

    def weigh(self, name: str, factor: float) -> None:
        """The stage ``name``, still to come, takes ``factor`` times longer than usual: the progress bar knows it."""
        if name in self._left:
            self._left[name] *= factor

    def skip(self, name: str) -> None:
        """The stage ``name`` will not run: the progress bar does not wait for it."""
        self._left.pop(name, None)

    def run(
        self,
        name: str,
        settings: dict[str, Any],
        inputs: list[Path],
        outputs: list[Path],
        work: Callable[[Collector], dict[str, Any]],
        always: bool = False,
        readable: Callable[[], object] | None = None,
    ) -> dict[str, Any]:
        """Do ``work(reporter)`` as stage ``name`` unless it is done already; returns its (JSON) result.

        settings: whatever changes the outcome. inputs: files whose content changes it. outputs: files that must be as
        the stage left them for it to count as done. always: never keep an earlier result. readable: for outputs that
        people may edit: raises a ``TreeDGSError`` when they cannot be used any more.

        Raises:
            NotKept: the stage would have to be done again, and only kept ones are wanted.
        """
        share = self._left.pop(name)
        high = min(self._at + (1.0 - self._at) * share / (share + sum(self._left.values())), 1.0)
        space = self.space
        if space is None:
            collector, began = Collector(self.reporter), time.monotonic()
            with self.reporter.stage(name, self._at, high):
                found = work(collector)
            self.done[name] = {"seconds": time.monotonic() - began, "peak_memory_mb": peak_memory_mb()}
            self._at, self.warnings = high, self.warnings + collector.warnings
            return found
        contents = fingerprint(inputs)
        self.run_ids[name] = _hash(__version__, *list(self.run_ids.values())[-1:], settings, contents)
        # The same folder by another name is no reason to do a stage again.
        absolute = {k: os.path.abspath(v) if isinstance(v, Path) else v for k, v in settings.items()}
        self._key = _hash(__version__, self._key, absolute, contents)
        plain = json.loads(json.dumps(settings, default=str))
        with self.reporter.stage(name, self._at, high):
            if not always and self._is_kept(space, name, outputs, readable):
                self.reporter.info(f"{name}: unchanged since the last run, kept")
                found = space.result(name)
            elif self.only_kept:
                raise NotKept(
                    f"{space.folder}: the stage {name} of its run is not finished with these inputs and settings; "
                    "run photos-to-dbh with them once without --at, then give the points again."
                )
            else:
                collector = Collector(self.reporter)
                edited = outputs if readable else []
                with space.running(name, self._key, plain, outputs, edited) as found:
                    found.update(work(collector))
                    found["warnings"] = list(dict.fromkeys(collector.warnings))
        # A stage done again may come out otherwise: what follows depends on what is there, not on what was asked for.
        self._key = _hash(self._key, space.output_hashes(name))
        self._at = high
        self.warnings += found.get("warnings", [])
        return found

    def _is_kept(self, space: Workspace, name: str, outputs: list[Path], readable: Callable[[], object] | None) -> bool:
        if not space.ran(name, self._key):
            return False
        problem = space.damage(name, outputs)
        aside = ""
        try:
            if readable is not None and not problem:
                readable()
        except TreeDGSError as trouble:
            problem = str(trouble)
            aside = "".join(f" The file is kept as {move_aside(path).name}." for path in outputs)
        if problem:
            self.reporter.warn(f"{problem.rstrip('.')}; the stage {name} is done again.{aside}")
        return not problem


def _hash(*parts: Any) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()[:16]
