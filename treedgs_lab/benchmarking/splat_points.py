"""Three ways from a Gaussian field to points: the samples of the method, and the two baselines of the paper."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.splats.baseline_points import fuse_depth
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.options import SampleOptions
from treedgs_geo.stems.splats.sample import sample_surface

#: Depth fusion over all Gaussians at once: a point is kept when so many photos, its own included, show a surface there.
AGREEING = 3


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
    xyz = fuse_depth(field, views, least_views=AGREEING, about=field.means.astype(float))[0]
    if not len(xyz):
        raise ReconstructionError("no rendered depth is confirmed by other photos, so no point is left.")
    nearest = cKDTree(field.means).query(xyz)[1]
    return xyz, np.ones(len(xyz), np.float32), field.groups[nearest]
