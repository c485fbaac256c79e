"""Stems found and fitted in the photos, against the truth of a rendered plot.

    python -m treedgs_lab.benchmarks.photos.stems_from_photos --plot DIR [DIR ...] --true-poses [--output FILE]
    python -m treedgs_lab.benchmarks.photos.stems_from_photos --plot DIR --workspace WS
        (poses and ground of a workspace)

A found stem matches a true one within 0.5 m of its axis at breast height (the nearest pair first). False: a stem with a
DBH farther than 0.5 m from any true stem or sapling. Truth is read for scoring only (and for the poses when asked).
``--simulate "--preset plot --seed 42 …"`` makes a plot that is not there yet with these options of ``simulate-plot``.
"""

from __future__ import annotations

import argparse
import json
import shlex
import time
from pathlib import Path

import numpy as np

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.progress import make_reporter
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_lab.benchmarks.verbs import run_verb

MATCH_M = 0.5
COLUMNS = (
    f"{'tree':6} {'kind':11} {'true':>5} {'dbh':>5} {'err':>6} {'se':>5} flag   {'clear':>5} {'views':>5} "
    f"{'llr':>5} {'gap':>5} {'seed':>5} {'lean':>4} r1     reasons"
)


def pair_up(true_xy: np.ndarray, fits: list) -> dict[int, int]:
    """True stem -> fit, nearest first; stems with a diameter are matched before refused ones."""
    xy = np.array([fit.axis.p for fit in fits]).reshape(-1, 2)
    distance = np.linalg.norm(true_xy[:, None] - xy[None], axis=2)
    cost = distance + np.array([0.0 if fit.measured else 10.0 for fit in fits])[None]
    pairs: dict[int, int] = {}
    for i, j in sorted(np.argwhere(distance <= MATCH_M).tolist(), key=lambda ij: cost[ij[0], ij[1]]):
        if i not in pairs and j not in pairs.values():
            pairs[i] = j
    return pairs


def everything_there(plot: Path, frame: LocalFrame, true_xy: np.ndarray) -> np.ndarray:
    """(K, 2) places of stems and saplings: a DBH there is no invention."""
    stems = json.loads((plot / "truth" / "stems.json").read_text())
    shift = np.array(stems["origin"], float)[:2] - frame.origin[:2]
    saplings = np.array([row[:2] for row in stems["saplings_xy_dbhcm"]], float).reshape(-1, 2) + shift
    others = np.array([np.array(axis)[2, 2:4] for axis in stems["stems"].values()], float).reshape(-1, 2) + shift
    return np.vstack([true_xy, saplings, others])


def row_of(tree: dict, fit) -> dict:
    """One in-plot stem as the result file has it; printed."""
    clear, dbh = int(tree["n_unoccluded_bh_views"]), float(tree["dbh_cm"])
    row = {"tree": tree["tree_id"], "kind": tree["kind"], "dbh_cm": round(dbh, 2), "clear": clear}
    if fit is None:
        print(f"{tree['tree_id']:6} {tree['kind']:11} {dbh:5.1f}  missed{'':18} {clear:5d}")
        return row
    error, found = fit.dbh_cm - dbh, fit.evidence
    print(
        f"{tree['tree_id']:6} {tree['kind']:11} {dbh:5.1f} {fit.dbh_cm:5.1f} {error:+6.2f} {fit.se_cm:5.2f} "
        f"{fit.flag:6} {clear:5d} {found.n_views:5d} {found.llr:5.0f} {found.gap:5.0f} {fit.seed_score:5.0f} "
        f"{fit.lean_deg:4.1f} {100 * fit.r1:+.2f}  {','.join(fit.reasons)}"
    )
    return row | {
        "error_cm": round(error, 2),
        "se_cm": round(fit.se_cm, 2),
        "flag": fit.flag,
        "reasons": ",".join(fit.reasons),
        "gain": round(found.gain, 1),
        "twins": round(found.twins, 1) if np.isfinite(found.twins) else None,
        "twins_share": round(found.twins_share, 2) if np.isfinite(found.twins_share) else None,
    }


