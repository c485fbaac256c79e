"""Where the sun stood, read from the stems themselves: the border of light and shade on round, upright bark.

Bark facing the sun is bright, the rest dark; on a vertical cylinder the border is a fixed vertical line 90 degrees from
the sun's azimuth, so every view of every stem tells where the sun was. No clock, no time zone and no ephemeris needed,
and an overcast flight is recognised.
"""

from __future__ import annotations

import numpy as np

from .stack import PhotoStack
from .strips import Axis, Strips, cut_strips

#: Steps of the azimuth search, and how far the best must stand out (robust sds) to be believed.
STEP_DEG = 4.0
MIN_PEAK_SD = 4.0


def sun_azimuths(stack: PhotoStack, stems: list[tuple[Axis, float, np.ndarray]]) -> np.ndarray:
    """Sun azimuth of every flight, rad counter-clockwise from east; NaN where the stems do not tell.

    stems: axis, radius (m) and (V,) probability that a view sees it.
    """
    flights = np.array([view.flight for view in stack.views], int)
    sun = np.full(int(flights.max()) + 1 if len(flights) else 1, np.nan)
    angles = np.radians(np.arange(0, 360, STEP_DEG))
    total = np.zeros((len(stack), len(angles)))
    for axis, radius, seen in stems:
        if radius < 0.08:
            continue
        strips = cut_strips(stack, axis, 0.5, 3.3, 0.28, 0.04, radius + 0.05, 0.01, 1.0, linear=False)
        total += seen[:, None] * _border_score(strips, radius, angles)
    for flight in np.unique(flights):
        curve = total[flights == flight].sum(axis=0)
        spread = 1.4826 * np.median(np.abs(curve - np.median(curve)))
        best = int(curve.argmax())
        if curve[best] > max(MIN_PEAK_SD * spread, 1.0):
            sun[flight] = angles[best]
    return sun


def _border_score(strips: Strips, radius: float, angles: np.ndarray) -> np.ndarray:
    """(V, angles): coherent luma steps at the expected border, brighter towards the sun."""
    normal = strips.normal
    view = np.column_stack([normal[:, 1], -normal[:, 0]])
    border = np.stack([-np.sin(angles), np.cos(angles)])
    towards = normal @ np.stack([np.cos(angles), np.sin(angles)])
    place = -np.sign(view @ border) * (normal @ border)
    inside = np.abs(place) < 0.85
    du = strips.u[1] - strips.u[0]
    column = np.clip(np.round((radius * place - strips.u[0]) / du).astype(int), 0, len(strips.u) - 1)
    luma = strips.gradient[..., 0]
    norm = np.sqrt((strips.gradient**2).sum(axis=-1)) + 1e-6
    signed = (strips.coherence * luma / norm).mean(axis=1)
    value = np.take_along_axis(signed, column, axis=1) * np.sign(towards)
    return np.where(inside, value, 0.0)
