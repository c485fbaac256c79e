"""The dry run: what a job would meet, reported before it starts. Reads inputs, writes nothing.

Time, memory and disk are estimates from recorded runs (``docs/technician/qgis.md``): good for "minutes or hours", not
for seconds.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, TreeDGSError
from ..core.machine import cores
from ..core.progress import Reporter
from ..core.shown import count_of
from ..core.workspace import in_use, read_record
from .dry_run_report import Findings, Needs, check_target

if TYPE_CHECKING:
    from ..geotags.stations import Stations
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.survey import Survey
    from ..reconstruction.cameras import View
    from .dry_run_ground import LowPoints
    from .search_forecast import PlannedSearch
    from .settings import PhotosToDbhSettings, PointcloudToDbhSettings

#: Core-seconds on the machines of docs/results: per megapixel of features, per matched pair, per photo of mapping and
#: adjustment; of the search, see :mod:`.search_forecast`.
GUIDED_S_MP, GUIDED_S_PAIR, GUIDED_S_PHOTO = 0.18, 0.02, 0.17
#: The same where every feature is matched with every other, 8000 of a photo.
FULL_S_MP, FULL_S_PAIR, FULL_S_PHOTO = 0.34, 0.10, 0.4
#: Core-seconds per million cloud points: reading, ground, stems.
CLOUD_S_MILLION = 9.0
#: A stem needs about this many photos of its breast height; below this overlap photos may not join.
FEW_VIEWS, LOW_OVERLAP_PCT = 5, 70.0


def check_photos(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The dry run of ``photos-to-dbh``.

    Raises:
        TreeDGSError: what would end the job: an input that cannot be used, an output that cannot be written, no disk.
    """
    from ..core.errors import ReconstructionError
    from ..core.plots import read_plots
    from ..geotags.control import read_control
    from ..geotags.photos import list_photos, read_photo
    from ..geotags.reading import read_stations
    from ..reconstruction.calibration import calibration_of
    from ..terrain.dtm import read_dtm
    from .context import Flight
    from .published_plot import check_published
    from .routes import CHAIN_PRESETS
    from .search_forecast import only_nadir, planned_ground, planned_views, search_ahead
    from .stages import Collector
    from .stages_before_stems import check_cover

    findings = Findings(reporter)
    for target in (settings.output, settings.workspace / "run.json"):
        check_target(target, findings)
    if used := in_use(settings.workspace):
        findings.problem(used)
    try:
        check_published(settings)
    except TreeDGSError as problem:
        findings.problem(str(problem))
    list_photos(settings.photos)
    reporter.info(f"Workspace: {settings.workspace}")
    with reporter.stage("photos and geotags", 0.0, 0.7):
        heard = Collector(reporter)
        stations = read_stations(
            settings.photos, settings.geotags, settings.crs, frame=settings.geotags_crs, reporter=heard
        )
        findings.warnings += len(heard.warnings)
    fix_pct = _report_positions(stations, settings, findings)
    with reporter.stage("plots and terrain", 0.7, 0.85):
        plots = read_plots(settings.plots, stations.crs) if settings.plots else []
        dtm = read_dtm(settings.dtm, stations.crs, reporter) if settings.dtm else None
        try:
            check_cover(settings, Flight(stations, plots), dtm)
        except TreeDGSError as problem:
            findings.problem(str(problem))
        try:
            if settings.gcp:
                read_control(settings.gcp, stations, reporter)
        except TreeDGSError as problem:
            findings.problem(str(problem))
    ground = planned_ground(stations, plots, dtm)
    options = CHAIN_PRESETS[settings.preset]
    nothing = only_nadir(stations)
    try:
        calibration_of([read_photo(stations.paths[0])], settings.calibration)
    except (ReconstructionError, InputError) as problem:
        findings.problem(str(problem))
    if nothing:
        findings.problem(f"{settings.photos}: no DBH can be measured: {nothing}.")
    with reporter.stage("overlap", 0.85, 0.98):
        views = planned_views(stations, ground)
        overlap = _overlap(views, stations, plots, findings, bool(nothing))
        search = search_ahead(stations, plots, ground, options.stems, views)
    _report_search(search, plots, findings)
    needs = _photo_needs(settings, stations, ground, plots, options.reconstruct, search)
    report_kept(settings.workspace, reporter)
    facts = {
        "n_photos": len(stations),
        "fix_pct": round(fix_pct, 1),
        **overlap,
        "n_tiles": search.tiles if search else None,
    }
    return findings.conclude(facts, needs)


