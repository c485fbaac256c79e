"""From photos to the tree layer: the stages, in their order."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError, OutputError, ReconstructionError
from ..core.files import content_hashes, read_json, write_json
from ..core.map_scale import zone_that_fits
from ..core.plots import read_plots
from ..core.progress import Reporter
from ..core.settings import to_json
from ..core.shown import count_of
from ..core.steps import Collector, Steps
from ..core.workspace import Workspace, in_use, peak_memory_mb, read_record
from ..geotags.control import read_control
from ..geotags.photos import list_photos, read_photo
from ..geotags.reading import read_stations
from ..geotags.sources import find_geotags
from ..geotags.stations import read_stations_layer, write_stations
from ..inventory.evidence.files import sheet_file, sheets_folder
from ..inventory.tree_layer import check_output, style_raster
from ..planning.flown import read_expected
from ..pointcloud.cloud import PointCloud
from ..pointcloud.files import write_cloud
from ..reconstruction.area import Area
from ..reconstruction.calibration import calibration_of
from ..reconstruction.cameras import OBLIQUE_DEG
from ..reconstruction.dense import DenseOptions, densify_band
from ..reconstruction.model import FRAME, MODEL_FILES, load_points, load_views
from ..reconstruction.model import REPORT as SFM_REPORT
from ..reconstruction.pipeline import reconstruct_photos
from ..stems.photos.fit_records import write_fits
from ..stems.quality.ground import with_ground_error
from ..stems.quality.tops import heights_sentence
from ..stems.quality.tree import Tree, with_block_errors
from ..terrain.dtm import GROUND_WARN_M, height_above, read_dtm, require_coverage, require_same_heights, write_dtm
from ..terrain.sparse_ground import dtm_from_sparse, sparse_ground_se, with_gaps_filled
from .context import Aligned, PhotoJob, Site, area_of
from .field_stems import answers_of, places_of, read_places, write_answers
from .forecast import (
    MANY_TILES,
    MIN_OBLIQUE,
    SEARCH_S,
    matching_cost,
    measure_weight,
    nadir_reason,
    only_nadir,
    planned_ground,
    planned_views,
    report_overlap,
    report_positions,
    search_ahead,
    search_cost,
)
from .given_store import read_given, with_given
from .heights import find_heights
from .outputs import write_outputs
from .photo_files import photo_files
from .published_plot import Published, check_published, is_published, published_route
from .routes import CHAIN_PRESETS, photo_route
from .settings import PhotosToDbhSettings
from .sheets import chosen_trees, draw_sheets
from .stage import Cost, Findings, Key, Stage, check, check_target, dry_run, run_stages

#: A plot this far from the nearest photo lies elsewhere.
MAX_AWAY_M = 500.0
#: The ground is modelled this far beside the area in which stems are looked for, metres.
BESIDE_M = 8.0
#: The trees of a run as it measured them, and their heights, in its workspace.
KEPT_TREES, KEPT_HEIGHTS = "trees.json", "heights.json"


# --- geotag: where each photo was taken -------------------------------------------------------------------------------


def _check_outputs(job: PhotoJob) -> None:
    for target in (job.settings.output, job.path("run.json")):
        check_target(target)


def _check_workspace(job: PhotoJob) -> None:
    """Nobody works there; what an earlier run left in it."""
    if used := in_use(job.settings.workspace):
        raise InputError(used)
    stages = (read_record(job.settings.workspace) or {"stages": {}})["stages"]
    done = [name for name, entry in stages.items() if entry.get("status") == "done" and name != "write"]
    broken = [f"{name} ({entry.get('status')})" for name, entry in stages.items() if entry.get("status") != "done"]
    if done:
        job.reporter.info(f"Kept from an earlier run, if inputs and settings are the same: {', '.join(done)}.")
    if broken:
        job.reporter.info(f"Ended early in the earlier run and done again: {', '.join(broken)}.")


def _check_plan(job: PhotoJob) -> None:
    if job.settings.flight_plan:
        read_expected(job.settings.flight_plan)


def _find_photos(job: PhotoJob) -> None:
    job.photos = list_photos(job.settings.photos)
    job.reporter.info(f"Workspace: {job.settings.workspace}")


def _geotag_cost(job: PhotoJob, findings: Findings) -> Cost:
    asked = job.settings
    job.stations = read_stations(asked.photos, asked.geotags, asked.crs, frame=asked.geotags_crs, reporter=findings)
    report_positions(job.stations, asked.photos, asked.geotags, findings)
    return Cost(seconds=5.0, memory_gb=0.8, disk_gb=0.2)


def _geotag_key(job: PhotoJob) -> Key:
    # By what the files are, not by where: photos that were moved or renamed are the same photos.
    asked = job.settings
    job.files = photo_files(job.space, asked.photos, job.photos, job.reporter)
    contents = dict(zip(job.files, content_hashes(job.files.values()), strict=True))
    used = {"photos": contents, "geotags": asked.geotags is not None, "crs": asked.crs, "frame": asked.geotags_crs}
    return Key(used, find_geotags(asked.geotags, asked.photos).all() if asked.geotags else [])


def _geotag(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    asked = job.settings
    stations = read_stations(asked.photos, asked.geotags, asked.crs, frame=asked.geotags_crs, reporter=reporter)
    write_stations(job.path(names.GEOTAGS), stations)
    return {"photos": len(stations), "positions": stations.counts()}


def _load_stations(job: PhotoJob, _: object) -> None:
    # People may move a camera by hand: the layer is taken as it is.
    stations = read_stations_layer(job.path(names.GEOTAGS))
    paths = [job.files.get(name, job.settings.photos / name) for name in stations.names]
    job.stations = replace(stations, paths=paths)
    job.space.record["crs"] = stations.crs.to_string()


GEOTAG = Stage(
    "geotag",
    0.02,
    _geotag,
    checks=(
        _check_outputs,
        _check_workspace,
        lambda job: check_published(job.settings),
        _check_plan,
        _find_photos,
    ),
    cost=_geotag_cost,
    key=_geotag_key,
    outputs=lambda job: [job.path(names.GEOTAGS)],
    load=_load_stations,
    readable=lambda job: read_stations_layer(job.path(names.GEOTAGS)),
)


# --- reconstruct: cameras ---------------------------------------------------------------------------------------------


def _read_control(job: PhotoJob) -> None:
    """Ground control; its warnings are the run's."""
    if job.settings.gcp is not None:
        heard = Collector(job.reporter)
        job.control = read_control(job.settings.gcp, job.stations, heard)
        job.steps.warnings += heard.warnings


