"""The stage ``dense`` of ``reconstruct``: dense points of each plot's stem band."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.progress import Reporter
from ..pointcloud.cloud import PointCloud
from ..pointcloud.files import write_cloud
from ..reconstruction.dense import DenseOptions, densify_band
from ..terrain.sparse_ground import dtm_from_sparse
from .context import PhotoJob
from .ground_stage import GROUND
from .stage import Stage


def _densify(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    """Dense points of each plot's stem band, ``dense.laz``."""
    block, dtm, path = job.block, job.given, job.path(names.DENSE)
    frame = block.frame
    ground = (dtm or dtm_from_sparse(frame.to_project(block.points), crs=frame.crs)).local(frame).height
    parts = []
    for number, plot in enumerate(job.plots):
        centre = frame.to_local(np.array([[plot.x, plot.y, 0.0]]))[0, :2]
        with reporter.stage(f"dense {plot.plot_id}", number / len(job.plots), (number + 1) / len(job.plots)):
            parts.append(densify_band(block.views, ground, centre, plot.radius_m + 1.0, DenseOptions(), reporter))
    xyz, rgb, votes = (np.concatenate([part[i] for part in parts]) for i in range(3))
    if not len(xyz):
        reporter.warn(
            "No dense point was found in the stem band: no two photos look at it from a small angle and from the side."
        )
        return {"dense": None, "n_dense": 0}
    colours = {name: rgb[:, k].astype(np.uint16) * 257 for k, name in enumerate(("red", "green", "blue"))}
    write_cloud(path, PointCloud(frame.to_project(xyz), frame.crs, colours | {"n_views": votes.astype(np.uint8)}))
    reporter.info(f"Stem band: {len(xyz)} dense points seen by {votes.mean():.1f} reference photos on average.")
    return {"dense": str(path), "n_dense": len(xyz)}


DENSE = Stage("dense", 0.3, _densify, checks=GROUND.checks, always=True)
