"""What the bark on a fitted cone shows: noise, arc and shape of the section, and the error of the diameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.cone import Cone
from ...geometry.ellipse import fit_ellipse
from ...geometry.section_kernels import SECTORS, bark_weights, lobes
from ...geometry.slices import across_axis
from ...geometry.taper import Taper
from ..propose.evidence import LEAST_OF_USUAL, usual
from ..propose.sensors import Sensor

#: Out-of-roundness of real stems, share of the radius (1 sd of a 60 degree sector).
ROUNDNESS = 0.02
#: Error that no cloud resolves: bark, ground height, breast height (cm), and the share of the diameter it grows by.
FLOOR_CM, FLOOR_SHARE = 0.25, 0.010
#: Error of terrestrial scans that the spread of the points about the bark shows, share of it on the diameter: where
#: walks with a mobile scanner drift, the walls of a stem do not lie where the stem is, however many points show them
#: (even seeds of ``docs/results/dense_clouds.json``).
DRIFT_SHARE = 0.25
#: The same of half rings, share of the shape's error on top of it, below this arc.
HALF_RING, HALF_RING_DEG = 0.75, 200.0
#: What of each part counts in the error of drone LiDAR (``treedgs_lab/benchmarks/clouds/interval_coverage.py``): the
#: fit at the noise the points have, its clutter, the shape that shows, the slices, a share of the diameter, and a
#: floor, cm: flight lines are off by a centimetre each, one side of the bark against the other, which the spread of the
#: points hardly shows.
ULS_FIT, ULS_SHAPE, ULS_HEIGHT, ULS_SHARE, ULS_FLOOR_CM = 1.0, 0.5, 0.25, 0.004, 0.5
#: A ring thicker than bark usually is in drone LiDAR, m, may be bark under moss or leaves, or of a wide beam: the
#: excess on the diameter, so often.
ULS_RING_M, ULS_RING = 0.012, 1.25
#: Directions in which the thickness of a ring is compared, each with so many points; spread of log MAD of one point.
DIRECTIONS, DIRECTION_POINTS, LOG_MAD_SD = 8, 8, 1.17
#: An arc below this does not show the shape, degrees.
SHAPE_SEEN_DEG = 270.0


@dataclass(frozen=True)
class FittedStem:
    """A cone fitted to the (N, 3) points of a stem. window: heights between which, m. on: (N,) bool, points on its
    bark. slices: (S, 5) of :func:`treedgs_geo.stems.geometry.section_kernels.slice_rows`. others: (M, 3) points
    around."""

    points: np.ndarray
    cone: Cone
    window: tuple[float, float]
    on: np.ndarray
    slices: np.ndarray
    taper: Taper | None
    others: np.ndarray


@dataclass(frozen=True)
class Bark:
    """residual: (W,) distances of the window's points from the cone, m. noise_m: spread of those near it. per_sector:
    (SECTORS,) points on the bark. arc_deg: circumference that they cover. purity: bark among them, share. lobes: waves
    of the section over its radius."""

    residual: np.ndarray
    noise_m: float
    per_sector: np.ndarray
    arc_deg: float
    purity: float
    lobes: float

    @classmethod
    def of(cls, fitted: FittedStem, sensor: Sensor) -> Bark:
        """Read off the points."""
        points, cone, (low, high) = fitted.points, fitted.cone, fitted.window
        inside_window = (points[:, 2] >= low) & (points[:, 2] <= high)
        residual = cone.residuals(points[inside_window])
        near = np.abs(residual[np.abs(residual) < 2.5 * sensor.cap_m])
        # The fit's own sigma has a floor, which clean clouds lie below.
        noise = float(np.clip(1.4826 * np.median(near), 0.002, sensor.cap_m)) if len(near) >= 6 else cone.sigma
        bark = points[fitted.on]
        per_sector = np.bincount(cone.sectors(bark, SECTORS), minlength=SECTORS)
        # Strays that fill a gap are few against the bark beside it.
        arc = 360.0 / SECTORS * np.count_nonzero(per_sector >= max(1.0, LEAST_OF_USUAL * usual(per_sector)))
        about = cone.vector, cone.h_ref, cone.sigma
        purity = 0.0
        if len(bark):
            purity = float(np.mean(bark_weights(bark, fitted.others, *about, sensor.floor_m, ROUNDNESS)[1]))
        return cls(residual, noise, per_sector, arc, purity, lobes(bark, *about))

    def share_beyond(self, cone: Cone, side: int) -> float:
        """Share of the window's points off the bark, outside (``side`` 1) or inside (-1) of it."""
        limit = max(4 * cone.sigma, 0.03)
        return float(np.mean(side * self.residual > limit)) if len(self.residual) else 0.0

    @property
    def clear_arc_deg(self) -> float:
        """Circumference in which points are as many as bark has: strays between few sectors do not count."""
        return 360.0 / SECTORS * np.count_nonzero(self.per_sector > 0.25 * np.percentile(self.per_sector, 75))