def _reconstruct_cost(job: PhotoJob, findings: Findings) -> Cost:
    try:
        calibration_of([read_photo(job.stations.paths[0])], job.settings.calibration)
    except (ReconstructionError, InputError) as problem:
        findings.problem(str(problem))
    return matching_cost(job.stations, planned_ground(job.stations, job.plots, job.given), job.preset.reconstruct)


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
    outputs=lambda job: [job.path(names.SFM) / name for name in (*MODEL_FILES, FRAME, SFM_REPORT)],
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


# --- ground -----------------------------------------------------------------------------------------------------------


def _read_plots(job: PhotoJob) -> None:
    if job.settings.plots:
        job.plots = read_plots(job.settings.plots, job.stations.crs)


def _read_ground(job: PhotoJob) -> None:
    if job.settings.dtm:
        job.given = read_dtm(job.settings.dtm, job.stations.crs, job.reporter)


def _check_cover(job: PhotoJob) -> None:
    """Plots under the flight, and a terrain model under the plots."""
    stations, plots = job.stations, job.plots
    placed = stations.xyz[stations.is_placed][:, :2]
    for plot in plots:
        away = float(np.linalg.norm(placed - [plot.x, plot.y], axis=1).min())
        if away > MAX_AWAY_M:
            zone = zone_that_fits(
                stations.crs,
                np.array([[plot.x, plot.y]]),
                lambda xy: bool(np.linalg.norm(placed - xy, axis=1).min() <= MAX_AWAY_M),
            )
            hint = f" (in EPSG:{zone.to_epsg()}, {zone.name}, it would lie there)" if zone is not None else ""
            raise InputError(
                f"{job.settings.plots}: plot {plot.plot_id!r} lies {away:.0f} m from the nearest photo, expected it "
                f"under the flight{hint}; check the coordinates and their CRS (column epsg)."
            )
    if job.given is not None:
        where = np.array([[p.x, p.y] for p in plots]) if plots else np.nanmedian(placed, axis=0)[None]
        require_coverage(job.given, where, str(job.settings.dtm))


