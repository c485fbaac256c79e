"""Hard stands, all of their stems: how many get a diameter, and how right, with a former code and with this one.

    git worktree add ../before COMMIT
    python -m treedgs_lab.benchmarks.photos.hard_stands PLOT … --against ../before --output FILE.json

Plots are rendered, with truth; one called ``hard_SEED`` that is not there is simulated
(:func:`.stem_network.hard_options`). Cameras and ground are the renderer's, in both codes: this is about stems. Each
code runs with what its own chain asks the network by default (``--asked``). ``thin``: measured stems below 20 cm.
Without ``--against`` this code alone is run.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.files import read_json
from treedgs_lab.benchmarks.records import ROOT, write_record
from treedgs_lab.benchmarks.verbs import environment

#: Stems below this are counted by themselves, cm: dense stands hide them most.
THIN_CM = 20.0


def measured_by(code: Path, asked: str, plots: list[Path]) -> dict[str, dict[str, Any]]:
    """Figures of each plot as a code's own :mod:`.stem_network` writes them."""
    with tempfile.TemporaryDirectory(prefix="treedgs-hard-") as work:
        file = Path(work) / "found.json"
        command = [
            sys.executable,
            "-m",
            "treedgs_lab.benchmarks.photos.stem_network",
            *map(str, plots),
            "--modes",
            asked,
        ]
        subprocess.run([*command, "--output", str(file)], cwd=code, env=environment(code), check=True)
        found = read_json(file)
    return {plot.name: found[plot.name][asked] for plot in plots}


def pooled(plots: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """All in-plot stems of all plots."""
    trees = [tree for figures in plots.values() for tree in figures["trees"]]
    seen = [tree for tree in trees if tree["clear"] >= 3]
    kept = [tree for tree in trees if tree.get("flag") in ("ok", "check")]
    sure = [tree for tree in kept if tree["flag"] == "ok"]
    error = np.array([tree["error_cm"] for tree in kept])
    off = np.abs(error) / np.array([tree["se_cm"] for tree in kept])
    inside = off <= 1.645
    thin = np.array([tree["dbh_cm"] < THIN_CM for tree in kept])
    return {
        "stems": len(trees),
        "in_layer": sum("flag" in tree for tree in trees),
        "measured": len(kept),
        "clear3": len(seen),
        "clear3_measured": sum(tree.get("flag") in ("ok", "check") for tree in seen),
        "false": sum(figures["false"] for figures in plots.values()),
        "rmse_cm": round(float(np.sqrt((error**2).mean())), 2),
        "me_cm": round(float(error.mean()), 2),
        "in_90": round(float(inside.mean()), 3),
        "error_over_se_rms": round(float(np.sqrt((off**2).mean())), 2),
        "thin": int(thin.sum()),
        "thin_in_90": int(inside[thin].sum()),
        "ok": len(sure),
        "ok_off_by_2_cm": sum(abs(tree["error_cm"]) > 2 for tree in sure),
        "ok_max_cm": max((abs(tree["error_cm"]) for tree in sure), default=None),
        "seconds": round(sum(figures["seconds"] for figures in plots.values()), 0),
    }


def main() -> int:
    """Run the codes on all plots, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--against", type=Path, help="checkout of the former code")
    parser.add_argument("--asked", nargs=2, default=("ivy", "auto"), help="of the network: by the former code, by this")
    parser.add_argument("--output", type=Path, required=True)
    options = parser.parse_args()
    plots = [plot.resolve() for plot in options.plots]
    record: dict[str, Any] = {}
    codes = {"now": (ROOT, options.asked[1])}
    if options.against is not None:
        codes = {"before": (options.against.resolve(), options.asked[0])} | codes
    for name, (code, asked) in codes.items():
        found = measured_by(code, asked, plots)
        record[name] = {"asked": asked, "pooled": pooled(found), "plots": found}
        print(name, record[name]["pooled"], flush=True)
    write_record(options.output, record)
    return 0


if __name__ == "__main__":
    sys.exit(main())
