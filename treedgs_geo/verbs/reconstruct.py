"""``reconstruct``: drone photos to georeferenced cameras, sparse points and a dense prior of the stem band."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import param, to_json
from ..core.workspace import SFM, TREES, workspace_option
from ..run.settings import PhotoInputs, PhotosToDbhSettings


@dataclass(frozen=True, kw_only=True)
class ReconstructSettings(PhotoInputs):
    """Parameters of ``reconstruct``."""

    dense: bool = param(True, help="Make dense points of the stem band where plots are given.")
    workspace: Path = workspace_option()


def run(settings: ReconstructSettings, reporter: Reporter) -> dict[str, Any]:
    """The first stages of ``photos-to-dbh``, and dense points; finished stages of the same inputs are kept."""
    from ..run.photos import GEOTAG, RECONSTRUCT, held, job_of
    from ..run.reconstruct_stage import DENSE
    from ..run.stage import check, run_stages

    shared = {item.name: getattr(settings, item.name) for item in fields(PhotoInputs)}
    folder = settings.workspace
    job = job_of(PhotosToDbhSettings(**shared, workspace=folder, output=folder / TREES), reporter)
    stages = (GEOTAG, RECONSTRUCT, DENSE) if settings.dense and settings.plots else (GEOTAG, RECONSTRUCT)
    check(GEOTAG, job)
    with held(job, stages):
        job.space.record["parameters"] = to_json(settings)
        run_stages(stages, job, job.steps)
        found = job.space.result(DENSE.name) if DENSE in stages else {}
    report = job.block.report
    return {
        "workspace": str(folder),
        "sfm": str(job.path(SFM)),
        "n_photos": report["photos"],
        "n_registered": report["registered"],
        "reprojection_px": report["reprojection_rms_px"],
        "geotag_rms_e_n_u_m": report["geotag_rms_e_n_u_m"],
        **{name: report.get(name) for name in ("control_rms_e_n_u_m", "check_rms_e_n_u_m")},
        "focal_px": report["focal_px"],
        "n_points": report["points"],
        "seconds": report["seconds"],
        **{name: found[name] for name in ("dense", "n_dense") if name in found},
    }


COMMAND = Command(
    name="reconstruct",
    title="Reconstruct cameras from photos",
    group="5 Steps and research",
    summary="Georeferenced structure from motion: camera poses, sparse points, dense points of the stem band.",
    help=(
        "Inputs: overlapping drone photos (80 % overlap, most of them oblique) and their PPK, RTK or EXIF positions, "
        "or three or more control points. All flights end in one frame, adjusted with the geotags as priors. "
        "Output in the workspace: geotags.gpkg, "
        "sfm/ (COLMAP model in a local frame, frame.json with the CRS and origin, report.json) and dense.laz (stem "
        "band of the plots, project CRS). A block that contradicts its geotags, the lens calibration in the metadata, "
        "or the flying height is refused."
    ),
    settings=ReconstructSettings,
    run=run,
    main=("photos", "geotags", "crs", "dtm", "plots", "workspace"),
    example=(
        "treedgs reconstruct --photos flight/images --geotags flight --crs EPSG:6344 --plots flight/plots.csv "
        "--workspace work"
    ),
    outputs={
        "workspace": "folder of the results",
        "sfm": "COLMAP model (folder)",
        "dense": "dense points of the stem band (file)",
        "n_photos": "photos",
        "n_registered": "photos registered",
        "reprojection_px": "RMS reprojection error, px",
        "geotag_rms_e_n_u_m": "RMS distance of cameras to their geotags, E, N, U, m",
        "control_rms_e_n_u_m": "RMS distance of the block to control points, E, N, U, m",
        "check_rms_e_n_u_m": "RMS distance of the block to check points, E, N, U, m",
        "focal_px": "focal length, px",
        "n_points": "sparse points",
        "n_dense": "dense points",
        "seconds": "seconds of structure from motion",
    },
)
