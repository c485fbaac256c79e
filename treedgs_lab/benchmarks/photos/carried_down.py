"""Diameters carried down from 2 to 5 m, and what shows through fitted stems: both on one search a plot.

    python -m treedgs_lab.benchmarks.photos.carried_down PLOT … --output FILE.json

Plots are rendered, with truth; one called ``hard_SEED`` that is not there is simulated
(:func:`.stem_network.hard_options`). Cameras and ground are the renderer's.

``carried``: the stems of the plot whose breast height is hidden and that are measured above it. There are few; so every
other stem of the layer is measured above as well (``all_above``), as if its breast height were hidden. Each by its own
taper (``own_*``), as before, and held to that of the plot's stems.

``through``: share of the photos that show the ground through a fitted stem (:mod:`.opacity_test`), of each measured or
refused fit, beside whether a stem or sapling stands there.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from treedgs_geo.core.intervals import HALF_WIDTH_SE
from treedgs_geo.core.progress import Reporter
from treedgs_geo.stems.photos import route, upper_stem
from treedgs_geo.stems.photos.deduplicate import known_rows
from treedgs_geo.stems.photos.evidence.opacity_test import ground_correlation, share_through
from treedgs_geo.stems.photos.evidence.taper_prior import stand_taper
from treedgs_geo.stems.photos.fit.edge_adjustment import TaperPrior
from treedgs_geo.stems.photos.fit.null_model import ABOVE, BREAST
from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.search_steps import TileSearch, load_photos, recall
from treedgs_geo.stems.photos.stem_fit import Fitter
from treedgs_geo.stems.photos.tiles import split
from treedgs_lab.benchmarks.photos.stem_network import hard_options
from treedgs_lab.benchmarks.photos.stems_from_photos import MATCH_M, everything_there, pair_up
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_lab.benchmarks.verbs import run_verb

#: A stem carried down, by its own taper and held to that of the plot's stems.
Carried = list[tuple[PhotoFit, PhotoFit]]


def searched(plot: Path, options: PhotoStemOptions) -> tuple[route.Searched, Carried, Fitter]:
    """The search of a plot of one piece of ground, what it carried down, and the fitter that it used."""
    views, _, ground, area = plot_inputs(plot)
    ((tile, box),) = split(area, options.margin_m)
    carried: Carried = []
    held_to = upper_stem.held_to

    def noted(taper: TaperPrior, own: PhotoFit, *where: Any) -> PhotoFit:
        carried.append((own, held_to(taper, own, *where)))
        return carried[-1][1]

    with mock.patch.object(upper_stem, "held_to", noted):
        found = route.search_photos(views, ground, area, options)
    if found.looks[0] is None:
        raise SystemExit(f"{plot}: too few photos see the plot")
    search = TileSearch(views, ground, area, tile, box, options, Reporter())
    load_photos(search)
    recall(search, found.looks[0])
    return found, carried, search.fitter


def through(fit: PhotoFit, fitter: Fitter) -> float:
    """:func:`.opacity_test.share_through` of a fit, 0 where too few photos show the ground."""
    if fitter.backdrop is None:
        return 0.0
    band = (ABOVE if fit.carried else BREAST).fine
    shape = fit.r0, fit.r1
    found = ground_correlation(fitter.stack, fitter.ground, fitter.backdrop, fit.axis, shape, band)
    return share_through(found, fit.evidence.n_views)


def seen_above(
    fit: PhotoFit, fits: list[PhotoFit], carried: Carried, fitter: Fitter
) -> tuple[PhotoFit, PhotoFit] | None:
    """A stem measured above: by its own taper, and held to that of the plot's stems; ``None`` where it is refused."""
    if fit.carried:
        return min(carried, key=lambda pair: float(np.hypot(*(pair[1].axis.p - fit.axis.p))))
    others = [each for each in fits if each is not fit]
    known, above = known_rows(others), replace(fitter, bands=ABOVE)
    own = upper_stem.measured_above(fit, above, known)
    return None if own is None else (own, upper_stem.held_to(stand_taper(others), own, above, known))


