"""Three ways from a Gaussian field to points: the samples of the method, and the two baselines of the paper."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..core.errors import ReconstructionError
from ..gaussians.field import GaussianField
from ..gaussians.options import SampleOptions
from ..gaussians.project import CropCamera
from ..gaussians.raster import render
from ..gaussians.sample import sample_surface
from ..reconstruction.cameras import View

#: Depth fusion: pixels this opaque count, and a point is kept when this many other photos show a surface within
#: ``AGREE_M`` of it.
OPAQUE, AGREE_M, LEAST_AGREEING = 0.5, 0.05, 2


def points_of(
    field: GaussianField, views: list[View], how: str, sampling: SampleOptions
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (P, 3) local, opacity (P,), number of their stem (P,). how: ``sample``, ``means`` or ``depth``.

    Raises:
        ReconstructionError: no point is left.
    """
    if how == "sample":
        points = sample_surface(field, views, sampling)
        return points.xyz, points.opacity, points.groups
    if how == "means":
        opacity = np.asarray(field.opacities, np.float32).ravel()
        return field.means.astype(float), opacity, field.groups
    xyz = fuse_depths(field, views)
    if not len(xyz):
        raise ReconstructionError("no rendered depth is confirmed by other photos, so no point is left.")
    nearest = cKDTree(field.means).query(xyz)[1]
    return xyz, np.ones(len(xyz), np.float32), field.groups[nearest]


def fuse_depths(field: GaussianField, views: list[View]) -> np.ndarray:
    """(P, 3) rendered depths of all photos, back-projected, that other photos' rendered depths confirm."""
    drawn = [_depth(field, view) for view in views]
    kept = []
    for number, (camera, depth) in enumerate(drawn):
        row, column = np.nonzero(np.isfinite(depth))
        way = np.column_stack(
            [(column + 0.5 - camera.cx) / camera.fx, (row + 0.5 - camera.cy) / camera.fy, np.ones(len(row))]
        )
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        points = (way * depth[row, column, None]) @ camera.rotation + camera.centre
        agreeing = np.zeros(len(points), int)
        for other, (second, seen) in enumerate(drawn):
            if other == number:
                continue
            local = points @ second.rotation.T + second.translation
            u = np.floor(second.fx * local[:, 0] / local[:, 2] + second.cx).astype(int)
            v = np.floor(second.fy * local[:, 1] / local[:, 2] + second.cy).astype(int)
            inside = (u >= 0) & (u < second.width) & (v >= 0) & (v < second.height) & (local[:, 2] > 0)
            there = seen[v[inside], u[inside]]
            with np.errstate(invalid="ignore"):
                agreeing[inside] += np.abs(there - np.linalg.norm(local[inside], axis=1)) < AGREE_M
        kept.append(points[agreeing >= LEAST_AGREEING])
    return np.concatenate(kept) if kept else np.empty((0, 3))


def _depth(field: GaussianField, view: View) -> tuple[CropCamera, np.ndarray]:
    """Rendered depth over the part of the photo that the field covers, NaN where it is not opaque."""
    c = view.camera
    local = field.means @ view.rotation.T + view.translation
    u, v = c.fx * local[:, 0] / local[:, 2] + c.cx, c.fy * local[:, 1] / local[:, 2] + c.cy
    left, top = max(int(u.min()) - 4, 0), max(int(v.min()) - 4, 0)
    right, bottom = min(int(u.max()) + 4, c.width), min(int(v.max()) + 4, c.height)
    camera = CropCamera(
        max(right - left, 1), max(bottom - top, 1), c.fx, c.fy, c.cx - left, c.cy - top, view.rotation, view.translation
    )
    shown = render(field.packed, camera)
    assert shown.depth is not None
    return camera, np.where(shown.alpha > OPAQUE, shown.depth, np.nan)
