"""Does what is seen between a stem's edges lie on its bark? Asked where no ground is seen behind it.

Neighbouring photos show bark alike where it is: half a stem before its axis. The strip of wall between a window and a
door has edges as straight, but is alike in the plane through them; and what only lines up is alike nowhere. Zero-mean
normalised cross-correlation (Lewis 1995, "Fast normalized cross-correlation") on both surfaces tells these three apart.
"""

from __future__ import annotations

import cv2
import numpy as np

from ..images.axis_patches import StemAxis
from ..images.crops import FX, PhotoStack

#: Photos are compared that see the stem and look at it from so many degrees apart, at most so many pairs and no fewer.
_APART_DEG, _MAX_PAIRS, _MIN_PAIRS = (5.0, 25.0), 40, 5
#: Probability from which a photo sees the stem; share of the radius that is compared.
_SEES, _INNER = 0.6, 0.75
#: Patterns are compared, not shades that are wider than this (s.d., pixels); least product of their variances.
_SHADE_PX, _NOISE = 6.0, 0.01


def surface_likeness(
    stack: PhotoStack, axis: StemAxis, radius: tuple[float, float], band_m: tuple[float, float], seen: np.ndarray
) -> tuple[float, float]:
    """How alike neighbouring photos are on a stem's bark, -1 to 1; and by how much more, at most (two standard errors),
    than on the plane through its edges. 0 and NaN where fewer than five pairs of photos show it: edges of so few line
    up anywhere.

    radius: at breast height (m) and its slope (m/m). band_m: heights above the ground. seen: (V,) probability that a
    photo sees the stem.
    """
    middle = axis.at(np.array([axis.bh_m]))[0]
    away = stack.centre - middle
    rays = away / np.linalg.norm(away, axis=1, keepdims=True)
    apart = np.degrees(np.arccos(np.clip(rays @ rays.T, -1, 1)))
    side = (_APART_DEG[0] <= apart) & (apart <= _APART_DEG[1]) & np.outer(seen > _SEES, seen > _SEES)
    pairs = np.argwhere(np.triu(side))
    pairs = pairs[np.linspace(0, len(pairs) - 1, min(len(pairs), _MAX_PAIRS)).astype(int)]
    found = []
    for pair in pairs:
        px_m = float((np.linalg.norm(away[pair], axis=1) / stack.camera[pair, FX]).max())
        facing = rays[pair].sum(axis=0)[:2]
        bark = _facing(axis, radius, band_m, facing / np.linalg.norm(facing), px_m)
        pictures = [_shown(stack, v, surface, px_m) for surface in bark for v in pair]
        shown = [picture for picture in pictures if picture is not None]
        if len(shown) == len(pictures):
            found.append([_alike(*shown[:2]), _alike(*shown[2:])])
    if len(found) < _MIN_PAIRS:
        return 0.0, np.nan
    on_bark, in_plane = np.array(found).T
    lead = on_bark - in_plane
    return float(on_bark.mean()), float(lead.mean() + 2 * lead.std(ddof=1) / np.sqrt(len(lead)))


def _facing(
    axis: StemAxis, radius: tuple[float, float], band_m: tuple[float, float], facing: np.ndarray, px_m: float
) -> list[np.ndarray]:
    """(H, W, 3) local points a pixel apart: the bark that faces a direction (2,), and the plane behind it."""
    heights = np.arange(*band_m, px_m)
    r = radius[0] + radius[1] * (heights - axis.bh_m)
    across = np.linspace(-_INNER, _INNER, max(int(2 * _INNER * radius[0] / px_m), 8))
    sideways, ahead = np.array([-facing[1], facing[0], 0.0]), np.array([*facing, 0.0])
    plane = axis.at(heights)[:, None] + (r[:, None] * across)[..., None] * sideways
    return [plane + (r[:, None] * np.sqrt(1 - across**2))[..., None] * ahead, plane]


def _shown(stack: PhotoStack, v: int, points: np.ndarray, px_m: float) -> np.ndarray | None:
    """(H, W) grey values of a photo at points (H, W, 3), as blurred as pixels of ``px_m`` are; ``None`` where its crop
    does not hold them."""
    pixels, depth = stack.views[v].project(points.reshape(-1, 3))
    place = (pixels - 0.5 - stack.corner[v][::-1]).astype(np.float32)
    low, high = np.floor(place.min(axis=0)) - 3, np.ceil(place.max(axis=0)) + 4
    if not (np.isfinite(place).all() and (low >= 0).all() and (high <= stack.shape[v][::-1]).all()):
        return None
    (left, top), (right, bottom) = low.astype(int), high.astype(int)
    grey: np.ndarray = np.ascontiguousarray(stack.crop(v)[top:bottom, left:right, 1], np.float32)
    finer = px_m * stack.camera[v, FX] / float(np.median(depth))
    if finer > 1.2:
        grey = cv2.GaussianBlur(grey, (0, 0), 0.5 * finer)
    at = (place - low.astype(np.float32)).reshape(*points.shape[:2], 2)
    return cv2.remap(grey, np.ascontiguousarray(at[..., 0]), np.ascontiguousarray(at[..., 1]), cv2.INTER_LINEAR)


def _alike(one: np.ndarray, other: np.ndarray) -> float:
    """Correlation of two pictures (H, W) without their shades."""
    a, b = (picture - cv2.GaussianBlur(picture, (0, 0), _SHADE_PX) for picture in (one, other))
    a, b = a - a.mean(), b - b.mean()
    return float((a * b).mean() / np.sqrt((a * a).mean() * (b * b).mean() + _NOISE))
