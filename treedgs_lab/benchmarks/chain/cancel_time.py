"""How long Ctrl-C takes: a real job through ``qgis_process``, interrupted in each stage, until no process is left.

python -m treedgs_lab.benchmarks.chain.cancel_time PLOT_FOLDER [--output docs/results/cancel_time.json]
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

from tools import qgis_run
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.verbs import CRS

#: The log's line after which the signal comes, and how long after it, s.
MOMENTS = (("Features in each photo", 3.0), ("Same points in several photos", 3.0), ("Stems and their diameters", 3.0))


def interrupt(plot: Path, workspace: Path, words: str, after_s: float) -> dict:
    """Start (or resume), wait for the words, signal, and watch every process of the job."""
    program = qgis_run.qgis_process()
    assert program is not None, "QGIS is not installed"
    command = [program, "run", "treedgs:photostodbh", "--", f"PHOTOS={plot / 'images'}", f"GEOTAGS={plot}"]
    command += [f"CRS={CRS}", f"PLOTS={plot / 'plots.csv'}", f"WORKSPACE={workspace}"]
    command += [f"OUTPUT={workspace / 'trees.gpkg'}"]
    running = subprocess.Popen(
        command, env=qgis_run.environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert running.stdout is not None
    for line in running.stdout:
        if words in line and "…" in line:
            break
    time.sleep(after_s)
    children = psutil.Process(running.pid).children(recursive=True)
    began = time.monotonic()
    running.send_signal(signal.SIGINT)
    _, left = psutil.wait_procs(children, timeout=30)
    engine_s = time.monotonic() - began
    running.communicate(timeout=60)
    return {
        "stage": words,
        "processes": len(children),
        "engine_gone_s": round(engine_s, 2),
        "qgis_gone_s": round(time.monotonic() - began, 2),
        "left": len(left),
        "rc": running.returncode,
        "load": round(psutil.getloadavg()[0], 1),
    }


def main() -> int:
    """Interrupt in three stages of one workspace, print, optionally write JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plot", type=Path)
    parser.add_argument("--output", type=Path)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        runs = [interrupt(chosen.plot, Path(folder) / "work", words, after) for words, after in MOMENTS]
    result = {"runs": runs}
    print(json.dumps(result, indent=1))
    write_record(chosen.output, result)
    return 0 if all(run["left"] == 0 for run in runs) else 1


if __name__ == "__main__":
    sys.exit(main())
