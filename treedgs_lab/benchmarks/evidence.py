"""Put the outputs of ``treedgs benchmark`` and ``treedgs evaluate`` into the docs: one command each, nothing by hand.

    treedgs benchmark --quick --output OUT            (on an idle machine: the seconds count)
    treedgs benchmark --suite stability --output OUT
    treedgs benchmark --suite cost --output OUT
    treedgs evaluate --plots PLOTS.csv --output EVALUATION     (columns trees, truth, lidar, splats, workspace_in)
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

from treedgs_geo.core.files import read_json, write_json
from treedgs_lab.benchmarks.figures import PUBLISHED
from treedgs_lab.benchmarks.records import RESULTS, made_by

#: Copied as they are; pictures of the suite and HTML pages stay in OUT.
COPIED = (
    *("benchmark.csv", "cost.json", "cost.svg"),
    *("stability-trees.csv", "stability-factors.csv"),
)
METHODS = ("densities.svg", "trend.svg", "methods.csv", "segmentation.csv")


def publish(source: Path, name: str) -> None:
    """Copy one output to ``docs/results/NAME`` and note in ``published.json`` where it is from."""
    shutil.copy(source, RESULTS / name)
    known = read_json(PUBLISHED) if PUBLISHED.exists() else {}
    written = datetime.date.fromtimestamp(source.stat().st_mtime).isoformat()
    known[name] = made_by([0]) | {"output": f"{source.parent.name}/{source.name}", "date": written}
    write_json(PUBLISHED, dict(sorted(known.items())))
    print(f"docs/results/{name}")


def publish_outputs(source: Path, part: str) -> None:
    """What ``treedgs benchmark`` left. part: some plots of the chart (``benchmark_PART.csv``), or some seeds
    or methods of the suite (``stability_PART-*.csv``, ``stability_PART.json``), kept beside the whole by this name."""
    for name in COPIED:
        if (source / name).exists():
            stem, mark, rest = name.partition("-" if name.startswith("stability") else ".")
            publish(source / name, f"{stem}_{part}{mark}{rest}" if part else name)
    if (source / "stability.json").exists():
        verdict = read_json(source / "stability.json")["verdict"]
        target = RESULTS / (f"stability_{part}.json" if part else "stability-methods.json")
        write_json(target, {"made_by": made_by([0]), **verdict})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="source", type=Path, action="append", default=[], help="outputs of benchmark")
    parser.add_argument("--part", default="", help="--from has a part of the suite or of the chart, called this")
    parser.add_argument("--evaluation", type=Path, action="append", default=[], help="outputs of evaluate, by plot")
    options = parser.parse_args()
    for source in options.source:
        publish_outputs(source, options.part)
    for folder in options.evaluation:
        for name in METHODS:
            if (folder / name).exists():
                publish(folder / name, f"{folder.name}-{name}")


if __name__ == "__main__":
    main()
