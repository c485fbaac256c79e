"""Time, memory and Gaussians of stem primitives against the number of stems, one thread, in one run.

    python -m treedgs_lab.benchmarks.gaussians.growth --plot DIR [--workspace WS] [--stems 1 2 4 8]

Each number of stems runs in a process of its own (peak memory), after a warm-up that compiles the kernels. Linear
growth shows as a constant CPU time a stem and a constant step of memory a stem.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from pathlib import Path

import numpy as np

from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, scene_of, truth_rows


def fit(plot: Path, workspace: Path | None, count: int, answers: multiprocessing.Queue) -> None:
    """Fit ``count`` stems and report seconds, memory and sizes."""
    frame, views, dtm = scene_of(plot, workspace)
    places = local_places(truth_rows(plot)[:count], frame)
    ground = dtm.local(frame).height
    began = time.process_time()
    field, report = fit_with_report(views, frame, ground, places, None, GaussianOptions(threads=1))
    answers.put(
        {
            "stems": count,
            "crops": sum(stem["crops"] for stem in report.stems),
            "megapixels": report.megapixels,
            "gaussians": len(field),
            "million_pairs": round(report.pairs / 1e6),
            "cpu_s": round(time.process_time() - began, 1),
            "peak_memory_mb": peak_memory_mb(),
        }
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, help="a rendered plot with truth/")
    parser.add_argument("--workspace", type=Path, help="poses (sfm/) of this workspace instead of the true ones")
    parser.add_argument("--stems", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    context, runs = multiprocessing.get_context("spawn"), []
    for count in [1, *arguments.stems]:
        answers = context.Queue()
        child = context.Process(target=fit, args=(arguments.plot, arguments.workspace, count, answers))
        child.start()
        runs.append(answers.get())
        child.join()
    runs = runs[1:]
    for run in runs:
        print(run)
    record: dict = {"runs": runs}
    if len(runs) > 1:
        stems = np.array([run["stems"] for run in runs], float)
        for name in ("cpu_s", "peak_memory_mb"):
            slope, base = np.polyfit(stems, [run[name] for run in runs], 1)
            record[name] = {"per_stem": round(float(slope), 2), "base": round(float(base), 1)}
            print(f"{name}: {base:.1f} + {slope:.2f} a stem")
    write_record(arguments.output, record, seeds=[GaussianOptions().seed])


if __name__ == "__main__":
    main()
