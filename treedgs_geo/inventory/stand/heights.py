"""Heights for trees that have none: a height-diameter curve fitted to the survey's own heights, or a published one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ...stems.quality.priors import BREAST_HEIGHT_M

#: A curve from fewer heights, or over a narrower range of DBH (largest / smallest), says more about chance than trees.
MIN_HEIGHTS, MIN_SPREAD = 10, 1.5


@dataclass(frozen=True)
class HeightCurve:
    """h = bh + (d / (a + b d))^2 (Naslund 1936), d in cm, h in m.

    rmse_m: root mean square residual (n - 2 degrees of freedom). low_cm, high_cm: DBHs it was fitted to.
    """

    a: float
    b: float
    breast_height_m: float
    n: int
    rmse_m: float
    low_cm: float
    high_cm: float

    def __call__(self, dbh_cm: np.ndarray) -> np.ndarray:
        """Heights, m."""
        d = np.asarray(dbh_cm, float)
        return self.breast_height_m + (d / (self.a + self.b * d)) ** 2

    def outside(self, dbh_cm: np.ndarray) -> np.ndarray:
        """True where the curve is used beyond the DBHs it was fitted to."""
        d = np.asarray(dbh_cm, float)
        return (d < self.low_cm) | (d > self.high_cm)

    @property
    def text(self) -> str:
        """The curve with its numbers."""
        return f"h = {self.breast_height_m:g} + (d / ({self.a:.4f} + {self.b:.4f} d))²"


def fit_curve(
    dbh_cm: np.ndarray, height_m: np.ndarray, breast_height_m: float = BREAST_HEIGHT_M, min_heights: int = MIN_HEIGHTS
) -> tuple[HeightCurve | None, str]:
    """Fit by least squares on the heights themselves, so that their mean is met; outliers count less (soft L1 at 2 m).

    Returns:
        the curve, or None with the reason why there is none.
    """
    d, h = np.asarray(dbh_cm, float), np.asarray(height_m, float)
    use = np.isfinite(d) & np.isfinite(h) & (h > breast_height_m + 0.3) & (d > 0)
    d, h = d[use], h[use]
    if len(d) < min_heights:
        return None, f"{len(d)} trees with DBH and height, a curve needs {min_heights}"
    if d.max() < MIN_SPREAD * d.min():
        return None, f"heights only of trees from {d.min():.1f} to {d.max():.1f} cm DBH, too narrow for a curve"
    # Linear in a and b after the transformation: where the search starts.
    start = np.polyfit(d, d / np.sqrt(h - breast_height_m), 1)[::-1]
    start = np.clip(start, [1e-3, 1e-3], [1e3, 1e3])

    def residual(p: np.ndarray) -> np.ndarray:
        return breast_height_m + (d / (p[0] + p[1] * d)) ** 2 - h

    found = least_squares(
        residual, start, bounds=([1e-6, 1e-6], [1e4, 1e4]), loss="soft_l1", f_scale=2.0, x_scale=start
    )
    rmse = float(np.sqrt(np.sum(residual(found.x) ** 2) / max(len(d) - 2, 1)))
    a, b = (float(value) for value in found.x)
    curve = HeightCurve(a, b, breast_height_m, len(d), rmse, float(d.min()), float(d.max()))
    return curve, ""
