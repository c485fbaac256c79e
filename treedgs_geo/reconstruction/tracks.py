"""Tracks: the same ground point seen in several photos, and its position from known poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..core.machine import EXACT
from .cameras import Camera, Sensor, View

#: Points whose rays meet under a smaller angle are dropped.
MIN_ANGLE_DEG = 1.5


class Rays(NamedTuple):
    """starts (M, 3): where the camera stood when each observation was read, metres. directions (M, 3): unit vectors."""

    starts: np.ndarray
    directions: np.ndarray

    def of(self, rows: np.ndarray) -> Rays:
        """Those of some observations, (M,) bool."""
        return Rays(self.starts[rows], self.directions[rows])


@dataclass
class Block:
    """The photogrammetric block.

    sensor: the lens and shutter of its photos. rotations (N, 3, 3), translations (N, 3): world -> camera at the middle
    row, NaN where a photo has no pose.
    keypoints: per photo (K, 2) pixels. points: (P, 3) local metres. image, key, point: (M,) int, one row an
    observation.
    """

    sensor: Sensor
    rotations: np.ndarray
    translations: np.ndarray
    keypoints: list[np.ndarray]
    points: np.ndarray
    image: np.ndarray
    key: np.ndarray
    point: np.ndarray

    @property
    def camera(self) -> Camera:
        """Intrinsics of the first flight."""
        return self.sensor.camera

    @property
    def is_posed(self) -> np.ndarray:
        """(N,) bool."""
        return np.isfinite(self.translations).all(axis=1)

    @property
    def centres(self) -> np.ndarray:
        """(N, 3) camera centres, NaN without a pose."""
        return -np.einsum("nji,nj->ni", self.rotations, self.translations)

    def observed(self) -> np.ndarray:
        """(M, 2) observed pixels."""
        offsets = np.concatenate([[0], np.cumsum([len(k) for k in self.keypoints])])[:-1]
        return np.concatenate(self.keypoints)[offsets[self.image] + self.key]

    def residuals(self) -> np.ndarray:
        """(M, 2) predicted minus observed pixels; NaN behind the camera."""
        sensor, observed = self.sensor, self.observed()
        share = sensor.share(observed[:, 1])
        places = self.points[self.point] - share[:, None] * sensor.travel_m[self.image]
        local = np.einsum("mij,mj->mi", self.rotations[self.image], places) + self.translations[self.image]
        return sensor.to_pixels(local, self.image) - observed

    def standing_still(self) -> np.ndarray:
        """(M, 2) pixels by which observations would move if the cameras stood still while they were read."""
        local = np.einsum("mij,mj->mi", self.rotations[self.image], self.points[self.point])
        still = self.sensor.to_pixels(local + self.translations[self.image], self.image)
        return still - self.observed() - self.residuals()

    def rays(self) -> Rays:
        """The viewing ray of each observation."""
        return self.rays_of(self.image, self.observed())

    def rays_of(self, image: np.ndarray, pixels: np.ndarray) -> Rays:
        """The viewing rays of (K, 2) pixels of the photos ``image``, (K,)."""
        rays = np.einsum("mji,mj->mi", self.rotations[image], self.sensor.directions(pixels, image))
        share = self.sensor.share(pixels[:, 1])
        return Rays(self.centres[image] + share[:, None] * self.sensor.travel_m[image], rays)

    def moved(self, i: int, points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        """(K, 3) points less what photo i moved when it read their rows: as a camera that stands still sees them."""
        return points - self.sensor.share(pixels[:, 1])[:, None] * self.sensor.travel_m[i]

    def view(self, i: int) -> View:
        """Photo i as a view."""
        camera, flight, travel = self.sensor.camera_of(i), int(self.sensor.flight[i]), self.sensor.travel_m[i]
        return View(str(i), Path(), camera, self.rotations[i], self.translations[i], flight, travel)

    def part(self, points: np.ndarray) -> Block:
        """The block of some of the points, (P,) bool; photos and keypoints are shared, poses copied."""
        rows, number = points[self.point], np.cumsum(points) - 1
        return replace(
            self,
            rotations=self.rotations.copy(),
            translations=self.translations.copy(),
            points=self.points[points],
            image=self.image[rows],
            key=self.key[rows],
            point=number[self.point[rows]],
        )

    def long_tracks(self, columns: int, rows: int, most: int) -> np.ndarray:
        """(P,) bool: points that are among the ``most`` seen by the most photos of one of ``columns`` x ``rows`` parts
        of any photo."""
        observed, camera = self.observed(), self.camera
        column = np.clip((observed[:, 0] * (columns / camera.width)).astype(int), 0, columns - 1)
        row = np.clip((observed[:, 1] * (rows / camera.height)).astype(int), 0, rows - 1)
        part = (self.image * rows + row) * columns + column
        seen_by = np.bincount(self.point, minlength=len(self.points))[self.point]
        order = np.lexsort((self.point, -seen_by, part))
        first = np.searchsorted(part[order], part[order])
        chosen = np.zeros(len(self.points), bool)
        chosen[self.point[order[np.arange(len(order)) - first < most]]] = True
        return chosen

    def add(self, image: np.ndarray, key: np.ndarray, point: np.ndarray) -> None:
        """Add observations, (M,) each."""
        self.image, self.key = np.concatenate([self.image, image]), np.concatenate([self.key, key])
        self.point = np.concatenate([self.point, point])

    def unpose(self, photos: np.ndarray) -> None:
        """Take the poses and observations of some photos, (N,) bool, out of the block."""
        self.rotations[photos], self.translations[photos] = np.nan, np.nan
        self.keep(~photos[self.image])

    def keep(self, mask: np.ndarray, min_views: int = 2) -> np.ndarray:
        """Keep these observations, then only points with ``min_views`` of them left; renumber the points.

        Returns:
            (M,) bool: the observations that were kept.
        """
        image, key, point = self.image[mask], self.key[mask], self.point[mask]
        counts = np.bincount(point, minlength=len(self.points))
        good = counts[point] >= min_views
        left = np.flatnonzero(np.bincount(point[good], minlength=len(self.points)))
        numbers = np.empty(len(self.points), np.int64)
        numbers[left] = np.arange(len(left))
        self.image, self.key, self.point = image[good], key[good], numbers[point[good]]
        self.points = self.points[left]
        kept = np.zeros(len(mask), bool)
        kept[np.flatnonzero(mask)[good]] = True
        return kept


def build_tracks(
    keypoints: list[np.ndarray], matches: dict[tuple[int, int], np.ndarray], usable: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Join pairwise matches into tracks.

    A track that would hold two keypoints of one photo keeps neither of them there.

    Args:
        matches: (i, j) -> (m, 2) keypoint numbers. usable: (N,) bool photos.

    Returns:
        image, key, track: (M,) int.
    """
    counts = np.array([len(k) for k in keypoints])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    edges = [
        np.column_stack([m[:, 0] + offsets[i], m[:, 1] + offsets[j]])
        for (i, j), m in matches.items()
        if usable[i] and usable[j] and len(m)
    ]
    if not edges:
        empty = np.empty(0, np.int64)
        return empty, empty.copy(), empty.copy()
    ends, count = np.concatenate(edges).T, int(offsets[-1])
    label = connected_components(coo_array((np.ones(len(ends[0]), bool), ends), (count, count)), directed=False)[1]
    nodes = np.flatnonzero(np.bincount(label)[label] > 1)
    image = np.searchsorted(offsets, nodes, side="right") - 1
    _, track = np.unique(label[nodes], return_inverse=True)
    pair = track.astype(np.int64) * len(keypoints) + image
    _, place, repeated = np.unique(pair, return_inverse=True, return_counts=True)
    single = repeated[place] == 1
    return image[single], (nodes - offsets[image])[single], track[single]


