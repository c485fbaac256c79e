"""Ties across moved shadows: ground texture of adjusted photos found again in a photo of another flight by correlation.

SIFT finds corners, and on a forest floor most corners are edges of shadows. Between two flights the shadows move and
no feature matches,
but the litter below them stays: a window of some 200 pixels, warped by the known ground into the other photo's view
and stripped of its
slow brightness, still correlates clearly. False peaks are found out because all windows of a photo must agree on one
rotation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from .images import load_image
from .predicted_points import turn_to_points
from .tracks import Block

#: Windows per photo (columns, rows) and their half width in pixels.
GRID = (8, 6)
HALF = 96
#: A correlation peak counts when it stands this many standard deviations above the rest: searched widely, searched
#: closely.
PEAK_SIGMAS = 6.5
CLOSE_SIGMAS = 4.0


@dataclass(frozen=True)
class Ties:
    """T ties of one photo: pixels (T, 2) in it, points (T, 3) on the ground, reference (T,) photo that showed the
    same texture, at
    reference_pixels (T, 2)."""

    pixels: np.ndarray
    points: np.ndarray
    reference: np.ndarray
    reference_pixels: np.ndarray


class GreyPhotos:
    """Photos without their slow brightness, a few kept in memory."""

    def __init__(self, paths: list[Path], most: int = 12) -> None:
        self._paths, self._most = paths, most
        self._kept: dict[int, np.ndarray] = {}

    def __call__(self, i: int) -> np.ndarray:
        """(H, W) float32."""
        if i not in self._kept:
            if len(self._kept) >= self._most:
                self._kept.pop(next(iter(self._kept)))
            self._kept[i] = flatten(cv2.cvtColor(load_image(self._paths[i]), cv2.COLOR_RGB2GRAY))
        return self._kept[i]


def flatten(grey: np.ndarray) -> np.ndarray:
    """Logarithm minus its local mean over its local spread: shadow and light look alike inside."""
    value = np.log(grey.astype(np.float32) + 8)
    high = value - cv2.GaussianBlur(value, (0, 0), 3)
    return np.clip(high / np.sqrt(cv2.GaussianBlur(high * high, (0, 0), 8) + 1e-5), -3, 3)


def ground_surface(points: np.ndarray, neighbours: int = 25) -> Callable[[np.ndarray], np.ndarray]:
    """Height of the ground at (K, 2) places from (P, 3) sparse points: a low quartile of the nearest ``neighbours``."""
    tree = cKDTree(points[:, :2])

    def height(xy: np.ndarray) -> np.ndarray:
        _, near = tree.query(xy, k=min(neighbours, len(points)))
        return np.percentile(points[near, 2], 30, axis=1)

    return height


def find_ties(
    block: Block,
    greys: GreyPhotos,
    i: int,
    rotation: np.ndarray,
    centre: np.ndarray,
    references: np.ndarray,
    ground: Callable[[np.ndarray], np.ndarray],
    reach_px: int,
    sigmas: float = PEAK_SIGMAS,
) -> Ties:
    """Correlate windows of posed ``references``, warped over the ground, with photo i near where its rough pose
    predicts them.
    """
    camera = block.camera
    columns = np.linspace(HALF + 8, camera.width - HALF - 8, GRID[0])
    rows = np.linspace(HALF + 8, camera.height - HALF - 8, GRID[1])
    pixels, points, sources, source_pixels = [], [], [], []
    target = np.pad(greys(i), reach_px)
    # Ground below a coarse grid of each window, the warp between is smooth; and below its middle.
    du, dv = np.meshgrid(np.linspace(-HALF, HALF, 7), np.linspace(-HALF, HALF, 7))
    middles = np.array([[u, v] for u in columns for v in rows])
    whole = np.round(middles)
    windows = np.concatenate([middles[:, None] + np.column_stack([du.ravel(), dv.ravel()]), whole[:, None]], axis=1)
    places = _on_ground(block, i, windows.reshape(-1, 2), rotation, centre, ground)
    shown = {r: block.project(r, places).reshape(len(windows), -1, 2) for r in references}
    places = places.reshape(len(windows), -1, 3)
    for k in np.flatnonzero(np.isfinite(places).all(axis=(1, 2))):
        left, top = whole[k].astype(int) - HALF
        window = target[top : top + 2 * HALF + 2 * reach_px, left : left + 2 * HALF + 2 * reach_px]
        for r in references:
            seen, spot = shown[r][k, :-1], shown[r][k, -1]
            if not (seen.min() >= 2 and (seen.max(axis=0) <= [camera.width - 2, camera.height - 2]).all()):
                continue
            maps = [_fill(seen[:, axis].reshape(7, 7) - 0.5) for axis in range(2)]
            template = cv2.remap(greys(r), maps[0], maps[1], cv2.INTER_LINEAR)
            peak = _peak(cv2.matchTemplate(window, template, cv2.TM_CCOEFF_NORMED), sigmas)
            if peak is None:
                continue
            pixels.append(whole[k] + peak - reach_px)
            points.append(places[k, -1])
            sources.append(r)
            source_pixels.append(spot)
    return Ties(
        np.array(pixels).reshape(-1, 2),
        np.array(points).reshape(-1, 3),
        np.array(sources, int),
        np.array(source_pixels).reshape(-1, 2),
    )


def tie_photo(
    block: Block,
    greys: GreyPhotos,
    i: int,
    guess: np.ndarray,
    centre: np.ndarray,
    posed: np.ndarray,
    ground: Callable[[np.ndarray], np.ndarray],
    reach_deg: float,
    slack_px: float,
    rng: np.random.Generator,
    least: int = 8,
) -> tuple[np.ndarray, Ties] | None:
    """Rotation of a photo that stands at ``centre``, and its ties; None where too few windows agree.

    Args:
        guess: rough rotation. posed: numbers of the photos to look in; the three with the nearest viewing directions
        are used.
        reach_deg: how far ``guess`` may be off. slack_px: added to the tolerance, for a position known to decimetres
        only.
    """
    focal = block.camera.fx
    axes = block.rotations[posed, 2]
    references = posed[np.argsort(-axes @ guess[2])[:3]]
    rotation, agree = guess, np.zeros(0, bool)
    for reach, tolerance, sigmas in (
        (int(np.tan(np.radians(reach_deg)) * focal), 6.0, PEAK_SIGMAS),
        (16, 2.5, CLOSE_SIGMAS),
    ):
        ties = find_ties(block, greys, i, rotation, centre, references, ground, reach, sigmas)
        if len(ties.pixels) < least:
            return None
        rays, moved = block.sensor.directions(ties.pixels, i), block.moved(i, ties.points, ties.pixels)
        turned = turn_to_points(
            moved, rays, centre, (tolerance + slack_px) / focal, rng, near=guess, max_turn_deg=2 * reach_deg
        )
        if turned is None or turned[1].sum() < least or turned[1].mean() < 0.2:
            return None
        rotation, agree = turned
    return rotation, Ties(ties.pixels[agree], ties.points[agree], ties.reference[agree], ties.reference_pixels[agree])


def _on_ground(
    block: Block, i: int, pixels: np.ndarray, rotation: np.ndarray, centre: np.ndarray, ground: Callable
) -> np.ndarray:
    """(K, 3) where the rays of pixels (K, 2) of a photo meet the ground, NaN where they are too flat to."""
    rays = block.sensor.directions(pixels, i) @ rotation
    steep = rays[:, 2] <= -0.2
    origin = (centre + block.sensor.share(pixels[:, 1])[:, None] * block.sensor.travel_m[i])[steep]
    slopes = rays[steep] / rays[steep, 2:]
    z = np.full(len(slopes), float(np.median(block.points[:, 2])))
    for _ in range(4):
        spots = origin + (z - origin[:, 2])[:, None] * slopes
        z = ground(spots[:, :2]) if len(spots) else z
    found = np.full((len(pixels), 3), np.nan)
    found[steep] = origin + (z - origin[:, 2])[:, None] * slopes
    return found


def _fill(coarse: np.ndarray) -> np.ndarray:
    """(7, 7) values at -HALF..HALF -> (2 HALF, 2 HALF) at the pixel centres, bilinear."""
    at = ((np.arange(2 * HALF) + 0.5) / (2 * HALF) * 6).astype(np.float32)
    return cv2.remap(coarse.astype(np.float32), *np.meshgrid(at, at), cv2.INTER_LINEAR)


def _peak(response: np.ndarray, sigmas: float) -> np.ndarray | None:
    """(2,) place of the peak to a fraction of a pixel, None where it does not stand out."""
    v, u = np.unravel_index(int(response.argmax()), response.shape)
    if not (0 < u < response.shape[1] - 1 and 0 < v < response.shape[0] - 1):
        return None
    around = response.copy()
    around[max(v - 4, 0) : v + 5, max(u - 4, 0) : u + 5] = np.nan
    # In a small search area the second best says little: there only the height above the rest counts.
    rival = 1.15 * np.nanmax(around) if sigmas >= PEAK_SIGMAS else 0.0
    if response[v, u] < max(np.nanmean(around) + sigmas * np.nanstd(around), rival):
        return None

    def vertex(a: float, b: float, c: float) -> float:
        return 0.5 * (a - c) / (a - 2 * b + c) if a - 2 * b + c < 0 else 0.0

    return np.array(
        [
            u + vertex(response[v, u - 1], response[v, u], response[v, u + 1]),
            v + vertex(response[v - 1, u], response[v, u], response[v + 1, u]),
        ]
    )
