"""Pinhole crops of the photos over one stem's band, with what lies behind the stem: a texture on the local ground.

The cost of everything that follows is proportional to the pixels cut out here, so the crops cover the stem's cylinder
and little more. A crop keeps its photo's rotation and centre; only the lens distortion is taken out (one resampling).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numba
import numpy as np

from ...reconstruction.cameras import View
from ...reconstruction.images import pinhole_maps
from .project import CropCamera


@dataclass(frozen=True)
class Crop:
    """One photo's view of one stem band.

    camera: pinhole, in the stem's own frame (origin at the seed on the ground). image: (H, W, 3) float32, 0..1, gamma
    space. weight: (H, W) float32, 0 where the photo shows something the band model does not explain. texels: (H, W, 2)
    float32, column and row in the ground texture. ground: (H, W) float32, weight as a picture of the ground: 0 where
    the stem may stand in front of it. flight: index of the flight.
    """

    camera: CropCamera
    image: np.ndarray
    weight: np.ndarray
    texels: np.ndarray
    ground: np.ndarray
    flight: int

    @property
    def pixels(self) -> int:
        """How many it has."""
        return self.camera.width * self.camera.height

    def part(self, box: tuple[slice, slice]) -> Crop:
        """Its pixels in a box, rows and columns."""
        rows, columns = box
        image = np.ascontiguousarray(self.image[box])
        camera = self.camera.part(columns.start, rows.start, image.shape[1], image.shape[0])
        weight, texels, ground = (np.ascontiguousarray(v[box]) for v in (self.weight, self.texels, self.ground))
        return replace(self, camera=camera, image=image, weight=weight, texels=texels, ground=ground)


def band_outline(radius_m: float, low_m: float, high_m: float) -> np.ndarray:
    """(48, 3) points on the rims and the middle of the stem's cylinder, around the origin."""
    angle = np.arange(16) * np.pi / 8
    ring = np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle), np.zeros(16)])
    return np.concatenate([ring + [0, 0, z] for z in (low_m, (low_m + high_m) / 2, high_m)])


def crop_camera(view: View, origin: np.ndarray, outline: np.ndarray, margin_px: float = 2.0) -> CropCamera | None:
    """Smallest pinhole crop that holds ``outline`` (K, 3, relative to ``origin``); None where it leaves the photo by
    more than a quarter, or reaches behind the camera.
    """
    view = view.at_point(origin)
    pixels, depth = view.project(outline + origin)
    if not np.all(depth > 0) or view.contains(pixels).mean() < 0.75:
        return None
    crop = crop_around(view, outline + origin, margin_px)
    if crop.width * crop.height > 4 * view.camera.width * view.camera.height:
        return None
    return replace(crop, translation=view.translation + view.rotation @ origin)


def crop_around(view: View, points: np.ndarray, margin_px: float = 2.0) -> CropCamera:
    """Smallest pinhole crop that holds (N, 3) points in front of the camera, at the photo's resolution."""
    camera = view.camera
    local = points @ view.rotation.T + view.translation
    u, v = camera.fx * local[:, 0] / local[:, 2] + camera.cx, camera.fy * local[:, 1] / local[:, 2] + camera.cy
    x0, y0 = np.floor([u.min() - margin_px, v.min() - margin_px])
    x1, y1 = np.ceil([u.max() + margin_px, v.max() + margin_px])
    return CropCamera(
        int(x1 - x0),
        int(y1 - y0),
        camera.fx,
        camera.fy,
        camera.cx - x0,
        camera.cy - y0,
        view.rotation,
        view.translation,
    )


