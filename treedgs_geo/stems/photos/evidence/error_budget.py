"""Standard error of a diameter from photos, and how far round the stem its photos stand."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from ...quality.priors import OVAL_SD, USUAL_TAPER
from ..fit.edge_adjustment import FineFit
from ..tuned import OVAL_FREE, OVAL_PRIOR, OVAL_SEEN, SE_FORMAL, SE_SCATTER, TAPER_FREE, TAPER_REACH_M


def standard_error_cm(fine: FineFit, weight: np.ndarray, px_cm: float, n_views: int) -> float:
    """Standard error of the diameter, given that the right edges were found: three parts, scaled on rendered plots.

    The scatter of the photos' diameters, more where they are few (Student's t against the normal at 90 %); the formal
    error of the fit, which few and coarse edges make large; and a part of a pixel (``px_cm`` centimetres at the stem)
    over the number of clear photos, for what all of them share.
    """
    good = (weight > 0) & np.isfinite(fine.view_r)
    if good.sum() < 2:
        return 99.0
    w, d = weight[good], 200 * fine.view_r[good]
    n = max(w.sum() ** 2 / (w**2).sum(), 1.0)
    few = float(stdtrit(max(n - 1.0, 1.0), 0.95)) / 1.645
    scatter = few * np.sqrt((w * d**2).sum() / w.sum() / n)
    return float(np.linalg.norm([SE_SCATTER * scatter, formal_error_cm(fine), px_cm / max(n_views, 1)]))


def formal_error_cm(fine: FineFit) -> float:
    """Formal standard error of the diameter, times ``SE_FORMAL``: edges of one stem err together. What its unknown
    oval makes of it counts once, since no edge errs by it."""
    of_round_m = np.sqrt(max(fine.fit_sd_m**2 - fine.oval_sd_m**2, 0.0))
    return 200 * float(np.hypot(SE_FORMAL * of_round_m, fine.oval_sd_m))


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
    return OVAL_SEEN * max(float(seen) - OVAL_FREE * dbh_cm, 0.0)


def taper_error_cm(r1: float) -> float:
    """What an unusual taper adds to the error of the diameter: some of the edges are then not the stem's. r1: slope of
    the radius, m/m."""
    return 200 * TAPER_REACH_M * max(abs(r1 - USUAL_TAPER) - TAPER_FREE, 0.0)


def azimuth_spread(azimuth: np.ndarray) -> float:
    """Degrees of the circle between the views' azimuths: 360 minus the largest gap."""
    if len(azimuth) < 2:
        return 0.0
    ordered = np.sort(np.degrees(azimuth) % 360)
    gaps = np.diff(np.append(ordered, ordered[0] + 360))
    return float(360 - gaps.max())
