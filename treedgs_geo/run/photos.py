"""From photos to the tree layer."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.progress import Reporter
from ..core.settings import to_json
from ..core.workspace import Workspace, peak_memory_mb
from ..geotags.photos import list_photos
from ..inventory.readings import readings_table
from ..inventory.searched import partly_searched, searched_table
from ..inventory.tree_layer import check_output
from ..planning.flown import read_expected
from ..stems.photos.fit_records import read_fits
from ..stems.quality.tops import heights_sentence
from ..stems.quality.tree import Tree
from .context import Run
from .heights import with_heights
from .measure import measure, placed
from .outputs import compare_with_plan, write_layers, write_page
from .published_plot import check_published, is_published
from .routes import preset_of
from .searched import ENOUGH_VIEWS, day_of, seen_in_photos
from .sheets import make_sheets
from .stages import Collector, Steps
from .stages_before_stems import Ready, prepare
from .targeted_store import read_given, with_given

if TYPE_CHECKING:
    import pandas as pd

    from .settings import PhotosToDbhSettings


def run_chain(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The whole chain; returns the result of ``photos-to-dbh``.

    Cheap checks come first, so that hours of work never end in a typing error.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    check_output(settings.output)
    check_published(settings)
    if settings.flight_plan:
        read_expected(settings.flight_plan)
    photos = list_photos(settings.photos)
    reporter.info(f"Workspace: {settings.workspace}")
    with Workspace.held(settings.workspace) as space:
        space.record["parameters"] = to_json(settings)
        # Paths that were given relative are relative to this folder.
        space.record["folder"] = os.getcwd()
        return _run(
            Run(settings, preset_of(settings.preset, settings.stem_network), space, Steps(space, reporter)), photos
        )


def _run(run: Run, photos: list[Path]) -> dict[str, Any]:
    ready = prepare(run, photos)
    nothing, site = ready.nothing, ready.site
    if site is None or ready.aligned is None:
        return _write(run, ready, [], nothing)
    trees: list[Tree] = []
    if not nothing:
        trees = measure(run, site, ready.aligned)
        trees = with_heights(run, site, ready.aligned, trees)
        trees = with_given(trees, read_given(run, run.steps.reporter))
        if not any(tree.qc_flag != "reject" for tree in trees):
            nothing = (
                nothing_found(run.settings)
                if not trees
                else f"all {len(trees)} stems found were refused, each with its reason in the layer"
            )
    return _write(run, ready, trees, nothing)


def nothing_found(settings: PhotosToDbhSettings) -> str:
    """Why there is no tree at all."""
    if is_published(settings):
        return "the segmentation found no stem among the points of the Gaussians"
    return "no stem was found in the photos: none shows two edges of a trunk near the ground"


def _readings(run: Run, trees: list[Tree]) -> pd.DataFrame | None:
    """What the refused stems were read as, where the run kept its fits."""
    path = run.path(names.FITS)
    if not trees or not path.exists():
        return None
    fits = read_fits(path).fits
    rows = []
    for tree in trees:
        fit = fits[tree.tree_id - 1] if tree.qc_flag == "reject" and 0 < tree.tree_id <= len(fits) else None
        if fit is not None and np.isfinite(fit.se_cm):
            rows.append((tree.tree_id, fit.dbh_cm, fit.se_cm))
    return readings_table(rows)


def _write(run: Run, ready: Ready, trees: list[Tree], nothing: str) -> dict[str, Any]:
    """Layer, copy in the workspace, evidence sheets, report. nothing: why no tree has a diameter, empty where one
    has."""
    settings, report, run_id = run.settings, run.path(names.REPORT), run.steps.run_id
    flight, aligned, site = ready.flight, ready.aligned, ready.site
    plots = flight.plots
    trees = placed(trees, plots, run_id)
    sheets = make_sheets(run, site, trees) if site is not None else {}

    def work(reporter: Collector) -> dict[str, Any]:
        if nothing:
            reporter.warn(f"No stem is measurable: {nothing}.")
        if trees and all(tree.plot_id is None for tree in trees) and plots:
            reporter.warn("All stems found stand outside the plots; check the plot centres.")
        searched = searched_table(seen_in_photos(site, plots), plots, flight.stations.crs, day_of(flight.stations.utc))
        why = f"elsewhere fewer than {ENOUGH_VIEWS} photos look from the side"
        for sentence in partly_searched(searched, why) if site is not None else []:
            reporter.warn(sentence)
        write_layers(run, trees, flight.stations.crs, reporter, searched, _readings(run, trees))
        planned = compare_with_plan(run, aligned, trees, reporter)
        write_page(run, run_id, flight, aligned, trees, sheets, reporter, planned)
        return {"report": str(report)}

    # The outputs may be changed by the user between runs: always written anew, it costs a second.
    run.steps.run("write", {"output": settings.output}, [], [], work, always=True)
    measured = [tree for tree in trees if tree.dbh_cm is not None]
    status = f"No stem is measurable: {nothing}."
    if measured:
        status = f"{len(measured)} of the {len(trees)} stems found were measured"
        if heights := heights_sentence(trees):
            run.steps.reporter.info(f"{heights}.")
            status += f"; {heights[0].lower()}{heights[1:].partition(' (')[0]}"
    return {
        "output": str(settings.output),
        "report": str(report),
        "workspace": str(run.space.folder),
        "run": str(run.space.folder / "run.json"),
        "n_trees": len(trees),
        "n_measured": len(measured),
        "n_rejected": len(trees) - len(measured),
        "mean_dbh_cm": round(float(np.mean([tree.dbh_cm for tree in measured])), 2) if measured else None,
        "status": status,
        "warnings": run.steps.warnings,
        "peak_memory_mb": peak_memory_mb(),
    }
