"""The stage ``heights``: heights of the trees and a canopy height model from the block's own photos."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine

from ..core import workspace as names
from ..core.files import read_json, write_json
from ..core.progress import Reporter
from ..inventory.tree_layer import style_raster
from ..reconstruction.cameras import View
from ..reconstruction.canopy import CELL_M, CanopyVolume, surface_of, volume_of
from ..reconstruction.ground_sight import ground_sight
from ..reconstruction.multi_view_correlation import pictures_of
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.fit_records import read_fits
from ..stems.photos.tiles import split
from ..stems.photos.tree_heights import Heights, Profile, heights_of, profiles
from ..stems.photos.tuned import MIN_PHOTOS
from ..stems.quality.tree import Tree
from ..terrain.dtm import Dtm, write_dtm
from .context import PhotoJob, Site
from .ground_stage import circles
from .stage import Key, Stage

#: The heights of a run's trees, in its workspace.
KEPT_HEIGHTS = "heights.json"
#: Pixel of the pictures that are compared, metres at the middle of the crowns, and photos that each is compared with.
PIXEL_M, NEIGHBOURS = 0.11, 12
#: Crowns reach over the rim of a plot, and their tops stand beside their stems, metres.
_RIM_M = 2.0
#: Middle of the crowns above the ground, where the pictures' pixels have their size, metres.
_MIDDLE_M = 15.0
#: Ground is looked for so far beside that of the crowns, behind which oblique photos show it, metres.
_SIGHT_M = 22.0
#: Search up to so far above what the sparse points show, and between these heights, metres.
_MORE_M, _LOWEST_M, _HIGHEST_M = 12.0, 20.0, 85.0
_FEW_POINTS = 50
#: Most photos that are compared over one piece of ground.
MAX_COMPARED = 80


def find_heights(
    site: Site,
    points: np.ndarray,
    trees: list[Tree],
    fits: dict[int, PhotoFit],
    bh_m: float,
    raster: Path | None,
    reporter: Reporter,
    wanted: set[int] | None = None,
) -> dict[str, dict[str, Any]]:
    """Heights of a run's trees, and ``raster``, a canopy height model of the site.

    points: (N, 3) sparse points, local frame. trees: project coordinates, with a DBH or without. fits: by number of the
    tree, for the stems' axes; upright where there is none. bh_m: breast height. wanted: numbers of trees; only the
    pieces of ground of these are looked at.

    Returns:
        ``height_m``, ``height_se_m`` and ``height_why`` of each tree, by its number as text. All pieces of the site
        have one curve of height over diameter.
    """
    places = site.frame.to_local(np.array([[tree.x, tree.y, tree.z_ground or 0.0] for tree in trees]))[:, :2]
    slopes = _slopes(fits, trees)
    foot = places - slopes * bh_m
    pieces, highest_m = list(pieces_of(site)), highest(points, site)
    surfaces, profiled, numbers = [], [], []
    levels = np.empty(0)
    for number, (views, box) in enumerate(pieces):
        own = [k for k, (x, y) in enumerate(places) if box[0] <= x <= box[2] and box[1] <= y <= box[3]]
        if wanted is not None and wanted.isdisjoint(trees[k].tree_id for k in own):
            continue
        with reporter.stage("canopy", number / len(pieces), (number + 0.9) / len(pieces)):
            volume = canopy_over(site, views, box, highest_m, reporter)
        surfaces.append((volume.x, volume.y, surface_of(volume)))
        if own:
            levels, sight = volume.levels_m, ground_sight(views, site.ground, box, _SIGHT_M)
            profiled.append(profiles(volume, sight, foot[own], slopes[own]))
            numbers += own
    if raster is not None:
        _write(raster, surfaces, site)
    if not numbers:
        return {}
    dbh = np.array([np.nan if tree.dbh_cm is None else tree.dbh_cm for tree in trees])[numbers]
    heights = heights_of(Profile.joined(profiled), levels, dbh, foot[numbers], slopes[numbers])
    return {str(trees[k].tree_id): _entry(heights, row) for row, k in enumerate(numbers)}


def _entry(heights: Heights, row: int) -> dict[str, Any]:
    if not np.isfinite(heights.height_m[row]):
        return {"height_m": None, "height_se_m": None, "height_why": str(heights.why[row])}
    height, se = round(float(heights.height_m[row]), 2), round(float(heights.se_m[row]), 2)
    return {"height_m": height, "height_se_m": se, "height_why": None}


def _slopes(fits: dict[int, PhotoFit], trees: list[Tree]) -> np.ndarray:
    """(T, 2) metres sideways for one metre up along each stem's axis."""
    upright = np.zeros(2)
    return np.nan_to_num([fits[tree.tree_id].axis.s if tree.tree_id in fits else upright for tree in trees])


