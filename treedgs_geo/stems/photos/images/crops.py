"""The parts of the photos that can show a plot's lower stems, in memory once, with their cameras as plain arrays."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ....core.errors import InputError
from ....core.progress import Reporter
from ....geotags.sharpness import MAX_READERS
from ....reconstruction.area import Area
from ....reconstruction.cameras import OBLIQUE_DEG, View
from ....reconstruction.images import FINEST_GSD_M, shrink, shrink_factor, shrunk_camera

#: Columns of a camera row (:func:`camera_row`) after the rotation: translation in metres; focal lengths and principal
#: point in pixels; Brown's distortion; metres in the camera frame by which the camera moves on per row (rolling
#: shutter), and the row that the pose is of.
TX, TY, TZ, FX, FY, CX, CY, K1, K2, P1, P2, K3, ROW_X, ROW_Y, ROW_Z, ROW_0 = range(9, 25)


#: Photos are chosen by what they show from the ground up to here, m.
LOWER_STEM_M = 3.0
#: Crops reach this high above the ground, m.
TOP_M = 6.0


class PhotoArrays(NamedTuple):
    """What the compiled kernels take of a :class:`PhotoStack`: its arrays, by the same names."""

    pixels: np.ndarray
    start: np.ndarray
    shape: np.ndarray
    corner: np.ndarray
    camera: np.ndarray
    centre: np.ndarray


@dataclass(frozen=True)
class PhotoStack:
    """Crops of V photos and their cameras.

    views: the V views, with the cameras of the reduced photos. pixels: (N,) uint8, all crops one after the other,
    row-major BGR. start: (V,) int64 first byte. shape, corner: (V, 2) int64 rows and columns; photo row and
    column of the first pixel. camera: (V, 25) float64 rows of :func:`camera_row`. centre: (V, 3) float64 camera
    centres.
    """

    views: list[View]
    pixels: np.ndarray
    start: np.ndarray
    shape: np.ndarray
    corner: np.ndarray
    camera: np.ndarray
    centre: np.ndarray

    def __len__(self) -> int:
        return len(self.views)

    @property
    def arrays(self) -> PhotoArrays:
        """What the compiled kernels take."""
        return PhotoArrays(self.pixels, self.start, self.shape, self.corner, self.camera, self.centre)

    def crop(self, number: int) -> np.ndarray:
        """(H, W, 3) uint8 BGR of one photo."""
        first, (rows, columns) = self.start[number], self.shape[number]
        return self.pixels[first : first + rows * columns * 3].reshape(rows, columns, 3)

    def grey(self, number: int) -> np.ndarray:
        """(H, W) float32 crop of one photo, 0..255: its green channel."""
        return self.crop(number)[..., 1].astype(np.float32)

    def arrays_of(self, members: np.ndarray) -> PhotoArrays:
        """:attr:`arrays` of some photos, by their indices."""
        start, shape, corner = self.start[members], self.shape[members], self.corner[members]
        return PhotoArrays(self.pixels, start, shape, corner, self.camera[members], self.centre[members])


class GroundGrid(NamedTuple):
    """Ground heights on a regular grid. z: (rows, columns) float32, row 0 at ``y0``; NaN outside."""

    x0: float
    y0: float
    cell: float
    z: np.ndarray

    @classmethod
    def sample(
        cls, ground: Callable[[np.ndarray, np.ndarray], np.ndarray], area: Area, margin_m: float, cell: float = 0.25
    ) -> GroundGrid:
        """Sample a ground function over an area; holes are filled from their nearest neighbours.

        Raises:
            InputError: no ground height anywhere in the area.
        """
        x0, y0, x1, y1 = area.bounds(margin_m)
        x = np.arange(x0, x1 + cell, cell)
        y = np.arange(y0, y1 + cell, cell)
        gx, gy = np.meshgrid(x, y)
        z = np.asarray(ground(gx.ravel(), gy.ravel()), float).reshape(gx.shape)
        hole = ~np.isfinite(z)
        if hole.all():
            raise InputError(
                "The terrain model has no height in the plot; expected one that covers it, give another DTM."
            )
        if hole.any():
            from scipy.ndimage import distance_transform_edt

            nearest = distance_transform_edt(hole, return_distances=False, return_indices=True)
            z = z[tuple(nearest)]
        return cls(x0, y0, cell, z.astype(np.float32))

    def at(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Bilinear height at (N,) x, y, clamped to the grid."""
        rows, columns = self.z.shape
        u = np.clip((np.asarray(x, float) - self.x0) / self.cell, 0, columns - 1.001)
        v = np.clip((np.asarray(y, float) - self.y0) / self.cell, 0, rows - 1.001)
        i, j = v.astype(int), u.astype(int)
        a, b = v - i, u - j
        z = self.z
        return (
            z[i, j] * (1 - a) * (1 - b)
            + z[i, j + 1] * (1 - a) * b
            + z[i + 1, j] * a * (1 - b)
            + z[i + 1, j + 1] * a * b
        )


def camera_row(view: View) -> np.ndarray:
    """(25,) float64: rotation (row-major), translation, fx, fy, cx, cy, k1, k2, p1, p2, k3, movement per row, middle
    row: see :data:`FX` and its like.
    """
    c = view.camera
    lens = [c.fx, c.fy, c.cx, c.cy, *c.distortion]
    per_row = view.rotation @ view.readout_travel_m / c.height
    return np.concatenate([view.rotation.ravel(), view.translation, lens, per_row, [0.5 * c.height]]).astype(np.float64)


