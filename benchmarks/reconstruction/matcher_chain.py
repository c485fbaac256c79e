"""The example matcher plug-in through the whole chain: what it costs, and that a second run does not start again.

    treedgs simulate-plot --output WORK/200001 --preset micro --seed 200001 --sun-shift-min 40 --labels true
    python -m training.matcher --plots WORK/200001 ... --minutes 2 --output WORK/sun_matcher.pt
    python -m benchmarks.reconstruction.matcher_chain --plot DIR --matcher examples/sun_matcher.py \
        --matcher-weights WORK/sun_matcher.pt --work WORK --output docs/results/matcher_chain.json

``photos-to-dbh`` three times: without a plug-in, with it, and with it again in the same workspace. CPU seconds and the
largest memory are of the whole command.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.records import write_record
from benchmarks.rendered import CLEAR_VIEWS
from benchmarks.verbs import photo_inputs, words
from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees


def measured_run(command: list[str]) -> tuple[float, float]:
    """CPU seconds and largest memory (MB) of a command that has to end well."""
    if sys.platform == "win32":
        raise SystemExit("This benchmark asks Linux or macOS what a process took; run it there.")
    process = subprocess.Popen(command)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command[2:5])}: ended with {process.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def chain(plot: Path, work: Path, name: str, more: list[Any]) -> dict:
    """One run of the chain, scored."""
    space, layer = work / name, work / f"{name}.gpkg"
    command = words("photos-to-dbh", *photo_inputs(plot), *more, "--workspace", space, "--output", layer)
    seconds, memory = measured_run(command)
    report = read_json(space / "sfm" / "report.json")
    accuracy, _ = score_against_truth(read_trees(layer), plot / "truth" / "trees.csv", CLEAR_VIEWS)
    kept = {
        key: report[key] for key in ("level", "registered", "photos", "pairs", "matches", "matcher") if key in report
    }
    return {
        "cpu_s": round(seconds, 1),
        "peak_memory_mb": round(memory),
        "reconstruct": kept,
        "reconstruct_s": read_json(space / "run.json")["stages"]["reconstruct"]["seconds"],
        **accuracy.as_dict(),
    }


def main() -> None:
    """Run, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--matcher", type=Path, required=True)
    parser.add_argument("--matcher-weights", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True, help="folder for the workspaces, without any yet")
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    plugin = ["--matcher", arguments.matcher, "--matcher-weights", arguments.matcher_weights]
    record: dict = {"plot": arguments.plot.name, "runs": {}}
    for label, name, more in (("without", "plain", []), ("with", "plugin", plugin), ("with, again", "plugin", plugin)):
        record["runs"][label] = chain(arguments.plot, arguments.work, name, more)
        print(label, record["runs"][label], flush=True)
        write_record(arguments.output, record)


if __name__ == "__main__":
    main()
