"""The stage ``reconstruct``: photos to cameras in one frame; and ``dense`` of the verb: points of the stem bands."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError, ReconstructionError
from ..core.machine import cores
from ..core.progress import Collector, Reporter
from ..core.settings import to_json
from ..geotags.control import read_control
from ..geotags.photos import read_photo
from ..pointcloud.cloud import PointCloud
from ..pointcloud.files import write_cloud
from ..reconstruction.calibration import calibration_of
from ..reconstruction.dense import DenseOptions, densify_band
from ..reconstruction.matching_strategy import GUIDED_NEIGHBOURS, reconstruct_photos
from ..reconstruction.model import FRAME, MODEL_FILES, REPORT, load_points, load_views
from ..reconstruction.pairs import select_pairs
from ..reconstruction.prior_knowledge import can_guide, gimbal_rotations
from ..terrain.sparse_ground import dtm_from_sparse
from .context import Aligned, PhotoJob
from .forecast import at_once, planned_ground
from .ground_stage import GROUND
from .stage import Cost, Findings, Key, Stage

#: Core-seconds on the machines of docs/results: per megapixel of features, per matched pair, per photo of mapping and
#: adjustment.
GUIDED_S_MP, GUIDED_S_PAIR, GUIDED_S_PHOTO = 0.18, 0.02, 0.17
#: The same where every feature is matched with every other, 8000 of a photo.
FULL_S_MP, FULL_S_PAIR, FULL_S_PHOTO = 0.34, 0.10, 0.4


def _read_control(job: PhotoJob) -> None:
    """Ground control; its warnings are the run's."""
    if job.settings.gcp is not None:
        heard = Collector(job.reporter)
        job.control = read_control(job.settings.gcp, job.stations, heard)
        job.steps.warnings += heard.warnings


def _reconstruct_cost(job: PhotoJob, findings: Findings) -> Cost:
    stations, options, half_field = job.stations, job.preset.reconstruct, 0.6
    photo, number = read_photo(stations.paths[0]), len(stations)
    longer, full_mp = max(photo.width, photo.height), photo.width * photo.height / 1e6
    used_mp = full_mp * min(1.0, options.max_image_size / longer) ** 2
    try:
        half_field = 0.5 * longer / calibration_of([photo], job.settings.calibration).camera.fx
    except (ReconstructionError, InputError) as problem:
        findings.problem(str(problem))
    ground = planned_ground(stations, job.plots, job.given)
    rotations = gimbal_rotations(stations)
    full_s, guided_s = (
        each_mp * used_mp * number
        + each_pair
        * min(len(select_pairs(stations.xyz, rotations, ground, half_field, neighbours)), neighbours * number)
        + each_photo * number
        for each_mp, each_pair, each_photo, neighbours in (
            (FULL_S_MP, FULL_S_PAIR * (options.max_features / 8000) ** 1.5, FULL_S_PHOTO, options.neighbours),
            (GUIDED_S_MP, GUIDED_S_PAIR, GUIDED_S_PHOTO, GUIDED_NEIGHBOURS),
        )
    )
    guided = can_guide(stations.xyz, rotations, ground)
    return Cost(
        seconds=(guided_s if guided else full_s) / at_once() * 1.1,
        more_s=full_s / at_once() if guided else 0.0,
        # A photo's features need about 0.1 GB a megapixel in each thread.
        memory_gb=0.08 * used_mp * min(cores(), 16),
        disk_gb=number * (0.004 + 0.001 * full_mp),
    )


def _reconstruct_key(job: PhotoJob) -> Key:
    used = {**to_json(job.preset.reconstruct), "stations": job.stations.digest()}
    if job.control is not None:
        used["control"] = job.control.digest()
    return Key(used, [job.settings.calibration] if job.settings.calibration else [])


def _reconstruct(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    lens = job.settings.calibration
    return reconstruct_photos(job.stations, job.preset.reconstruct, job.path(names.SFM), reporter, job.control, lens)


def _load_block(job: PhotoJob, report: dict[str, Any]) -> None:
    sfm, files = job.path(names.SFM), dict(zip(job.stations.names, job.stations.paths, strict=True))
    frame, views = load_views(sfm, job.settings.photos, files)
    job.aligned = Aligned(frame, views, load_points(sfm), report)


RECONSTRUCT = Stage(
    "reconstruct",
    0.46,
    _reconstruct,
    checks=(_read_control,),
    cost=_reconstruct_cost,
    key=_reconstruct_key,
    outputs=lambda job: [job.path(names.SFM) / name for name in (*MODEL_FILES, FRAME, REPORT)],
    load=_load_block,
    wanted=lambda job: not job.nothing,
)


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
