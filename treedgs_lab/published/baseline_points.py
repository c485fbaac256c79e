"""Two plain point clouds from a field, beside opacity-guided sampling: the centres alone, and fused depth maps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.splats.crops import crop_around
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.raster import draw


def means_only(field: GaussianField, least_opacity: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """(P, 3) float64 local centres of Gaussians at or above ``least_opacity``, and (P,) int32 their groups."""
    keep = field.opacities >= least_opacity
    return field.means[keep].astype(float), field.groups[keep]


def fuse_depth(
    field: GaussianField,
    views: Sequence[View],
    least_alpha: float = 0.5,
    agree_m: float = 0.05,
    least_views: int = 2,
    about: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the median-depth maps of each stem in every view, kept where other views' maps agree.

    A pixel counts where the accumulated alpha is at least ``least_alpha`` (the median depth is then known). A point is
    kept when at least ``least_views`` maps, its own included, show a depth within ``agree_m`` of it. about: (M, 3)
    local points; then the maps are cut out about these and show all Gaussians at once, as a whole scene is seen, and
    the groups are all -1. Returns (P, 3) local points, (P,) int32 groups, (P,) uint16 agreeing views.

    Raises:
        InputError: empty field or no view.
    """
    if len(field) == 0 or not views:
        raise InputError("Depth fusion needs a field with Gaussians and at least one photo; run fit-gaussians first.")
    found, groups, votes = [], [], []
    for group in np.unique(field.groups) if about is None else (-1,):
        own = field.select(field.groups == group) if about is None else field
        place = (own.means if about is None else about).astype(float)
        tried = (_depth_map(own, place, view, least_alpha) for view in views)
        maps = [made for made in tried if made is not None]
        for camera, depth in maps:
            rows, columns = np.nonzero(np.isfinite(depth))
            if not len(rows):
                continue
            rays = camera.pixel_rays()[rows, columns] @ camera.rotation
            points = camera.centre + depth[rows, columns, None] * rays
            agree = np.sum([_agrees(points, other, other_depth, agree_m) for other, other_depth in maps], axis=0)
            keep = agree >= least_views
            found.append(points[keep])
            votes.append(agree[keep].astype(np.uint16))
            groups.append(np.full(int(keep.sum()), group, np.int32))
    if not found:
        return np.empty((0, 3)), np.empty(0, np.int32), np.empty(0, np.uint16)
    return np.concatenate(found), np.concatenate(groups), np.concatenate(votes)


def _depth_map(
    field: GaussianField, about: np.ndarray, view: View, least_alpha: float
) -> tuple[CropCamera, np.ndarray] | None:
    """Pinhole crop around the (M, 3) points and the field's median depth (H, W), NaN where it is not known; None where
    the points are out of sight."""
    pixels, depth = view.project(about)
    inside = view.contains(pixels) & (depth > 0)
    if inside.sum() < 3:
        return None
    crop = crop_around(view, about[inside], margin_px=3.0)
    planes = draw(field.packed, crop, full=True).planes
    return crop, np.where(1 - planes[3] >= max(least_alpha, 0.5), planes[5], np.nan)


def _agrees(points: np.ndarray, camera: CropCamera, depth: np.ndarray, agree_m: float) -> np.ndarray:
    """(P,) bool: the map shows a depth near the point's own."""
    pixels, _ = camera.project(points)
    with np.errstate(invalid="ignore"):
        inside = (
            (pixels[:, 0] >= 0) & (pixels[:, 0] < camera.width) & (pixels[:, 1] >= 0) & (pixels[:, 1] < camera.height)
        )
    result = np.zeros(len(points), bool)
    columns, rows = np.floor(pixels[inside]).astype(int).T
    far = np.linalg.norm(points[inside] - camera.centre, axis=1)
    result[inside] = np.abs(depth[rows, columns] - far) < agree_m
    return result
