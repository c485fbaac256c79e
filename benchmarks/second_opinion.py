"""How good a stem primitive is as a second opinion: it is asked about every stem that the photo route fits.

    python benchmarks/second_opinion.py PLOT ... --output FILE.json       (the renderer's cameras, the plot's DTM)

Truth is read for scoring alone. "alone": no companion is likely and no other measured stem within 0.6 m: only those are
asked in ``photos-to-dbh`` (``chain/second_measurement.py``). A primitive is right within 1.5 cm or 6 % of the truth.
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

from stems_from_photos import plot_inputs  # noqa: E402

from treedgs_geo.chain.second_measurement import stems_to_measure_again, with_second_measurements  # noqa: E402
from treedgs_geo.core.progress import Reporter  # noqa: E402
from treedgs_geo.from_photos.find import stems_from_photos  # noqa: E402
from treedgs_geo.from_photos.options import PhotoStemOptions  # noqa: E402
from treedgs_geo.from_photos.trees import trees_of_photo_fits  # noqa: E402
from treedgs_geo.gaussians.options import GaussianOptions  # noqa: E402
from treedgs_geo.gaussians.train import fit_with_report  # noqa: E402
from treedgs_geo.trees.limits import LIMITS  # noqa: E402


def rows_of(plot: Path) -> tuple[list[dict], dict]:
    """One row a stem that was fitted within 0.3 m of a true one; and what it cost."""
    views, frame, ground, area = plot_inputs(plot)
    options = PhotoStemOptions()
    fits = stems_from_photos(views, frame, ground, area, options, Reporter())
    places = np.array([fit.axis.p for fit in fits])
    inside = area.contains(places, 0.0)
    began = time.perf_counter()
    _, report = fit_with_report(views, frame, ground, places, None, GaussianOptions(), Reporter())
    seconds = time.perf_counter() - began
    asked, everyone = stems_to_measure_again(fits, inside), stems_to_measure_again(fits, inside, everyone=True)
    alone = set(stems_to_measure_again(fits, np.ones(len(fits), bool), everyone=True))
    chosen = {number: report.primitives[number] for number in asked if number in report.primitives}
    after, opinion = with_second_measurements(trees_of_photo_fits(fits, frame), fits, chosen, options.bh_m)
    truth = list(csv.DictReader(open(plot / "truth" / "trees.csv")))
    true_xy = np.array([[float(t["E_bh"]), float(t["N_bh"])] for t in truth]) - frame.origin[:2]
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
                "alone": number in alone or number in asked,
                "asked": number in asked,
                "final_cm": None if final.dbh_cm is None else round(final.dbh_cm, 2),
                "final_flag": final.qc_flag,
            }
        )
    return rows, {
        "stems": len(fits),
        "seconds": round(seconds, 1),
        "asked": len(asked),
        "all": len(everyone),
        "gained": opinion.gained,
        "flagged": opinion.flagged,
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
        limit = np.array([LIMITS["second measurement"][0].check.at(r["true_cm"]) for r in sure])
        summary[name] = {
            "stems": len(group),
            "without a reason": len(sure),
            "right": int((np.abs(error) <= limit).sum()),
            "mean_cm": round(float(error.mean()), 2) if len(sure) else None,
            "rmse_cm": round(float(np.sqrt((error**2).mean())), 2) if len(sure) else None,
        }
    changed = [r for r in rows if r["asked"] and (r["final_flag"] != r["flag"] or r["flag"] == "reject")]
    for row in changed:
        print(json.dumps(row))
    print(json.dumps(summary, indent=1))
    if options.output:
        options.output.write_text(json.dumps({"summary": summary, "plots": costs, "trees": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