def cut_out(photo: np.ndarray, view: View, crop: CropCamera) -> tuple[np.ndarray, np.ndarray]:
    """Resample a photo (H, W, 3 uint8 RGB) into a crop of the same or a lower resolution, lens distortion removed.

    Cubic, because a linear resampling would blur edges that are measured to a tenth of a pixel. Returns (h, w, 3)
    uint8 and (h, w) float32, 1 where the pixel lies inside the photo.
    """
    camera = view.camera
    scale = crop.fx / camera.fx
    left, top = camera.cx - crop.cx / scale, camera.cy - crop.cy / scale
    map_u, map_v, _ = pinhole_maps(camera, (left, top, left + crop.width / scale, top + crop.height / scale), scale)
    inside = (map_u >= 0) & (map_u <= camera.width - 1) & (map_v >= 0) & (map_v <= camera.height - 1)
    image = cv2.remap(photo, map_u, map_v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return image, inside.astype(np.float32)


def near_axis(camera: CropCamera, radius_m: float, low_m: float, high_m: float) -> np.ndarray:
    """(H, W) bool: the pixel's ray passes within ``radius_m`` of the vertical through the origin, low to high."""
    centre, rays = camera.centre, camera.pixel_rays() @ camera.rotation
    flat = np.maximum(np.einsum("hwc,hwc->hw", rays[..., :2], rays[..., :2]), 1e-12)
    down = np.where(np.abs(rays[..., 2]) > 1e-9, rays[..., 2], 1e-9)
    ends = np.sort([(low_m - centre[2]) / down, (high_m - centre[2]) / down], axis=0)
    t = np.clip(-(rays[..., :2] @ centre[:2]) / flat, *np.maximum(ends, 0))
    closest = centre[:2] + t[..., None] * rays[..., :2]
    return np.hypot(closest[..., 0], closest[..., 1]) < radius_m


@dataclass(frozen=True)
class GroundPlane:
    """Ground texture of one stem: a plane z = a x + b y + c in the stem's frame, cut into square cells.

    half_m: half the side of the square. cell_m: side of a cell.
    """

    a: float
    b: float
    c: float
    half_m: float
    cell_m: float

    @classmethod
    def around(
        cls, ground: Callable[[np.ndarray, np.ndarray], np.ndarray], origin: np.ndarray, half_m: float, cell_m: float
    ) -> GroundPlane:
        """Least-squares plane through the ground on a grid about ``origin``; level where the ground is unknown."""
        steps = np.linspace(-half_m, half_m, 9)
        x, y = (value.ravel() for value in np.meshgrid(steps, steps))
        z = np.asarray(ground(x + origin[0], y + origin[1]), float) - origin[2]
        known = np.isfinite(z)
        if known.sum() < 6:
            return cls(0.0, 0.0, 0.0, half_m, cell_m)
        design = np.column_stack([x, y, np.ones_like(x)])[known]
        a, b, c = np.linalg.lstsq(design, z[known], rcond=None)[0]
        return cls(float(a), float(b), float(c), half_m, cell_m)

    @property
    def cells(self) -> int:
        """Cells along one side."""
        return int(np.ceil(2 * self.half_m / self.cell_m))

    def texels(self, camera: CropCamera) -> np.ndarray:
        """(H, W, 2) float32 texture column and row that each pixel's ray meets the ground in; clamped to the border."""
        rays = camera.pixel_rays() @ camera.rotation
        centre = camera.centre
        normal = np.array([-self.a, -self.b, 1.0])
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (self.c - centre @ normal) / (rays @ normal)
        hit = centre + t[..., None] * rays
        found = (hit[..., :2] + self.half_m) / self.cell_m
        found[~(t > 0) | ~np.isfinite(t)] = 0
        return np.clip(found, 0.5, self.cells - 0.5).astype(np.float32)

    def points(self, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(K, 3) centres of cells."""
        x, y = (columns + 0.5) * self.cell_m - self.half_m, (rows + 0.5) * self.cell_m - self.half_m
        return np.column_stack([x, y, self.a * x + self.b * y + self.c])


@numba.njit(cache=True, nogil=True)
def sample_texture(texture, texels, out):
    """Bilinear texture colours. texture: (S, S, 3) float32; texels: (H, W, 2); out: (H, W, 3)."""
    size = texture.shape[0]
    for y in range(texels.shape[0]):
        for x in range(texels.shape[1]):
            c, r = texels[y, x, 0] - np.float32(0.5), texels[y, x, 1] - np.float32(0.5)
            c0, r0 = min(max(int(c), 0), size - 2), min(max(int(r), 0), size - 2)
            fc, fr = c - c0, r - r0
            for k in range(3):
                top = texture[r0, c0, k] * (1 - fc) + texture[r0, c0 + 1, k] * fc
                bottom = texture[r0 + 1, c0, k] * (1 - fc) + texture[r0 + 1, c0 + 1, k] * fc
                out[y, x, k] = top * (1 - fr) + bottom * fr


@numba.njit(cache=True, nogil=True)
def _median_rows(values, out):
    """Median of each row of (K, V), NaN left out; NaN where nothing is left."""
    scratch = np.empty(values.shape[1], values.dtype)
    for i in range(values.shape[0]):
        n = 0
        for j in range(values.shape[1]):
            value = values[i, j]
            if value == value:
                at = n
                while at > 0 and scratch[at - 1] > value:
                    scratch[at] = scratch[at - 1]
                    at -= 1
                scratch[at] = value
                n += 1
        out[i] = np.nan if n == 0 else (scratch[(n - 1) // 2] + scratch[n // 2]) / 2


def median_texture(plane: GroundPlane, crops: list[Crop]) -> np.ndarray:
    """(S, S, 3) float32 ground colours: per cell the median over the crops that show it, well-weighted pixels only.

    A given cell is hidden by the stem in few views only, and those pixels are left out (``Crop.ground``): otherwise
    the ground would learn a picture of the stem, and nothing would be left to explain. Cells that fewer than two crops
    show take the colour of their nearest known neighbours.
    """
    size = plane.cells
    used = np.zeros((size, size), bool)
    for crop in crops:
        used[crop.texels[..., 1].astype(int), crop.texels[..., 0].astype(int)] = True
    rows, columns = np.nonzero(used)
    points = plane.points(columns, rows)
    seen = np.full((len(rows), len(crops), 3), np.nan, np.float32)
    for j, crop in enumerate(crops):
        pixels, _ = crop.camera.project(points)
        map_u, map_v = (pixels - 0.5).T.astype(np.float32)
        masked = np.where(crop.ground[..., None] > 0.5, crop.image, np.nan).astype(np.float32)
        # A map longer than a 16-bit integer is refused by OpenCV.
        for first in range(0, len(rows), 32000):
            part = slice(first, first + 32000)
            seen[part, j] = cv2.remap(
                masked,
                map_u[part, None],
                map_v[part, None],
                cv2.INTER_NEAREST,
                borderMode=cv2.BORDER_CONSTANT,
                borderValue=(np.nan, np.nan, np.nan),
            )[:, 0]
    median = np.empty((len(rows), 3), np.float32)
    for k in range(3):
        _median_rows(np.ascontiguousarray(seen[..., k]), median[:, k])
    known = np.isfinite(seen[..., 0]).sum(axis=1) >= min(2, len(crops))
    texture = np.zeros((size, size, 3), np.float32)
    texture[rows[known], columns[known]] = median[known]
    return _fill(texture, rows[known], columns[known])


def ground_textures(plane: GroundPlane, around: list[Crop], flights: set[int]) -> dict[int, np.ndarray]:
    """:func:`median_texture` of each flight. Shadows move between flights: each with enough crops has a ground of its
    own."""
    pooled, textures = None, {}
    for flight in sorted(flights):
        own = [crop for crop in around if crop.flight == flight]
        if 6 <= len(own) < len(around):
            textures[flight] = median_texture(plane, own)
        else:
            pooled = median_texture(plane, around) if pooled is None else pooled
            textures[flight] = pooled
    return textures


def _fill(texture: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Give every other cell the colour of the nearest known one (grey where none is)."""
    if len(rows) == 0:
        return np.full_like(texture, 0.5)
    unknown = np.ones(texture.shape[:2], np.uint8)
    unknown[rows, columns] = 0
    _, labels = cv2.distanceTransformWithLabels(unknown, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)
    colours = np.zeros((labels.max() + 1, 3), np.float32)
    colours[labels[rows, columns]] = texture[rows, columns]
    return np.ascontiguousarray(colours[labels])


@dataclass(frozen=True)
class FoliageRule:
    """Chromaticity G/(R+G+B) above which a pixel is foliage; ``low`` to ``high`` is the soft edge."""

    low: float
    high: float

    def weight(self, image: np.ndarray) -> np.ndarray:
        """(H, W, 3) uint8 -> (H, W) float32 weight, 0 on foliage.

        Smoothed first: the colour of one dark pixel is mostly noise.
        """
        smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0)
        green = smooth[..., 1] / np.maximum(smooth.sum(axis=-1), 1)
        return np.clip((self.high - green) / max(self.high - self.low, 1e-6), 0, 1).astype(np.float32)


def foliage_rule(samples: np.ndarray) -> FoliageRule | None:
    """Learn the split between foliage and the rest from (N, 3) uint8 pixels of these very photos (Otsu's criterion).

    None where the colours do not fall into two classes of which the upper is green: a leaf-off or dry stand has no
    such split, and masking by a guess would remove bark.
    """
    total = samples.astype(float).sum(axis=1)
    green = samples[total > 30, 1] / total[total > 30]
    if len(green) < 500:
        return None
    counts, edges = np.histogram(green, bins=200, range=(0.25, 0.6))
    middle = (edges[1:] + edges[:-1]) / 2
    below, mass = np.cumsum(counts), counts.sum()
    moment = np.cumsum(counts * middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = (moment[-1] / mass * below - moment) ** 2 / (below * (mass - below))
    best = int(np.nanargmax(np.where(np.isfinite(between), between, -1)))
    split = edges[best + 1]
    lower, upper = green[green < split], green[green >= split]
    if min(len(lower), len(upper)) < 0.03 * len(green):
        return None
    explained = 1 - (lower.var() * len(lower) + upper.var() * len(upper)) / (green.var() * len(green))
    # One normal class explains 0.64 of its variance by Otsu's split; two separate ones more. 1/3 is grey.
    if explained < 0.72 or upper.mean() < 1 / 3 + 0.02 or upper.mean() - lower.mean() < 0.02:
        return None
    return FoliageRule(float(split), float(upper.mean()))


def halved(crop: Crop, plane: GroundPlane) -> Crop:
    """The crop at half resolution."""
    camera = crop.camera.scaled(0.5)
    size = (camera.width, camera.height)
    return replace(
        crop,
        camera=camera,
        image=cv2.resize(crop.image, size, interpolation=cv2.INTER_AREA),
        weight=cv2.resize(crop.weight, size, interpolation=cv2.INTER_AREA),
        ground=cv2.resize(crop.ground, size, interpolation=cv2.INTER_AREA),
        texels=plane.texels(camera),
    )
