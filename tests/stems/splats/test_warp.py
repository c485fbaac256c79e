"""The Warp kernels against the Numba ones, on Warp's CPU device (and a GPU where there is one)."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("warp", reason="warp-lang is not installed; the GPU path is optional")

from treedgs_geo.core.errors import InputError
from treedgs_geo.stems.splats.devices import make_rasteriser
from treedgs_geo.stems.splats.field import COLOUR, LOG_SCALE, LOGIT, MEAN, QUATERNION
from treedgs_geo.stems.splats.point_kernels import TILE_PX, list_by_tile, opacity_before
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.raster import Rasteriser, project
from treedgs_geo.stems.splats.warp_raster import WarpRasteriser, available
from treedgs_geo.stems.splats.warp_raster import opacity_before as warp_opacity

CAMERA = CropCamera(83, 57, 300.0, 310.0, 41.0, 29.0, np.eye(3), np.array([0, 0, 6.0]))
DEVICES = [device for device in ("cpu", "cuda") if available(device)]


def some(n: int = 300, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    p = np.zeros((n, 14))
    p[:, MEAN] = rng.uniform(-0.8, 0.8, (n, 3))
    p[:, QUATERNION] = rng.standard_normal((n, 4))
    p[:, LOG_SCALE] = np.log(rng.uniform(0.004, 0.2, (n, 3)))
    p[:, LOGIT], p[:, COLOUR] = rng.uniform(-3, 4, n), rng.random((n, 3))
    return p


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("full", [False, True])
def test_pictures_and_gradients_agree(device, full):
    p, rng = some(), np.random.default_rng(1)
    ours, theirs = Rasteriser(1, 0.15), WarpRasteriser(device, 0.15)
    one, two = ours.forward(p, CAMERA, full), theirs.forward(p, CAMERA, full)
    for k, (a, b) in enumerate(zip(one.planes, two.planes, strict=True)):
        different = ~np.isclose(a, b, atol=2e-4, equal_nan=True)
        # The median depth is a choice: at a transmittance of 0.5 to the last bit it may fall either way. Everywhere
        # else a pixel on an ellipse's rim (alpha = 1/255) may be in or out.
        assert different.mean() < (0.01 if k == 5 else 0.002)
        assert k == 5 or np.abs(a - b).max() < 0.02
    given = rng.standard_normal((8 if full else 4, 57, 83)).astype(np.float32)
    a, b = ours.backward(p, one, given), theirs.backward(p, two, given)
    scale = np.abs(a).max(axis=0) + 1e-9
    assert (np.abs(a - b) / scale).max() < 0.01


@pytest.mark.parametrize("device", DEVICES)
def test_point_queries_agree(device):
    p, rng = some(), np.random.default_rng(2)
    far = CropCamera(83, 57, 30000.0, 31000.0, 41.0, 29.0, np.eye(3), np.array([0, 0, 600.0]))
    for camera in (CAMERA, far):
        projected, _ = project(p, camera)
        m, tiles_x, tiles_y = 4000, (83 - 1) // TILE_PX + 1, (57 - 1) // TILE_PX + 1
        points = np.stack([rng.uniform(0, 83, m), rng.uniform(0, 57, m), camera.translation[2] + rng.uniform(-1, 1, m)])
        tile = (points[1] // TILE_PX).astype(int) * tiles_x + (points[0] // TILE_PX).astype(int)
        points = points[:, np.argsort(tile, kind="stable")].astype(np.float32)
        start = np.zeros(tiles_x * tiles_y + 1, np.int64)
        list_by_tile(projected, projected.shape[1], tiles_x, tiles_y, start, start, False)
        start = np.cumsum(start)
        items = np.empty(start[-1], np.int64)
        list_by_tile(projected, projected.shape[1], tiles_x, tiles_y, start.copy(), items, True)
        first = np.searchsorted(np.sort(tile), np.arange(tiles_x * tiles_y + 1))
        before, met = np.empty(m, np.float32), np.empty(m, np.int32)
        opacity_before(projected, start, items, first, points, before, met)
        got, count = warp_opacity(projected, 83, 57, points, device=device)
        assert (np.abs(got - before) > 2e-3).mean() < 0.005 and np.abs(got - before).max() < 0.03
        assert (count != met).mean() < 0.01


def test_a_missing_gpu_is_one_sentence():
    if available("cuda"):
        assert make_rasteriser("cuda").device == "cuda"
        return
    with pytest.raises(InputError, match="no such GPU was found"):
        make_rasteriser("cuda")


@pytest.mark.parametrize("device", DEVICES)
def test_nothing_to_draw(device):
    p = some(5)
    p[:, 2] = -50
    raster = WarpRasteriser(device)
    done = raster.forward(p, CAMERA)
    assert done.planes[3].min() == 1
    assert not raster.backward(p, done, np.ones((4, 57, 83), np.float32)).any()