def canopy_over(
    site: Site, views: list[View], box: tuple[float, float, float, float], highest_m: float, reporter: Reporter
) -> CanopyVolume:
    """What photos show over one of :func:`pieces_of`."""
    middle = np.array([(box[0] + box[2]) / 2, (box[1] + box[3]) / 2])
    level = float(np.nan_to_num(site.ground(middle[:1], middle[1:])[0]))
    pictures = pictures_of(views, np.array([*middle, level + _MIDDLE_M]), PIXEL_M, NEIGHBOURS)
    wide = (box[0] - _RIM_M, box[1] - _RIM_M, box[2] + _RIM_M, box[3] + _RIM_M)
    return volume_of(pictures, site.ground, wide, highest_m, reporter)


def pieces_of(site: Site) -> Iterator[tuple[list[View], tuple[float, float, float, float]]]:
    """Photos that show a piece of ground's crowns, and its box."""
    from_above = above_crowns(site)
    for piece, box in split(site.area, 1.0):
        level = float(np.nan_to_num(np.nanmedian(site.ground(piece.centres[:, 0], piece.centres[:, 1]))))
        outline = np.vstack([piece.centres, piece.outline(0.0, 12)])
        points = np.column_stack([outline, np.full(len(outline), level + _MIDDLE_M)])
        views = [view for view in from_above if view.contains(view.project(points)[0]).mean() >= 0.1]
        yield views[:: max(-(-len(views) // MAX_COMPARED), 1)], box


def above_crowns(site: Site) -> list[View]:
    """Photos taken above the middle of the crowns; those from among the stems show no tops."""
    level = float(np.nan_to_num(np.nanmedian(site.ground(*site.area.centres.T))))
    return [view for view in site.views if view.centre[2] - level > _MIDDLE_M]


def highest(points: np.ndarray, site: Site) -> float:
    """Height above the ground up to which crowns are looked for: well above what the sparse points (N, 3), local frame,
    show over the area."""
    inside = points[site.area.contains(points[:, :2], _RIM_M)]
    height = inside[:, 2] - site.ground(inside[:, 0], inside[:, 1])
    height = height[height > 3.0]
    if len(height) < _FEW_POINTS:
        return 0.5 * (_LOWEST_M + _HIGHEST_M)
    return float(np.clip(np.percentile(height, 99.5) + _MORE_M, _LOWEST_M, _HIGHEST_M))


def _write(path: Any, surfaces: list[tuple[np.ndarray, np.ndarray, np.ndarray]], site: Site) -> None:
    """Surfaces (x, y, heights above the ground) as one raster, project coordinates, the higher one where they meet."""
    x0, y0 = (min(float(surface[axis][0]) for surface in surfaces) - CELL_M / 2 for axis in (0, 1))
    x1, y1 = (max(float(surface[axis][-1]) for surface in surfaces) + CELL_M / 2 for axis in (0, 1))
    columns, rows = (int(np.ceil((high - low) / CELL_M - 1e-6)) for low, high in ((x0, x1), (y0, y1)))
    heights = np.full((rows, columns), np.nan)
    for x, y, height in surfaces:
        column = np.minimum(((x - x0) / CELL_M).astype(int), columns - 1)
        row = np.maximum(rows - 1 - ((y - y0) / CELL_M).astype(int), 0)
        at = np.ix_(row, column)
        heights[at] = np.fmax(heights[at], height)
    corner = site.frame.to_project(np.array([[x0, y0 + rows * CELL_M, 0.0]]))[0]
    size = CELL_M * site.frame.scale
    grid = Affine(size, 0, corner[0], 0, -size, corner[1])
    write_dtm(path, Dtm(heights, grid, site.frame.crs), band="canopy height above ground")


def _wants_heights(job: PhotoJob) -> bool:
    wanted = job.settings.heights
    if not job.trees or not (wanted == "photos" or (wanted == "auto" and job.preset.heights)):
        return False
    if len(above_crowns(job.place)) >= MIN_PHOTOS:
        return True
    if wanted == "photos":
        job.reporter.warn("No photos were taken above the crowns: the trees get no heights.")
    return False


def _heights_key(job: PhotoJob) -> Key:
    used: dict[str, Any] = {"places": [[round(tree.x, 2), round(tree.y, 2), tree.dbh_cm] for tree in job.trees]}
    return Key(used | {"plots": circles(job.place.area), "ground": job.space.output_hashes("ground")})


def _heights(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    raster = job.path(names.CHM)
    style_raster(raster, "chm")
    fits = dict(enumerate(read_fits(job.path(names.FITS)).fits, start=1))
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
