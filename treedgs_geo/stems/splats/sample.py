"""Surface points with a reliability: opacity-guided sampling and point-wise opacity (``paper.tex``
sec:opacity_sampling).

Candidates are drawn inside each Gaussian (eq:opacity_sampling) and scored in every view by the opacity that lies in
front of them along the ray; the score kept is the smallest over the views whose rendering is not background there
(eq:opacity_reliability). Three things differ from the released code that the paper builds on, each on purpose:

* points and Gaussians are projected by one pixel convention (a half-pixel slip between them erodes stems from all
  sides);
* the product of (1 - alpha) needs no order, so there is no list of limited length to overflow;
* a point that no view sees is not "opaque in every view": views with transmittance left in front of it are counted
  (``n_seen``), and Gaussians without any are dropped, never scored 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...core.errors import InputError
from ...core.progress import Reporter
from ...core.seeding import own_seed
from ...reconstruction.cameras import View
from .field import GaussianField
from .options import SampleOptions
from .point_kernels import TILE_PX, opacity_before, tile_lists
from .project import CropCamera
from .raster import project

#: Points scored at once: bounds memory (one opacity per point and photo where a quantile is asked for).
CHUNK = 400_000


@dataclass(frozen=True)
class SurfacePoints:
    """Points on and in the Gaussians.

    xyz: (P, 3) float64, local frame. opacity: (P,) float32, smallest (or a low quantile of) opacity in front of the
    point over its foreground views. n_views: (P,) uint16 foreground views. n_seen: (P,) uint16 views that see the
    point. groups: (P,) int32 stem of the Gaussian. n_dropped: Gaussians dropped because no view sees them.
    """

    xyz: np.ndarray
    opacity: np.ndarray
    n_views: np.ndarray
    n_seen: np.ndarray
    groups: np.ndarray
    n_dropped: int = 0

    def __len__(self) -> int:
        return len(self.xyz)


def draw_candidates(field: GaussianField, samples: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """eq:opacity_sampling: (P, 3) float64 points and (P,) int64 the Gaussian each came from.

    M Bernoulli(alpha) draws a Gaussian keep Binomial(M, alpha) points, so the count is drawn first and only kept
    points are made. Each group of the field (a stem) is seeded by itself: its points do not depend on the others.
    """
    sources, offsets = [np.empty(0, np.int64)], [np.empty((0, 3))]
    for group in np.unique(field.groups):
        own = np.flatnonzero(field.groups == group)
        rng = np.random.default_rng(own_seed(seed, field.means[own]))
        sources.append(np.repeat(own, rng.binomial(samples, field.opacities[own].astype(float))))
        offsets.append(rng.standard_normal((len(sources[-1]), 3)))
    source = np.concatenate(sources)
    offset = np.concatenate(offsets) * field.scales[source]
    return field.means[source].astype(float) + np.einsum("pij,pj->pi", field.rotations[source], offset), source


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
    camera = view.camera
    if not inside.any():
        return opacity, foreground
    local = points[inside] @ view.rotation.T + view.translation
    u = camera.fx * local[:, 0] / local[:, 2] + camera.cx
    v = camera.fy * local[:, 1] / local[:, 2] + camera.cy
    # One pixel more on each side: Gaussians that reach a point but no pixel centre must not be culled.
    corner_u, corner_v = np.floor(u.min()) - 1, np.floor(v.min()) - 1
    width, height = int(u.max() - corner_u) + 2, int(v.max() - corner_v) + 2
    crop = CropCamera(
        width, height, camera.fx, camera.fy, camera.cx - corner_u, camera.cy - corner_v, view.rotation, view.translation
    )
    projected, _ = project(parameters, crop)
    tiles_x, tiles_y = width // TILE_PX + 1, height // TILE_PX + 1
    start, items = tile_lists(projected, tiles_x, tiles_y)
    u, v = u - corner_u, v - corner_v
    tile = (v // TILE_PX).astype(np.int64) * tiles_x + (u // TILE_PX).astype(np.int64)
    order = np.argsort(tile, kind="stable")
    point_start = np.searchsorted(tile[order], np.arange(tiles_x * tiles_y + 1))
    rays = np.stack([u, v, np.linalg.norm(local, axis=1)])[:, order].astype(np.float32)
    before, met = np.empty(len(order), np.float32), np.empty(len(order), np.int32)
    opacity_before(projected, start, items, point_start, rays, before, met)
    index = np.flatnonzero(inside)[order]
    opacity[index], foreground[index] = before, met > 0
    return opacity, foreground


def sample_surface(
    field: GaussianField, views: Sequence[View], options: SampleOptions | None = None, reporter: Reporter | None = None
) -> SurfacePoints:
    """Sample the field and score each point against every view.

    Raises:
        InputError: the field is empty, or no view shows any of it.
    """
    options, reporter = options or SampleOptions(), reporter or Reporter()
    if len(field) == 0:
        raise InputError(
            "The Gaussian field is empty, so there is no surface to sample; run fit-gaussians on stems the photos show."
        )
    if not views:
        raise InputError("There is no registered photo to score surface points with; run reconstruct first.")
    points, source = draw_candidates(field, options.samples, options.seed)
    parameters = field.packed
    best = np.ones(len(points), np.float32)
    n_views, n_seen = np.zeros(len(points), np.uint16), np.zeros(len(points), np.uint16)
    blocks = [slice(i, i + CHUNK) for i in range(0, len(points), CHUNK)]
    with ThreadPoolExecutor(options.threads) as pool:
        for number, block in enumerate(blocks):
            own = points[block]
            scored = pool.map(lambda view, own=own: view_opacity(parameters, view, own), views)
            least = np.full(len(own), np.inf, np.float32)
            for done, (opacity, foreground) in enumerate(scored, start=1):
                least = np.minimum(least, np.where(foreground, opacity, np.inf))
                n_views[block] += foreground
                n_seen[block] += foreground & (1 - opacity > options.seen_transmittance)
                reporter.progress((number + done / len(views)) / len(blocks))
            best[block] = np.where(np.isfinite(least), least, 1)
    seen_by_gaussian = np.zeros(len(field), bool)
    seen_by_gaussian[source[n_seen > 0]] = True
    keep = (n_views > 0) & (best > 0)
    dropped = 0
    if options.seen_transmittance > 0:
        keep &= seen_by_gaussian[source]
        dropped = int(np.count_nonzero(~seen_by_gaussian[np.unique(source)]))
    if not keep.any():
        raise InputError(
            "None of the photos shows any of the Gaussians, so no surface point can be scored; check that the field "
            "and the photos belong together."
        )
    return SurfacePoints(points[keep], best[keep], n_views[keep], n_seen[keep], field.groups[source[keep]], dropped)
