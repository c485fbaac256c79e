"""How long does planning one hectare with ten plots take?

    python -m treedgs_lab.benchmarks.planning.seconds [--output FILE]

Ten plots of 8 m radius on 100 x 100 m, five numbers for the stand, camera ``m3e``: the whole verb as a process, start
of Python, comparing and writing included. The first run compiles; the second is what is kept too.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.verbs import run_verb


def main() -> None:
    """Plan twice, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    seconds = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        rows = [f"P{k},{611310 + 20 * (k % 5)},{3718425 + 45 * (k // 5)},6344,8" for k in range(10)]
        (folder / "plots.csv").write_text(
            "\n".join(["plot_id,easting,northing,epsg,radius_m", *rows]) + "\n", encoding="utf-8"
        )
        for _ in range(2):
            began = time.monotonic()
            run_verb(
                "plan-flight", "--plots", folder / "plots.csv", "--stems-per-ha", 700, "--dbh-mean-cm", 27,
                "--dbh-sd-cm", 6.5, "--tree-height-m", 20, "--crown-base-m", 10,
                "--output", folder / "plan", "--log-format", "quiet",
            )  # fmt: skip
            seconds.append(round(time.monotonic() - began, 1))
        plan = json.loads((folder / "plan" / "plan.json").read_text(encoding="utf-8"))
    figures = {"seconds": seconds, "flights_compared": len(plan["tried"]), "photos": plan["photos"]}
    print(json.dumps(figures))
    write_record(args.output, figures, seeds=[0])


if __name__ == "__main__":
    main()
