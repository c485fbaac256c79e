"""What the fit of a whole plot begins with: undistorted photos, the plot's box, points of the dense prior in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ...core.crs import LocalFrame
from ...core.errors import InputError, MissingComponentError
from ...core.progress import Reporter
from ...reconstruction.area import Area
from ...reconstruction.cameras import View
from ...reconstruction.dense import DenseOptions, densify_band
from ...reconstruction.images import load_image, pinhole_maps
from .camera import CropCamera

#: Layers that stereo is made in, metres above ground: disparities of one layer stay few.
_LAYERS_M = ((-1.0, 5.0), (5.0, 12.0), (12.0, 20.0), (20.0, 30.0))
#: Cell in which two reference photos must agree, as a share of a pixel's footprint, and its bounds in metres.
_VOXEL_PX, _VOXEL_M = 2.0, (0.03, 0.2)
#: Of the box: beyond the plots, below the ground and above it, metres.
_MARGIN_M, _LOW_M, _HIGH_M = 3.0, -1.5, 40.0


@dataclass(frozen=True)
class WholePhotos:
    """Whole photos without lens distortion.

    cameras: pinhole, one a photo. images: (H, W, 3) uint8 RGB. inside: (H, W) float32, 0 where the photo has no pixel
    once its distortion is taken out."""

    cameras: list[CropCamera]
    images: list[np.ndarray]
    inside: list[np.ndarray]

    @classmethod
    def load(cls, views: Sequence[View], factor: float = 1.0) -> WholePhotos:
        """The views' photos, at ``factor`` times their size (held in memory at that size).

        Raises:
            InputError: a photo that cannot be read, or is of another size than its camera.
        """
        found = cls([], [], [])
        for view in views:
            found._add(CropCamera.of(view), *_undistorted(view), factor)
        return found

    def scaled(self, factor: float) -> WholePhotos:
        """The same at ``factor`` times the size held."""
        if factor == 1:
            return self
        found = WholePhotos([], [], [])
        for camera, image, inside in zip(self.cameras, self.images, self.inside, strict=True):
            found._add(camera, image, inside, factor)
        return found

    def _add(self, camera: CropCamera, image: np.ndarray, inside: np.ndarray, factor: float) -> None:
        camera = camera.scaled(factor)
        self.cameras.append(camera)
        for held, picture in ((self.images, image), (self.inside, inside)):
            same = picture.shape[:2] == (camera.height, camera.width)
            held.append(
                picture if same else cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
            )

    def __len__(self) -> int:
        return len(self.cameras)


def _undistorted(view: View) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) uint8 RGB of the view without lens distortion, and (H, W) float32, 1 where the photo has a pixel.

    Cubic, because a linear resampling would blur edges that are measured to a tenth of a pixel.
    """
    photo, camera = load_image(view), view.camera
    if photo.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"{view.path}: is {photo.shape[1]} x {photo.shape[0]} pixels, expected {camera.width} x {camera.height} as "
            "reconstructed; give the photos that were reconstructed."
        )
    map_u, map_v, _ = pinhole_maps(camera, (0, 0, camera.width, camera.height))
    inside = (map_u >= 0) & (map_u <= camera.width - 1) & (map_v >= 0) & (map_v <= camera.height - 1)
    image = cv2.remap(photo, map_u, map_v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return image, inside.astype(np.float32)


@dataclass(frozen=True)
class Box:
    """What of the world is modelled. low, high: (3,) local metres."""

    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, area: Area, ground: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Box:
        """The box about the plots.

        Raises:
            InputError: the ground is not known there.
        """
        x0, y0, x1, y1 = area.bounds(_MARGIN_M)
        x, y = (part.ravel() for part in np.meshgrid(np.linspace(x0, x1, 9), np.linspace(y0, y1, 9)))
        height = np.asarray(ground(x, y), float)
        if not np.isfinite(height).any():
            raise InputError("The ground under the plots is not known, so there is no box to model; give --dtm.")
        low, high = np.nanmin(height) + _LOW_M, np.nanmax(height) + _HIGH_M
        return cls(np.array([x0, y0, low]), np.array([x1, y1, high]))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) -> (N,) bool."""
        return np.all((points >= self.low) & (points <= self.high), axis=1)

    def seen(self, camera: CropCamera) -> np.ndarray:
        """(H, W) bool: the pixel's ray passes through the box in front of the camera."""
        rays, near, far = camera.pixel_rays() @ camera.rotation, np.array(-np.inf), np.array(np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for low, high, at, ray in zip(self.low, self.high, camera.centre, np.moveaxis(rays, -1, 0), strict=True):
                sides = (low - at) / ray, (high - at) / ray
                near, far = np.maximum(near, np.fmin(*sides)), np.minimum(far, np.fmax(*sides))
        return (far > 0) & (near < far)


def dense_prior(
    views: Sequence[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    area: Area,
    box: Box,
    reporter: Reporter | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(M, 3) local points of our own multi-view stereo over the plots, from the ground to the crowns, and (M, 3) their
    colours 0..1."""
    reporter = reporter or Reporter()
    pixel = float(np.median([np.linalg.norm(v.centre - (box.low + box.high) / 2) / v.camera.fx for v in views]))
    voxel_m = float(np.clip(_VOXEL_PX * pixel, *_VOXEL_M))
    points, colours = [np.empty((0, 3))], [np.empty((0, 3))]
    jobs = [(place, radius, layer) for place, radius in zip(area.centres, area.radii_m, strict=True)
            for layer in _LAYERS_M]  # fmt: skip
    for number, (place, radius, (low, high)) in enumerate(jobs):
        options = DenseOptions(low_m=low, high_m=high, voxel_m=voxel_m, max_views=500)
        with reporter.stage("stereo", number / len(jobs), (number + 1) / len(jobs)):
            xyz, rgb, _ = densify_band(list(views), ground, np.asarray(place), float(radius) + 2.0, options, reporter)
        points.append(xyz)
        colours.append(rgb / 255)
    return np.concatenate(points), np.concatenate(colours)


def read_dense(path: Path, frame: LocalFrame) -> tuple[np.ndarray, np.ndarray | None]:
    """Points to start Gaussians from: (M, 3) local, and (M, 3) colours 0..1 or None.

    path: LAS/LAZ in the project CRS, or a PLY in the reconstruction's own local frame, as OpenMVS writes it
    (``scene_dense.ply``, made from the workspace's ``sfm/``).

    Raises:
        InputError: missing, unreadable, empty, or not where the photos are. MissingComponentError: open3d, for a PLY.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: not found; give a LAS/LAZ cloud or OpenMVS's scene_dense.ply.")
    colours = None
    if path.suffix.lower() == ".ply":
        try:
            import open3d
        except ImportError:
            raise MissingComponentError(
                f"{path}: reading a PLY needs the package open3d, which is not installed; run 'pip install open3d' in "
                "the engine's environment, or give the points as LAZ in the project CRS."
            ) from None

        with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
            cloud = open3d.io.read_point_cloud(path)
        xyz = np.asarray(cloud.points, float)
        colours = np.asarray(cloud.colors, float) if cloud.has_colors() else None
    else:
        from ...pointcloud.files import read_cloud

        xyz = frame.to_local(read_cloud(path, attributes=()).xyz)
    if len(xyz) == 0 or not np.isfinite(xyz).all():
        raise InputError(f"{path}: holds no readable points; write it again.")
    if np.abs(np.median(xyz, axis=0)).max() > 5000:
        raise InputError(
            f"{path}: lies {np.abs(np.median(xyz, axis=0)).max() / 1000:.0f} km from the photos; a PLY must be "
            "in the local frame of sfm/, a LAZ in the project CRS."
        )
    return xyz, colours


def thinned(points: np.ndarray, colours: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """One point (the mean) a cell, the cells just so large that at most ``most`` are left."""
    cell = 0.01
    while True:
        place = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
        _, owner, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
        if len(count) <= most:
            break
        cell *= max(1.05, (len(count) / most) ** 0.5)
    sums = np.zeros((len(count), 6))
    np.add.at(sums, owner.ravel(), np.hstack([points, colours]))
    mean = sums / count[:, None]
    return mean[:, :3], mean[:, 3:]


def start_scales(points: np.ndarray) -> np.ndarray:
    """(N,) standard deviations, metres, as published: the root mean square distance to the three nearest neighbours."""
    if len(points) < 4:
        return np.full(len(points), 0.1)
    away = cKDTree(points).query(points, k=4)[0][:, 1:]
    return np.maximum(np.sqrt((away**2).mean(axis=1)), 1e-3)
