"""``reconstruct``: drone photos to georeferenced cameras, sparse points and a dense prior of the stem band."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import param, to_json
from ..core.workspace import DENSE, GEOTAGS, SFM, KeptWorkspace, Workspace, workspace_option
from ..reconstruction.options import calibration_option, gcp_option, geotags_crs_option, project_crs_option


@dataclass(frozen=True, kw_only=True)
class ReconstructSettings(KeptWorkspace):
    """Parameters of ``reconstruct``."""

    photos: Path = param(kind="folder", help="Folder with the original drone photos (searched with its subfolders).")
    geotags: Path | None = param(
        None,
        kind="files",
        help="Folder or file with MRK and RTKLIB .pos (PPK), or a CSV with name, lat, lon, h; "
        "without it EXIF/XMP positions are used.",
    )
    geotags_crs: str | None = geotags_crs_option()
    gcp: Path | None = gcp_option()
    calibration: Path | None = calibration_option()
    crs: str | None = project_crs_option()
    dtm: Path | None = param(
        None,
        kind="file",
        help="Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is taken from the photos.",
        suffixes=(".tif", ".tiff"),
    )
    plots: Path | None = param(
        None,
        kind="file",
        help="CSV of plots (plot_id, easting, northing, radius_m or lon, lat): where the stem band is "
        "made dense; without it no dense points are made.",
        suffixes=(".csv",),
    )
    dense: bool = param(True, kind="flag", help="Make dense points of the stem band where plots are given.")
    workspace: Path = workspace_option()


def run(settings: ReconstructSettings, reporter: Reporter) -> dict[str, Any]:
    """Geotag, reconstruct, densify; finished parts of the same inputs are kept."""
    reporter.info(f"Workspace: {settings.workspace}")
    with Workspace.held(settings.workspace) as workspace:
        return _run(settings, workspace, reporter)


def _run(settings: ReconstructSettings, workspace: Workspace, reporter: Reporter) -> dict[str, Any]:
    from ..core.files import fingerprint
    from ..core.plots import read_plots
    from ..geotags import read_stations, write_stations
    from ..geotags.control import read_control
    from ..reconstruction.model import FRAME, MODEL_FILES, REPORT
    from ..reconstruction.options import ReconstructOptions
    from ..reconstruction.pipeline import reconstruct_photos

    sfm = workspace.path(SFM)
    with reporter.stage("geotags", 0.0, 0.05):
        stations = read_stations(
            settings.photos, settings.geotags, settings.crs, frame=settings.geotags_crs, reporter=reporter
        )
        plots = read_plots(settings.plots, stations.crs) if settings.plots else []
        dtm = _read_dtm(settings, stations.crs, plots)
        control = read_control(settings.gcp, stations, reporter) if settings.gcp else None
        write_stations(workspace.path(GEOTAGS), stations)
    workspace.record["crs"] = stations.crs.to_string()
    options = ReconstructOptions()
    key = f"{fingerprint(stations.paths)}:{stations.digest()}:{to_json(options)}"
    if control:
        key += f":{control.digest()}"
    if settings.calibration:
        key += f":{fingerprint([settings.calibration])}"
    with reporter.stage("reconstruct", 0.05, 0.75):
        outputs = [sfm / name for name in (*MODEL_FILES, FRAME, REPORT)]
        damage = workspace.damage("reconstruct", outputs) if workspace.ran("reconstruct", key) else ""
        if workspace.is_done("reconstruct", key, outputs):
            reporter.info("reconstruct: unchanged since the last run, kept")
            report = workspace.result("reconstruct")
        else:
            if damage:
                reporter.warn(f"{damage}; the stage reconstruct is done again.")
            with workspace.running("reconstruct", key, to_json(settings), outputs) as report:
                report.update(reconstruct_photos(stations, options, sfm, reporter, control, settings.calibration))
    result = {
        "workspace": str(settings.workspace),
        "sfm": str(sfm),
        "n_photos": report["photos"],
        "n_registered": report["registered"],
        "reprojection_px": report["reprojection_rms_px"],
        "geotag_rms_e_n_u_m": report["geotag_rms_e_n_u_m"],
        "focal_px": report["focal_px"],
        "n_points": report["points"],
        "seconds": report["seconds"],
    }
    if plots and settings.dense:
        with reporter.stage("dense", 0.75, 1.0):
            result |= _densify(settings, workspace, plots, dtm, reporter)
    return result


def _read_dtm(settings: ReconstructSettings, crs: Any, plots: list) -> Any:
    if settings.dtm is None:
        return None
    import numpy as np

    from ..terrain.dtm import read_dtm, require_coverage

    dtm = read_dtm(settings.dtm, crs)
    if plots:
        require_coverage(dtm, np.array([[plot.x, plot.y] for plot in plots]), str(settings.dtm))
    return dtm


def _densify(
    settings: ReconstructSettings, workspace: Workspace, plots: list, dtm: Any, reporter: Reporter
) -> dict[str, Any]:
    """Dense points of each plot's stem band -> ``dense.laz``."""
    import numpy as np

    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.files import write_cloud
    from ..reconstruction.dense import DenseOptions, densify_band
    from ..reconstruction.model import load_points, load_views
    from ..terrain.sparse_ground import dtm_from_sparse

    frame, views = load_views(workspace.path(SFM), settings.photos)
    if dtm is None:
        dtm = dtm_from_sparse(frame.to_project(load_points(workspace.path(SFM)).xyz), crs=frame.crs)
    ground = dtm.local(frame).height
    parts = []
    for number, plot in enumerate(plots):
        centre = frame.to_local(np.array([[plot.x, plot.y, 0.0]]))[0, :2]
        with reporter.stage(f"dense {plot.plot_id}", number / len(plots), (number + 1) / len(plots)):
            parts.append(densify_band(views, ground, centre, plot.radius_m + 1.0, DenseOptions(), reporter))
    xyz, rgb, votes = (np.concatenate([part[i] for part in parts]) for i in range(3))
    if not len(xyz):
        reporter.warn(
            "No dense point was found in the stem band: no two photos look at it from a small angle and from the side."
        )
        return {"dense": None, "n_dense": 0}
    cloud = PointCloud(
        frame.to_project(xyz),
        frame.crs,
        {
            "red": rgb[:, 0].astype(np.uint16) * 257,
            "green": rgb[:, 1].astype(np.uint16) * 257,
            "blue": rgb[:, 2].astype(np.uint16) * 257,
            "n_views": votes.astype(np.uint8),
        },
    )
    write_cloud(workspace.path(DENSE), cloud)
    reporter.info(f"Stem band: {len(xyz)} dense points seen by {votes.mean():.1f} reference photos on average.")
    return {"dense": str(workspace.path(DENSE)), "n_dense": len(xyz)}


