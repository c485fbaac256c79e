"""Surface points with a reliability: opacity-guided sampling and point-wise opacity (``paper.tex``
sec:opacity_sampling).

Candidates are drawn inside each Gaussian (eq:opacity_sampling) and scored in every view by the opacity that lies in
front of them along the ray; the score kept is the smallest over the views whose rendering is not background there
(eq:opacity_reliability). Two things differ from the released code that the paper builds on, each on purpose:

* points and Gaussians are projected by one pixel convention (a half-pixel slip between them erodes stems from all
  sides);
* the product of (1 - alpha) needs no order, so there is no list of limited length to overflow.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch

from ....core.errors import InputError
from ....core.progress import Reporter
from ....core.seeding import own_seed
from ....pointcloud.cloud import PointCloud
from ....reconstruction.cameras import View
from ..camera import CropCamera
from ..field import GaussianField
from ..options import SampleOptions
from ..point_kernels import opacity_before
from .project import TILE_PX, lists_by_tile
from .rasterize import projected

#: Points scored at once: bounds memory.
CHUNK = 400_000


def draw_candidates(field: GaussianField, samples: int, seed: int) -> np.ndarray:
    """eq:opacity_sampling: (P, 3) float64 points.

    M Bernoulli(alpha) draws a Gaussian keep Binomial(M, alpha) points, so the count is drawn first and only kept
    points are made. Seeded by the field's own centres, too.
    """
    rng = np.random.default_rng(own_seed(seed, field.means))
    source = np.repeat(np.arange(len(field)), rng.binomial(samples, field.opacities.astype(float)))
    offset = rng.standard_normal((len(source), 3)) * field.scales[source]
    return field.means[source].astype(float) + np.einsum("pij,pj->pi", field.rotations[source], offset)


def view_opacity(parameters: np.ndarray, view: View, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Opacity in front of each point in one view.

    parameters: (N, 14). points: (P, 3). Returns (P,) float32 opacity and (P,) bool foreground (the point lies inside
    the photo and Gaussians cover its ray). The accumulated alpha is evaluated on
    the ray through the point itself rather than at the nearest pixel centre, so no rounding can put a thin stem's
    points off it.
    """
    opacity, foreground = np.ones(len(points), np.float32), np.zeros(len(points), bool)
    pixels, depth = view.project(points)
    inside = view.contains(pixels) & (depth > 0)
    if not inside.any():
        return opacity, foreground
    whole = CropCamera.of(view)
    local = points[inside] @ view.rotation.T + view.translation
    u, v = whole.project(points[inside])[0].T
    # One pixel more on each side: Gaussians that reach a point but no pixel centre must not be culled.
    left, top = int(np.floor(u.min())) - 1, int(np.floor(v.min())) - 1
    u, v = u - left, v - top
    width, height = int(u.max()) + 2, int(v.max()) + 2
    rows = projected(parameters, whole.part(left, top, width, height))
    start, items, tiles_x = lists_by_tile(torch.from_numpy(rows), width, height)
    tile = (v // TILE_PX).astype(np.int64) * tiles_x + (u // TILE_PX).astype(np.int64)
    order = np.argsort(tile, kind="stable")
    point_start = np.searchsorted(tile[order], np.arange(len(start)))
    rays = np.stack([u, v, np.linalg.norm(local, axis=1)])[:, order].astype(np.float32)
    before, met = np.empty(len(order), np.float32), np.empty(len(order), np.int32)
    opacity_before(rows, start.numpy(), items.numpy(), point_start, rays, before, met)
    index = np.flatnonzero(inside)[order]
    opacity[index], foreground[index] = before, met > 0
    return opacity, foreground


def sample_surface(
    field: GaussianField, views: Sequence[View], options: SampleOptions | None = None, reporter: Reporter | None = None
) -> PointCloud:
    """Points on and in the Gaussians, local frame, scored against every view: ``opacity`` float32, the smallest in
    front of the point over its foreground views; ``n_views`` uint16, these.

    Raises:
        InputError: the field is empty, or no view shows any of it.
    """
    options, reporter = options or SampleOptions(), reporter or Reporter()
    if len(field) == 0:
        raise InputError("The Gaussian field is empty, so there is no surface to sample; run fit-gaussians again.")
    if not views:
        raise InputError("There is no registered photo to score surface points with; run reconstruct first.")
    points, parameters = draw_candidates(field, options.samples, options.seed), field.packed
    best, n_views = np.ones(len(points), np.float32), np.zeros(len(points), np.uint16)
    blocks = [slice(i, i + CHUNK) for i in range(0, len(points), CHUNK)]
    with ThreadPoolExecutor(options.threads) as pool:
        for number, block in enumerate(blocks):
            own = points[block]
            scored = pool.map(lambda view, own=own: view_opacity(parameters, view, own), views)
            least = np.full(len(own), np.inf, np.float32)
            for done, (opacity, foreground) in enumerate(scored, start=1):
                least = np.minimum(least, np.where(foreground, opacity, np.inf))
                n_views[block] += foreground
                reporter.progress((number + done / len(views)) / len(blocks))
            best[block] = np.where(np.isfinite(least), least, 1)
    keep = (n_views > 0) & (best > 0)
    if not keep.any():
        raise InputError(
            "None of the photos shows any of the Gaussians, so no surface point can be scored; check that the field "
            "and the photos belong together."
        )
    return PointCloud(points[keep], attributes={"opacity": best[keep], "n_views": n_views[keep]})
