"""From which ground sample distance, and with how many photos, does a stem's standard error stay small?

    python -m treedgs_lab.benchmarks.photos.height_and_photos --plots DIR [DIR ...] [--output FILE] [--chart FILE.svg]

``--plots``: simulated grid flights (``simulate-plot --flight grid``) at several heights. With true cameras and ground,
the stems are fitted in all photos, in every second, third, ... (:data:`EVERY`), so that each stem is seen from one
height with few and with many photos. Standard errors follow ``c * gsd^a / n^b``, n photos that show breast height free
(``truth/visibility.csv``); the law gives the coarsest ground sample distance at the stem for 0.5, 1 and 2 cm, no
coarser than was flown. Beside it stands what the fits really erred, and how many stems were measured at all. Truth is
read for cameras, ground and scoring alone.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.report.charts import BLUE, GREY, VERMILION, chart_svg, new_chart
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_lab.benchmarks.photos.stems_from_photos import pair_up
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows

SEED = 1
#: Every n-th photo in the order of the flight.
EVERY = (1, 2, 3, 5)
#: A photo shows a stem's breast height when so much of it is free, from no steeper than this (sine).
FREE, MIN_SINE = 0.7, 0.35
WANTED_CM = (0.5, 1.0, 2.0)
PHOTOS = (3, 6, 12)
#: Colours and marks, by plot.
STYLE = ((BLUE, "o"), (VERMILION, "s"), (GREY, "^"))


def free_views(plot: Path) -> dict[str, set[str]]:
    """Tree -> names of the photos that show its breast height free."""
    found: dict[str, set[str]] = {}
    with open(plot / "truth" / "visibility.csv", newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            free = row["in_frame"] == "1" and float(row["visible_fraction"]) >= FREE
            if free and float(row["foreshortening"]) > MIN_SINE:
                found.setdefault(row["tree_id"], set()).add(row["image"])
    return found


def stems_of(plot: Path) -> list[dict[str, Any]]:
    """One row an in-plot stem and share of the photos."""
    views, frame, ground, area = plot_inputs(plot)
    rows, free, by_name = truth_rows(plot), free_views(plot), {view.name: view for view in views}
    true_xy = local_places(rows, frame)
    found = []
    for every in EVERY:
        chosen = sorted(views, key=lambda view: view.name)[::every]
        names = {view.name for view in chosen}
        fits = stems_from_photos(chosen, ground, area, PhotoStemOptions(seed=SEED))
        pairs = pair_up(true_xy, fits)
        for k, row in enumerate(rows):
            seen = [by_name[name] for name in sorted(free.get(row["tree_id"], set()) & names)]
            spot = frame.to_local(np.array([[float(row[key]) for key in ("E_bh", "N_bh", "h_bh")]]))
            stem = {"plot": plot.name, "tree": row["tree_id"], "photos": len(chosen), "free_photos": len(seen)}
            stem |= {"gsd_cm": round(gsd_cm(seen or chosen, spot), 3), "dbh_cm": round(float(row["dbh_cm"]), 2)}
            fit = fits[pairs[k]] if k in pairs else None
            if fit is not None and fit.measured:
                error = round(fit.dbh_cm - float(row["dbh_cm"]), 3)
                stem |= {"error_cm": error, "se_cm": round(fit.se_cm, 3), "flag": fit.flag}
            found.append(stem)
    return found


def gsd_cm(views: list[View], spot: np.ndarray) -> float:
    """Median ground sample distance at a place (1, 3) in photos, centimetres."""
    return float(np.median([100 * view.project(spot)[1][0] / view.camera.fx for view in views]))


def law_of(stems: list[dict]) -> dict[str, Any]:
    """``c, a, b`` of se = c * gsd^a / n^b (cm), and the coarsest GSD for each wanted standard error and n photos."""
    measured = [stem for stem in stems if "se_cm" in stem and stem["free_photos"]]
    if len({stem["plot"] for stem in measured}) < 2 or len(measured) < 10:
        return {}
    n, gsd, se = (np.array([stem[key] for stem in measured], float) for key in ("free_photos", "gsd_cm", "se_cm"))
    design = np.column_stack([np.ones(len(n)), np.log(gsd), -np.log(n)])
    weight = np.ones(len(n))
    for _ in range(20):
        fitted = np.linalg.lstsq(design * weight[:, None], np.log(se) * weight, rcond=None)[0]
        # A few stems among leaves have errors of their own kind.
        weight = 1 / np.sqrt(1 + (np.abs(np.log(se) - design @ fitted) / 0.3) ** 2)
    c, a, b = float(np.exp(fitted[0])), float(fitted[1]), float(fitted[2])
    flown = float(gsd.max())
    coarsest = {
        f"{wanted:g} cm": {str(k): round(min(float((wanted * k**b / c) ** (1 / a)), flown), 2) for k in PHOTOS}
        for wanted in WANTED_CM
    }
    numbers = {"c": round(c, 3), "a": round(a, 3), "b": round(b, 3), "coarsest_flown_gsd_cm": round(flown, 2)}
    return numbers | {"coarsest_gsd_cm_by_free_photos": coarsest}


def shares_of(stems: list[dict]) -> list[dict[str, Any]]:
    """What was measured and how right, by plot and number of free photos."""
    table = []
    for plot in sorted({stem["plot"] for stem in stems}):
        for low, high in ((0, 3), (3, 6), (6, 12), (12, 24), (24, 1000)):
            own = [stem for stem in stems if stem["plot"] == plot and low <= stem["free_photos"] < high]
            if not own:
                continue
            measured = [stem for stem in own if "se_cm" in stem]
            row: dict[str, Any] = {"plot": plot, "free_photos": f"{low} to {high - 1}", "stems": len(own)}
            row |= {"measured": len(measured), "gsd_cm": round(float(np.median([s["gsd_cm"] for s in own])), 2)}
            if measured:
                error = np.array([stem["error_cm"] for stem in measured])
                row["median_se_cm"] = round(float(np.median([stem["se_cm"] for stem in measured])), 3)
                row["rmse_cm"] = round(float(np.sqrt(np.mean(error**2))), 3)
                row["median_abs_error_cm"] = round(float(np.median(np.abs(error))), 3)
            table.append(row)
    return table


def draw(stems: list[dict], law: dict[str, Any]) -> bytes:
    """The chart as SVG: standard error over free photos, a colour and mark a flight, the law as lines."""
    figure, axes = new_chart(7.0, 4.8)
    for number, plot in enumerate(sorted({stem["plot"] for stem in stems})):
        own = [stem for stem in stems if stem["plot"] == plot and "se_cm" in stem and stem["free_photos"]]
        colour, mark = STYLE[number % len(STYLE)]
        gsd = float(np.median([stem["gsd_cm"] for stem in own]))
        places = [[stem[key] for stem in own] for key in ("free_photos", "se_cm")]
        axes.plot(*places, mark, ms=4.5, mfc="none", mec=colour, alpha=0.75, label=f"{gsd:.1f} cm a pixel at the stem")
        if law:
            n = np.geomspace(1, max(places[0]), 50)
            axes.plot(n, law["c"] * gsd ** law["a"] / n ** law["b"], color=colour, lw=1.6)
    for wanted in WANTED_CM:
        axes.axhline(wanted, color=GREY, lw=0.8, ls=":")
    axes.set(xscale="log", yscale="log", ylabel="standard error of the DBH, cm")
    axes.set_xlabel("photos that show breast height free")
    for axis, ticks in ((axes.xaxis, (1, 2, 4, 8, 16, 32, 64)), (axes.yaxis, (0.2, 0.5, 1, 2, 5))):
        axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_ticks([], minor=True)
    axes.legend()
    return chart_svg(figure)


def main() -> None:
    """Fit, summarise, print, write and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="+", required=True)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--chart", type=Path, help="SVG file")
    args = parser.parse_args()
    stems = [stem for plot in args.plots for stem in stems_of(plot)]
    law, shares = law_of(stems), shares_of(stems)
    print(json.dumps({"law": law, "by_free_photos": shares}, indent=1))
    write_record(args.output, {"law": law, "by_free_photos": shares, "stems": stems}, seeds=[SEED])
    if args.chart:
        args.chart.write_bytes(draw(stems, law))


if __name__ == "__main__":
    main()
