"""Diameter over height: the published taper RANSAC, and a robust constant, line or line with butt swell, chosen by an
information criterion with priors on the slope and the swell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True)
class TaperRansac:
    """Constants of eq:taper. cm and m as named."""

    threshold_cm: float = 2.0
    trials: int = 1000
    samples: int = 3
    least_inliers: int = 10
    steepest_cm_m: float = 0.3
    first_top_m: float = 1.8
    step_m: float = 0.5


@dataclass(frozen=True)
class Taper:
    """d(h) = at_bh + slope (h - bh) [+ butt]. Diameters cm, heights m. inliers: (S,) bool over the slices given.
    model: constant, linear or butt; butt_cm: swell at the ground (:func:`taper_line`)."""

    at_bh_cm: float
    slope_cm_m: float
    se_cm: float
    inliers: np.ndarray
    model: str
    butt_cm: float = 0.0


def taper_ransac(
    heights_m: np.ndarray, diameters_cm: np.ndarray, bh_m: float, options: TaperRansac | None = None, seed: int = 0
) -> Taper | None:
    """Published taper fit (eq:taper, eq:dbh_final) over height ranges that grow until the inliers are stable.

    A range is accepted when its inliers, as far as the next range's line goes, stay inliers. ``None``: no range has
    enough inlier slices with a slope in [-steepest, 0).
    """
    options = options or TaperRansac()
    finite = np.isfinite(diameters_cm)
    if finite.sum() < options.least_inliers:
        return None
    rng = np.random.default_rng(seed)
    previous: Taper | None = None
    top = options.first_top_m
    limit = heights_m[finite].max()
    while True:
        inside = finite & (heights_m <= top)
        current = _ransac_line(heights_m, diameters_cm, inside, bh_m, options, rng)
        if previous is not None and current is not None and not (previous.inliers & ~current.inliers).any():
            return previous
        if current is not None:
            previous = current
        if top >= limit:
            return previous
        top += options.step_m


def _ransac_line(
    h: np.ndarray, d: np.ndarray, inside: np.ndarray, bh_m: float, options: TaperRansac, rng: np.random.Generator
) -> Taper | None:
    index = np.flatnonzero(inside)
    if len(index) < options.least_inliers:
        return None
    x, y = h[index] - bh_m, d[index]
    draws = np.argsort(rng.random((options.trials, len(index))), axis=1)[:, : options.samples]
    xs, ys = x[draws], y[draws]
    xm, ym = xs.mean(axis=1), ys.mean(axis=1)
    below = ((xs - xm[:, None]) ** 2).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = ((xs - xm[:, None]) * (ys - ym[:, None])).sum(axis=1) / below
    base = ym - slope * xm
    valid = np.isfinite(slope) & (slope < 0) & (slope >= -options.steepest_cm_m)
    if not valid.any():
        return None
    slope, base = slope[valid], base[valid]
    near = np.abs(y[None] - base[:, None] - slope[:, None] * x[None]) <= options.threshold_cm
    best = int(np.argmax(near.sum(axis=1)))
    chosen = near[best]
    if chosen.sum() < options.least_inliers:
        return None
    # The usual final least squares over the inliers, kept only where it obeys the slope bound.
    fit = np.polyfit(x[chosen], y[chosen], 1)
    if -options.steepest_cm_m <= fit[0] < 0:
        line = float(fit[1]), float(fit[0])
    else:
        line = float(base[best]), float(slope[best])
    residual = y[chosen] - line[0] - line[1] * x[chosen]
    spread = float(np.sqrt((residual**2).sum() / max(chosen.sum() - 2, 1)))
    xbar = x[chosen].mean()
    se = spread * np.sqrt(1 / chosen.sum() + xbar**2 / max(((x[chosen] - xbar) ** 2).sum(), 1e-9))
    inliers = np.zeros(len(h), bool)
    inliers[index[chosen]] = True
    return Taper(line[0], line[1], float(se), inliers, "linear")


#: Butt swell: diameter added at the ground by the prior's sd (cm), and the height over which it falls to a third (m).
BUTT_SD_CM, BUTT_M = 12.0, 0.3
#: Slope of the planted-pine profile and its sd, cm/m; no slice is better than this, cm.
_PRIOR_CM_M, _PRIOR_SD_CM_M, _FLOOR_CM = -1.0, 0.6, 0.2
#: Slices below this height are needed before a swell is considered, m: above it there is none to see.
BUTT_SEEN_M = 0.7


def taper_line(
    heights_m: np.ndarray, diameters_cm: np.ndarray, se_cm: np.ndarray, bh_m: float, slices_per_independent: float = 1.0
) -> Taper | None:
    """Robust weighted profile through slice diameters: constant, linear, or linear + butt, by a corrected AIC.

    d(h) = a + b (h - bh) + c (exp(-h / 0.3) - exp(-bh / 0.3)). se_cm: (S,) per slice. slices_per_independent: how
    many overlapping slices make one independent one. Priors: b from the planted-pine profile, c = 0 with sd 12 cm.
    ``slope_cm_m`` is b, ``butt_cm`` c. ``None`` with fewer than three usable slices.
    """
    usable = np.isfinite(diameters_cm) & np.isfinite(se_cm) & (se_cm > 0)
    if usable.sum() < 3:
        return None
    h, y, s = heights_m[usable], diameters_cm[usable], np.hypot(se_cm[usable], _FLOOR_CM)
    columns = np.column_stack([np.ones_like(h), h - bh_m, np.exp(-h / BUTT_M) - np.exp(-bh_m / BUTT_M)])
    mean, sd = np.array([0.0, _PRIOR_CM_M, 0.0]), np.array([np.inf, _PRIOR_SD_CM_M, BUTT_SD_CM])
    models = {"constant": 1, "linear": 2}
    if (h < BUTT_SEEN_M).sum() >= 2 and (h > bh_m).sum() >= 3:
        models["butt"] = 3
    best: tuple[float, Taper] | None = None
    for model, k in models.items():
        basis = np.ascontiguousarray(columns[:, :k])
        precision = 1.0 / sd[:k] ** 2
        line, normal, residual, robust, scale = _robust_line(
            basis, y, s, precision, precision * mean[:k], slices_per_independent
        )
        count = max(robust.sum() / slices_per_independent, 3.0)
        chi2 = float((np.minimum(residual**2, (4.7 * scale) ** 2)).sum() / slices_per_independent)
        chi2 += float((precision * (line - mean[:k]) ** 2).sum())
        criterion = chi2 + 2 * k + 2 * k * (k + 1) / max(count - k - 1, 1.0)
        inflation = max(1.0, float((robust * residual**2).sum() / max(robust.sum() - k, 1.0)))
        se = float(np.sqrt(np.linalg.inv(normal)[0, 0] * inflation))
        inliers = np.zeros(len(heights_m), bool)
        inliers[np.flatnonzero(usable)[robust > 0]] = True
        full = np.r_[line, np.zeros(3 - k)]
        taper = Taper(float(full[0]), float(full[1]), se, inliers, model, float(full[2]))
        if best is None or criterion < best[0]:
            best = criterion, taper
    assert best is not None
    return best[1]


@njit(cache=True, nogil=True)
def _robust_line(basis, y, s, precision, pull, shared):  # pragma: no cover - compiled
    """Bisquare re-weighted least squares with a prior: line (K,), normal (K, K), residuals and weights (S,), scale."""
    n, k = basis.shape
    robust, residual, size = np.ones(n), np.empty(n), np.empty(n)
    normal, right = np.empty((k, k)), np.empty(k)
    scale = 1.0
    for _ in range(30):
        normal[:] = np.diag(precision)
        right[:] = pull
        for m in range(n):
            weight = robust[m] / (s[m] * s[m]) / shared
            for a in range(k):
                right[a] += weight * basis[m, a] * y[m]
                for b in range(k):
                    normal[a, b] += weight * basis[m, a] * basis[m, b]
        line = np.linalg.solve(normal, right)
        for m in range(n):
            value = y[m]
            for a in range(k):
                value -= basis[m, a] * line[a]
            residual[m] = value / s[m]
            size[m] = abs(residual[m])
        scale = max(1.4826 * np.median(size), 1.0)
        moved = 0.0
        for m in range(n):
            share = max(1 - (residual[m] / (4.7 * scale)) ** 2, 0.0) ** 2
            moved = max(moved, abs(share - robust[m]))
            robust[m] = share
        if moved < 1e-7:
            break
    return line, normal, residual, robust, scale
