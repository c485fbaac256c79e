"""Stems found and fitted in the photos, against the truth of a rendered plot.

    python -m treedgs_lab.benchmarks.photos.stems_from_photos --plot DIR [DIR ...] --true-poses [--output FILE]
    python -m treedgs_lab.benchmarks.photos.stems_from_photos --plot DIR --workspace WS
        (poses and ground of a workspace)

A found stem is the true one within 0.5 m at breast height, pairs by place alone. False: a stem with a DBH farther than
0.5 m from any true stem or sapling. Truth is read for scoring only (and for the poses when asked). ``--simulate
"--preset plot --seed 42 …"`` makes a plot that is not there yet with these options of ``simulate-plot``; one called
``hard_SEED`` is made as one of :data:`HARD` by its seed. ``all``: the stems of all plots together. Coverage (``in_90``)
is that of 90 % intervals. ``--stem-network off auto``: without the network and with it, a record each.
"""

from __future__ import annotations

import argparse
import json
import shlex
import time
from pathlib import Path

import numpy as np
import pandas as pd

from treedgs_geo.core.progress import make_reporter
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.trees import trees_of_photo_fits
from treedgs_lab.benchmarks.plot import CLEAR_VIEWS, TruePlot, in_plot_rows, site_of
from treedgs_lab.benchmarks.processes import simulate
from treedgs_lab.benchmarks.records import write_record

#: Size of a hard stand, and three kinds of it: dense, with undergrowth, ivy, hardwoods, a drone's sensor.
HARD_SIZE = "--preset demo --radius-m 7.5 --camera samples=3 --faults float_epochs=0 --lidar-density-m2 0"
HARD = (
    "--stems-per-ha 1200 --dbh-mean-cm 20 --camera sensor=drone --stand dbh_sd_cm=8,shrubs_per_m2=0.5,leaf_area_m2=12,"
    "ivy_stems=1,wrapped_stems=3,snags=1,touching_saplings=2,bark_variety,moss_pct=15,hardwood_pct=40,leaf_off,"
    "spacing=natural,strong_leans=1,lean_max_deg=12",
    "--stems-per-ha 900 --dbh-mean-cm 26 --camera sensor=drone --weather sky=overcast --stand dbh_sd_cm=9,"
    "shrubs_per_m2=0.4,shrub_height_m=2.5,shrub_variety,leaf_area_m2=18,flute_pct=3,buttress_m=0.3,ellipticity_pct=8,"
    "wrapped_stems=2,snags=1,bark_variety,lichen_pct=20,hardwood_pct=30,leaf_off,forks_below_bh=1",
    "--stems-per-ha 1000 --dbh-mean-cm 22 --camera sensor=drone --weather sun_shift_min=20 --stand dbh_sd_cm=8,"
    "shrubs_per_m2=0.4,shrub_height_m=2.2,leaf_area_m2=15,ivy_stems=1,wrapped_stems=2,touching_saplings=1,"
    "bark_variety,moss_pct=25,lichen_pct=10,undergrowth_per_m2=0.3,hardwood_pct=20,spacing=natural,forks_above_bh=1,"
    "slope_pct=12",
)


def options_of(plot: Path, given: str | None) -> list[str]:
    """Options of ``simulate-plot`` for a plot that is not there: those given, or a hard stand's."""
    if given is not None:
        return shlex.split(given)
    seed = int(plot.name.removeprefix("hard_"))
    return [*shlex.split(f"{HARD_SIZE} {HARD[seed % 3]}"), "--seed", str(seed)]


def figures(rows: list[dict]) -> dict:
    """Counts and errors (cm) of rows of :func:`.score_trees`."""
    table = pd.DataFrame(rows)
    false = table.get("false", pd.Series(False, table.index)).fillna(False).astype(bool)
    stems = table[~false]
    clear = stems[stems["clear"] >= CLEAR_VIEWS]
    read = stems[stems["read_cm"].notna()]
    e = (read["read_cm"] - read["true_cm"]).to_numpy(float)
    sure = np.abs(e[(read["flag"] == "ok").to_numpy()])
    found = {
        "in_plot": len(stems),
        "found": int((stems["flag"] != "absent").sum()),
        "false": int(false.sum()),
        "measured": len(read),
        "clear3": len(clear),
        "clear3_measured": int(clear["read_cm"].notna().sum()),
        "ok": len(sure),
        "ok_off_by_2_cm": int((sure > 2).sum()),
        "max_ok_cm": round(float(sure.max(initial=0.0)), 3),
    }
    if not len(read):
        return found
    return found | {
        "rmse_cm": round(float(np.sqrt((e**2).mean())), 3),
        "bias_cm": round(float(e.mean()), 3),
        "max_cm": round(float(np.abs(e).max()), 3),
        "z_rms": round(float(np.sqrt(((e / read["se_cm"]) ** 2).mean())), 3),
        "in_90": round(float(((read["lo_cm"] <= read["true_cm"]) & (read["true_cm"] <= read["hi_cm"])).mean()), 3),
    }


def run(plot: Path, workspace: Path | None, options: PhotoStemOptions) -> dict:
    """Find, fit, score and print one plot: its figures, seconds and trees."""
    site = site_of(plot, workspace)
    began, cpu = time.perf_counter(), time.process_time()
    fits = search_photos(site.views, site.ground, site.area, options, make_reporter("plain")).fits
    seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
    rows = in_plot_rows(TruePlot.load(plot), trees_of_photo_fits(fits, site.frame))
    print(pd.DataFrame(rows).to_string(index=False))
    found = figures(rows) | {"seconds": round(seconds, 1), "cpu_seconds": round(cpu, 1)}
    print(plot.name, json.dumps(found), flush=True)
    return found | {"trees": rows}


def main() -> None:
    """Find, fit, score, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, nargs="+")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--workspace", type=Path)
    source.add_argument("--true-poses", action="store_true")
    parser.add_argument("--simulate", metavar="OPTIONS", help="options of simulate-plot for plots that are not there")
    parser.add_argument("--stem-network", nargs="+", choices=("auto", "off"), default=["auto"])
    parser.add_argument("--seed", type=int, default=7, help="of the random places that chance is measured at")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    args = parser.parse_args()
    for plot in args.plot:
        if not (plot / "truth" / "config.json").exists():
            simulate(plot, options_of(plot, args.simulate))
    results: dict[str, dict] = {}
    for network in args.stem_network:
        options = PhotoStemOptions(seed=args.seed, stem_network=network)
        found = {plot.name: run(plot, args.workspace, options) for plot in args.plot}
        if len(found) > 1:
            found["all"] = figures([row for one in found.values() for row in one["trees"]])
            print("all", json.dumps(found["all"]))
        results |= found if len(args.stem_network) == 1 else {network: found}
    write_record(args.output, results, seeds=[args.seed])


if __name__ == "__main__":
    main()
