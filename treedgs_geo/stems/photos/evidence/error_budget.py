"""Standard error of a diameter from photos, and how far round the stem its photos stand."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from ...quality.priors import OVAL_SD, USUAL_TAPER
from ..fit.edge_adjustment import FineFit
from ..quality_control import ErrorParts
from ..tuned import OVAL_FREE, OVAL_PRIOR, TAPER_FREE


def scatter_cm(view_r: np.ndarray, weight: np.ndarray) -> float:
    """Standard error of the mean of the photos' diameters, larger where they are few (Student's t against the normal
    at 90 %). view_r: (V,) radius deviation of each, m, NaN without both edges; weight: (V,)."""
    good = (weight > 0) & np.isfinite(view_r)
    if good.sum() < 2:
        return 45.0  # unknown: wider than any stem
    w, d = weight[good], 200 * view_r[good]
    n = max(w.sum() ** 2 / (w**2).sum(), 1.0)
    few = float(stdtrit(max(n - 1.0, 1.0), 0.95)) / 1.645
    return few * float(np.sqrt((w * d**2).sum() / w.sum() / n))


def formal_error(fine: FineFit) -> ErrorParts:
    """What the fit itself says; what its unknown oval makes of it is apart, since no edge errs by it, while edges of
    one stem err together."""
    of_round_m = float(np.sqrt(max(fine.fit_sd_m**2 - fine.oval_sd_m**2, 0.0)))
    return ErrorParts(formal=200 * of_round_m, oval=200 * fine.oval_sd_m)


def oval_error_cm(dbh_cm: float, azimuth: np.ndarray, weight: np.ndarray) -> float:
    """What a stem's unknown oval adds to the error of a round fit, for photos from unevenly spread directions.

    Stems are oval by some per cent, and an oval is ``1 + e/2 cos 2(azimuth - theta)`` wide. Photos all round average
    that to girth over pi (Cauchy); photos along one line see one width. ``azimuth``: (V,) radians, ``weight``: (V,).
    """
    total = float(weight.sum())
    if total <= 0:
        return 0.0
    return float(OVAL_SD * dbh_cm * np.abs((weight * np.exp(2j * azimuth)).sum()) / total)


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
