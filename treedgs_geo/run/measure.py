"""Stems and diameters of a photo run, by the route asked for, with the errors that the whole run adds to each."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError
from ..core.files import read_json, write_json
from ..core.plots import Plot
from ..core.progress import Reporter
from ..stems.photos.fit_records import write_fits
from ..stems.photos.targeted_fit import GivenStems
from ..stems.quality.ground import with_ground_error
from ..stems.quality.tree import Tree, with_block_errors
from ..terrain.sparse_ground import sparse_ground_se
from .context import Aligned, Run, Site
from .field_stems import answers_of, places_of, read_places, write_answers
from .published_plot import is_published, published_route
from .routes import Found, auto_route, photo_route, splat_route
from .stages_before_stems import circles

#: The trees of a run as it measured them, in its workspace.
KEPT_TREES = "trees.json"


def measure(run: Run, site: Site, aligned: Aligned) -> list[Tree]:
    """Stems and diameters, project coordinates; kept as ``trees.json`` and ``fits.json`` so that a resumed run skips
    it."""
    settings, kept, fits = run.settings, run.path(KEPT_TREES), run.path(names.FITS)
    fit, field = route_of(run), read_places(settings, site)
    outputs = [kept, fits] if field is None else [kept, fits, run.path(names.FIELD_STEMS)]

    def work(reporter: Reporter) -> dict[str, Any]:
        given = None if field is None else places_of(field, site, settings.field_error_m)
        found = _by_route(run, site, aligned, fit, reporter, given)
        trees = with_run_errors(run, site, aligned, found.trees)
        write_json(kept, [asdict(tree) for tree in trees])
        write_fits(fits, found.kept)
        facts = found.facts
        if field is not None and given is not None:
            answers = answers_of(field, given, site, found.kept.fits, trees, run.preset.stems.margin_m)
            write_answers(run.path(names.FIELD_STEMS), answers)
            facts = facts | answers.report(settings.field_stems, reporter)
        return {"fit": "photos" if fit == "auto" else fit, "stems": len(trees), **facts}

    used = {
        "fit": fit,
        "preset": settings.preset,
        "stem_network": settings.stem_network,
        "bh_m": settings.bh_m,
        "seed": settings.seed,
        "plots": circles(site.area),
        "scale_sd": _scale_sd(aligned),
        "ground_m": _ground_m(run),
    }
    if field is not None:
        used["field_stems"] = [np.round(field.xy, 3).tolist(), list(field.names), settings.field_error_m]
    inputs = []
    if settings.device != "cpu":
        used["device"] = settings.device
    if fit == "paper":
        used |= {"time_limit": settings.time_limit, "segmenter": [settings.segmenter, settings.segmenter_command]}
        inputs = [path for path in (settings.dense, settings.segmenter_model) if path is not None]
    run.steps.run("measure", used, inputs, outputs, work)
    return read_kept_trees(kept)


def route_of(run: Run) -> str:
    """``photos``, ``gaussians``, ``paper`` or ``auto``."""
    settings = run.settings
    return "paper" if is_published(settings) else settings.fit


def with_run_errors(run: Run, site: Site, aligned: Aligned, trees: list[Tree]) -> list[Tree]:
    """The same with the errors of the block's scale, and of the ground's height under each tree."""
    trees = [with_block_errors(tree, _scale_sd(aligned), 0.0) for tree in trees]
    places = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    # How well the sparse points show the ground under each tree counts in its error.
    ground_se = sparse_ground_se(site.frame.to_project(aligned.points), site.dtm, places, _ground_m(run))
    return [with_ground_error(tree, float(se), "photos") for tree, se in zip(trees, ground_se, strict=True)]


def _scale_sd(aligned: Aligned) -> float:
    return aligned.report.get("scale_sd") or 0.0


def _ground_m(run: Run) -> float | None:
    """How far a given terrain model lies above the ground that the photos see, metres."""
    return run.space.record["stages"]["ground"]["result"].get("above_photos_m")


def _by_route(run: Run, site: Site, aligned: Aligned, fit: str, reporter: Reporter, given: GivenStems | None) -> Found:
    settings = run.settings
    if fit == "auto":
        return auto_route(site, run.preset, settings.bh_m, settings.seed, reporter, given)
    if fit == "photos":
        return photo_route(site, run.preset, settings.bh_m, reporter, given)
    if fit == "paper":
        return published_route(run, site, aligned, reporter)
    return splat_route(site, run, reporter, given)


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


def placed(trees: list[Tree], plots: list[Plot], run_id: str) -> list[Tree]:
    """The trees with the plot that they stand in and the run that measured them."""
    out = []
    for tree in trees:
        plot = next((p.plot_id for p in plots if np.hypot(tree.x - p.x, tree.y - p.y) <= p.radius_m), None)
        out.append(replace(tree, run_id=run_id, plot_id=plot).finish())
    return out
