"""Other processes looked at while they may end at any moment."""

from __future__ import annotations

import psutil


def words_of(process: psutil.Process) -> str:
    """Its command line in one string; empty once it has ended (a zombie has none to read)."""
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""
