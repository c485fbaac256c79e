"""Bowed stems in drone LiDAR: the stability suite's base plot with its stems bowed over the lowest 4 m.

    python benchmarks/bowed_stems.py --scratch DIR --output docs/results/bowed_stems.json

Plots of three seeds, rendered with few tiny photos (they are not used); in-plot stems with a DBH count. Seed 1 is the
suite's; the limits of ``from_points/measuring/bow.py`` were set with all three in sight, so this is no blind test.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from interval_coverage import figures, measure  # noqa: E402

from treedgs_geo import __version__  # noqa: E402
from treedgs_geo.benchmarking.factors import BASE, factor  # noqa: E402
from treedgs_geo.core.files import write_json  # noqa: E402
from treedgs_geo.core.progress import make_reporter  # noqa: E402
from treedgs_geo.simulation.settings import SimulateSettings  # noqa: E402
from treedgs_geo.simulation.simulate import simulate_plot  # noqa: E402

SEEDS = (1, 51, 52)
#: The photos of a plot whose cloud is used: as few and small as the simulator allows.
PHOTOS = {"photos": 10, "image_width": 320, "image_height": 240, "gsd_cm": 2.5, "samples": 1}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scratch", type=Path, required=True, help="where the plots are kept")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    record: dict = {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "version": __version__,
        "seeds": SEEDS,
        "bow_cm": {},
    }
    for bow in factor("sweep").levels:
        parts = []
        for seed in SEEDS:
            folder = args.scratch / f"bow_{bow:g}_{seed}"
            if not (folder / "truth" / "config.json").exists():
                simulate_plot(
                    SimulateSettings(output=folder, seed=seed, sweep_cm=bow, **{**BASE, **PHOTOS}),
                    make_reporter("quiet"),
                )
            parts.append(measure(folder))
        rows = [row for found, _ in parts for row in found]
        result = figures(rows, sum(count for _, count in parts))
        sure = [abs(row["error_cm"]) for row in rows if row["flag"] == "ok"]
        result["worst_ok_cm"] = round(max(sure, default=0.0), 2)
        record["bow_cm"][f"{bow:g}"] = result
        print(f"{bow:g} cm", json.dumps(result), flush=True)
    if args.output:
        write_json(args.output, record)


if __name__ == "__main__":
    main()