def stem_row(tree: dict[str, str], fit: PhotoFit, seen: tuple[PhotoFit, PhotoFit] | None) -> dict[str, Any] | None:
    """What is read above of one true stem, against the tape; ``None`` where nothing is."""
    if seen is None:
        return None
    (own, held), true_cm = seen, float(tree["dbh_cm"])
    return {
        "tree": tree["tree_id"],
        "dbh_cm": round(true_cm, 2),
        "carried": fit.carried,
        "flag": fit.flag,
        "own_error_cm": round(own.dbh_cm - true_cm, 2),
        "own_se_cm": round(own.se_cm, 2),
        "error_cm": round(held.dbh_cm - true_cm, 2),
        "se_cm": round(held.se_cm, 2),
    }


def figures(plot: Path, options: PhotoStemOptions) -> dict[str, Any]:
    """Both parts of one plot."""
    found, carried, fitter = searched(plot, options)
    frame = plot_inputs(plot)[1]
    truth = truth_rows(plot, in_plot=False)
    places = local_places(truth, frame)
    pairs = pair_up(places, found.fits)
    rows = [
        stem_row(truth[i], found.fits[j], seen_above(found.fits[j], found.fits, carried, fitter))
        for i, j in pairs.items()
    ]
    there = everything_there(plot, frame, places)
    stem_of = {j: truth[i] for i, j in pairs.items()}
    shares = [
        {
            "stands": bool(np.linalg.norm(there - fit.axis.p, axis=1).min() <= MATCH_M),
            "tree": stem_of[j]["tree_id"] if j in stem_of else None,
            "flag": fit.flag,
            "reasons": ",".join(fit.reasons),
            "dbh_cm": round(fit.dbh_cm, 1),
            "error_cm": round(fit.dbh_cm - float(stem_of[j]["dbh_cm"]), 2) if j in stem_of else None,
            "share": round(through(fit, fitter), 3),
        }
        for j, fit in enumerate(found.fits)
    ]
    return {"above": [row for row in rows if row is not None], "through": shares}


def pooled(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Errors of rows of ``above`` by both tapers, cm, and the share inside 90 % intervals."""
    out: dict[str, Any] = {"stems": len(rows)}
    for name in ("own_", ""):
        if rows:
            error, se = (np.array([row[f"{name}{key}_cm"] for row in rows]) for key in ("error", "se"))
            out |= {
                f"{name}rmse_cm": round(float(np.sqrt((error**2).mean())), 2),
                f"{name}bias_cm": round(float(error.mean()), 2),
                f"{name}worst_cm": round(float(np.abs(error).max()), 2),
                f"{name}error_over_se_rms": round(float(np.sqrt(((error / se) ** 2).mean())), 2),
                f"{name}in_90": round(float((np.abs(error / se) < HALF_WIDTH_SE).mean()), 3),
            }
    return out


def main() -> None:
    """Every plot; print, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    args = parser.parse_args()
    options, plots = PhotoStemOptions(), {}
    for plot in args.plots:
        if not (plot / "truth" / "config.json").exists():
            run_verb("simulate-plot", "--output", plot, *hard_options(int(plot.name.rpartition("_")[2])))
        plots[plot.name] = figures(plot, options)
        every = [row for each in plots.values() for row in each["above"]]
        shares = [row for each in plots.values() for row in each["through"]]
        record = {
            "all_above": pooled(every),
            "carried": pooled([row for row in every if row["carried"]]),
            "most_through_a_stem": max((row["share"] for row in shares if row["stands"]), default=None),
            "plots": plots,
        }
        print(plot.name, {key: value for key, value in record.items() if key != "plots"}, flush=True)
        write_record(args.output, record, seeds=[options.seed])


if __name__ == "__main__":
    main()
