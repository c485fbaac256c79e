"""The whole photo chain with a former code and with this one, in turns on one core: seconds, diameters, stems lost.

    git worktree add ../before COMMIT
    python -m treedgs_lab.benchmarks.photos.side_by_side --against ../before
        --plots ../shared/data/plot_a ../shared/data/plot_e \
        --core 1 --output docs/results/photos_side_by_side.json

Processor seconds (own and children's) are what a busy machine changes least; wall seconds stand beside them.
``--warm``: each code runs once on a plot before, uncounted, so that no run compiles; without it the first run of each
code says what compiling costs. Nothing true is given; tree heights and evidence sheets are left out of both.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_lab.benchmarks.records import ROOT, write_record
from treedgs_lab.benchmarks.verbs import environment, photo_inputs, words

assert sys.platform != "win32", "this benchmark needs Linux"

#: Of every random choice: the verb's own.
SEED = 0
#: Clear photos that a stem of the comparison has at least.
MIN_VIEWS = 3
FIGURES = ("n_reference", "n_measured", "n_false", "rmse_cm", "me_cm", "max_abs_cm", "coverage_90")


def run(code: Path, plot: Path, core: int | None, work: Path, chosen: list[str]) -> dict[str, Any]:
    """One chain run of a code on a plot, from nothing."""
    output = work / "trees.gpkg"
    command = words("photos-to-dbh", *photo_inputs(plot), "--workspace", work / "ws", "--output", output, *chosen)
    pinned = ["taskset", "-c", str(core)] if core is not None else []
    env = {**environment(code), "OMP_NUM_THREADS": "1"} if core is not None else environment(code)
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([*pinned, *command, "--log-format", "quiet"], cwd=code, env=env, check=True)
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - began
    stages = read_json(work / "ws" / "run.json")["stages"]
    block = read_json(work / "ws" / "sfm" / "report.json")
    accuracy, _ = score_against_truth(read_trees(output), plot / "truth" / "trees.csv", MIN_VIEWS)
    found = accuracy.as_dict()
    return {
        "processor_s": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1),
        "wall_s": round(wall, 1),
        "stages_wall_s": {name: stage["seconds"] for name, stage in stages.items()},
        "reconstruction_wall_s": block["stage_seconds"],
        "registered": [block["registered"], block["photos"]],
        "level": block.get("level"),
        "climbed_because": block.get("climbed_because"),
        **{name: found[name] for name in FIGURES},
    }


def main() -> int:
    """Run, print and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, help="checkout of the former code")
    parser.add_argument("--plots", type=Path, nargs="+", required=True)
    parser.add_argument("--core", type=int, help="processor core that all runs share")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--warm", action="store_true", help="run each code once before, uncounted")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    options = parser.parse_args()
    codes = {"before": options.against.resolve(), "now": ROOT}
    chosen = ["--preset", options.preset, "--heights", "none", "--sheets", "none"]
    rows: list[dict[str, Any]] = []
    for repeat in range(-1 if options.warm else 0, options.repeats):
        for plot in options.plots if repeat >= 0 else options.plots[:1]:
            for name, code in codes.items():
                with tempfile.TemporaryDirectory(prefix="treedgs-side-") as work:
                    row = run(code, plot.resolve(), options.core, Path(work), chosen)
                if repeat < 0:
                    continue
                rows.append({"plot": plot.resolve().name, "code": name, "repeat": repeat, **row})
                print(
                    f"{rows[-1]['plot']:<8} {name:<7} {row['processor_s']:7.1f} s ({row['wall_s']:.0f} s wall) "
                    f"{row['n_measured']} of {row['n_reference']}, {row['n_false']} false, {row['rmse_cm']:.2f} cm, "
                    f"{row['coverage_90']:.0%} inside, level {row['level']} {row['climbed_because'] or ''}",
                    flush=True,
                )
                write_record(options.output, {"threads": os.environ.get("OMP_NUM_THREADS"), "runs": rows}, [SEED])
    return 0


if __name__ == "__main__":
    sys.exit(main())