def _report_positions(stations: Stations, settings: PhotosToDbhSettings, findings: Findings) -> float:
    """How the photos are placed; returns the share with a fixed position, per cent."""
    from ..geotags.sources import find_geotags

    counts = stations.counts()
    fix_pct = 100 * counts.get("fix", 0) / len(stations)
    findings.reporter.info(
        f"{len(stations)} photos; positions: "
        + ", ".join(f"{number} {quality}" for quality, number in counts.items())
        + f" ({fix_pct:.0f} % fixed)."
    )
    if fix_pct < 90:
        share = f"Only {fix_pct:.0f} %" if fix_pct >= 0.5 else "None"
        given = find_geotags(settings.geotags, settings.photos) if settings.geotags else None
        advice = (
            f"give their accuracies in {given.tables[0].name} (sd_e, sd_n, sd_u, metres) if they are better"
            if given and given.tables
            else "process the PPK again with a nearer base station"
            if given
            else "give PPK files (--geotags), or positions by photo name with their accuracies (CSV)"
        )
        findings.warning(
            f"{share} of the photos have a fixed (centimetre) position: the trees' places and the scale rest on them; "
            f"{advice}."
        )
    return fix_pct


def _report_search(search: PlannedSearch | None, plots: list, findings: Findings) -> None:
    """How large the search is; without plots it may be a hundred times what was meant."""
    from .search_forecast import MANY_TILES

    if search is None:
        return
    if plots:
        findings.reporter.info(f"The plots are searched in {count_of(search.tiles, 'tile')}.")
    elif search.tiles > MANY_TILES:
        findings.warning(f"{search.sentence()}: give plots (--plots) to measure only those.")
    else:
        findings.reporter.info(f"{search.sentence()}.")


def _overlap(views: list[View], stations: Stations, plots: list, findings: Findings, is_nadir: bool) -> dict[str, Any]:
    """How often each place of the plots is seen from the side, and how much neighbouring photos share."""
    from ..reconstruction.cameras import OBLIQUE_DEG
    from .search_forecast import MIN_OBLIQUE

    if not views:
        findings.warning(
            "The overlap cannot be estimated: the photos do not say where the camera looked or how high it flew."
        )
        return {"overlap_pct": None, "median_views": None}
    frame_origin = np.array([*np.median(stations.xyz[stations.is_placed][:, :2], axis=0), 0.0])
    aims = np.array([view.centre[:2] - view.rotation[2, :2] / view.rotation[2, 2] * view.centre[2] for view in views])
    low, high = aims.min(axis=0) - 10, aims.max(axis=0) + 10
    step = max(float(np.max(high - low)) / 60, 1.0)
    x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step))
    grid = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    sees = np.array([view.contains(view.project(grid)[0]) for view in views])
    filled = sees.sum(axis=1) > 0
    shared = (sees.astype(np.int32) @ sees.T.astype(np.int32)).astype(float)
    size = np.diag(shared).copy()
    np.fill_diagonal(shared, 0.0)
    overlap_pct = float(np.median(100 * shared[filled].max(axis=1) / size[filled])) if filled.any() else 0.0
    oblique = [view for view in views if view.nadir_angle_deg > OBLIQUE_DEG]
    if plots:
        places = np.array([[p.x, p.y, 0.0] for p in plots]) - frame_origin
        angle, ring = np.linspace(0, 2 * np.pi, 12, endpoint=False), np.array([0.0, 0.5, 1.0])
        offsets = np.array([[r * np.cos(a), r * np.sin(a), 0.0] for r in ring for a in angle])
        places = np.concatenate([place + offsets * p.radius_m for place, p in zip(places, plots, strict=True)])
    else:
        places = grid[sees.any(axis=0)]
    breast = places + [0.0, 0.0, 1.3]
    seen = sum((view.contains(view.project(breast)[0]).astype(int) for view in oblique), np.zeros(len(breast), int))
    median = float(np.median(seen)) if len(seen) else 0.0
    findings.reporter.info(
        f"{len(oblique)} of {len(views)} photos look from the side (more than {OBLIQUE_DEG:.0f} degrees from straight "
        f"down). Neighbouring photos share {overlap_pct:.0f} % of their ground. The middle place of the "
        f"{'plots' if plots else 'flight'} lies in {median:.0f} of them, before trees hide it."
    )
    if overlap_pct < LOW_OVERLAP_PCT:
        findings.warning(
            f"Neighbouring photos share only {overlap_pct:.0f} % of their ground, 80 % is asked for: photos may not "
            "join, and then their trees are lost; fly with more overlap."
        )
    if len(oblique) < MIN_OBLIQUE and not is_nadir:
        findings.warning(
            "Almost all photos look straight down, which shows crowns but no trunk from the side: expect no DBH; fly "
            "oblique photos (30 to 50 degrees) from all sides."
        )
    elif plots and not is_nadir and (share := float(np.mean(seen < 3 * FEW_VIEWS))) > 0.1:
        findings.warning(
            f"{100 * share:.0f} % of the plots' ground lies in fewer than {3 * FEW_VIEWS} oblique photos; a stem needs "
            f"about {FEW_VIEWS} that really see it, and crowns hide most: expect refused stems there."
        )
    return {"overlap_pct": round(overlap_pct, 1), "median_views": median}


