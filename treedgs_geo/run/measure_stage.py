"""The stage ``measure``: stems in the photos, and their diameters."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError
from ..core.files import read_json, write_json
from ..core.plots import plot_of
from ..core.progress import Reporter
from ..core.shown import count_of
from ..geotags.photos import read_photo
from ..stems.photos.fit_records import KeptFits, write_fits
from ..stems.photos.route import search_photos
from ..stems.photos.trees import trees_of_photo_fits
from ..stems.quality.ground import with_ground_error
from ..stems.quality.limits import judge
from ..stems.quality.tree import Tree, with_block_errors
from ..terrain.sparse_ground import sparse_ground_se
from .context import Aligned, PhotoJob
from .field_stems import answer_field_stems, field_stems, given_stems
from .forecast import MANY_TILES, at_once, only_nadir, planned_ground, planned_views, report_overlap, search_ahead
from .ground_stage import circles
from .published_plot import Published, is_published, published_route
from .settings import PhotosToDbhSettings
from .stage import Cost, Findings, Key, Stage

#: The trees of a run as it measured them, in its workspace.
KEPT_TREES = "trees.json"
#: Core-seconds of the other stages for each photo of a usual plot; only the progress bar depends on it.
_OTHER_S_PHOTO = 8.0


def _announce_search(job: PhotoJob) -> None:
    """Before hours of work: why no stem can be seen, or how large the search will be."""
    stations, plots = job.stations, job.plots
    job.nothing = only_nadir(stations)
    if job.nothing:
        return
    job.planned = planned_views(stations, planned_ground(stations, plots, job.given))
    job.search = search_ahead(stations, plots, job.planned, job.preset.stems)
    if is_published(job.settings):
        job.steps.weigh("measure", max(job.settings.time_limit, 1.0))  # of a minute's search
    elif job.search is not None:
        job.steps.weigh("measure", max(job.search.core_seconds / (_OTHER_S_PHOTO * len(stations)), 1.0))
        if not plots and job.search.tiles > MANY_TILES:
            job.reporter.warn(f"{job.search.sentence()}: give plots (--plots) to measure only those.")


def _measure_cost(job: PhotoJob, findings: Findings) -> Cost:
    """Says how large the search will be, and how often its ground is seen."""
    if job.nothing:
        findings.problem(f"{job.settings.photos}: no DBH can be measured: {job.nothing}.")
        return Cost()
    report_overlap(job.planned, job.stations, job.plots, findings)
    search, core_s = job.search, 0.0
    findings.facts["n_tiles"] = search.tiles if search else None
    if search is not None:
        core_s = search.core_seconds
        if job.plots:
            findings.info(f"The plots are searched in {count_of(search.tiles, 'tile')}.")
        elif search.tiles <= MANY_TILES:
            findings.info(f"{search.sentence()}.")
    if is_published(job.settings):
        core_s = 60 * job.settings.time_limit * 1.3 + 120
    photo = read_photo(job.stations.paths[0])
    # The search keeps its photos open.
    open_gb = 0.004 * photo.width * photo.height / 1e6 * min(len(job.stations), 100)
    return Cost(seconds=core_s / at_once() * 1.1, memory_gb=open_gb)


def _measure_key(job: PhotoJob) -> Key:
    asked, field = job.settings, field_stems(job)
    used = {
        "fit": _route(asked),
        "preset": asked.preset,
        "stem_network": asked.stem_network,
        "bh_m": asked.bh_m,
        "max_dbh_cm": asked.max_dbh_cm,
        "seed": asked.seed,
        "plots": circles(job.place.area),
        "scale_sd": _scale_sd(job.block),
        "confirmed": _confirmed(job.block),
        "ground_m": _ground_m(job),
    }
    if field is not None:
        used["field_stems"] = [np.round(field.xy, 3).tolist(), list(field.names), asked.field_error_m]
    files: list[Path] = []
    if asked.device != "cpu":
        used["device"] = asked.device
    if is_published(asked):
        used["time_limit"] = asked.time_limit
        files = [asked.dense] if asked.dense is not None else []
    return Key(used, files)


def _measure_outputs(job: PhotoJob) -> list[Path]:
    field = [] if job.settings.field_stems is None else [job.path(names.FIELD_STEMS)]
    return [job.path(KEPT_TREES), job.path(names.FITS), *field]


def _measure(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    """Stems and diameters by the route asked for, with the errors that the whole run adds to each."""
    asked, site, options = job.settings, job.place, job.preset.stems
    field = field_stems(job)
    given = None if field is None else given_stems(field.xy, site, asked.field_error_m)
    if is_published(asked):
        found, facts = published_route(site, job.block.points, Published.of(asked), job.path, reporter)
        kept = KeptFits([])
    else:
        with reporter.placed(site.frame):
            searched = search_photos(site.views, site.ground, site.area, options, reporter, given)
        found, facts = trees_of_photo_fits(searched.fits, site.frame), dict[str, Any]()
        kept = KeptFits(searched.fits, searched.looks)
    trees = with_run_errors(job, found)
    write_json(job.path(KEPT_TREES), [asdict(tree) for tree in trees])
    write_fits(job.path(names.FITS), kept)
    if field is not None and given is not None:
        facts |= {"field_stems": answer_field_stems(job, field, given, kept.fits, trees, reporter)}
    return {"fit": _route(asked), "stems": len(trees), **facts}


def _route(asked: PhotosToDbhSettings) -> str:
    return "gaussians" if is_published(asked) else "photos"


def with_run_errors(job: PhotoJob, trees: list[Tree]) -> list[Tree]:
    """The same with the errors of the block's scale, and of the ground's height under each tree; flagged where the
    block itself is not sure."""
    block, site = job.block, job.place
    trees = [with_block_errors(tree, _scale_sd(block), 0.0) for tree in trees]
    if judge("photos", _confirmed(block)).flagged:
        trees = [tree.add_reason("weak_block") for tree in trees]
    places = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    # How well the sparse points show the ground under each tree counts in its error.
    ground_se = sparse_ground_se(site.frame.to_project(block.points), site.dtm, places, _ground_m(job))
    return [with_ground_error(tree, float(se), "photos") for tree, se in zip(trees, ground_se, strict=True)]


def _scale_sd(block: Aligned) -> float:
    return block.report.get("scale_sd") or 0.0


def _confirmed(block: Aligned) -> dict[str, float]:
    """Share of the placed photos that the others' points confirm; empty for blocks that were not asked."""
    report = block.report
    return {"confirmed": report["confirmed"] / max(report["registered"], 1)} if "confirmed" in report else {}


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


def placed(trees: list[Tree], job: PhotoJob) -> list[Tree]:
    """The trees with the plot that they stand in and the run that measured them."""
    return [replace(tree, run_id=job.run_id, plot_id=plot_of(job.plots, tree.x, tree.y)).finish() for tree in trees]


def _load_trees(job: PhotoJob, _: object) -> None:
    job.trees = placed(read_kept_trees(job.path(KEPT_TREES)), job)


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
