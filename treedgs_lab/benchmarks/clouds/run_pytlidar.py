"""Diameters of PyTLidar (TreeQSM in Python, GPL-3) of trees that are cut out for it: runs in its own environment.

    ENV/bin/python treedgs_lab/benchmarks/clouds/run_pytlidar.py CLOUD.npy OUT.json --places PLACES.npy

PLACES.npy: (K, 2) true places of stems; TreeQSM finds none by itself. A tree is what lies within 0.6 m of its place
from 0.1 to 5 m above the lowest point there; its diameter is that of the trunk's cylinder at 1.3 m. Parameters by
PyTLidar's own ``define_input``. A tree on which it gives up counts as none.
"""

import contextlib

import numpy as np
from PyTLidar import build_inputs, run_qsm
from rival import run

REACH_M, LOW_M, HIGH_M, BH_M = 0.6, 0.1, 5.0, 1.3


def measure(xyz, args):
    trees = []
    for place in np.load(args.places):
        near = xyz[np.hypot(*(xyz[:, :2] - place).T) < REACH_M]
        near = near - (0.0, 0.0, near[:, 2].min() if len(near) else 0.0)
        own = near[(near[:, 2] > LOW_M) & (near[:, 2] < HIGH_M)]
        with contextlib.suppress(Exception):
            trees += stem_of(own)
    return trees


def stem_of(tree):
    """The one stem of (N, 3) points, heights from the ground; none where no trunk reaches breast height."""
    models, _ = run_qsm(tree, build_inputs(tree, savetxt=0, savepdf=0)[0])
    part = models[0]["cylinder"]
    low = part["start"]
    high = low + part["axis"] * part["length"].reshape(-1, 1)
    at = (part["branch"].ravel() == 0) & (low[:, 2] <= BH_M) & (high[:, 2] > BH_M)
    k = int(np.flatnonzero(at)[0])
    x, y, _ = low[k] + (BH_M - low[k, 2]) / (high[k, 2] - low[k, 2]) * (high[k] - low[k])
    return [{"x": float(x), "y": float(y), "dbh_cm": 200 * float(part["radius"].ravel()[k])}]


if __name__ == "__main__":
    run(__doc__, "pytlidar", measure, places={"required": True})
