"""Stems and diameters of 3DFin (GPL-3) with its defaults, without its windows: runs in an environment of its own.

    ENV/bin/python treedgs_lab/benchmarks/clouds/run_3dfin.py CLOUD.npy OUT.json

Its processing class is given the points and keeps nothing but places and DBH.
"""

import tempfile
from pathlib import Path

import numpy as np
from rival import run
from three_d_fin.processing.abstract_processing import FinProcessing
from three_d_fin.processing.configuration import FinConfiguration, MiscParameters


class InMemory(FinProcessing):
    """3DFin's steps on an array; what it would write is left out."""

    xyz = np.empty((0, 3))
    trees: list = []

    def _construct_output_path(self):
        self.output_basepath = Path(self.config.misc.output_dir) / "cloud"

    def _load_base_cloud(self):
        self.base_cloud = self.xyz

    def _get_xyz_from_base(self):
        return self.xyz

    def _export_tree_locations(self, tree_locations, dbh_values):
        self.trees = [
            {"x": float(place[0]), "y": float(place[1]), "dbh_cm": 100 * float(d)}
            for place, d in zip(tree_locations, np.ravel(dbh_values), strict=True)
            if d > 0
        ]

    def _nothing(self, *_, **__):
        pass

    _get_xyz_z0_from_base = _pre_processing_hook = _post_processing_hook = _enrich_base_cloud = _nothing
    _export_dtm = _export_stripe = _export_tree_height = _export_circles = _export_axes = _nothing
    _export_tabular_data = _nothing


def measure(xyz, _args):
    InMemory.xyz = xyz
    with tempfile.TemporaryDirectory() as folder:
        work = InMemory(FinConfiguration(misc=MiscParameters(output_dir=folder)))
        work.process()
    return work.trees


if __name__ == "__main__":
    run(__doc__, "3DFin", measure)
