"""What the machine gives this process."""

from __future__ import annotations

import os


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def available_threads() -> int:
    """Threads to use: :func:`cores`; ``TREEDGS_THREADS`` sets it where several plots share a machine."""
    asked = os.environ.get("TREEDGS_THREADS", "")
    return int(asked) if asked.isdigit() and int(asked) else cores()
