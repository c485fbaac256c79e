"""Diameters from clouds by the TreeDGS that ``PYTHONPATH`` names: runs by itself, so that it can be a former version.

    PYTHONPATH=CHECKOUT python treedgs_lab/benchmarks/clouds/run_treedgs.py FOLDER OUT [--bh 1.3]

Measures every ``*.npy`` of FOLDER ((N, 3) metres) as ``pointcloud-to-dbh`` does and writes OUT/NAME.json: seconds on
the clock and of the processor (reading left out), and the trees. The first cloud is measured twice: the first time
(``seconds_first``) loads the compiled code.
"""

import argparse
import contextlib
import importlib
import json
import time
from pathlib import Path

import numpy as np
from rival import peak_gb

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.terrain.ground import dtm_from_cloud, flat_ground

#: Where the measuring is, and was in version 0.1.
ROOMS = ("treedgs_geo.stems.cloud.estimate.cloud", "treedgs_geo.measure.cloud")


def room():
    """The module that measures."""
    for name in ROOMS:
        with contextlib.suppress(ModuleNotFoundError):
            return importlib.import_module(name)
    raise SystemExit(f"none of {ROOMS} is on PYTHONPATH")


def measure(xyz: np.ndarray, code, options) -> dict:
    """Ground, stems and diameters of one cloud, timed."""
    began, spent = time.perf_counter(), time.process_time()
    try:
        dtm = dtm_from_cloud(xyz)
    except Exception:  # a cut-out tree: its lowest points stand in for the ground
        dtm = flat_ground(xyz)
    trees, _ = code.measure_cloud(PointCloud(xyz), dtm, options)
    return {
        "seconds": time.perf_counter() - began,
        "cpu_seconds": time.process_time() - spent,
        "peak_gb": peak_gb(),
        "trees": [
            {
                "x": tree.x,
                "y": tree.y,
                "dbh_cm": tree.dbh_cm,
                "lo": tree.dbh_lo_cm,
                "hi": tree.dbh_hi_cm,
                "flag": tree.qc_flag,
                "reason": tree.qc_reason,
            }
            for tree in trees
        ],
    }


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--bh", type=float, help="breast height, m (default: TreeDGS's)")
    args = parser.parse_args()
    code = room()
    options = code.MeasureOptions() if args.bh is None else code.MeasureOptions(bh_m=args.bh)
    files = sorted(args.folder.glob("*.npy"))
    first = measure(np.load(files[0]), code, options)
    for file in files:
        record = measure(np.load(file), code, options)
        if file is files[0]:
            record["seconds_first"] = first["seconds"]
        (args.out / f"{file.stem}.json").write_text(json.dumps(record))


if __name__ == "__main__":
    main()