COMMAND = Command(
    name="reconstruct",
    qgis_id="reconstruct",
    title="Reconstruct cameras from photos",
    group="5 Steps and research",
    summary="Georeferenced structure from motion: camera poses, sparse points, dense points of the stem band.",
    help=(
        "Inputs: overlapping drone photos (80 % overlap, most of them oblique) and their PPK, RTK or EXIF "
        "positions. All flights end in one "
        "frame, adjusted with the geotags as priors. Output in the workspace: geotags.gpkg, sfm/ (COLMAP model in a "
        "local frame, frame.json with "
        "the CRS and origin, report.json) and dense.laz (stem band of the plots, project CRS). A block that "
        "contradicts its geotags, "
        "the lens calibration in the metadata, or the flying height is refused."
    ),
    settings=ReconstructSettings,
    run=run,
    main=("photos", "geotags", "crs", "dtm", "plots", "workspace"),
    example=(
        "treedgs reconstruct --photos flight/images --geotags flight --crs EPSG:6344 --plots plots.csv --workspace work"
    ),
    outputs={
        "workspace": "folder of the results",
        "sfm": "COLMAP model (folder)",
        "dense": "dense points of the stem band (file)",
        "n_photos": "photos",
        "n_registered": "photos registered",
        "reprojection_px": "RMS reprojection error, px",
        "geotag_rms_e_n_u_m": "RMS distance of cameras to their geotags, E, N, U, m",
        "focal_px": "focal length, px",
        "n_points": "sparse points",
        "n_dense": "dense points",
        "seconds": "seconds of structure from motion",
    },
)
