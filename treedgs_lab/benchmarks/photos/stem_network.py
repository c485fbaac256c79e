"""What the network that tells stems brings: the same plots without it, asked for ivy, and asked for all.

    python -m treedgs_lab.benchmarks.photos.stem_network PLOT … [--workspaces WORK] [--modes off ivy full]
        --output FILE.json

Plots are rendered, with truth. Cameras and ground are the renderer's, or with ``--workspaces`` those of the chain's
workspaces ``WORK/PLOT-balanced``. A plot that is not there is simulated if it is called ``hard_SEED``
(:func:`hard_options`). Coverage (``in_90``) is that of +- 1.645 standard errors.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_lab.benchmarks.photos.stems_from_photos import score
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import plot_inputs
from treedgs_lab.benchmarks.verbs import run_verb

_STANDS = (
    "--stems-per-ha 1200 --dbh-mean-cm 20 --dbh-sd-cm 8 --shrubs-per-m2 0.5 --leaf-area-m2 12 --ivy-stems 1 "
    "--wrapped-stems 3 --snags 1 --touching-saplings 2 --bark-variety true --moss-pct 15 --hardwood-pct 40 "
    "--leaf-off true --sensor drone --spacing natural --strong-leans 1 --lean-max-deg 12",
    "--stems-per-ha 900 --dbh-mean-cm 26 --dbh-sd-cm 9 --shrubs-per-m2 0.4 --shrub-height-m 2.5 --shrub-variety true "
    "--leaf-area-m2 18 --flute-pct 3 --buttress-m 0.3 --ellipticity-pct 8 --wrapped-stems 2 --snags 1 --bark-variety "
    "true --lichen-pct 20 --hardwood-pct 30 --leaf-off true --sky overcast --sensor drone --forks-below-bh 1",
    "--stems-per-ha 1000 --dbh-mean-cm 22 --dbh-sd-cm 8 --shrubs-per-m2 0.4 --shrub-height-m 2.2 --leaf-area-m2 15 "
    "--ivy-stems 1 --wrapped-stems 2 --touching-saplings 1 --bark-variety true --moss-pct 25 --lichen-pct 10 "
    "--undergrowth-per-m2 0.3 --hardwood-pct 20 --sensor drone --spacing natural --forks-above-bh 1 "
    "--sun-shift-min 20 --slope-pct 12",
)


def hard_options(seed: int) -> list[str]:
    """Options of ``simulate-plot`` for a hard stand: one of three, by the seed."""
    size = "--preset demo --radius-m 7.5 --samples 3 --float-epochs 0 --lidar-density-m2 0 --log-format quiet"
    return [*size.split(), "--seed", str(seed), *_STANDS[seed % 3].split()]


#: What the network is asked: nothing, ivy, how wide stems of low confidence are too, as the chain does, everything.
MODES: dict[str, dict] = {
    "off": {"stem_network": "off"},
    "ivy": {"enough_certain": 0.0, "most_asked": 0},
    "low-confidence": {"enough_certain": 0.0},
    "auto": {},
    "full": {"enough_certain": np.inf},
}


def run(plot: Path, workspace: Path | None, mode: str) -> dict:
    """Find and fit the stems of a plot; the figures of its in-plot stems."""
    views, frame, ground, area = plot_inputs(plot, workspace)
    began = time.perf_counter()
    fits = stems_from_photos(views, ground, area, PhotoStemOptions(**MODES[mode]))
    seconds = time.perf_counter() - began
    figures = score(fits, plot, frame)
    wrong = [t for t in figures["trees"] if t.get("flag") == "ok" and abs(t["error_cm"]) > 2]
    seen = [t for t in figures["trees"] if t["clear"] >= 3]
    measured = np.array([t["error_cm"] for t in seen if t.get("flag") in ("ok", "check")])
    return figures | {
        "clear3_rmse_cm": round(float(np.sqrt((measured**2).mean())), 3) if len(measured) else None,
        "ok_off_by_2_cm": [f"{t['tree']} {t['error_cm']:+.1f}" for t in wrong],
        "seconds": round(seconds, 1),
    }


def main() -> None:
    """Run both ways, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--workspaces", type=Path, help="folder of the chain's workspaces")
    parser.add_argument("--modes", nargs="+", default=["off", "ivy", "full"], choices=list(MODES))
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    results: dict[str, dict] = {}
    for plot in args.plots:
        if not (plot / "truth" / "config.json").exists():
            run_verb("simulate-plot", "--output", plot, *hard_options(int(plot.name.rpartition("_")[2])))
        workspace = None if args.workspaces is None else args.workspaces / f"{plot.name}-balanced"
        results[plot.name] = {mode: run(plot, workspace, mode) for mode in args.modes}
        for name, figures in results[plot.name].items():
            print(plot.name, name, json.dumps({k: v for k, v in figures.items() if k != "trees"}), flush=True)
        write_record(args.output, results, seeds=[PhotoStemOptions().seed])


if __name__ == "__main__":
    main()
