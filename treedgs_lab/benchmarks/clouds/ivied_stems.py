"""Stems under ivy in drone LiDAR: is a ring of leaves taken for bark?

    python -m treedgs_lab.benchmarks.clouds.ivied_stems --scratch DIR --output docs/results/ivied_stems.json

Simulated plots, three stems of each under ivy, rendered with few tiny photos (they are not used). The limits of
:func:`treedgs_geo.stems.cloud.estimate.cloud.beside_the_others` were set on plots of seeds 501 to 503; these report.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

from treedgs_lab.benchmarks.clouds.interval_coverage import figures, measure, simulated
from treedgs_lab.benchmarks.plot import DENSITIES
from treedgs_lab.benchmarks.records import write_record

SEEDS = (511, 512, 513, 514)
_STAND: dict = {"ivy_stems": 3, "bark_variety": True, "moss_pct": 15.0, "shrubs_per_m2": 0.3, "gsd_cm": 3.5}


def main() -> None:
    """Make the plots, measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scratch", type=Path, required=True, help="where the plots are kept")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    under_ivy: list[dict] = []
    others: list[dict] = []
    count = {True: 0, False: 0}
    for number, seed in enumerate(SEEDS):
        density = DENSITIES[number % len(DENSITIES)]
        folder = simulated(args.scratch / f"ivy_{seed}", preset="demo", seed=seed, lidar_density_m2=density, **_STAND)
        with open(folder / "truth" / "looks.csv", encoding="utf-8") as stream:
            ivy = {
                row["tree_id"]: float(row["ivy_m"]) > 0 for row in csv.DictReader(stream) if row["in_plot"] == "True"
            }
        rows, _ = measure(folder)
        for row in rows:
            (under_ivy if ivy[row["tree"]] else others).append(row)
        for kind in count:
            count[kind] += sum(value is kind for value in ivy.values())
    record = {
        "under_ivy": {"stems": count[True], "with_dbh": under_ivy},
        "others": figures(others, count[False]) if others else {"stems": count[False], "measured": 0},
    }
    print(json.dumps(record, indent=1))
    write_record(args.output, record, seeds=SEEDS)


if __name__ == "__main__":
    main()
