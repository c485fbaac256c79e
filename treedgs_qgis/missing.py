"""What the engine's end of a job can be, each one sentence; and that it is missing, with what sets it up."""

from __future__ import annotations

import math
from collections.abc import Iterable

from . import extras
from .words import tr

#: A set-up beside other programs that kept both cores busy took this many times as long as one alone: 425 s, not 180.
BUSY = 2.4


class EngineError(Exception):
    """One sentence for the user: what happened and what to do."""


class EngineMissing(EngineError):
    """No usable engine environment was found.

    parts: extras to set up beside what is there. helps: whether setting up the engine makes it work; not where a
    setting or a variable names another Python. broken: it was set up, and something is wrong with it.
    """

    def __init__(self, text: str, parts: Iterable[str] = (), helps: bool = True) -> None:
        super().__init__(text)
        self.parts, self.helps, self.broken = tuple(parts), helps, False


class EngineCancelled(EngineError):
    """The user stopped the job."""


def set_up_runs() -> str:
    """Said to a job, and to a second set-up, meanwhile."""
    return tr("The engine is being set up; wait until the message bar says that it is set up, then press Run again.")


def how_to_install() -> str:
    """What to do about a missing engine: ends each of those sentences."""
    return tr(
        "run the algorithm 'Set up the engine' (in a shell: qgis_process run treedgs:setupengine), or point the "
        "environment variable TREEDGS_PYTHON at a Python that has the engine's libraries"
    )


def takes(parts: Iterable[str] = ()) -> str:
    """Disk and time of setting up the engine, or only these extras: ``1.2 GB, 2–5 min``."""
    chosen = list(parts) or ["", *extras.USUAL]
    quiet = extras.minutes(chosen)
    return tr("{size}, {low}–{high} min").format(
        size=extras.in_words(sum(map(extras.disk_mb, chosen))), low=quiet, high=math.ceil(BUSY * quiet)
    )
