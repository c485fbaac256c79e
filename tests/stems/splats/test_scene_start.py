"""What the fit of a plot begins with: photos without their lens distortion, points of another program."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pyproj
import pytest

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.splats.scene_start import WholePhotos, read_dense

FRAME = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))


def painted(folder: Path) -> View:
    """A photo painted with its own undistorted coordinates, taken straight down."""
    camera, down = Camera(200, 160, 300, 300, 99, 81, k1=-0.1), np.diag([1.0, -1.0, -1.0])
    x, y = camera.undistort(*np.meshgrid(np.arange(200) + 0.5, np.arange(160) + 0.5))
    picture = np.clip(np.stack([0 * x, 128 + 300 * y, 128 + 300 * x], -1), 0, 255).astype(np.uint8)
    cv2.imwrite(str(folder / "a.png"), picture)
    return View("a.png", folder / "a.png", camera, down, -down @ np.array([0, 0, 50.0]))


def test_photos_lose_their_lens_distortion(tmp_path):
    photos = WholePhotos.load([painted(tmp_path)])
    image, inside, rays = photos.images[0], photos.inside[0] > 0, photos.cameras[0].pixel_rays()
    assert 0.9 < inside.mean() <= 1
    # Clipped where the painted numbers do not fit into a byte.
    inside &= (np.abs(rays[..., :2] / rays[..., 2:]) < 0.4).all(axis=-1)
    for channel in (0, 1):
        off = image[..., channel] - (128 + 300 * rays[..., channel] / rays[..., 2])
        assert np.abs(off[inside]).max() < 2
    half = photos.scaled(0.5)
    assert half.images[0].shape == (80, 100, 3) and half.cameras[0].fx == 150 and len(half) == 1


def test_a_photo_of_another_size_is_refused(tmp_path):
    view = painted(tmp_path)
    cv2.imwrite(str(view.path), np.zeros((80, 100, 3), np.uint8))
    with pytest.raises(InputError, match="is 100 x 80 pixels, expected 200 x 160"):
        WholePhotos.load([view])


def test_an_openmvs_cloud_is_read(tmp_path):
    """Binary PLY with lists of views per point, as OpenMVS writes it."""
    rng, path = np.random.default_rng(0), tmp_path / "scene_dense.ply"
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 300\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property list uint8 uint32 view_indices\nproperty list uint8 float view_weights\nend_header\n"
    )
    points = rng.normal([0, 0, 1.5], [0.1, 0.1, 0.8], (300, 3)).astype(np.float32)
    with open(path, "wb") as stream:
        stream.write(header.encode())
        for point in points:
            stream.write(
                point.tobytes()
                + bytes([60, 50, 40, 2])
                + np.array([0, 3], np.uint32).tobytes()
                + bytes([2])
                + np.array([1, 0.5], np.float32).tobytes()
            )
    xyz, colours = read_dense(path, FRAME)
    np.testing.assert_allclose(xyz, points)
    assert colours.max() < 0.3
    path.write_text("ply\n")
    with pytest.raises(InputError, match="no readable points"):
        read_dense(path, FRAME)
    with pytest.raises(InputError, match="not found"):
        read_dense(tmp_path / "none.ply", FRAME)
