"""What each level of the reconstruction costs and gives on the same photos: guided, and after it fine and full.

    python -m treedgs_lab.benchmarks.reconstruction.levels --plots ../shared/data/plot_h --work WORK
        --output levels.json

Each of the later levels starts from the guided block, as it does where that is not good enough, whether it is or not.
Cameras are compared with ``truth/`` as :mod:`treedgs_lab.benchmarks.reconstruction.accuracy` does; seconds are of the
processor, children included, one thread. Features of the fine level are those of the guided one.
"""

from __future__ import annotations

import argparse
import os
import shutil
from pathlib import Path
from typing import Any

from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags.photos import read_photo
from treedgs_geo.geotags.reading import read_stations
from treedgs_geo.reconstruction.calibration import calibration_record
from treedgs_geo.reconstruction.matching_levels import levels_of
from treedgs_geo.reconstruction.matching_strategy import Work, at_level, kept_poses
from treedgs_geo.reconstruction.model import save_model
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.prior_knowledge import survey_of
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.reconstruction.accuracy import score
from treedgs_lab.benchmarks.records import write_record

_REPORTED = (
    "photos", "registered", "points", "track_length", "reprojection_rms_px", "poses_px_median", "poses_px_worst",
    "pairs", "matches",
)  # fmt: skip
_SCORED = (
    "centre_rms_e_n_u_cm", "centre_max_cm", "focal_error_pct", "bh_raw_px_x_y", "bh_scatter_px_x_y",
    "bh_scatter_worst_view_px",
)  # fmt: skip


def _seconds() -> float:
    return sum(os.times()[:4])


def of_plot(plot: Path, work: Path) -> dict[str, dict]:
    """Figures of each level."""
    stations = read_stations(plot / "images", plot, TruePlot.load(plot).frame.crs.to_string())
    options, survey = ReconstructOptions(threads=1), survey_of(stations, None, None)
    # What an earlier run has kept would cost nothing.
    shutil.rmtree(work / plot.name, ignore_errors=True)
    former = None
    found: dict[str, dict[str, Any]] = {}
    for level in levels_of(options.neighbours, True):
        own = Work(stations, options, survey, work / plot.name / level.name / "sfm")
        if level.again:  # the guided level's features
            own = Work(stations, options, survey, work / plot.name / "guided" / "sfm")
        if level.again and kept_poses(former, survey) is None:
            found[level.name] = {"left_out": "too few poses of the guided block are sure"}
            continue
        began = _seconds()
        joined, report = at_level(own, level, Reporter(), former)
        seconds = _seconds() - began
        lens = calibration_record(read_photo(stations.paths[0]).model, joined.block.sensor, report["lens_sd"])
        target = work / plot.name / level.name / "sfm"
        save_model(target, joined.block, stations.names, stations.paths, stations.flight, survey.frame, report, lens)
        scored = score(plot, target.parent)
        found[level.name] = {"cpu_s": round(seconds, 1), **{name: report[name] for name in _REPORTED}}
        found[level.name] |= {name: scored[name] for name in _SCORED}
        if former is None:
            former = joined
        print(plot.name, level.name, found[level.name], flush=True)
    return found


def main() -> int:
    """Run the levels on each plot, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", nargs="+", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    found = {}
    for plot in args.plots:
        found[plot.name] = of_plot(plot, args.work)
        write_record(args.output, found, seeds=[1])
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
