"""The stage ``sheets`` of a photo run: each stem is looked at once more in the photos that it was fitted in."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ..core import workspace as names
from ..core.errors import OutputError
from ..core.files import short_hash, temporary_beside
from ..core.progress import Reporter
from ..inventory.evidence.files import sheet_file, sheets_folder, trees_with_sheets, write_sheet
from ..inventory.evidence.photo_sheet import PhotoEvidence, photo_sheet
from ..reconstruction.area import Area
from ..stems.photos.deduplicate import known_rows
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.images.crops import choose_views
from ..stems.photos.options import PhotoStemOptions
from ..stems.photos.search_steps import photos_of
from ..stems.photos.stem_images import DrawnStem, look_at
from ..stems.photos.tiles import split
from ..stems.quality.tree import Tree
from .context import PhotoJob, Site
from .given_store import fits_by_id
from .published_plot import is_published
from .stage import Key, Stage

#: A stem at the rim of a piece of ground may have been found in the next one, metres.
_RIM_M = 0.6
#: Other stems within this distance may hide edges of a stem, metres.
_NEAR_M = 40.0


def chosen_trees(job: PhotoJob, trees: list[Tree] | None = None) -> list[Tree]:
    """Those of the trees, the job's if not given, that get a sheet."""
    wanted = job.settings.sheets
    every = job.trees if trees is None else trees
    return trees_with_sheets(every, job.preset.sheets if wanted == "auto" else wanted, wanted != "auto")


def add_sheets(job: PhotoJob, trees: list[Tree], reporter: Reporter) -> None:
    """Sheets of more trees beside those of the run (its ``run_id``); trouble with them is a warning."""
    chosen = chosen_trees(job, trees)
    if not chosen:
        return
    place = sheet_file(job.path(names.SHEETS), chosen[0]).parent
    try:
        place.mkdir(parents=True, exist_ok=True)
        with temporary_beside(place) as made:
            made.mkdir()
            draw_sheets(job, chosen, made, reporter)
            for sheet in made.iterdir():
                os.replace(sheet, place / sheet.name)
    except (OutputError, OSError) as problem:
        reporter.warn(f"No evidence sheets: {problem}")


def draw_sheets(job: PhotoJob, trees: list[Tree], folder: Path, reporter: Reporter) -> int:
    """Sheets of trees of the workspace into a folder; returns how many. Trouble with one is a warning."""
    site, fits = job.place, fits_by_id(job.space).fits
    options = job.preset.stems
    done = 0
    for piece, members in _by_piece(site, trees, fits, options):
        _, stack = photos_of(site.views, site.ground, piece, options, reporter)
        for tree in members:
            fit = fits[tree.tree_id]
            around = [f for f in fits.values() if f is not fit and np.hypot(*(f.axis.p - fit.axis.p)) < _NEAR_M]
            try:
                shown = look_at(stack, fit, shape_of(tree, fit, site), known_rows(around), options)
                write_sheet(folder, tree, photo_sheet(PhotoEvidence(tree, fit, shown, stack)))
                done += 1
            except (ValueError, IndexError, ArithmeticError, cv2.error) as problem:
                reporter.warn(f"Tree {tree.tree_id}: its evidence sheet could not be drawn ({problem}).")
            reporter.progress(done / len(trees))
    return done


def shape_of(tree: Tree, fit: PhotoFit, site: Site) -> DrawnStem:
    """The stem to draw: the diameter in the layer at the place in the layer, along the axis that the photos gave;
    what was tried where there is no diameter."""
    if tree.dbh_cm is None:
        return DrawnStem(fit.axis, fit.r0, fit.r1, fit.oval)
    place = site.frame.to_local(np.array([[tree.x, tree.y, tree.z_ground or 0.0]]))[0, :2]
    slope = fit.r1 if tree.taper_cm_m is None else tree.taper_cm_m / 200
    return DrawnStem(replace(fit.axis, p=place), tree.dbh_cm / 200, slope, fit.oval)


def _by_piece(
    site: Site, trees: list[Tree], fits: dict[int, PhotoFit], options: PhotoStemOptions
) -> Iterator[tuple[Area, list[Tree]]]:
    """The pieces of ground that were searched at once, with their trees: of the pieces round a stem that whose photos
    it was fitted in."""
    pieces = split(site.area, options.margin_m)
    members: list[list[Tree]] = [[] for _ in pieces]
    photos: dict[int, set[str]] = {}
    for tree in trees:
        fit = fits[tree.tree_id]
        x, y = fit.axis.p
        away = [max(x0 - x, x - x1, y0 - y, y - y1) for _, (x0, y0, x1, y1) in pieces]
        near = [k for k, far in enumerate(away) if far <= max(_RIM_M, min(away))]
        for k in near if len(near) > 1 else ():
            if k not in photos:
                ground = site.ground(pieces[k][0].centres[:, 0], pieces[k][0].centres[:, 1])
                middle = float(np.nan_to_num(np.median(ground)))
                chosen = choose_views(site.views, pieces[k][0], middle, options.max_views)
                photos[k] = {site.views[v].name for v in chosen}
        best = max(near, key=lambda k: (len(photos.get(k, set()) & set(fit.photos)), -away[k]))
        members[best].append(tree)
    for (piece, _), own in zip(pieces, members, strict=True):
        if own:
            yield piece, own


def _sheets_key(job: PhotoJob) -> Key:
    return Key({"sheets": job.settings.sheets, "trees": short_hash(*map(asdict, chosen_trees(job)))})


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