def triangulate(block: Block, limit_px: float) -> None:
    """Place the block's points from its poses; drop observations beyond ``limit_px`` and points seen under a small
    angle.

    Least squares on the distances to the viewing rays, weighted with 1/range; the worst observation of a bad point
    goes first.
    """
    block.keep(block.is_posed[block.image])
    rays = block.rays()
    for _ in range(4):
        if not len(block.point):
            return
        intersect(block, rays)
        error = np.linalg.norm(block.residuals(), axis=1)
        error[~np.isfinite(error)] = 1e9
        worst = np.zeros(len(block.points))
        np.maximum.at(worst, block.point, error)
        bad = (error > limit_px) & (error >= worst[block.point] - 1e-9)
        if not bad.any():
            break
        rays = rays.of(block.keep(~bad))
    if not len(block.point):
        return
    intersect(block, rays)
    error = np.linalg.norm(block.residuals(), axis=1)
    rays = rays.of(block.keep(np.isfinite(error) & (error <= limit_px)))
    block.keep(widest_angle_deg(block, rays)[block.point] >= MIN_ANGLE_DEG)


def intersect(block: Block, rays: Rays | None = None) -> None:
    """Place the block's points where their rays pass nearest, weighted with 1 / range. rays: the block's."""
    starts, directions = block.rays() if rays is None else rays
    weight = np.ones(len(directions))
    for _ in range(2):
        left, right = ray_normals(starts, directions, weight, block.point, len(block.points))
        left += 1e-9 * np.trace(left, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        block.points = np.linalg.solve(left, right[:, :, None])[:, :, 0]
        weight = 1 / np.maximum(np.linalg.norm(block.points[block.point] - starts, axis=1), 1.0) ** 2


@numba.njit(**EXACT)
def ray_normals(
    centres: np.ndarray, rays: np.ndarray, weight: np.ndarray, point: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations (P, 3, 3) and (P, 3) of the points that lie nearest to their weighted rays."""
    left, right = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for m in range(len(rays)):
        p = point[m]
        for i in range(3):
            for j in range(3):
                value = weight[m] * ((1.0 if i == j else 0.0) - rays[m, i] * rays[m, j])
                left[p, i, j] += value
                right[p, i] += value * centres[m, j]
    return left, right


def widest_angle_deg(block: Block, rays: Rays) -> np.ndarray:
    """(P,) twice the largest angle between a ray and the mean ray of its point: close to the widest angle of
    intersection.
    """
    mean = np.zeros((len(block.points), 3))
    np.add.at(mean, block.point, rays.directions)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
    away = np.degrees(np.arccos(np.clip(np.sum(rays.directions * mean[block.point], axis=1), -1, 1)))
    widest = np.zeros(len(block.points))
    np.maximum.at(widest, block.point, away)
    return 2 * widest