def _photo_needs(
    settings: PhotosToDbhSettings,
    stations: Stations,
    ground: float,
    plots: list,
    options: Any,
    ahead: PlannedSearch | None,
) -> Needs:
    from ..core.errors import ReconstructionError
    from ..geotags.photos import read_photo
    from ..reconstruction.calibration import calibration_of
    from ..reconstruction.matching_levels import GUIDED_NEIGHBOURS, can_guide
    from ..reconstruction.pairs import select_pairs
    from ..reconstruction.prior_knowledge import gimbal_rotations
    from .published_plot import is_published
    from .search_forecast import SEARCH_S

    photo = read_photo(stations.paths[0])
    longer = max(photo.width, photo.height)
    used_mp = photo.width * photo.height / 1e6 * min(1.0, options.max_image_size / longer) ** 2
    number = len(stations)
    try:
        camera = calibration_of([photo]).camera
        half_field = 0.5 * longer / camera.fx
    except ReconstructionError:
        half_field = 0.6
    rotations = gimbal_rotations(stations)
    full_s, guided_s = (
        each_mp * used_mp * number
        + each_pair * len(select_pairs(stations.xyz, rotations, ground, half_field, neighbours))
        + each_photo * number
        for each_mp, each_pair, each_photo, neighbours in (
            (FULL_S_MP, FULL_S_PAIR * (options.max_features / 8000) ** 1.5, FULL_S_PHOTO, options.neighbours),
            (GUIDED_S_MP, GUIDED_S_PAIR, GUIDED_S_PHOTO, GUIDED_NEIGHBOURS),
        )
    )
    guided = can_guide(stations.xyz, stations.sd, rotations, ground)
    hectare_part = sum(np.pi * p.radius_m**2 for p in plots) / 100 if plots else 20.0
    search = SEARCH_S * min(number, {"fast": 48, "best": 200}.get(settings.preset, 100)) * hectare_part
    if ahead is not None and not plots:
        search = ahead.core_seconds
    if settings.fit == "gaussians":
        search *= 6
    if is_published(settings):
        # Stereo, sampling and segmentation beside the fit.
        search = 60 * settings.time_limit * 1.3 + 120
    at_once = max(min(cores(), 16) ** 0.9, 1)
    full_mp = photo.width * photo.height / 1e6
    return Needs(
        seconds=((guided_s if guided else full_s) + search) / at_once * 1.1 + 5,
        more_s=full_s / at_once if guided else 0.0,
        # A photo's features need about 0.1 GB a megapixel in each thread; the search keeps its photos open.
        memory_gb=0.8 + 0.08 * used_mp * min(cores(), 16) + 0.004 * full_mp * min(number, 100),
        disk_gb=0.2 + number * (0.004 + 0.001 * full_mp),
        folder=settings.workspace,
    )


