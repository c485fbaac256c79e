"""Parts of the engine that not everybody needs: what brings each, how large it is. Standard library only.

Sizes are measured (``python tools/measure_engine.py`` writes ``extras.json``).
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable
from pathlib import Path

from .words import tr

SIZES = Path(__file__).with_name("extras.json")
#: What ``setupengine`` lets choose -> modules it brings. The library's ``core.extras`` has the same.
CHOICES: dict[str, tuple[str, ...]] = {
    "reports": ("openpyxl", "reportlab"),
    "simulate": ("open3d",),
}
#: Small, and a stand table is what most people want in the end.
USUAL = ("reports",)
#: Chosen by BUILD, not by hand.
GPU = "gpu"


#: A usual line: what the times that are promised are reckoned with.
LINE_MBIT_S = 50.0


def _measured(extra: str, what: str) -> int:
    return int(json.loads(SIZES.read_text(encoding="utf-8"))["parts"][extra or "engine"][what])


def disk_mb(extra: str = "") -> int:
    """Megabytes on disk of an extra, or of the engine without any ('')."""
    return _measured(extra, "disk_mb")


def download_mb(extra: str = "") -> int:
    """Megabytes to download."""
    return _measured(extra, "download_mb")


def install_s(extra: str = "") -> int:
    """Processor seconds of setting it up, on the computer of the measurement: about what comes on top of the download
    on a quiet one."""
    return _measured(extra, "install_s")


def compile_s() -> float:
    """Seconds of compiling ahead what jobs run compiled, once: measured on one processor; a second one halves it."""
    measured = json.loads(SIZES.read_text(encoding="utf-8"))["compile_cpu_s"]
    return float(measured) / min(os.cpu_count() or 1, 2)


def size(extra: str = "") -> str:
    """The same in words: ``0.9 GB``, ``15 MB``."""
    return in_words(disk_mb(extra))


def in_words(megabytes: float) -> str:
    """``0.9 GB``, ``15 MB``."""
    return f"{megabytes / 1000:.1f} GB" if megabytes >= 950 else f"{megabytes:.0f} MB"


def minutes(parts: Iterable[str]) -> int:
    """What setting up some parts ('': the engine itself) takes on a line of 50 Mbit/s, rounded up."""
    chosen = list(parts)
    seconds = sum(download_s(part) + install_s(part) for part in chosen) + (compile_s() if "" in chosen else 0)
    return max(1, math.ceil(seconds / 60))


def download_s(extra: str = "") -> float:
    """Seconds on a line of 50 Mbit/s."""
    return download_mb(extra) * 8 / LINE_MBIT_S


def needed_gb(chosen: Iterable[str]) -> float:
    """Free disk that setting up takes: what is installed, and pip's copy of the largest wheels meanwhile."""
    parts = ["", *chosen]
    return round(sum(disk_mb(part) + download_mb(part) for part in parts) / 1000, 1)


def title(extra: str) -> str:
    """What it is for, with its size."""
    texts = {
        "reports": tr("Stand tables as Excel and PDF ({size})"),
        "simulate": tr("Simulated plots, dense points as PLY ({size})"),
    }
    return texts[extra].format(size=size(extra))


def missing(modules: Iterable[str]) -> list[str]:
    """The extras that bring all of some modules; empty when one of them belongs to none."""
    found: list[str] = []
    for module in modules:
        names = [name for name, brings in CHOICES.items() if module in brings]
        if not names:
            return []
        found += [name for name in names if name not in found]
    return found