def diameter_errors(fitted: FittedStem, bark: Bark, sensor: Sensor, bh_m: float, dbh_cm: float) -> tuple[float, float]:
    """``(cautious, reported)`` standard errors of the diameter, cm. The first is the same sum for every kind of cloud,
    by which flags go; the second is calibrated where clouds with known diameters were at hand. bh_m: breast height
    along the axis, m."""
    cone, radius = fitted.cone, float(fitted.cone.radius(bh_m))
    covariance = cone.covariance if cone.covariance is not None else np.full((8, 8), np.nan)
    reach = np.array([0, 0, 0, 0, 1.0, bh_m - cone.h_ref, 0, 0])
    fit_se = 200 * float(np.sqrt(max(reach @ covariance @ reach, 0)))
    shape_se = 200 * radius * max(ROUNDNESS, bark.lobes) / np.sqrt(max(bark.arc_deg / 60.0, 1.0))
    height_se = 0.0 if fitted.taper is None else fitted.taper.se_cm
    # Bark that looks like twigs: half the twigs' reach, in the share that they have.
    clutter_se = (1 - bark.purity) * 200 * cone.sigma
    # Points scatter to all sides: the mean distance from the axis of a ring as thick as this is too large.
    curve_se = 100 * bark.noise_m**2 / radius
    parts = [fit_se, clutter_se, curve_se, shape_se, 0.5 * height_se, FLOOR_CM, FLOOR_SHARE * dbh_cm]
    if sensor.calibrated:
        seen = bark.lobes if bark.arc_deg >= SHAPE_SEEN_DEG else max(ROUNDNESS, bark.lobes)
        seen_se = 200 * radius * seen / np.sqrt(max(bark.arc_deg / 60.0, 1.0))
        ring_se = ULS_RING * 200 * float(np.sqrt(max(bark.noise_m**2 - ULS_RING_M**2, 0.0)))
        fit_se = ULS_FIT * fit_se * min(bark.noise_m / cone.sigma, 1.0)
        reported = [fit_se, clutter_se, ULS_SHAPE * seen_se, ULS_HEIGHT * height_se, ring_se]
        reported += [ULS_SHARE * dbh_cm, ULS_FLOOR_CM]
    else:
        # Half a ring does not show an oval section's other half.
        hidden_se = HALF_RING * shape_se if bark.arc_deg < HALF_RING_DEG else 0.0
        reported = [*parts, DRIFT_SHARE * 200 * bark.noise_m, hidden_se]
    return float(np.sqrt(np.square(parts).sum())), float(np.sqrt(np.square(reported).sum()))


def uneven_ring(points: np.ndarray, cone: Cone) -> tuple[float, float]:
    """How unlike the thickness of a ring of (N, 3) points is in different directions (mean square of its logarithm's
    departures over their errors: 1 = by chance alone), and the excess of the thickest over the thinnest, m.

    Leaves on one side make that side thick; noise, range and lines make every side so."""
    e = cone.residuals(points)
    near = np.abs(e) < 0.1
    e, place = e[near], cone.sectors(points[near], DIRECTIONS)
    sides = [e[place == k] for k in range(DIRECTIONS) if np.count_nonzero(place == k) >= DIRECTION_POINTS]
    if len(sides) < DIRECTIONS // 2:
        return 0.0, 0.0
    spread = np.array([max(1.4826 * float(np.median(np.abs(side - np.median(side)))), 0.002) for side in sides])
    off = np.log(spread) - np.median(np.log(spread))
    error = LOG_MAD_SD / np.sqrt([len(side) for side in sides])
    return float(np.mean((off / error) ** 2)), float(np.sqrt(spread.max() ** 2 - spread.min() ** 2))


def girth_factor(points: np.ndarray, cone: Cone, sensor: Sensor) -> float:
    """Girth / pi over the mean diameter of the section's ellipse; 1 where the circle is the better model."""
    if sensor.solid or len(points) < 60:
        return 1.0
    some = points[:: max(len(points) // 600, 1)]
    flat = across_axis(some, cone) * (float(cone.r) / np.maximum(cone.radius(some[:, 2]), 1e-3))[:, None]
    oval = fit_ellipse(flat, noise_m=max(cone.sigma, sensor.floor_m), start=np.array([0.0, 0.0, float(cone.r)]))
    return oval.girth_d / (oval.a + oval.b) if oval is not None and oval.gain > 0 else 1.0
