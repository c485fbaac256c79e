"""TreeDGS in processes of its own, whose seconds and peak memory are nobody else's: verbs on plots as ``simulate-plot``
writes them, and jobs of this package."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any

from treedgs_geo.core.children import python_command
from treedgs_geo.core.files import read_json, write_json

#: Of all rendered and simulated plots: NAD83(2011) / UTM 15N.
CRS = "EPSG:6344"
#: What the crew brings of ground control, in the plot's folder.
CONTROL = "gcp_list.txt"


class Stopwatch:
    """Seconds since it was made: on the clock, and of processors, of this process and its finished children."""

    def __init__(self) -> None:
        self._began = self._now()

    def seconds(self) -> dict[str, float]:
        """``wall_s`` and ``cpu_s``, to a tenth."""
        wall_s, cpu_s = (round(now - began, 1) for now, began in zip(self._now(), self._began, strict=True))
        return {"wall_s": wall_s, "cpu_s": cpu_s}

    @staticmethod
    def _now() -> tuple[float, float]:
        times = os.times()
        return time.monotonic(), times.user + times.system + times.children_user + times.children_system


def words(verb: str, *options: Any) -> list[str]:
    """The command of a verb; options as one types them, paths and numbers too."""
    return python_command("treedgs_geo", verb, *options)


def photo_inputs(plot: Path, crs: str = CRS) -> list[Any]:
    """``--photos`` … of a plot's folder, all that may be known of it: never ``truth/`` nor ``dtm.tif``."""
    inputs = ["--photos", plot / "images", "--crs", crs, "--plots", plot / "plots.csv"]
    if any(plot.glob("*.MRK")) or any(plot.glob("*.pos")):
        inputs += ["--geotags", plot]
    if (plot / CONTROL).exists():
        inputs += ["--gcp", plot / CONTROL]
    return inputs


def run_verb(verb: str, *options: Any) -> None:
    """Run a verb to its end.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    subprocess.run(words(verb, *options), check=True)


def simulate(plot: Path, options: list[Any]) -> None:
    """``simulate-plot`` with these options, unless the plot is there."""
    if not (plot / "truth" / "config.json").exists():
        run_verb("simulate-plot", "--output", plot, *options, "--log-format", "quiet")


def run_job(job: dict[str, Any], result: Path) -> dict[str, Any]:
    """Run a job of :mod:`.speed.jobs` in a child process; returns and keeps its record (``error`` instead of results if
    it failed)."""
    job_file = result.with_suffix(".job.json")
    write_json(job_file, job)
    began = time.perf_counter()
    command = python_command("treedgs_lab.benchmarks.speed.jobs", job_file, result)
    child = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
    job_file.unlink(missing_ok=True)
    if child.returncode or not result.exists():
        error = f"exit code {child.returncode}: {_last_line(child.stderr)}"
        write_json(result, {"error": error, "wall_s": round(time.perf_counter() - began, 2)})
    return read_json(result)


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["no message"])[-1][:300]
