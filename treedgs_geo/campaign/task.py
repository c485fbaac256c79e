"""What a Dask worker does for a plot: start its supervisor and wait. Nothing of a plot runs inside the worker."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

from ..core.children import python_command
from ..core.folder_lock import host

#: Dask's name for the memory a worker has for plots, GB (``--resources memory_gb=12``).
RESOURCE = "memory_gb"
#: Seconds that a worker which cannot start plots waits before it takes the next one.
SETUP_S = 5.0


def run_plot(job: dict[str, Any]) -> dict[str, Any]:
    """Run one plot in a process of its own; a crash there is an answer here."""
    limit = _limit()
    with subprocess.Popen(
        python_command("treedgs_geo.campaign.supervise"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(json.dumps({**job, "limit_gb": limit}).encode() + b"\n")
            process.stdin.flush()
            # The pipe stays open: its end shows the supervisor that this worker is gone.
            answer = process.stdout.read().splitlines()
        except BrokenPipeError:
            answer = []
    try:
        return json.loads(answer[-1])
    except (IndexError, ValueError):
        if process.returncode > 0:
            # It ended by itself before it could say anything: this host's Python or libraries, not the plot. A host
            # that fails at once would otherwise draw all plots from those that work.
            time.sleep(SETUP_S)
            return {
                "outcome": "setup",
                "message": f"no plot can be started on {host()} ({sys.executable} ended with "
                f"code {process.returncode}); run 'treedgs doctor' there",
            }
        return {"outcome": "interrupted", "message": "the plot's supervisor was killed", "may_retry": True}


def _limit() -> float | None:
    """Memory of this worker for plots, GB, where it declares any."""
    try:
        from distributed import get_worker

        value = get_worker().state.total_resources.get(RESOURCE)
        return float(value) if value else None
    except (ImportError, ValueError, AttributeError):
        return None
