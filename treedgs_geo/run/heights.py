"""Heights of the trees and a canopy height model from the block's own photos."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine

from ..core.progress import Reporter
from ..reconstruction.area import Area
from ..reconstruction.cameras import View
from ..reconstruction.canopy import CELL_M, Canopy, canopy_of, finer_tip
from ..reconstruction.multi_view_correlation import Pictures, pictures_of
from ..stems.photos.fit_records import read_fits
from ..stems.photos.tiles import split
from ..stems.quality.tips import covers, tips_of
from ..stems.quality.tops import HEIGHT_REASONS, MOVING_SHARE, Joined, join_tops
from ..stems.quality.tree import Tree
from ..terrain.dtm import Dtm, write_dtm
from .context import Site

#: Pixels of the pictures that are compared, metres at the middle of the crowns.
PIXEL_M = (0.0735, 0.0367)
#: Crowns reach over the rim of a plot, and their tops stand beside their stems, metres.
_RIM_M = 2.0
#: Middle of the crowns above the ground, where the pictures' pixels have their size, metres.
_MIDDLE_M = 15.0
#: Search from so far above what the sparse points show, and between these heights, metres.
_MORE_M, _LOWEST_M, _HIGHEST_M = 3.0, 15.0, 75.0
_FEW_POINTS = 50
#: Most photos that are compared over one piece of ground.
MAX_COMPARED = 80
#: Standard error of a height, metres and share of the height; the share where nothing says what heights suit the
#: diameters. Set on ten simulated flights of 19 to 62 photos (docs/evidence/heights.md).
_SE_M, _SE_SHARE, _SE_SHARE_ALONE = 0.4, 0.04, 0.08
#: Of the cells about a treetop so many must hold something, and its height must suit the diameter within this share
#: (logarithm) of the plot's own curve.
_MIN_COVER, _MAX_OVER = 0.3, 0.15
#: A tip with fewer cells about it suits where its height is within this share of a curve that scatters no more.
_SUITS = 0.1


def find_heights(
    site: Site, points: np.ndarray, trees: list[Tree], fits: Path, bh_m: float, raster: Path, reporter: Reporter
) -> tuple[dict[str, dict[str, Any]], float]:
    """Heights of a run's trees, and ``raster``, a canopy height model of the site.

    points: (N, 3) sparse points, local frame. trees: project coordinates, with a DBH or without. fits: file of the
    photo fits, for the stems' axes. bh_m: breast height.

    Returns:
        ``height_m``, ``height_se_m`` and ``height_why`` of each tree, by its number as text; the share of the trees
        with a DBH whose top is seen alike in neighbouring photos.
    """
    places = site.frame.to_local(np.array([[tree.x, tree.y, tree.z_ground or 0.0] for tree in trees]))[:, :2]
    slopes = _slopes(fits, trees)
    ground = site.ground
    pieces, found, shares = list(pieces_of(site)), {}, []
    canopies: list[Canopy] = []
    for number, (views, box) in enumerate(pieces):
        low, high = number / len(pieces), (number + 1) / len(pieces)
        own = [k for k, (x, y) in enumerate(places) if box[0] <= x <= box[2] and box[1] <= y <= box[3]]
        with reporter.stage("canopy", low, low + 0.9 * (high - low)):
            pictures, canopy = canopy_over(site, views, box, points, reporter)
        canopies.append(canopy)
        tips = tips_of(canopy.x, canopy.y, canopy.height_m)
        if not own:
            continue
        tip_z = np.nan_to_num(ground(tips[:, 0], tips[:, 1])) if len(tips) else np.empty(0)
        at = places[own][:, None] + slopes[own][:, None] * (tips[None, :, 2:] - bh_m)
        dbh = np.array([np.nan if trees[k].dbh_cm is None else trees[k].dbh_cm for k in own])
        joined = join_tops(at, tips, dbh)
        shares += [joined.share] * int(np.isfinite(dbh).sum())
        tops, reasons = _trusted(joined, tips, dbh, covers(canopy.x, canopy.y, canopy.height_m, tips))
        foot_z = ground(places[own, 0], places[own, 1])
        for k, top, apart, why, foot in zip(own, tops, joined.apart_m, reasons, foot_z, strict=True):
            height = finer_tip(pictures, tips[top], tip_z[top]) + tip_z[top] - foot if top >= 0 else np.nan
            suits = top >= 0 and np.isfinite(joined.level) and trees[k].dbh_cm is not None
            found[str(trees[k].tree_id)] = _entry(
                height, str(why), _SE_SHARE if suits else _SE_SHARE_ALONE, float(apart)
            )
    _write(raster, canopies, site)
    return found, float(np.mean(shares)) if shares else 1.0


def _trusted(joined: Joined, tips: np.ndarray, dbh_cm: np.ndarray, cover: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(S,) tops as joined, -1 where they cannot be trusted, and (S,) why not. cover: (K,) of the tips."""
    tops, reasons = joined.top.copy(), joined.reason.copy()
    if joined.share < MOVING_SHARE:
        return np.full_like(tops, -1), np.full_like(reasons, "moving")
    for stem in np.flatnonzero(tops >= 0):
        over = float(joined.over_curve(tips[tops[stem], 2], dbh_cm[stem]))
        # Heights that scatter so much over the diameters are not those of one stand: most tips are chance. A lonely
        # tip that suits the diameter well is hardly one (six on the simulated flights: at most 1.1 m off).
        suits = abs(over) <= _SUITS and joined.scatter <= _SUITS
        chance = cover[tops[stem]] < _MIN_COVER and not suits or joined.scatter > _MAX_OVER
        if chance or abs(over) > _MAX_OVER:
            tops[stem], reasons[stem] = -1, "sparse" if chance else "other_tree"
    return tops, reasons


