"""How often a part of the chosen explanation of a place is the stem (``PART_ODDS`` of ``from_photos/choice.py``).

    python -m benchmarks.photos.parts PLOT [PLOT ...] --output docs/results/parts.json

Every stem of the plots (rendered, with truth; the renderer's cameras) is searched and fitted. For each place within 15
cm of a true stem, the explanations that lie inside the chosen one are counted: how many are the stem (less than 1.5 cm
off), and how many would be by the probabilities of the witnesses alone, and with ``PART_ODDS``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from unittest import mock

import numpy as np

from benchmarks.records import write_record
from benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_geo.from_photos import fit as photo_fit
from treedgs_geo.from_photos.choice import PART_ODDS, contains
from treedgs_geo.from_photos.find import stems_from_photos
from treedgs_geo.from_photos.options import PhotoStemOptions

NEAR_M, RIGHT_CM = 0.15, 1.5


def parts_of(plot: Path) -> list[dict]:
    """One entry a part."""
    views, frame, ground, area = plot_inputs(plot)
    truth = truth_rows(plot, in_plot=False)
    places, dbh = local_places(truth, frame), np.array([float(tree["dbh_cm"]) for tree in truth])
    found: list[dict] = []
    choose = photo_fit.choose

    def listen(*args, **more):
        choice = choose(*args, **more)
        best = choice.best
        away = np.hypot(*(places - best.fine.axis.p).T)
        tree = int(away.argmin())
        inside = np.array([item is not best and contains(best.vector, item.vector) for item in choice.rivals])
        alone = choice.share / np.where(inside, PART_ODDS, 1.0)
        alone /= alone.sum()
        for k in np.flatnonzero(inside & (away[tree] < NEAR_M)):
            off = 200 * choice.rivals[k].fine.r0 - dbh[tree]
            found.append(
                {
                    "tree": truth[tree]["tree_id"],
                    "by_witnesses": round(float(alone[k]), 4),
                    "with_part_odds": round(float(choice.share[k]), 4),
                    "right": bool(abs(off) < RIGHT_CM),
                    "chosen_right": bool(abs(200 * best.fine.r0 - dbh[tree]) < RIGHT_CM),
                }
            )
        return choice

    with mock.patch.object(photo_fit, "choose", listen):
        stems_from_photos(views, ground, area, PhotoStemOptions())
    return found


def main() -> None:
    """Gather, count, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    found = {plot.name: parts_of(plot) for plot in options.plots}
    every = [row for rows in found.values() for row in rows]
    figures = {
        "plots": list(found),
        "parts": len(every),
        "right": sum(row["right"] for row in every),
        "right_by_witnesses": round(sum(row["by_witnesses"] for row in every), 1),
        "right_with_part_odds": round(sum(row["with_part_odds"] for row in every), 1),
        "chosen_right": sum(row["chosen_right"] for row in every),
        "rows": found,
    }
    print({name: value for name, value in figures.items() if name != "rows"})
    write_record(options.output, figures, seeds=[PhotoStemOptions().seed])


if __name__ == "__main__":
    main()
