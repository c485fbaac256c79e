"""Geotags of another instant, and float solutions labelled fixed: what does the block make of them?

    python -m treedgs_lab.benchmarks.reconstruction.late_geotags --plots DIR [DIR ...] --work WORK [--output FILE]

The ``.pos`` of simulated plots is changed: its times are late by so many seconds, or every epoch says to be fixed, with
centimetres. Its marks are a drone's own positions, metres off, so that only the photos can tell. Camera centres are
scored against the truth.
"""

from __future__ import annotations

import argparse
import datetime
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.pipeline import reconstruct_photos
from treedgs_lab.benchmarks.blocks import camera_errors
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.records import write_record

#: Name, seconds that the path is late, and whether its float epochs say to be fixed.
FAULTS = (("none", 0.0, False), ("17 ms", 0.017, False), ("200 ms", 0.2, False), ("floats fixed", 0.0, True))
_STAMP = "%Y/%m/%d %H:%M:%S.%f"
_FLOAT = re.compile(r"^(\S+ \S+\s+\S+\s+\S+\s+\S+\s+)2(\s+\S+\s+)\S+\s+\S+\s+\S+")


def changed(pos: Path, late_s: float, fixed: bool) -> None:
    """Change a ``.pos`` of ``simulate-plot`` in place."""
    rows = []
    for row in pos.read_text().splitlines():
        if not row.startswith("%"):
            when = datetime.datetime.strptime(row[:23], _STAMP) + datetime.timedelta(seconds=late_s)
            row = when.strftime(_STAMP)[:-3] + row[23:]
            row = _FLOAT.sub(r"\g<1>1\g<2>0.0110 0.0105 0.0270", row) if fixed else row
        rows.append(row)
    pos.write_text("\n".join(rows) + "\n")


def score(plot: Path, work: Path, late_s: float, fixed: bool) -> dict[str, Any]:
    """Reconstruct with the changed path in ``work`` and compare with the truth."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    for path in (*plot.glob("*.MRK"), *plot.glob("*.pos")):
        shutil.copy(path, work)
    changed(next(work.glob("*.pos")), late_s, fixed)
    truth = TruePlot.load(plot)
    stations = read_stations(plot / "images", work, truth.frame.crs, check_photos=False)
    report = reconstruct_photos(stations, ReconstructOptions(), work / "sfm", Reporter())
    true = {view.name: view.centre for view in truth.views()}
    off = truth.frame.to_local(stations.xyz) - np.array([true[name] for name in stations.names])
    sure = np.array([quality == "fix" for quality in stations.quality])
    found = camera_errors(truth, work / "sfm")
    return {
        "geotags_rms_3d_cm": round(float(100 * np.sqrt(np.mean(np.sum(off[sure] ** 2, axis=1)))), 2),
        **{name: found[name] for name in ("centre_rms_3d_cm", "centre_max_cm", "common_shift_cm")},
        **{name: report[name] for name in ("registered", "geotag_late_s", "geotag_late_sd_s", "scale_sd")},
        "contradicted": len(report["geotag_contradicted"]),
        "fixed": int(sure.sum()),
    }


def main() -> None:
    """Reconstruct, score, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="+", required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    figures: dict[str, Any] = {}
    for plot in args.plots:
        figures[plot.name] = {}
        for name, late_s, fixed in FAULTS:
            figures[plot.name][name] = found = score(plot, args.work / plot.name / name, late_s, fixed)
            print(plot.name, name, json.dumps(found), flush=True)
            write_record(args.output, figures)


if __name__ == "__main__":
    main()
