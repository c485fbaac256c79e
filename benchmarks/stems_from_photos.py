"""Stems found and fitted in the photos, against the truth of a rendered plot.

    python benchmarks/stems_from_photos.py --plot DIR [DIR ...] --true-poses [--output FILE]
    python benchmarks/stems_from_photos.py --plot DIR --workspace WS        (poses and ground of a workspace)

A found stem matches a true one within 0.5 m of its axis at breast height (the nearest pair first). False: a stem with a
DBH farther than 0.5 m from any true stem or sapling. Truth is read for scoring only (and for the poses when asked).
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from treedgs_geo.core.crs import LocalFrame, project_crs  # noqa: E402
from treedgs_geo.core.plots import read_plots  # noqa: E402
from treedgs_geo.core.progress import make_reporter  # noqa: E402
from treedgs_geo.from_photos.find import stems_from_photos  # noqa: E402
from treedgs_geo.from_photos.options import PhotoStemOptions  # noqa: E402
from treedgs_geo.reconstruction.area import Area  # noqa: E402
from treedgs_geo.reconstruction.cameras import Camera, View  # noqa: E402


def true_views(plot: Path) -> tuple[list[View], LocalFrame]:
    """The renderer's own cameras, in the local frame of its origin."""
    config = json.loads((plot / "truth" / "config.json").read_text())
    frame = LocalFrame(project_crs(f"EPSG:{config['epsg']}"), np.array(config["origin_E_N_h"], float))
    views = []
    for row in csv.DictReader(open(plot / "truth" / "cameras.csv")):
        rotation = np.array([[float(row[f"r{i}{j}"]) for j in range(3)] for i in range(3)])
        inner = (float(row[k]) for k in ("fx", "fy", "cx", "cy", "k1", "k2"))
        camera = Camera(int(row["width"]), int(row["height"]), *inner)
        views.append(
            View(
                row["image"],
                plot / "images" / row["image"],
                camera,
                rotation,
                np.array([float(row[k]) for k in ("tx", "ty", "tz")]),
                int(row["flight"]),
            )
        )
    return views, frame


def raster_ground(path: Path, frame: LocalFrame):
    """Ground function of local x, y from a DTM in project coordinates."""
    import rasterio
    from scipy.ndimage import map_coordinates

    with rasterio.open(path) as source:
        z = source.read(1).astype(float)
        inverse = ~source.transform
        if source.nodata is not None:
            z[z == source.nodata] = np.nan

    def ground(x, y):
        column, row = inverse * (np.asarray(x) + frame.origin[0], np.asarray(y) + frame.origin[1])
        at = [np.asarray(row) - 0.5, np.asarray(column) - 0.5]
        return map_coordinates(z, at, order=1, cval=np.nan) - frame.origin[2]

    return ground


