"""Put the outputs of ``treedgs benchmark`` and ``treedgs evaluate`` into the docs: one command each, nothing by hand.

    treedgs benchmark --quick --output OUT            (on an idle machine: the seconds count)
    treedgs benchmark --stability --output OUT
    treedgs benchmark --cost --output OUT
    treedgs evaluate --trees ... --truth ... --lidar ... --splats ... --workspace-in ... --output EVALUATION
    python -m treedgs_lab.benchmarks.evidence --from OUT [--evaluation EVALUATION ...]

Copies charts, CSV and JSON into ``docs/results/`` and notes commit, date and machine of each in ``published.json`` (so
run it where OUT was made, with the same code). What is not in OUT stays as it is. ``python -m
treedgs_lab.benchmarks.figures`` then fills the pages.
"""

from __future__ import annotations

import argparse
import datetime
import shutil
from pathlib import Path

import pandas as pd

from treedgs_geo.core.files import read_json, write_json
from treedgs_lab.benchmarks.figures import PUBLISHED
from treedgs_lab.benchmarks.records import RESULTS, made_by
from treedgs_lab.benchmarks.stability.factor_report import by_factor
from treedgs_lab.benchmarks.stability.report import verdict

#: Copied as they are; pictures of the suite and HTML pages stay in OUT.
COPIED = (
    "benchmark.csv",
    "stability-trees.csv",
    "stability-blocks.csv",
    "stability-factors.csv",
    "cost.json",
    "cost.svg",
)
METHODS = (
    "densities.svg",
    "trend.svg",
    "methods.csv",
    "segmentation.csv",
)


def publish(source: Path, name: str) -> None:
    """Copy one output to ``docs/results/NAME`` and note in ``published.json`` where it is from."""
    shutil.copy(source, RESULTS / name)
    known = read_json(PUBLISHED) if PUBLISHED.exists() else {}
    written = datetime.date.fromtimestamp(source.stat().st_mtime).isoformat()
    known[name] = made_by([0]) | {"output": f"{source.parent.name}/{source.name}", "date": written}
    write_json(PUBLISHED, dict(sorted(known.items())))
    print(f"docs/results/{name}")


def publish_verdict(source: Path, name: str) -> None:
    """The suite's verdict method by method, of its ``stability.json``."""
    if (source / "stability.json").exists():
        write_json(RESULTS / name, {"made_by": made_by([0]), **read_json(source / "stability.json")["verdict"]})


def publish_part(source: Path, part: str) -> None:
    """Some seeds or methods of the stability suite: ``stability_PART-*.csv`` and ``stability_PART.json``; or some plots
    of the chart: ``benchmark_PART.csv``."""
    if (source / "benchmark.csv").exists():
        publish(source / "benchmark.csv", f"benchmark_{part}.csv")
        return
    for name in ("factors", "trees"):
        publish(source / f"stability-{name}.csv", f"stability_{part}-{name}.csv")
    publish_verdict(source, f"stability_{part}.json")


def score_again(part: str) -> None:
    """The strata and the verdict anew from ``stability_PART-trees.csv``, where their rules have changed since."""
    trees = pd.read_csv(RESULTS / f"stability_{part}-trees.csv")
    by_factor(trees).to_csv(RESULTS / f"stability_{part}-factors.csv", index=False, float_format="%.4g")
    kept = read_json(RESULTS / f"stability_{part}.json")
    write_json(RESULTS / f"stability_{part}.json", {"made_by": kept["made_by"], **verdict(trees)})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="source", type=Path, action="append", default=[], help="outputs of benchmark")
    parser.add_argument(
        "--part", help="--from has a part of the suite or of the chart: kept beside the whole by this name"
    )
    parser.add_argument("--evaluation", type=Path, action="append", default=[], help="outputs of evaluate, by plot")
    parser.add_argument("--score-again", metavar="PART", help="strata and verdict anew from the trees kept of a part")
    options = parser.parse_args()
    if options.score_again:
        score_again(options.score_again)
    RESULTS.mkdir(exist_ok=True)
    for source in options.source:
        if options.part:
            publish_part(source, options.part)
            continue
        for name in COPIED:
            if (source / name).exists():
                publish(source / name, name)
        publish_verdict(source, "stability-methods.json")
    for folder in options.evaluation:
        for name in METHODS:
            if (folder / name).exists():
                publish(folder / name, f"{folder.name}-{name}")


if __name__ == "__main__":
    main()
