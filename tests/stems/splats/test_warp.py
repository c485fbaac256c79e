"""The Warp kernels against the Numba ones, on Warp's CPU device (and a GPU where there is one)."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")
wp = pytest.importorskip("warp", reason="warp-lang is not installed; the GPU path is optional")

from treedgs_geo.core.errors import InputError  # noqa: E402
from treedgs_geo.stems.splats.camera import CropCamera  # noqa: E402
from treedgs_geo.stems.splats.field import COLOUR, LOG_SCALE, LOGIT, MEAN, QUATERNION  # noqa: E402
from treedgs_geo.stems.splats.on_torch import check_device, warp_project, warp_raster  # noqa: E402
from treedgs_geo.stems.splats.on_torch.project import project  # noqa: E402
from treedgs_geo.stems.splats.on_torch.rasterize import rasterize, tensors_of  # noqa: E402
from treedgs_geo.stems.splats.on_torch.warp_raster import available  # noqa: E402

CAMERA = CropCamera(83, 57, 300.0, 310.0, 41.0, 29.0, np.eye(3), np.array([0, 0, 6.0]))
DEVICES = [device for device in ("cpu", "cuda") if available(device) and (device == "cpu" or torch.cuda.is_available())]


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
    given = torch.tensor(np.random.default_rng(1).standard_normal((9 if full else 4, 57, 83)).astype(np.float32))
    pictures, gradients = [], []
    for warp, on in ((False, "cpu"), (True, device)):
        tensors = tensors_of(some(), on)
        shown = rasterize(*tensors, CAMERA, geometry=full, dilation_px2=0.15, warp=warp)
        planes = shown.planes
        if full:
            planes = torch.cat([planes, torch.nan_to_num(shown.median_depth)[None]])
        (planes * given.to(on)).sum().backward()
        pictures.append(planes.detach().cpu())
        gradients.append([shown.pull.cpu(), *(tensor.grad.cpu() for tensor in tensors)])
    for k, (a, b) in enumerate(zip(*pictures, strict=True)):
        # The median depth is a choice: at a transmittance of 0.5 to the last bit it may fall either way. Everywhere
        # else a pixel on an ellipse's rim (alpha = 1/255) may be in or out.
        assert ((a - b).abs() > 2e-4).float().mean() < (0.01 if k == 8 else 0.002)
        assert k == 8 or (a - b).abs().max() < 0.02
    for mine, other in zip(*gradients, strict=True):
        torch.testing.assert_close(mine, other, atol=1e-2 * float(mine.abs().max()), rtol=0)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("dilation", [0.0, 0.15])
def test_the_projection_and_its_gradients_are_torchs(device, dilation):
    p = some(500)
    p[:100, 2] -= 6.2  # behind the camera, or it is inside
    mine, other = tensors_of(p), tensors_of(p, device)
    rows, index = project([part.double() for part in mine], CAMERA, dilation, 1 / 255)
    found, same = warp_project.project(other, CAMERA, dilation, 1 / 255)
    assert 300 < len(index) < 500 and torch.equal(index, same.cpu())
    torch.testing.assert_close(found.cpu(), rows.float(), rtol=1e-6, atol=1e-6)
    given = torch.tensor(np.random.default_rng(1).standard_normal(rows.shape).astype(np.float32))
    (rows * given).sum().backward()
    pulled = warp_project.pull_back(same, given.to(device), other, CAMERA, dilation, 1 / 255)
    for part, grad in zip(mine, pulled, strict=True):
        torch.testing.assert_close(grad.cpu(), part.grad, rtol=1e-5, atol=1e-7 * float(part.grad.abs().max()))


@pytest.mark.parametrize("arch", [75, 90])
def test_the_kernels_compile_for_a_gpu(arch, tmp_path):
    """NVIDIA's compiler is part of warp-lang: no card is needed for this."""
    for module, kernels in ((warp_raster, ("_forward", "_backward")), (warp_project, ("_project",))):
        wp.compile_aot_module(module, arch=arch, module_dir=tmp_path, use_ptx=True)
        code = next(tmp_path.glob(f"*{module.__name__.split('.')[-1]}*.sm{arch}.ptx")).read_text()
        assert all(f"{kernel}_" in code for kernel in kernels)


def test_a_missing_gpu_is_one_sentence():
    if available("cuda"):
        pytest.skip("there is a GPU")
    with pytest.raises(InputError, match="no such GPU was found"):
        check_device("cuda")


@pytest.mark.parametrize("device", DEVICES)
def test_nothing_to_draw(device):
    p = some(5)
    p[:, 2] = -50
    tensors = tensors_of(p, device)
    shown = rasterize(*tensors, CAMERA, warp=True)
    assert float(shown.alpha.detach().max()) == 0
    shown.planes.sum().backward()
    assert not any(tensor.grad.any() for tensor in tensors)
