"""What is known of one plot, in its folder: what ran, how it ended, and whether it has to run (again)."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.files import write_json
from ..core.geopackage import is_whole
from .places import RECORD, TREES

#: A plot that fails is tried again at most this often.
RETRIES = 2
#: An attempt cut short because its worker or coordinator died is not the plot's fault; but there is an end to it.
MAX_INTERRUPTIONS = 12
#: Endings that another try at once cannot change.
_FINAL = {"input"}
#: Endings that are not the plot's: a full disk, a host without a library or with too little memory. They do not use up
#: its attempts.
ELSEWHERE = {"disk", "setup", "missing", "too_large"}
_KEPT_ATTEMPTS = 60


@dataclass
class Record:
    """``plot.json``. key: inputs and settings. stamp: names, sizes, times of the inputs. status: ``new``, ``done`` or
    ``failed``. attempts: ``{"series", "host", "began", "outcome", …}``; one without outcome was cut short.
    result: what the plot's run returned."""

    folder: Path
    key: str = ""
    stamp: str = ""
    status: str = "new"
    attempts: list[dict[str, Any]] = field(default_factory=list)
    result: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> Record:
        """The plot's record; a new one where there is none, or none that can be read."""
        try:
            found = json.loads((Path(folder) / RECORD).read_text(encoding="utf-8"))
            attempts, result = list(found["attempts"]), dict(found["result"])
            return cls(Path(folder), found["key"], found["stamp"], found["status"], attempts, result)
        except (OSError, ValueError, KeyError, TypeError):
            return cls(Path(folder))

    def save(self) -> None:
        """Write atomically."""
        kept = {name: value for name, value in vars(self).items() if name != "folder"}
        write_json(self.folder / RECORD, {**kept, "attempts": self.attempts[-_KEPT_ATTEMPTS:]})

    def is_unchanged(self, stamp: str, settings: str) -> bool:
        """Finished, and nothing about its files and settings looks different: no need to read them."""
        return self.status == "done" and self.stamp == stamp and self.key.split(":")[0] == settings and self.has_trees()

    def has_trees(self) -> bool:
        """The plot's layer is there and whole."""
        return is_whole(self.folder / TREES, "trees")

    def counts(self, key: str, series: int) -> tuple[int, int]:
        """``(failed, cut short)`` attempts of this key in this series of starts."""
        mine = [a for a in self.attempts if a.get("series") == series and a.get("key") == key]
        cut = sum(a.get("outcome") in (None, "interrupted") for a in mine)
        return sum(a.get("outcome") not in {None, "interrupted", "done", *ELSEWHERE} for a in mine), cut

    def may_run(self, key: str, series: int) -> bool:
        """Whether another attempt is left."""
        failed, cut = self.counts(key, series)
        ended = [a for a in self.attempts if a.get("outcome") not in (None, "interrupted")]
        last = ended[-1] if ended else {}
        final = last.get("series") == series and last.get("key") == key and last.get("outcome") in _FINAL
        return failed <= RETRIES and cut <= MAX_INTERRUPTIONS and not final

    def last_problem(self) -> str:
        """What the last attempt said."""
        for attempt in reversed(self.attempts):
            if attempt.get("message"):
                return str(attempt["message"])
        return "its worker died each time"