def choose_views(views: list[View], area: Area, ground_z: float, max_views: int) -> list[int]:
    """Indices of the oblique photos that see lower stems of the area, thinned evenly over azimuth where many do."""
    if len(area.radii_m) == 0:
        return []
    outline = np.vstack([area.outline(), area.centres])
    heights = np.repeat([ground_z, ground_z + LOWER_STEM_M], len(outline))
    points = np.column_stack([np.vstack([outline, outline]), heights])
    kept, azimuths, shares = [], [], []
    for index, view in enumerate(views):
        pixels, _ = view.project(points)
        share = float(view.contains(pixels).mean())
        offset = points - view.centre
        sine = np.hypot(offset[:, 0], offset[:, 1]) / np.linalg.norm(offset, axis=1)
        if share < 0.1 or np.median(sine) < np.sin(np.radians(OBLIQUE_DEG)):
            continue
        middle = offset[-1]
        kept.append(index)
        azimuths.append(np.arctan2(middle[1], middle[0]))
        shares.append(share)
    if len(kept) <= max_views:
        return kept
    # Deal the photos out sector by sector, those that see most of the area first.
    sector = np.floor((np.array(azimuths) % (2 * np.pi)) / (2 * np.pi) * 24).astype(int)
    order = np.lexsort([-np.array(shares), sector])
    turn = np.empty(len(kept), int)
    for s in range(24):
        members = order[sector[order] == s]
        turn[members] = np.arange(len(members))
    chosen = np.lexsort([-np.array(shares), turn])[:max_views]
    return sorted(kept[i] for i in chosen)


def load_stack(
    views: list[View],
    area: Area,
    ground: GroundGrid,
    max_views: int,
    margin_m: float,
    reporter: Reporter | None = None,
    finest_m: float = FINEST_GSD_M,
) -> PhotoStack:
    """Read the crops that cover the area from the ground to :data:`TOP_M`. Unreadable photos are reported and left out;
    pixels much finer than ``finest_m`` are averaged.

    Raises:
        InputError: a photo whose size differs from its camera's.
    """
    reporter = reporter or Reporter()
    outline = np.vstack([area.outline(margin_m), area.centres])
    z = ground.at(outline[:, 0], outline[:, 1])
    hull = np.vstack([np.column_stack([outline, z - 0.3]), np.column_stack([outline, z + TOP_M])])
    wanted: list[tuple[View, int, tuple[int, int, int, int]]] = []
    for index in choose_views(views, area, float(np.median(ground.z)), max_views):
        view = views[index]
        pixels, depth = view.project(hull)
        camera = view.camera
        ahead = np.isfinite(pixels).all(axis=1)
        # A camera that stands among the stems may have them anywhere.
        pixels = pixels if ahead.all() else np.array([[0.0, 0.0], [camera.width, camera.height]])
        k = shrink_factor(camera, float(np.median(depth[ahead])), finest_m)
        left, top = np.clip(np.floor(pixels.min(axis=0) / k) - 3, 0, None).astype(int) * k
        right = int(min(np.ceil(pixels[:, 0].max() / k) + 3, camera.width // k)) * k
        bottom = int(min(np.ceil(pixels[:, 1].max() / k) + 3, camera.height // k)) * k
        if right - left >= 32 * k and bottom - top >= 32 * k:
            wanted.append((view, k, (top, left, bottom, right)))
    box = np.array([np.array(edges) // k for _, k, edges in wanted], np.int64).reshape(-1, 4)
    corner, shape = box[:, :2], box[:, 2:] - box[:, :2]
    ends = np.cumsum(3 * shape.prod(axis=1))
    pixels, start = np.empty(ends[-1] if len(ends) else 0, np.uint8), ends - 3 * shape.prod(axis=1)

    def read(number: int) -> bool:
        crop = _crop(wanted[number])
        if crop is not None:
            pixels[start[number] : ends[number]] = crop
        return crop is not None

    # Decoding leaves Python's lock free; few photos at a time, because large ones are large while they are decoded.
    with ThreadPoolExecutor(max_workers=min(os.cpu_count() or 1, MAX_READERS)) as readers:
        is_read = np.array(list(readers.map(read, range(len(wanted)))), bool)
    for number in np.flatnonzero(~is_read):
        reporter.warn(f"{wanted[number][0].path}: cannot be read as an image; it is left out.")
    reduced = [view if k == 1 else replace(view, camera=shrunk_camera(view.camera, k)) for view, k, _ in wanted]
    kept = [view for view, there in zip(reduced, is_read, strict=True) if there]
    return PhotoStack(
        views=kept,
        pixels=pixels,
        start=start[is_read],
        shape=shape[is_read],
        corner=corner[is_read],
        camera=np.array([camera_row(view) for view in kept]).reshape(-1, ROW_0 + 1),
        centre=np.array([view.centre for view in kept]).reshape(-1, 3),
    )


def _crop(wanted: tuple[View, int, tuple[int, int, int, int]]) -> np.ndarray | None:
    """(N,) uint8: one photo's crop (top, left, bottom, right) by its reduction; ``None`` where it cannot be read."""
    import cv2

    view, k, (top, left, bottom, right) = wanted
    camera = view.camera
    image = cv2.imread(str(view.path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        return None
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"{view.path}: is {image.shape[1]} x {image.shape[0]} pixels, expected {camera.width} x "
            f"{camera.height} as when it was aligned; give the original photo."
        )
    return shrink(image[top:bottom, left:right], k).ravel()
