"""Points spread evenly over a stem and its surroundings, scored like surface points.

Points drawn inside Gaussians say where Gaussians are, fog included. Where opacity *ends* can only be read off points
that also lie where there is nothing: here they fill the cylinder that a stem's Gaussians take up, whatever the
Gaussians do in it. Each stem is scored against its own Gaussians, because it was fitted without the others, and in the
photos that look at it from the side.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...core.errors import InputError
from ...core.progress import Reporter
from ...reconstruction.cameras import View
from .bands import choose_views
from .field import GaussianField
from .options import SampleOptions
from .sample import SurfacePoints, view_opacity

#: Points of one stem for every candidate that a Gaussian would get: 100 candidates make 20,000 points.
POINTS_A_SAMPLE = 200
#: Opacity kept of a point: this quantile over the views. The smallest is that of the one view with a wrong pose.
QUANTILE = 0.2
#: Most views a stem is scored in.
MOST_VIEWS = 32


def cylinder_points(means: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 3) points, even over the upright cylinder about Gaussians' centres (N, 3)."""
    middle = np.median(means[:, :2], axis=0)
    away = np.hypot(*(means[:, :2] - middle).T)
    radius = float(np.percentile(away, 98)) + 0.02
    low, high = np.percentile(means[:, 2], [1, 99])
    r, angle = radius * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack(
        [middle[0] + r * np.cos(angle), middle[1] + r * np.sin(angle), low + (high - low) * rng.random(count)]
    )


def low_quantile(opacity: np.ndarray, n_views: np.ndarray, quantile: float) -> np.ndarray:
    """(P,) the ``quantile`` of (V, P) opacities, +inf where a view does not count; 1 where none does."""
    opacity.sort(axis=0)
    rank = np.floor(quantile * np.maximum(n_views.astype(int) - 1, 0)).astype(int)
    kept = np.take_along_axis(opacity, rank[None], axis=0)[0]
    return np.where(np.isfinite(kept), kept, 1).astype(np.float32)


def sample_volume(
    field: GaussianField, views: Sequence[View], options: SampleOptions | None = None, reporter: Reporter | None = None
) -> SurfacePoints:
    """Spread points over each stem of the field and score them.

    Raises:
        InputError: the field is empty, there is no view, or no view shows any of it.
    """
    options, reporter = options or SampleOptions(), reporter or Reporter()
    if len(field) == 0:
        raise InputError(
            "The Gaussian field is empty, so there is no volume to sample; run fit-gaussians on stems the photos show."
        )
    if not views:
        raise InputError("There is no registered photo to score points with; run reconstruct first.")
    stems = np.unique(field.groups)

    def work(stem: int) -> SurfacePoints:
        own = field.select(field.groups == stem)
        rng = np.random.default_rng([options.seed, stem + 1])
        points = cylinder_points(own.means.astype(float), POINTS_A_SAMPLE * options.samples, rng)
        parameters = own.packed
        kept, n_seen = [], np.zeros(len(points), np.uint16)
        for index in choose_views(views, points.mean(axis=0), MOST_VIEWS):
            opacity, foreground, _ = view_opacity(parameters, views[index], points)
            kept.append(np.where(foreground, opacity, np.inf))
            n_seen += foreground & (1 - opacity > options.seen_transmittance)
        opacity = np.array(kept, np.float32)
        n_views = np.isfinite(opacity).sum(axis=0).astype(np.uint16)
        # A point that no photo shows Gaussians at has nothing in front of it.
        value = np.where(n_views > 0, low_quantile(opacity, n_views, QUANTILE), 0).astype(np.float32)
        return SurfacePoints(points, value, n_views, n_seen, np.full(len(points), stem, np.int32))

    parts = []
    with ThreadPoolExecutor(options.threads) as pool:
        for done, part in enumerate(pool.map(work, stems.tolist()), start=1):
            parts.append(part)
            reporter.progress(done / len(stems))
    if not any((part.n_views > 0).any() for part in parts):
        raise InputError(
            "None of the photos shows any of the Gaussians, so no point can be scored; check that the field and the "
            "photos belong together."
        )

    def whole(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts])

    return SurfacePoints(whole("xyz"), whole("opacity"), whole("n_views"), whole("n_seen"), whole("groups"))