def score(fits: list, plot: Path, frame: LocalFrame) -> dict:
    """Match and print one line a tree; returns the pooled figures of the in-plot stems."""
    truth = list(csv.DictReader(open(plot / "truth" / "trees.csv")))
    stems = json.loads((plot / "truth" / "stems.json").read_text())
    origin = np.array(stems["origin"], float)
    shift = origin[:2] - frame.origin[:2]
    saplings = np.array([row[:2] for row in stems["saplings_xy_dbhcm"]], float).reshape(-1, 2) + shift
    others = np.array([np.array(axis)[2, 2:4] for axis in stems["stems"].values()], float).reshape(-1, 2) + shift
    true_xy = np.array([[float(t["E_bh"]), float(t["N_bh"])] for t in truth]) - frame.origin[:2]
    xy = np.array([fit.axis.p for fit in fits]).reshape(-1, 2)
    pairs, taken = {}, set()
    distance = np.linalg.norm(true_xy[:, None] - xy[None], axis=2) if len(xy) else np.empty((len(truth), 0))
    # Stems with a diameter are matched before refused ones.
    cost = distance + np.array([0.0 if fit.measured else 10.0 for fit in fits])[None]
    for i, j in sorted(np.argwhere(distance <= 0.5).tolist(), key=lambda ij: cost[ij[0], ij[1]]):
        if i not in pairs and j not in taken:
            pairs[i] = j
            taken.add(j)
    every = np.vstack([true_xy, saplings, others])
    false = [j for j, fit in enumerate(fits) if fit.measured and np.linalg.norm(every - xy[j], axis=1).min() > 0.5]
    errors, sigmas, clear_total, clear_measured, found, inside = [], [], 0, 0, 0, 0
    trees: list[dict] = []
    print(
        f"{'tree':6} {'kind':11} {'true':>5} {'dbh':>5} {'err':>6} {'se':>5} flag   {'clear':>5} {'views':>5} "
        f"{'llr':>5} {'gap':>5} {'seed':>5} {'lean':>4} {'xy_cm':>5} r1     reasons"
    )
    for i, tree in enumerate(truth):
        if tree["in_plot"] != "True":
            continue
        inside += 1
        clear = int(tree["n_unoccluded_bh_views"])
        dbh = float(tree["dbh_cm"])
        j = pairs.get(i)
        clear_total += clear >= 3
        row = {"tree": tree["tree_id"], "kind": tree["kind"], "dbh_cm": round(dbh, 2), "clear": clear}
        trees.append(row)
        if j is None:
            print(f"{tree['tree_id']:6} {tree['kind']:11} {dbh:5.1f}  missed{'':18} {clear:5d}")
            continue
        fit = fits[j]
        found += 1
        error = fit.dbh_cm - dbh
        row |= {
            "error_cm": round(error, 2),
            "se_cm": round(fit.se_cm, 2),
            "flag": fit.flag,
            "reasons": ",".join(fit.reasons),
            "gain": round(fit.gain, 1),
        }
        if fit.measured:
            errors.append(error)
            sigmas.append(error / fit.se_cm)
            clear_measured += clear >= 3
        print(
            f"{tree['tree_id']:6} {tree['kind']:11} {dbh:5.1f} {fit.dbh_cm:5.1f} {error:+6.2f} {fit.se_cm:5.2f} "
            f"{fit.flag:6} {clear:5d} {fit.n_views:5d} {fit.llr:5.0f} {fit.gap:5.0f} {fit.seed_score:5.0f} "
            f"{fit.lean_deg:4.1f} {100 * distance[i, j]:5.1f} {100 * fit.r1:+.2f}  {','.join(fit.reasons)}"
        )
    for j in false:
        fit = fits[j]
        print(
            f"FALSE at {xy[j].round(2)}: dbh {fit.dbh_cm:.1f} {fit.flag} llr {fit.llr:.0f} gap {fit.gap:.0f} "
            f"seed {fit.seed_score:.0f} views {fit.n_views} {','.join(fit.reasons)}"
        )
    outer = [(i, j) for i, j in pairs.items() if truth[i]["in_plot"] != "True" and fits[j].measured]
    for i, j in outer:
        print(
            f"outer {truth[i]['tree_id']} {truth[i]['kind']}: true {float(truth[i]['dbh_cm']):.1f}, "
            f"dbh {fits[j].dbh_cm:.1f} {fits[j].flag} llr {fits[j].llr:.0f} {','.join(fits[j].reasons)}"
        )
    e = np.array(errors)
    figures = {
        "in_plot": inside,
        "found": found,
        "false": len(false),
        "measured": len(e),
        "clear3": clear_total,
        "clear3_measured": clear_measured,
    }
    if len(e):
        figures |= {
            "rmse_cm": float(np.sqrt((e**2).mean())),
            "bias_cm": float(e.mean()),
            "max_cm": float(np.abs(e).max()),
            "z_rms": float(np.sqrt(np.mean(np.square(sigmas)))),
            "in_90": float((np.abs(sigmas) < 1.645).mean()),
        }
        sure = [abs(row["error_cm"]) for row in trees if row.get("flag") == "ok"]
        figures |= {"ok": len(sure), "max_ok_cm": max(sure, default=0.0)}
    return figures | {"trees": trees}


def plot_inputs(plot: Path, workspace: Path | None = None) -> tuple:
    """Photos, frame, ground and area of a rendered plot: the renderer's cameras, or those of a workspace."""
    if workspace:
        from treedgs_geo.reconstruction.model import load_views

        frame, views = load_views(workspace / "sfm", plot / "images")
    else:
        views, frame = true_views(plot)
    dtm = plot / "dtm.tif"
    if workspace and (workspace / "dtm.tif").exists():
        dtm = workspace / "dtm.tif"
    plots = read_plots(plot / "plots.csv", frame.crs)
    area = Area.circles(np.array([[p.x, p.y] for p in plots]) - frame.origin[:2], np.array([p.radius_m for p in plots]))
    return views, frame, raster_ground(dtm, frame), area


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, nargs="+")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--workspace", type=Path)
    source.add_argument("--true-poses", action="store_true")
    parser.add_argument("--seed", type=int, default=7, help="of the random places that chance is measured at")
    parser.add_argument("--repeat", type=int, default=1, help="run again to see the time without compiling")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    args = parser.parse_args()
    results = {}
    for plot in args.plot:
        views, frame, ground, area = plot_inputs(plot, args.workspace)
        for _ in range(args.repeat):
            began, cpu = time.perf_counter(), time.process_time()
            fits = stems_from_photos(
                views, frame, ground, area, PhotoStemOptions(seed=args.seed), make_reporter("plain")
            )
            seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
        figures = score(fits, plot, frame) | {"seconds": round(seconds, 1), "cpu_seconds": round(cpu, 1)}
        figures = {k: round(v, 3) if isinstance(v, float) else v for k, v in figures.items()}
        results[plot.name] = figures
        print(plot.name, json.dumps({k: v for k, v in figures.items() if k != "trees"}))
    if args.output:
        args.output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
