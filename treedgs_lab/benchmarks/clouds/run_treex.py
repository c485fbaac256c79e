"""Stems and diameters of TreeX (pointtree, MIT): runs in an environment of its own.

    ENV/bin/python treedgs_lab/benchmarks/clouds/run_treex.py CLOUD.npy OUT.json [--preset uls|tls]

Its own presets; diameters are its own, at 1.3 m.
"""

from pointtree.instance_segmentation import TreeXAlgorithm, TreeXPresetTLS, TreeXPresetULS
from rival import run

PRESETS = {"tls": TreeXPresetTLS, "uls": TreeXPresetULS}


def measure(xyz, args):
    _, places, dbh = TreeXAlgorithm(**{**PRESETS[args.preset](), "num_workers": 1, "random_seed": 0})(xyz)
    return [
        {"x": float(x), "y": float(y), "dbh_cm": 100 * float(d)} for (x, y), d in zip(places, dbh, strict=True) if d > 0
    ]


if __name__ == "__main__":
    run(__doc__, "pointtree", measure, preset={"choices": PRESETS, "default": "tls"})