def _entry(height_m: float, why: str, se_share: float, apart_m: float = 0.0) -> dict[str, Any]:
    """apart_m: how much lower another top is that would suit the stem about as well."""
    if not np.isfinite(height_m):
        return {"height_m": None, "height_se_m": None, "height_why": why or "no_top"}
    assert not why or why in HEIGHT_REASONS
    return {
        "height_m": round(float(height_m), 2),
        "height_se_m": round(float(np.sqrt(_SE_M**2 + (se_share * height_m) ** 2 + (0.5 * apart_m) ** 2)), 2),
        "height_why": None,
    }


def _slopes(path: Path, trees: list[Tree]) -> np.ndarray:
    """(T, 2) metres sideways for one metre up along each stem's axis; upright where the photos gave no axis."""
    fits = read_fits(path).fits
    slopes = np.zeros((len(trees), 2))
    for k, tree in enumerate(trees):
        if tree.tree_id <= len(fits):
            slopes[k] = fits[tree.tree_id - 1].axis.s
    return np.nan_to_num(slopes)


def canopy_over(
    site: Site, views: list[View], box: tuple[float, float, float, float], points: np.ndarray, reporter: Reporter
) -> tuple[list[Pictures], Canopy]:
    """The canopy over one of :func:`pieces_of`, and the pictures that it was seen in. points: (N, 3) sparse points,
    local frame."""
    middle = np.array([(box[0] + box[2]) / 2, (box[1] + box[3]) / 2])
    level = float(np.nan_to_num(site.ground(middle[:1], middle[1:])[0]))
    pictures = pictures_of(views, np.array([*middle, level + _MIDDLE_M]), PIXEL_M, 2)
    wide = (box[0] - _RIM_M, box[1] - _RIM_M, box[2] + _RIM_M, box[3] + _RIM_M)
    return pictures, canopy_of(pictures, site.ground, wide, highest(points, site, wide), reporter)


def pieces_of(site: Site) -> Iterator[tuple[list[View], tuple[float, float, float, float]]]:
    """Photos that show a piece of ground's crowns, and its box."""
    for piece, box in split(site.area, 1.0):
        level = float(np.nan_to_num(np.nanmedian(site.ground(piece.centres[:, 0], piece.centres[:, 1]))))
        outline = np.vstack([piece.centres, _ring(piece)])
        points = np.column_stack([outline, np.full(len(outline), level + _MIDDLE_M)])
        views = [view for view in site.views if view.contains(view.project(points)[0]).mean() >= 0.1]
        yield views[:: max(-(-len(views) // MAX_COMPARED), 1)], box


def _ring(piece: Area) -> np.ndarray:
    return piece.outline(0.0, 12)


def highest(points: np.ndarray, site: Site, box: tuple[float, float, float, float]) -> float:
    """Height above the ground where the search for crowns begins: above what the sparse points (N, 3) in the box
    show."""
    inside = (points[:, 0] > box[0]) & (points[:, 0] < box[2]) & (points[:, 1] > box[1]) & (points[:, 1] < box[3])
    height = points[inside, 2] - site.ground(points[inside, 0], points[inside, 1])
    height = height[height > 3.0]
    if len(height) < _FEW_POINTS:
        return 0.5 * (_LOWEST_M + _HIGHEST_M)
    return float(np.clip(np.percentile(height, 99.5) + _MORE_M, _LOWEST_M, _HIGHEST_M))


def _write(path: Any, canopies: list[Canopy], site: Site) -> None:
    """The canopies as one raster of heights above the ground, project coordinates, the higher one where they meet."""
    x0, y0 = (min(float(getattr(c, axis)[0]) for c in canopies) - CELL_M / 2 for axis in "xy")
    x1, y1 = (max(float(getattr(c, axis)[-1]) for c in canopies) + CELL_M / 2 for axis in "xy")
    columns, rows = (int(np.ceil((high - low) / CELL_M - 1e-6)) for low, high in ((x0, x1), (y0, y1)))
    heights = np.full((rows, columns), np.nan)
    for canopy in canopies:
        column = np.minimum(((canopy.x - x0) / CELL_M).astype(int), columns - 1)
        row = np.maximum(rows - 1 - ((canopy.y - y0) / CELL_M).astype(int), 0)
        at = np.ix_(row, column)
        heights[at] = np.fmax(heights[at], canopy.height_m)
    corner = site.frame.to_project(np.array([[x0, y0 + rows * CELL_M, 0.0]]))[0]
    size = CELL_M * site.frame.scale
    grid = Affine(size, 0, corner[0], 0, -size, corner[1])
    write_dtm(path, Dtm(heights, grid, site.frame.crs), band="canopy height above ground")
