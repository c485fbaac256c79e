"""How good a stem primitive is as a second measurement: it measures every stem that the photo route fits.

    python -m treedgs_lab.benchmarks.photos.second_measurement PLOT ... --output second_measurement.json

Cameras are the renderer's, the ground is the plot's DTM. Truth is read for scoring alone. "alone": no companion
is likely and no other measured stem within 0.6 m: only those are measured twice in ``photos-to-dbh``
(``run/second_measurement.py``). A primitive is right within 1.5 cm or 6 % of the truth.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.run.second_measurement import stems_to_measure_again, with_second_measurements
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_geo.stems.photos.trees import trees_of_photo_fits
from treedgs_geo.stems.quality.limits import LIMITS
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows


def rows_of(plot: Path) -> tuple[list[dict], dict]:
    """One row a stem that was fitted within 0.3 m of a true one; and what it cost."""
    views, frame, ground, area = plot_inputs(plot)
    options = PhotoStemOptions()
    fits = stems_from_photos(views, ground, area, options, Reporter())
    places = np.array([fit.axis.p for fit in fits])
    inside = area.contains(places, 0.0)
    began = time.perf_counter()
    _, report = fit_with_report(views, frame, ground, places, None, GaussianOptions(), Reporter())
    seconds = time.perf_counter() - began
    chosen, everyone = stems_to_measure_again(fits, inside), stems_to_measure_again(fits, inside, everyone=True)
    alone = set(stems_to_measure_again(fits, np.ones(len(fits), bool), everyone=True))
    found = {number: report.primitives[number] for number in chosen if number in report.primitives}
    after, counts = with_second_measurements(trees_of_photo_fits(fits, frame), fits, found, options.bh_m)
    truth = truth_rows(plot, in_plot=False)
    true_xy = local_places(truth, frame)
    rows = []
    for number, fit in enumerate(fits):
        away = np.linalg.norm(true_xy - fit.axis.p, axis=1)
        tree = truth[int(np.argmin(away))]
        primitive = report.primitives.get(number)
        if away.min() > 0.3 or primitive is None:
            continue
        own, final = primitive.primitive, after[number]
        rows.append(
            {
                "plot": plot.name,
                "tree": tree["tree_id"],
                "kind": tree["kind"],
                "true_cm": float(tree["dbh_cm"]),
                "photos_cm": round(fit.dbh_cm, 2),
                "flag": fit.flag,
                "reasons": ",".join(fit.reasons),
                "bark_cm": round(own.dbh_cm, 2),
                "bark_reasons": ",".join(own.findings.reasons),
                "alone": number in alone or number in chosen,
                "measured_again": number in chosen,
                "final_cm": None if final.dbh_cm is None else round(final.dbh_cm, 2),
                "final_flag": final.qc_flag,
            }
        )
    return rows, {
        "stems": len(fits),
        "seconds": round(seconds, 1),
        "measured_again": len(chosen),
        "all": len(everyone),
        "gained": counts.gained,
        "flagged": counts.flagged,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    rows, costs = [], {}
    for plot in options.plots:
        own, costs[plot.name] = rows_of(plot)
        rows += own
        print(plot.name, costs[plot.name], flush=True)
    summary = {}
    for name, wanted in (("alone", True), ("beside another", False)):
        group = [r for r in rows if r["alone"] == wanted]
        sure = [r for r in group if not r["bark_reasons"]]
        error = np.array([r["bark_cm"] - r["true_cm"] for r in sure])
        bound = LIMITS["second measurement"][0].check
        assert bound is not None
        limit = np.array([bound.at(r["true_cm"]) for r in sure])
        summary[name] = {
            "stems": len(group),
            "without a reason against it": len(sure),
            "right": int((np.abs(error) <= limit).sum()),
            "mean_cm": round(float(error.mean()), 2) if len(sure) else None,
            "rmse_cm": round(float(np.sqrt((error**2).mean())), 2) if len(sure) else None,
        }
    changed = [r for r in rows if r["measured_again"] and (r["final_flag"] != r["flag"] or r["flag"] == "reject")]
    for row in changed:
        print(json.dumps(row))
    print(json.dumps(summary, indent=1))
    write_record(options.output, {"summary": summary, "plots": costs, "trees": rows}, seeds=[GaussianOptions().seed])


if __name__ == "__main__":
    main()