def _area(job: PhotoJob) -> Area:
    """Where to look for stems, local; ``job.nothing``: why nowhere, if so."""
    views = job.block.views
    area = area_of(job.block.frame, views, job.block.points, job.plots)
    oblique = [view for view in views if view.nadir_angle_deg > OBLIQUE_DEG]
    if len(oblique) < MIN_OBLIQUE:
        job.nothing = nadir_reason(np.array([view.nadir_angle_deg for view in views]))
    elif not len(area.radii_m):
        job.nothing = "no place is seen by six or more oblique photos; fly more of them, from all sides"
    return area


def _ground_key(job: PhotoJob) -> Key:
    job.area = _area(job)
    dtm, given = job.settings.dtm, job.given
    used: dict[str, Any] = {"dtm": dtm is not None, "plots": circles(job.area)}
    if given is not None:
        # A world file beside the raster places it as well.
        used["grid"] = [list(given.transform), given.crs.to_wkt() if given.crs is not None else None]
    return Key(used, [dtm] if dtm else [])


def _ground(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    """The terrain model of the run, project coordinates: the user's, its gaps filled, or what the photos see."""
    path, given, area, frame, bounds = job.path(names.DTM), job.given, job.area, job.block.frame, None
    if area is not None and len(area.radii_m):
        low_x, low_y, high_x, high_y = area.bounds(BESIDE_M)
        corners = frame.to_project(np.array([[low_x, low_y, 0.0], [high_x, high_y, 0.0]]))
        bounds = corners[0, :2], corners[1, :2]
    found = dtm_from_sparse(frame.to_project(job.block.points), crs=frame.crs, bounds=bounds)
    style_raster(path)
    if given is None:
        write_dtm(path, found)
        return {"ground": "from the photos"}
    name, x, y = str(job.settings.dtm), *found.centres()
    x, y = (np.broadcast_to(a, found.heights.shape).ravel() for a in (x, y))
    seen = np.column_stack([x, y, found.heights.ravel()])
    require_same_heights(given, seen[np.isfinite(seen).all(axis=1)], name)
    above = height_above(given, found)
    filled, gaps_m2 = with_gaps_filled(given, found, above)
    if abs(above) > GROUND_WARN_M:
        reporter.warn(
            f"{name}: lies {above:+.2f} m from the ground that the photos see (median), expected within "
            f"{GROUND_WARN_M:g} m; breast height may be off by as much and the trees' intervals are widened by it: "
            "check its datum (where shrubs cover the ground, the photos see the shrubs)."
        )
    if gaps_m2:
        reporter.warn(
            f"{name}: has no height in {gaps_m2:.0f} m2 round the plots; the ground that the photos see stands in "
            "there."
        )
    write_dtm(path, filled)
    return {"ground": name, "above_photos_m": round(above, 3)}


def _load_site(job: PhotoJob, _: object) -> None:
    block = job.block
    assert job.area is not None
    job.site = Site(block.frame, block.views, read_dtm(job.path(names.DTM), block.frame.crs), job.area)


def circles(area: Area) -> list:
    """(K, 3) centre and radius of an area, to the millimetre, for the keys of stages."""
    return np.round(np.column_stack([area.centres, area.radii_m]), 3).tolist()


#: Of ``reconstruct`` only.
DENSE = Stage("dense", 0.3, _densify, checks=(_read_plots, _read_ground, _check_cover), always=True)

GROUND = Stage(
    "ground",
    0.01,
    _ground,
    checks=(_read_plots, _read_ground, _check_cover),
    key=_ground_key,
    outputs=lambda job: [job.path(names.DTM)],
    load=_load_site,
    wanted=lambda job: job.aligned is not None,
)


# --- measure: stems and diameters -------------------------------------------------------------------------------------


def _announce_search(job: PhotoJob) -> None:
    """Before hours of work: why no stem can be seen, or how large the search will be."""
    asked, stations, plots = job.settings, job.stations, job.plots
    job.nothing = only_nadir(stations)
    if job.nothing or job.steps.space is None:  # a dry run says more than this
        return
    if is_published(asked):
        job.steps.weigh("measure", max(asked.time_limit, 1.0))  # of a minute's search
        return
    search = search_ahead(stations, plots, planned_ground(stations, plots, job.given), job.preset.stems)
    if search is not None and not plots and search.tiles > MANY_TILES:
        job.reporter.warn(f"{search.sentence()}: give plots (--plots) to measure only those.")
    job.steps.weigh("measure", measure_weight(search, len(stations)))


def _measure_cost(job: PhotoJob, findings: Findings) -> Cost:
    stations, plots = job.stations, job.plots
    if job.nothing:
        findings.problem(f"{job.settings.photos}: no DBH can be measured: {job.nothing}.")
    ground = planned_ground(stations, plots, job.given)
    views = planned_views(stations, ground)
    report_overlap(views, stations, plots, findings, bool(job.nothing))
    search = search_ahead(stations, plots, ground, job.preset.stems, views)
    findings.facts["n_tiles"] = search.tiles if search else None
    if search is not None and plots:
        findings.info(f"The plots are searched in {count_of(search.tiles, 'tile')}.")
    elif search is not None and search.tiles > MANY_TILES:
        findings.warn(f"{search.sentence()}: give plots (--plots) to measure only those.")
    elif search is not None:
        findings.info(f"{search.sentence()}.")
    if is_published(job.settings):
        return search_cost(stations, 60 * job.settings.time_limit * 1.3 + 120)
    hectare_part = sum(np.pi * p.radius_m**2 for p in plots) / 100 if plots else 20.0
    core_s = SEARCH_S * min(len(stations), job.preset.stems.max_views) * hectare_part
    if search is not None and not plots:
        core_s = search.core_seconds
    return search_cost(stations, core_s)


def _measure_key(job: PhotoJob) -> Key:
    asked, field = job.settings, read_places(job.settings.field_stems, job.place)
    used = {
        "fit": _route(asked),
        "preset": asked.preset,
        "stem_network": asked.stem_network,
        "bh_m": asked.bh_m,
        "seed": asked.seed,
        "plots": circles(job.place.area),
        "scale_sd": _scale_sd(job.block),
        "ground_m": _ground_m(job),
    }
    if field is not None:
        used["field_stems"] = [np.round(field.xy, 3).tolist(), list(field.names), asked.field_error_m]
    files: list[Path] = []
    if asked.device != "cpu":
        used["device"] = asked.device
    if is_published(asked):
        used |= {"time_limit": asked.time_limit, "segmenter": [asked.segmenter, asked.segmenter_command]}
        files = [path for path in (asked.dense, asked.segmenter_model) if path is not None]
    return Key(used, files)


def _measure_outputs(job: PhotoJob) -> list[Path]:
    field = [] if job.settings.field_stems is None else [job.path(names.FIELD_STEMS)]
    return [job.path(KEPT_TREES), job.path(names.FITS), *field]


def _measure(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    """Stems and diameters by the route asked for, with the errors that the whole run adds to each."""
    asked, site, preset = job.settings, job.place, job.preset
    field = read_places(asked.field_stems, site)
    given = None if field is None else places_of(field, site, asked.field_error_m)
    if is_published(asked):
        found = published_route(site, job.block.points, Published.of(asked), job.path, reporter)
    else:
        found = photo_route(site, preset, asked.bh_m, reporter, given)
    trees = with_run_errors(job, found.trees)
    write_json(job.path(KEPT_TREES), [asdict(tree) for tree in trees])
    write_fits(job.path(names.FITS), found.kept)
    facts = found.facts
    if field is not None and given is not None:
        answers = answers_of(field, given, site, found.kept.fits, trees, preset.stems.margin_m)
        write_answers(job.path(names.FIELD_STEMS), answers)
        facts = facts | answers.report(asked.field_stems, reporter)
    return {"fit": _route(asked), "stems": len(trees), **facts}


def _route(asked: PhotosToDbhSettings) -> str:
    return "gaussians" if is_published(asked) else "photos"


def with_run_errors(job: PhotoJob, trees: list[Tree]) -> list[Tree]:
    """The same with the errors of the block's scale, and of the ground's height under each tree."""
    block, site = job.block, job.place
    trees = [with_block_errors(tree, _scale_sd(block), 0.0) for tree in trees]
    places = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    # How well the sparse points show the ground under each tree counts in its error.
    ground_se = sparse_ground_se(site.frame.to_project(block.points), site.dtm, places, _ground_m(job))
    return [with_ground_error(tree, float(se), "photos") for tree, se in zip(trees, ground_se, strict=True)]


def _scale_sd(block: Aligned) -> float:
    return block.report.get("scale_sd") or 0.0


def _ground_m(job: PhotoJob) -> float | None:
    """How far a given terrain model lies above the ground that the photos see, metres."""
    return job.space.result("ground").get("above_photos_m")


def read_kept_trees(path: Path) -> list[Tree]:
    """The measured trees of an earlier run.

    Raises:
        InputError: not readable, or other records than trees.
    """
    records = read_json(path)
    try:
        return [Tree(**record) for record in records]
    except (TypeError, ValueError) as problem:
        raise InputError(
            f"{path}: holds no trees of this version ({problem}); delete it: they are then measured again."
        ) from None


def _load_trees(job: PhotoJob, _: object) -> None:
    job.trees = read_kept_trees(job.path(KEPT_TREES))


MEASURE = Stage(
    "measure",
    0.4,
    _measure,
    checks=(_announce_search,),
    cost=_measure_cost,
    key=_measure_key,
    outputs=_measure_outputs,
    load=_load_trees,
    wanted=lambda job: not job.nothing,
)


# --- heights ----------------------------------------------------------------------------------------------------------


def _wants_heights(job: PhotoJob) -> bool:
    wanted = job.settings.heights
    return bool(job.trees) and (wanted == "photos" or (wanted == "auto" and job.preset.heights))


def _heights_key(job: PhotoJob) -> Key:
    used: dict[str, Any] = {"places": [[round(tree.x, 2), round(tree.y, 2), tree.dbh_cm] for tree in job.trees]}
    return Key(used | {"plots": circles(job.place.area), "ground": job.space.output_hashes("ground")})


def _heights(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    raster = job.path(names.CHM)
    style_raster(raster, "chm")
    fits = job.path(names.FITS)
    found = find_heights(job.place, job.block.points, job.trees, fits, job.settings.bh_m, raster, reporter)
    write_json(job.path(KEPT_HEIGHTS), found)
    return {"heights": sum(entry["height_m"] is not None for entry in found.values())}


def _load_heights(job: PhotoJob, _: object) -> None:
    """The trees with ``height_m``, ``height_se_m`` and, where there is no height, ``height_why``."""
    found = read_json(job.path(KEPT_HEIGHTS))
    job.trees = [replace(tree, **found.get(str(tree.tree_id), {})) for tree in job.trees]


HEIGHTS = Stage(
    "heights",
    0.08,
    _heights,
    key=_heights_key,
    outputs=lambda job: [job.path(KEPT_HEIGHTS), job.path(names.CHM)],
    load=_load_heights,
    wanted=_wants_heights,
)


# --- sheets: one small picture a tree, and write ----------------------------------------------------------------------


def _sheets_key(job: PhotoJob) -> Key:
    text = json.dumps([asdict(tree) for tree in chosen_trees(job)], sort_keys=True)
    return Key({"sheets": job.settings.sheets, "trees": hashlib.sha256(text.encode()).hexdigest()[:16]})


def _sheets(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    with sheets_folder(job.path(names.SHEETS), job.run_id) as made:
        return {"sheets": draw_sheets(job, chosen_trees(job), made, reporter)}


SHEETS = Stage(
    "sheets",
    0.02,
    _sheets,
    key=_sheets_key,
    outputs=lambda job: [sheet_file(job.path(names.SHEETS), tree) for tree in chosen_trees(job)],
    # Stems of the published route were not looked for in the photos.
    wanted=lambda job: bool(chosen_trees(job)) and not is_published(job.settings),
)

# The outputs may be changed by the user between runs: always written anew, it costs a second.
WRITE = Stage("write", 0.01, write_outputs, key=lambda job: Key({"output": job.settings.output}), always=True)

#: From photos to trees; their sheets, layer and report.
TREES, OUTPUTS = (GEOTAG, RECONSTRUCT, GROUND, MEASURE, HEIGHTS), (SHEETS, WRITE)


def job_of(settings: PhotosToDbhSettings, reporter: Reporter) -> PhotoJob:
    """A photo run that has not begun."""
    preset = CHAIN_PRESETS[settings.preset]
    preset = replace(preset, stems=replace(preset.stems, stem_network=settings.stem_network))
    return PhotoJob(settings, preset, reporter, Steps(None, reporter, {}))


@contextmanager
def held(job: PhotoJob, stages: Sequence[Stage[PhotoJob]], only_kept: bool = False) -> Iterator[PhotoJob]:
    """The job in its workspace, for this process alone. stages: that will run. only_kept: see :class:`.stage.Steps`.

    Raises:
        InputError: another run works there. OutputError: the folder or the tree layer cannot be written.
    """
    check_output(job.settings.output)
    with Workspace.held(job.settings.workspace) as space:
        job.space = space
        job.steps = Steps(space, job.reporter, {stage.name: stage.share for stage in stages}, only_kept)
        yield job


def run_chain(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The whole chain; returns the result of ``photos-to-dbh``. Finished stages of the same inputs and settings are
    kept.

    Cheap checks come first, so that hours of work never end in a typing error.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    job = job_of(settings, reporter)
    check(GEOTAG, job)
    with held(job, (*TREES, *OUTPUTS)):
        job.space.record["parameters"] = to_json(settings)
        # Paths that were given relative are relative to this folder.
        job.space.record["folder"] = os.getcwd()
        run_stages(TREES, job, job.steps)
        job.run_id = job.steps.run_id
        _settle(job)
        try:
            run_stages((SHEETS,), job, job.steps)
        except OutputError as problem:  # the diameters are measured
            reporter.warn(f"No evidence sheets: {problem}")
            job.steps.warnings.append(f"No evidence sheets: {problem}")
        run_stages((WRITE,), job, job.steps)
    return _result(job)


def _settle(job: PhotoJob) -> None:
    """Trees measured at given places join the run's; each gets its plot; why there is no diameter at all."""
    if job.site is None or job.nothing:
        return
    trees = with_given(job.trees, read_given(job, job.reporter))
    if not trees:
        job.nothing = (
            "the segmentation found no stem among the points of the Gaussians"
            if is_published(job.settings)
            else "no stem was found in the photos: none shows two edges of a trunk near the ground"
        )
    elif all(tree.qc_flag == "reject" for tree in trees):
        job.nothing = f"all {len(trees)} stems found were refused, each with its reason in the layer"
    job.trees = placed(trees, job)


def placed(trees: list[Tree], job: PhotoJob) -> list[Tree]:
    """The trees with the plot that they stand in and the run that measured them."""
    out = []
    for tree in trees:
        plot = next((p.plot_id for p in job.plots if np.hypot(tree.x - p.x, tree.y - p.y) <= p.radius_m), None)
        out.append(replace(tree, run_id=job.run_id, plot_id=plot).finish())
    return out


def _result(job: PhotoJob) -> dict[str, Any]:
    result, status = result_of(job, job.trees), f"No stem is measurable: {job.nothing}."
    if result["n_measured"]:
        status = f"{result['n_measured']} of the {len(job.trees)} stems found were measured"
        if heights := heights_sentence(job.trees):
            job.reporter.info(f"{heights}.")
            status += f"; {heights[0].lower()}{heights[1:].partition(' (')[0]}"
    return {**result, "status": status, "warnings": job.steps.warnings}


def result_of(job: PhotoJob, trees: list[Tree]) -> dict[str, Any]:
    """What every run of the verb returns. trees: those that are new in the layer."""
    measured = [tree.dbh_cm for tree in trees if tree.dbh_cm is not None]
    return {
        "output": str(job.settings.output),
        "report": str(job.path(names.REPORT)),
        "workspace": str(job.settings.workspace),
        "run": str(job.path("run.json")),
        "n_trees": len(trees),
        "n_measured": len(measured),
        "n_rejected": len(trees) - len(measured),
        "mean_dbh_cm": round(float(np.mean(measured)), 2) if measured else None,
        "peak_memory_mb": peak_memory_mb(),
    }


def check_photos(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The dry run: what the run would meet and need. Reads inputs, writes nothing.

    Raises:
        TreeDGSError: what would end the job: an input that cannot be used, an output that cannot be written, no disk.
    """
    findings = Findings(reporter)
    job = job_of(settings, findings)
    return dry_run(TREES, job, findings, settings.workspace)
