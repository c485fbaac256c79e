"""Where the sun stood, read from the stems themselves: upright bark is brighter on the side that faces the sun.

The difference of brightness between the right and the left half of a stem, seen from many sides, follows the component
of the sun's direction across the view: two numbers a flight, by least squares over photos and stems. No clock, no time
zone and no ephemeris is needed, and an overcast flight is recognised (no significant direction).
"""

from __future__ import annotations

import numpy as np

from ..tuned import INSIDE, SEES, STRAIGHT_M
from .axis_patches import StemAxis, StripLayout, Strips, cut_strips
from .crops import PhotoStack


def sun_azimuths(stack: PhotoStack, stems: list[tuple[StemAxis, float, np.ndarray]]) -> np.ndarray:
    """Sun azimuth of every flight, rad counter-clockwise from east; NaN where the stems do not show it.

    stems: axis, radius (m) and (V,) probability that a view sees it.
    """
    flights = np.array([view.flight for view in stack.views], int)
    sun = np.full(int(flights.max()) + 1 if len(flights) else 1, np.nan)
    normals, contrasts, owners = [], [], []
    # The direction is believed from so many standard errors on.
    sure = 3.5
    angles = np.radians(np.arange(0, 360, 4.0))
    border = np.zeros((len(stack), len(angles)))
    for axis, radius, seen in stems:
        if radius < 0.07:
            continue
        layout = StripLayout(0.5, 3.3, STRAIGHT_M, 0.04, radius + 0.05, 0.01, sigma_px=1.0, linear=False)
        strips = cut_strips(stack, axis, layout, wanted=seen > SEES)
        contrast = right_minus_left(strips, radius)
        border += (seen > SEES)[:, None] * border_score(strips, radius, angles)
        good = (seen > SEES) & np.isfinite(contrast)
        normals.append(strips.normal[good])
        contrasts.append(contrast[good])
        owners.append(flights[good])
    if not normals:
        return sun
    normal, contrast, owner = np.vstack(normals), np.concatenate(contrasts), np.concatenate(owners)
    together, error = _direction(normal, contrast)
    for flight in np.unique(owner):
        mine = owner == flight
        if mine.sum() < 10:
            continue
        direction, own_error = _direction(normal[mine], contrast[mine])
        if np.linalg.norm(direction) <= sure * own_error:
            # Too little light of its own: what all flights say together, unless this one contradicts.
            if np.linalg.norm(together) <= sure * error or direction @ together < 0:
                continue
            direction = together
        coarse = np.arctan2(direction[1], direction[0])
        sun[flight] = _middle_of_peak(border[flights == flight].sum(axis=0), angles, coarse) % (2 * np.pi)
    return sun


def _middle_of_peak(curve: np.ndarray, angles: np.ndarray, coarse: float) -> float:
    """The border of light and shade is fuzzy and its score a plateau: its middle, within 40 degrees of ``coarse``."""
    near = np.cos(angles - coarse) > np.cos(np.radians(40))
    top = curve[near].max()
    if top <= 0:
        return coarse
    weight = np.maximum(curve - 0.6 * top, 0) * near
    return float(np.angle((weight * np.exp(1j * angles)).sum()))


def border_score(strips: Strips, radius: float, angles: np.ndarray) -> np.ndarray:
    """(V, angles): coherent luma steps where the light would end, 90 degrees from the sun, brighter towards it."""
    normal = strips.normal
    view = np.column_stack([normal[:, 1], -normal[:, 0]])
    border = np.stack([-np.sin(angles), np.cos(angles)])
    towards = normal @ np.stack([np.cos(angles), np.sin(angles)])
    place = -np.sign(view @ border) * (normal @ border)
    du = strips.u[1] - strips.u[0]
    column = np.clip(np.round((radius * place - strips.u[0]) / du).astype(int), 0, len(strips.u) - 1)
    norm = np.sqrt((strips.gradient**2).sum(axis=-1)) + 1e-6
    signed = (strips.coherence * strips.gradient[..., 0] / norm).mean(axis=1)
    value = np.take_along_axis(signed, column, axis=1) * np.sign(towards)
    return np.where(np.abs(place) < INSIDE, value, 0.0)


def _direction(normal: np.ndarray, contrast: np.ndarray) -> tuple[np.ndarray, float]:
    """Least squares of contrast = normal . direction with Huber weights; (2,) direction and its standard error."""
    weight = np.ones(len(contrast))
    direction = np.zeros(2)
    for _ in range(5):
        matrix = (normal * weight[:, None]).T @ normal + 1e-9 * np.eye(2)
        direction = np.linalg.solve(matrix, (normal * weight[:, None]).T @ contrast)
        rest = contrast - normal @ direction
        scale = 1.4826 * np.median(np.abs(rest)) + 1e-6
        weight = np.minimum(1.0, 1.5 * scale / np.maximum(np.abs(rest), 1e-9))
    variance = (weight * rest**2).sum() / max(weight.sum() - 2, 1)
    return direction, float(np.sqrt(variance * np.trace(np.linalg.inv(matrix)) / 2))


def right_minus_left(strips: Strips, radius: float) -> np.ndarray:
    """(V,) mean luma of the stem's right half minus its left half, median over blocks; NaN where not seen.

    From the gradients: the difference of the halves' means is the gradient's integral under a triangle.
    """
    du = strips.u[1] - strips.u[0]
    triangle = np.maximum(1 - np.abs(strips.u) / (INSIDE * radius), 0)
    step = strips.gradient[..., 0] / strips.px_m[:, None, None] * du
    halves = (step * triangle).sum(axis=2)
    filled = np.any(strips.coherence > 0, axis=2)
    with np.errstate(invalid="ignore"):
        halves = np.where(filled, halves, np.nan)
    out = np.full(len(halves), np.nan)
    rows = np.any(filled, axis=1)
    out[rows] = np.nanmedian(halves[rows], axis=1)
    return out
