"""Standard error of a diameter from photos, and how far round the stem its photos stand."""

from __future__ import annotations

import numpy as np

from ...quality.priors import USUAL_TAPER
from ..fit.edge_adjustment import FineFit
from ..tuned import OVAL_FREE, OVAL_PRIOR, TAPER_FREE


def scatter_cm(view_r: np.ndarray, weight: np.ndarray) -> float:
    """Standard error of the mean of the photos' diameters. view_r: (V,) radius deviation of each, m, NaN without both
    edges; weight: (V,)."""
    good = (weight > 0) & np.isfinite(view_r)
    if good.sum() < 2:
        return 45.0  # unknown: wider than any stem
    w, d = weight[good], 200 * view_r[good]
    return float(np.sqrt((w * d**2).sum() / w.sum() * (w**2).sum() / w.sum() ** 2))


def formal_error_cm(fine: FineFit) -> tuple[float, float]:
    """Formal error of the diameter without its section's unknown oval, and what that makes of it: no edge errs by it,
    while edges of one stem err together."""
    of_round_m = float(np.sqrt(max(fine.fit_sd_m**2 - fine.oval_sd_m**2, 0.0)))
    return 200 * of_round_m, 200 * fine.oval_sd_m


def seen_oval_error_cm(dbh_cm: float, view_cm: np.ndarray, azimuth: np.ndarray, weight: np.ndarray) -> float:
    """What an oval that the photos show adds to the error of the diameter.

    An oval shows ``1 + e/2 cos 2(azimuth - theta)`` times its diameter: the second harmonic of the photos' diameters,
    fitted with a weak prior, less what their scatter alone would give. view_cm: (V,) what each photo reads beside the
    others, NaN without both edges; azimuth: (V,) radians; weight: (V,).
    """
    good = np.isfinite(view_cm) & (weight > 0.02 * weight.max(initial=0.0))
    if good.sum() < 4:
        return 0.0
    d, w, turn = view_cm[good], weight[good] / weight[good].mean(), 2 * azimuth[good]
    design = np.column_stack([np.ones_like(d), np.cos(turn), np.sin(turn)])
    prior = np.diag([0.0, 1.0, 1.0]) / (OVAL_PRIOR * dbh_cm) ** 2
    scatter = float(np.average((d - np.average(d, weights=w)) ** 2, weights=w))
    for _ in range(6):
        weighed = design * (w / max(scatter, 0.1**2))[:, None]
        covariance = np.linalg.inv(weighed.T @ design + prior)
        found = covariance @ (weighed.T @ d)
        scatter = float((w * (d - design @ found) ** 2).sum() / max(len(d) - 3, 1))
    seen = np.sqrt(max(found[1] ** 2 + found[2] ** 2 - covariance[1, 1] - covariance[2, 2], 0.0))
    return max(float(seen) - OVAL_FREE * dbh_cm, 0.0)


def taper_excess_cm(r1: float) -> float:
    """By how much a taper is beyond what is usual, cm over a metre: some of the edges are then not the stem's. r1:
    slope of the radius, m/m."""
    return 200 * max(abs(r1 - USUAL_TAPER) - TAPER_FREE, 0.0)


def azimuth_spread(azimuth: np.ndarray) -> float:
    """Degrees of the circle between the views' azimuths: 360 minus the largest gap."""
    if len(azimuth) < 2:
        return 0.0
    ordered = np.sort(np.degrees(azimuth) % 360)
    gaps = np.diff(np.append(ordered, ordered[0] + 360))
    return float(360 - gaps.max())