def _read_through(settings: PointcloudToDbhSettings, reporter: Reporter) -> tuple[PointCloud, Survey, LowPoints]:
    """The first piece of the cloud, where its points are and how many, and the lowest of them."""
    from ..pointcloud.cloud import usable
    from ..pointcloud.file_crs import placed
    from ..pointcloud.files import iter_cloud
    from ..pointcloud.survey import Survey
    from .dry_run_ground import LowPoints

    survey, lowest = Survey(), LowPoints()
    first = None
    for piece in iter_cloud(settings.input, crs=settings.crs, need_crs=False):
        if not len(piece):
            continue
        if first is None:
            place = placed(piece.crs, piece.xyz, settings.input, reporter, settings.crs, settings.dtm)
            first = replace(piece, crs=place)
        xyz = piece.xyz[usable(piece)]
        survey.add(xyz)
        lowest.add(xyz)
    if first is None or not survey.n_points:
        raise InputError(f"{settings.input}: holds no usable point, expected a point cloud; check the file.")
    return first, survey, lowest


def check_cloud(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The dry run of ``pointcloud-to-dbh``: header, CRS, density, DTM; a sample of the points.

    Raises:
        TreeDGSError: what would end the job.
    """
    from ..pointcloud.files import describe_cloud
    from ..pointcloud.sanity import examine
    from ..stems.cloud.estimate.cloud import point_weights
    from ..terrain.dtm import read_dtm, require_coverage
    from .cloud_plots import plots_under
    from .dry_run_ground import check_ground

    findings = Findings(reporter)
    for target in filter(None, (settings.output, settings.stems_output, settings.report)):
        check_target(target, findings)
    with reporter.stage("read cloud", 0.0, 0.8):
        first, survey, lowest = _read_through(settings, reporter)
    point_weights(first, settings.weights)
    extent, odd = examine(survey, settings.input, True, describe_cloud(settings.input).scale, settings.dtm is not None)
    for finding in odd:
        (findings.problem if finding.refuse else findings.warning)(finding.sentence)
    if findings.problems:
        raise InputError(findings.problems[0])
    low, high, count = extent.low, extent.high, extent.n_points - extent.n_strays
    plots_under(settings, first.horizontal_crs, low, high, reporter)
    span = high - low
    density = count / max(float(span[0] * span[1]), 1.0)
    where = first.horizontal_crs.name if first.horizontal_crs is not None else "local metres, no CRS"
    reporter.info(
        f"{count:,} points, {span[0]:.0f} x {span[1]:.0f} m, {density:,.0f} points a square metre, heights "
        f"{low[2]:.1f} to {high[2]:.1f} m, {where}."
    )
    if density < 300:
        findings.warning(
            f"{density:.0f} points a square metre are few: a stem needs about 100 points on its lower 3 m (drone LiDAR "
            "above 1,000 points a square metre); expect most stems to be missed or refused."
        )
    dtm = None
    if settings.dtm is not None:
        dtm = read_dtm(settings.dtm, first.crs, reporter)
        x, y = np.meshgrid(np.linspace(low[0], high[0], 12), np.linspace(low[1], high[1], 12))
        require_coverage(dtm, np.column_stack([x.ravel(), y.ravel()]), str(settings.dtm))
    with reporter.stage("ground", 0.8, 0.98):
        xyz = lowest.points()
        check_ground(
            xyz[extent.holds(xyz)],
            settings.input,
            first.horizontal_crs,
            dtm,
            settings.dtm,
            findings.warning,
            findings.problem,
            settings.z_is,
        )
    needs = Needs(
        seconds=3 + CLOUD_S_MILLION * count / 1e6 / max(min(cores(), 4) ** 0.5, 1),
        memory_gb=0.5 + 0.35 * count / 1e6,
        disk_gb=0.05 + (0.00003 * count / 1e3 if settings.stems_output else 0.0),
        folder=settings.output.parent,
    )
    return findings.conclude({"n_points": count, "density_pts_m2": round(density, 1)}, needs)


def report_kept(workspace: Path, reporter: Reporter) -> None:
    """What an earlier run left in the workspace."""
    record = read_record(workspace)
    if record is None:
        return
    stages = record["stages"]
    done = [name for name, entry in stages.items() if entry.get("status") == "done" and name != "write"]
    broken = [f"{name} ({entry.get('status')})" for name, entry in stages.items() if entry.get("status") != "done"]
    if done:
        reporter.info(f"Kept from an earlier run, if inputs and settings are the same: {', '.join(done)}.")
    if broken:
        reporter.info(f"Ended early in the earlier run and done again: {', '.join(broken)}.")
