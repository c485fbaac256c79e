"""Synthetic stems and plots for the point-cloud tests: known diameters, seeded noise."""

from __future__ import annotations

import numpy as np


def stem_points(
    rng,
    dbh_cm,
    count=300,
    noise_m=0.01,
    arc_deg=360.0,
    lean=(0.0, 0.0),
    taper_cm_m=1.0,
    low=0.2,
    high=5.0,
    xy=(0.0, 0.0),
    bh_m=1.37,
    filled=False,
    lobes=0.0,
):
    """(count, 3) points on the bark of a leaning, tapering stem, z above ground; ``filled``: over the whole disc."""
    h = rng.uniform(low, high, count)
    angle = rng.uniform(0, np.radians(arc_deg), count)
    radius = (dbh_cm - taper_cm_m * (h - bh_m)) / 200 * (1 + lobes * np.cos(3 * angle))
    if filled:
        radius = radius * np.sqrt(rng.uniform(0, 1, count))
    radius = radius + rng.normal(0, noise_m, count)
    slope = np.hypot(*lean)
    direction = np.array(lean) / slope if slope > 0 else np.array([1.0, 0.0])
    circle = np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]
    # The cross-section is round across the axis: along the lean it is stretched in the horizontal plane.
    along = circle @ direction
    circle = circle + np.outer(along * (np.sqrt(1 + slope**2) - 1), direction)
    return np.column_stack([circle + np.asarray(xy) + np.outer(h - bh_m, lean), h])


def plot_cloud(rng, stems, size_m=12.0, slope=0.05, per_m2=150, bark=250, shrubs=400, noise_m=0.01, relief=None):
    """A plot on a slope: ``stems`` = [(x, y, dbh_cm), ...]; returns (N, 3) with absolute heights around 100 m.

    Ground with 1 cm noise, bark up to 8 m, leaves from 8 to 14 m, shrub points below 1 m away from the stems.
    relief: (N,) metres that the ground rises over (N, 2) places, instead of the slope.
    """
    ground_xy = rng.uniform(0, size_m, (int(per_m2 * size_m**2), 2))

    def ground(xy):
        return 100 + (slope * xy[:, 0] if relief is None else relief(xy)) + 0.1 * np.sin(xy[:, 1] / 3)

    parts = [np.column_stack([ground_xy, ground(ground_xy) + rng.normal(0, 0.01, len(ground_xy))])]
    for x, y, dbh in stems:
        points = stem_points(rng, dbh, bark, noise_m, high=8.0, xy=(x, y), taper_cm_m=0.8)
        foot = ground(np.array([[x, y]]))[0]
        points[:, 2] += foot
        parts.append(points)
        crown = np.column_stack([rng.normal(x, 0.8, 300), rng.normal(y, 0.8, 300), foot + rng.uniform(8, 14, 300)])
        parts.append(crown)
    shrub = rng.uniform(0, size_m, (shrubs, 2))
    parts.append(np.column_stack([shrub, ground(shrub) + rng.uniform(0.1, 1.0, shrubs)]))
    return np.concatenate(parts)
