"""Whether this computer has an NVIDIA card that the engine can use: asked of the driver's own program, never guessed.

Standard library only. The limits are those of the locked version of NVIDIA Warp (CUDA 12).
"""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass

from .pythons import find_program, no_window
from .words import tr

#: Driver of CUDA 12 (525 for Linux, 528 for Windows); GeForce GTX 9xx; room for the field of one plot.
OLDEST_DRIVER, OLDEST_CARD, MIN_MEMORY_MB = 525, (5, 2), 2000
QUERY = ["--query-gpu=name,driver_version,memory.total,compute_cap", "--format=csv,noheader,nounits"]


@dataclass(frozen=True)
class Choice:
    """``build``: ``cpu`` or ``cuda``; ``why``: the reason in words."""

    build: str
    why: str


def ask() -> tuple[int | None, str]:
    """Exit code and answer of ``nvidia-smi``; ``None`` where there is no such program or it does not answer."""
    program = find_program("nvidia-smi")
    if program is None:
        return None, ""
    try:
        done = subprocess.run(
            [program, *QUERY],
            capture_output=True,
            text=True,
            timeout=30,
            cwd=tempfile.gettempdir(),
            **no_window(),
        )
    except (OSError, subprocess.SubprocessError) as problem:
        return None, str(problem)
    return done.returncode, (done.stdout or done.stderr).strip()


def choose(code: int | None, answer: str) -> Choice:
    """What to build for what ``nvidia-smi`` said (see :func:`ask`)."""
    if code is None:
        return Choice("cpu", tr("there is no NVIDIA driver on this computer"))
    if code != 0:
        first = answer.splitlines()[0] if answer else f"exit code {code}"
        return Choice("cpu", tr("the NVIDIA driver does not answer ({answer})").format(answer=first))
    problem = tr("no NVIDIA card was found")
    for line in answer.splitlines():
        parts = [part.strip() for part in line.split(",")]
        if len(parts) != 4:
            continue
        name, driver, memory, card = parts
        values = {"name": name, "driver": driver, "memory": memory, "card": card}
        if _number(driver.split(".")[0]) < OLDEST_DRIVER:
            problem = tr(
                "{name}: its driver is {driver}, expected {least} or newer; update it and run this again"
            ).format(**values, least=OLDEST_DRIVER)
        elif tuple(_number(part) for part in card.split(".")) < OLDEST_CARD:
            problem = tr("{name} is too old for the engine (compute capability {card}, expected {least})").format(
                **values, least=".".join(map(str, OLDEST_CARD))
            )
        elif 0 < _number(memory) < MIN_MEMORY_MB:
            problem = tr("{name} has {memory} MB of memory, expected {least}").format(**values, least=MIN_MEMORY_MB)
        else:
            return Choice("cuda", tr("{name}, driver {driver}").format(**values))
    return Choice("cpu", problem)


def _number(text: str) -> int:
    """A whole number; 0 for what is none, like ``[N/A]``."""
    return int(text) if text.isdigit() else 0