def score(fits: list, plot: Path, frame: LocalFrame) -> dict:
    """Match and print one line a tree; returns the pooled figures of the in-plot stems."""
    truth = truth_rows(plot, in_plot=False)
    true_xy = local_places(truth, frame)
    pairs = pair_up(true_xy, fits)
    every = everything_there(plot, frame, true_xy)
    false = [fit for fit in fits if fit.measured and np.linalg.norm(every - fit.axis.p, axis=1).min() > MATCH_M]
    print(COLUMNS)
    wanted = [
        (tree, fits[pairs[i]] if i in pairs else None) for i, tree in enumerate(truth) if tree["in_plot"] == "True"
    ]
    trees = [row_of(tree, fit) for tree, fit in wanted]
    for fit in false:
        print(
            f"FALSE at {fit.axis.p.round(2)}: dbh {fit.dbh_cm:.1f} {fit.flag} llr {fit.evidence.llr:.0f} "
            f"seed {fit.seed_score:.0f} views {fit.evidence.n_views} {','.join(fit.reasons)}"
        )
    measured = [(tree, fit) for tree, fit in wanted if fit is not None and fit.measured]
    clear = [int(tree["n_unoccluded_bh_views"]) >= 3 for tree, _ in measured]
    figures = {
        "in_plot": len(wanted),
        "found": sum(fit is not None for _, fit in wanted),
        "false": len(false),
        "measured": len(measured),
        "clear3": sum(int(tree["n_unoccluded_bh_views"]) >= 3 for tree, _ in wanted),
        "clear3_measured": sum(clear),
    }
    return figures | pooled(measured) | {"trees": trees}


def pooled(measured: list[tuple]) -> dict:
    """Errors of (true row, fit) pairs, cm; coverage of the intervals."""
    if not measured:
        return {}
    e = np.array([fit.dbh_cm - float(tree["dbh_cm"]) for tree, fit in measured])
    z = e / np.array([fit.se_cm for _, fit in measured])
    sure = np.abs(e[[fit.flag == "ok" for _, fit in measured]])
    return {
        "rmse_cm": float(np.sqrt((e**2).mean())),
        "bias_cm": float(e.mean()),
        "max_cm": float(np.abs(e).max()),
        "z_rms": float(np.sqrt(np.mean(z**2))),
        "in_90": float((np.abs(z) < 1.645).mean()),
        "ok": len(sure),
        "max_ok_cm": float(sure.max(initial=0.0)),
    }


def main() -> None:
    """Find, fit, score, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, nargs="+")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--workspace", type=Path)
    source.add_argument("--true-poses", action="store_true")
    parser.add_argument("--simulate", metavar="OPTIONS", help="options of simulate-plot for plots that are not there")
    parser.add_argument("--seed", type=int, default=7, help="of the random places that chance is measured at")
    parser.add_argument("--repeat", type=int, default=1, help="run again to see the time without compiling")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    args = parser.parse_args()
    results = {}
    for plot in args.plot:
        if args.simulate and not (plot / "truth" / "config.json").exists():
            run_verb("simulate-plot", "--output", plot, *shlex.split(args.simulate))
        views, frame, ground, area = plot_inputs(plot, args.workspace)
        for _ in range(args.repeat):
            began, cpu = time.perf_counter(), time.process_time()
            fits = stems_from_photos(views, ground, area, PhotoStemOptions(seed=args.seed), make_reporter("plain"))
            seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
        figures = score(fits, plot, frame) | {"seconds": round(seconds, 1), "cpu_seconds": round(cpu, 1)}
        figures = {k: round(v, 3) if isinstance(v, float) else v for k, v in figures.items()}
        results[plot.name] = figures
        print(plot.name, json.dumps({k: v for k, v in figures.items() if k != "trees"}))
    write_record(args.output, results, seeds=[args.seed])


if __name__ == "__main__":
    main()
