"""What a Dask worker does for a plot: start its supervisor and wait. Nothing of a plot runs inside the worker."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

#: Dask's name for the memory a worker has for plots, GB (``--resources memory_gb=12``).
RESOURCE = "memory_gb"


def run_plot(job: dict[str, Any]) -> dict[str, Any]:
    """Run one plot in a process of its own; a crash there is an answer here."""
    limit = _limit()
    with subprocess.Popen(
        [sys.executable, "-m", "treedgs_geo.campaign.supervise"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(json.dumps({**job, "limit_gb": limit}).encode() + b"\n")
            process.stdin.flush()
            # The pipe stays open: its end tells the supervisor that this worker is gone.
            answer = process.stdout.read().splitlines()
        except BrokenPipeError:
            answer = []
    try:
        return json.loads(answer[-1])
    except (IndexError, ValueError):
        return {"outcome": "interrupted", "message": "the plot's supervisor died", "may_retry": True}


def _limit() -> float | None:
    """Memory of this worker for plots, GB, where it declares any."""
    try:
        from distributed import get_worker

        value = get_worker().state.total_resources.get(RESOURCE)
        return float(value) if value else None
    except (ImportError, ValueError, AttributeError):
        return None
