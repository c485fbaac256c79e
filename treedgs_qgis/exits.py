"""What the end of the engine's process means, where the engine itself could not say it. Standard library only."""

from __future__ import annotations

import re
import signal
from pathlib import Path

from .words import tr

#: What libraries print as their last words when an allocation is refused.
_NO_MEMORY = re.compile(
    r"^MemoryError|bad_alloc|memory allocation (still )?failed|cannot allocate memory|out of memory", re.IGNORECASE
)


def explain_exit(code: int, tail: list[str], log: Path) -> str:
    """One sentence for an exit that the engine itself could not explain."""
    if code in (-9, 137) or (code != 0 and any(_NO_MEMORY.search(line) for line in tail)):
        return tr(
            "The engine was killed by the system, most likely because memory ran out; close other programs, choose "
            "a faster preset or fewer photos, and run again to resume (log: {log})."
        ).format(log=log)
    if code in (-11, -6, -7, -4, -8, 139, 134):
        name = signal.Signals(-code if code < 0 else code - 128).name
        return tr(
            "The engine crashed ({name}); run 'Check the engine' (treedgs:checkengine), and if that is fine report the "
            "log {log}."
        ).format(name=name, log=log)
    if code in (-15, -2, 143, 130):
        return tr("The engine was stopped from outside; run again to resume (log: {log}).").format(log=log)
    windows = {
        0xC0000005: tr("it touched memory it does not own"),
        0xC000001D: tr("the processor lacks an instruction it needs"),
        0xC0000135: tr(
            "a system library is missing, install the Visual C++ redistributable from "
            "https://aka.ms/vs/17/release/vc_redist.x64.exe"
        ),
    }
    if code & 0xFFFFFFFF in windows:
        return tr("The engine crashed: {why} (log: {log}).").format(why=windows[code & 0xFFFFFFFF], log=log)
    last = next((line.strip() for line in reversed(tail) if line.strip()), tr("it said nothing"))
    return tr("The engine ended with code {code}: {last} (log: {log}).").format(code=code, last=last, log=log)
