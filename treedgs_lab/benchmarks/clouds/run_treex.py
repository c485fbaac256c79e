"""Stems and diameters of TreeX (pointtree, MIT): runs in an environment of its own.

    ENV/bin/python benchmarks/clouds/run_treex.py CLOUD.npy OUT.json [--preset uls|tls]

CLOUD.npy: (N, 3) metres, local origin. Its own presets; diameters are its own, at 1.3 m.
"""

import argparse
import importlib.metadata
import json
import resource
import sys
import time

import numpy as np
from pointtree.instance_segmentation import TreeXAlgorithm, TreeXPresetTLS, TreeXPresetULS

PRESETS = {"tls": TreeXPresetTLS, "uls": TreeXPresetULS}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cloud")
    parser.add_argument("out")
    parser.add_argument("--preset", choices=PRESETS, default="tls")
    args = parser.parse_args()
    xyz = np.load(args.cloud).astype(float)
    began, cpu = time.perf_counter(), time.process_time()
    trees, note = [], ""
    try:
        _, places, dbh = TreeXAlgorithm(**{**PRESETS[args.preset](), "num_workers": 1, "random_seed": 0})(xyz)
        trees = [
            {"x": float(x), "y": float(y), "dbh_cm": 100 * float(d)}
            for (x, y), d in zip(places, dbh, strict=True)
            if d > 0
        ]
    except Exception as problem:  # a cloud on which it gives up counts as no tree
        note = f"{type(problem).__name__}: {problem}"[:200]
    if sys.platform == "win32":
        raise SystemExit("Windows reports no peak of memory")
    record = {
        "version": importlib.metadata.version("pointtree"),
        "seconds": time.perf_counter() - began,
        "cpu_seconds": time.process_time() - cpu,
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "trees": trees,
        "note": note,
    }
    with open(args.out, "w", encoding="utf-8") as stream:
        json.dump(record, stream)


if __name__ == "__main__":
    main()
