"""Is every stem that photos see looked for, and is it in the layer? What does looking cost?

    python -m treedgs_lab.benchmarks.photos.recall PLOT … --own WORKSPACES --output FILE.json

Each rendered plot twice: with the renderer's cameras and ground, and with those of the chain (``WORKSPACES/PLOT-*``, as
``benchmarks.photos.photos_to_dbh --work WORKSPACES`` leaves them; left out where there are none). Of the plot's stems,
all and those with three or more clear photos: how many have a seed within 0.35 m of their breast height, a row in the
layer within 0.5 m, a diameter. Its price: seeds, refused rows where no stem or sapling stands, CPU seconds of the
search alone and of all that follows.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.stems.photos import route
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.tiles import split
from treedgs_lab.benchmarks.photos.stems_from_photos import MATCH_M, everything_there, pair_up
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import CLEAR_VIEWS, local_places, plot_inputs, truth_rows

#: A seed this close to a stem leads to it.
SEED_M = 0.35


def seeds_of(views: list, ground: Any, area: Any, options: PhotoStemOptions) -> tuple[np.ndarray, float]:
    """(S, 2) places that the search for edges proposes, as :func:`.find.search_photos` begins; CPU seconds."""
    began, places = time.process_time(), []
    for tile, box in split(area, options.margin_m):
        grid, stack = route.photos_of(views, ground, tile, options, Reporter())
        detector = route._detector(stack, grid, area, tile, box, options)
        seeds, beside, _ = route._edge_seeds(detector, area, options, np.random.default_rng(options.seed))
        places += [(seed.x, seed.y) for seed in [*seeds, *beside]]
    return np.array(places).reshape(-1, 2), time.process_time() - began


def figures(plot: Path, workspace: Path | None, options: PhotoStemOptions) -> dict[str, Any]:
    """Recall of a plot with the renderer's cameras, or with those of a workspace."""
    views, frame, ground, area = plot_inputs(plot, workspace)
    seeds, search_s = seeds_of(views, ground, area, options)
    began = time.process_time()
    fits = route.stems_from_photos(views, ground, area, options)
    whole_s = time.process_time() - began
    truth = truth_rows(plot, in_plot=False)
    places = local_places(truth, frame)
    pairs = pair_up(places, fits)
    rows = [i for i, tree in enumerate(truth) if tree["in_plot"] == "True"]
    near = np.linalg.norm(places[:, None] - seeds[None], axis=2).min(axis=1, initial=np.inf) <= SEED_M
    there = everything_there(plot, frame, places)
    refused = [fit for fit in fits if not fit.measured]
    nothing = [fit for fit in refused if np.linalg.norm(there - fit.axis.p, axis=1).min() > MATCH_M]

    def of(chosen: list[int]) -> dict[str, int]:
        return {
            "stems": len(chosen),
            "seeded": int(near[chosen].sum()),
            "in_layer": sum(i in pairs for i in chosen),
            "measured": sum(i in pairs and fits[pairs[i]].measured for i in chosen),
        }

    clear = [i for i in rows if int(truth[i]["n_unoccluded_bh_views"]) >= CLEAR_VIEWS]
    return {
        "cameras": "renderer's" if workspace is None else "own",
        "all": of(rows),
        "clear": of(clear),
        "not_in_layer": [truth[i]["tree_id"] for i in rows if i not in pairs],
        "seeds": len(seeds),
        "rows": len(fits),
        "refused_where_nothing_stands": len(nothing),
        "search_cpu_s": round(search_s, 1),
        "cpu_s": round(whole_s, 1),
    }


def main() -> None:
    """Every plot with both kinds of cameras; print, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--own", type=Path, help="folder of the chain's workspaces")
    parser.add_argument("--seed", type=int, default=7, help="of the random places that chance is measured at")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    args = parser.parse_args()
    options = PhotoStemOptions(seed=args.seed)
    found: dict[str, list[dict[str, Any]]] = {}
    for plot in args.plots:
        own = sorted(args.own.glob(f"{plot.name}-*/sfm")) if args.own else []
        for workspace in [None, *(folder.parent for folder in own[:1])]:
            row = figures(plot, workspace, options)
            found.setdefault(plot.name, []).append(row)
            print(plot.name, row, flush=True)
    write_record(args.output, {"plots": found}, seeds=[args.seed])


if __name__ == "__main__":
    main()
