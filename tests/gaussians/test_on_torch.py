"""Gaussians as torch tensors: pictures and gradients against a float64 twin in torch operations, losses against those
of the numpy fits, a fit by a loss of one's own, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tests.gaussians.test_raster import camera, cloud

torch = pytest.importorskip("torch")

from treedgs_geo.core.errors import InputError  # noqa: E402
from treedgs_geo.gaussians import loss as numpy_losses  # noqa: E402
from treedgs_geo.gaussians.on_torch import losses  # noqa: E402
from treedgs_geo.gaussians.on_torch.rasterize import packed_of, rasterize, tensors_of  # noqa: E402
from treedgs_geo.gaussians.raster import Rasteriser, render  # noqa: E402


def turned(quats):
    w, x, y, z = (quats / quats.norm(dim=1, keepdim=True)).unbind(1)
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return torch.stack(rows, 1).reshape(-1, 3, 3)


def twin(means, quats, log_scales, logits, colours, view):
    """(8, H, W) float64: colour, alpha, sum w d, sum w n, from 3D precisions (no ray-space algebra), all Gaussians over
    all pixels, no cut-off."""
    to_camera = torch.tensor(view.rotation, dtype=torch.float64)
    centre = means @ to_camera.T + torch.tensor(view.translation, dtype=torch.float64)
    axes = to_camera @ turned(quats) * torch.exp(log_scales)[:, None]
    covariance = axes @ axes.transpose(1, 2)
    x, y, z = centre.unbind(1)
    zero = torch.zeros_like(z)
    jac = torch.stack(
        [
            torch.stack([view.fx / z, zero, -view.fx * x / z**2], 1),
            torch.stack([zero, view.fy / z, -view.fy * y / z**2], 1),
        ],
        1,
    )
    conic = torch.linalg.inv(jac @ covariance @ jac.transpose(1, 2))
    uv = torch.stack([view.fx * x / z + view.cx, view.fy * y / z + view.cy], 1)
    ray = centre / z[:, None]
    q = torch.linalg.solve(covariance, ray[..., None])[..., 0]
    slope_z = -z[:, None] * q / (ray * q).sum(1, keepdim=True)
    far = ray.norm(dim=1, keepdim=True)
    focal = torch.tensor([view.fx, view.fy], dtype=torch.float64)
    slope = (slope_z[:, :2] * far + z[:, None] * ray[:, :2] / far) / focal
    normal = -q / q.norm(dim=1, keepdim=True)
    grid = torch.tensor(np.stack(np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5), -1))
    planes = [torch.zeros(view.height, view.width, dtype=torch.float64)] * 8
    trans = torch.ones(view.height, view.width, dtype=torch.float64)
    for k in torch.argsort(centre.detach().norm(dim=1), stable=True):
        d = grid - uv[k]
        alpha = torch.sigmoid(logits[k]) * torch.exp(-0.5 * torch.einsum("hwi,ij,hwj->hw", d, conic[k], d))
        weight = alpha.clamp(max=0.99) * trans
        shown = [*colours[k], torch.ones(()), centre[k].norm() + (d * slope[k]).sum(-1), *normal[k]]
        planes = [plane + weight * part for plane, part in zip(planes, shown, strict=True)]
        trans = trans - weight
    return torch.stack(planes)


def test_the_twin_passes_gradcheck():
    p = cloud(2, 3)
    small = camera(6, 5)
    assert torch.autograd.gradcheck(lambda *t: twin(*t, small), tensors_of(p, dtype=torch.float64), atol=1e-6)


def test_pictures_and_gradients_are_those_of_the_twin():
    p, view = cloud(9, 3), camera(24, 22)
    given = torch.tensor(np.random.default_rng(2).normal(size=(8, 22, 24)))
    ours, theirs = tensors_of(p), tensors_of(p, dtype=torch.float64)
    rendered = rasterize(*ours, view, geometry=True, alpha_min=1e-7)
    expected = twin(*theirs, view)
    torch.testing.assert_close(rendered.planes.double(), expected, atol=1e-4, rtol=1e-4)
    (rendered.planes * given).sum().backward()
    (expected * given).sum().backward()
    for mine, other in zip(ours, theirs, strict=True):
        assert mine.grad.dtype == torch.float32
        torch.testing.assert_close(mine.grad.double(), other.grad, atol=1e-3 * float(other.grad.abs().max()), rtol=0)


def test_depth_and_normals_are_those_of_render_and_carry_gradients():
    p, view = cloud(), camera()
    tensors = tensors_of(p)
    rendered, plain = rasterize(*tensors, view, geometry=True), render(p, view)
    assert rendered.pairs == plain.pairs
    for name, value in (("colour", plain.colour), ("alpha", plain.alpha), ("depth", plain.depth),
                        ("normal", plain.normals), ("median_depth", plain.median_depth)):  # fmt: skip
        np.testing.assert_allclose(getattr(rendered, name).detach().numpy(), value, atol=2e-4, err_msg=name)
    assert not rendered.median_depth.requires_grad
    torch.nansum(rendered.depth + rendered.normal[..., 2]).backward()
    assert all(torch.isfinite(t.grad).all() for t in tensors) and tensors[0].grad.abs().sum() > 0
    assert tensors[4].grad.abs().sum() == 0  # colours move no depth


def test_without_geometry_there_are_four_planes_and_threads_change_nothing():
    p, view = cloud(), camera(60, 90)
    one, three = (rasterize(*tensors_of(p), view, rasteriser=Rasteriser(n)) for n in (1, 3))
    assert one.planes.shape == (4, 90, 60) and one.median_depth is None
    with pytest.raises(InputError, match="geometry=True"):
        _ = one.depth
    assert torch.equal(one.colour, three.colour)


@pytest.mark.parametrize("name", ["l1", "d_ssim"])
def test_losses_are_those_of_the_numpy_fits(name):
    rng = np.random.default_rng(4)
    shown, image = rng.uniform(0, 1, (2, 31, 26, 3)).astype(np.float32)
    weight = rng.uniform(0, 1, (31, 26)).astype(np.float32)
    value, gradient = getattr(numpy_losses, name)(shown, image, weight)
    tensor = torch.tensor(shown, dtype=torch.float64, requires_grad=True)
    found = getattr(losses, name)(tensor, torch.tensor(image).double(), torch.tensor(weight).double())
    found.backward()
    assert float(found.detach()) == pytest.approx(value, rel=1e-5)
    np.testing.assert_allclose(tensor.grad.numpy(), gradient, atol=1e-3 * np.abs(gradient).max())


def test_normal_consistency_is_that_of_the_numpy_fits():
    p, view = cloud(60, 7), camera()
    p[:, 10] = 3.0
    planes = Rasteriser().forward(p, view, True).planes
    weight = np.random.default_rng(1).uniform(0, 1, planes.shape[1:])
    value, gradient = numpy_losses.normal_consistency(planes, view.pixel_rays(), weight)
    assert value > 0.01
    eight = np.concatenate([planes[:3], 1 - planes[3:4], planes[4:5], planes[6:9]]).astype(float)
    tensor = torch.tensor(eight, requires_grad=True)
    found = losses.normal_consistency(tensor, torch.tensor(view.pixel_rays()), torch.tensor(weight))
    found.backward()
    assert float(found.detach()) == pytest.approx(value, rel=1e-5)
    np.testing.assert_allclose(tensor.grad.numpy(), gradient, atol=1e-4 * np.abs(gradient).max())


def test_a_loss_of_ones_own_fits_in_ten_lines():
    """The example of docs/analyst/gaussians.md: moved and dulled Gaussians find back to a picture."""
    p, view = cloud(20, 1), camera()
    image = torch.tensor(render(p, view, full=False).colour)
    start = p.copy()
    start[:, :3] += np.random.default_rng(0).normal(0, 0.02, (20, 3))
    start[:, 11:] *= 0.7
    tensors = tensors_of(start)
    optimiser = torch.optim.Adam(
        [{"params": [t], "lr": lr} for t, lr in zip(tensors, (3e-3, 0, 0, 0, 0.02), strict=True)]
    )
    course = []
    for _ in range(60):
        optimiser.zero_grad()
        shown = rasterize(*tensors, view)
        loss = ((shown.colour - image) ** 2).mean() + 1e-3 * shown.alpha.mean()
        loss.backward()
        optimiser.step()
        course.append(float(loss.detach()))
    assert course[-1] < 0.2 * course[0]
    found = packed_of(tensors)
    assert np.abs(found[:, :3] - p[:, :3]).mean() < 0.8 * np.abs(start[:, :3] - p[:, :3]).mean()


def test_nothing_to_draw_has_zero_gradients():
    tensors = tensors_of(cloud(3))
    with torch.no_grad():
        tensors[0][:, 2] -= 1000.0
    rendered = rasterize(*tensors, camera(), geometry=True)
    assert rendered.pairs == 0 and torch.isnan(rendered.depth).all() and float(rendered.alpha.sum()) == 0
    rendered.planes.sum().backward()
    assert float(tensors[0].grad.abs().sum()) == 0


def test_wrong_shapes_are_named():
    tensors = tensors_of(cloud(5))
    with pytest.raises(InputError, match=r"quats has shape \(5, 3\), expected \(5, 4\)"):
        rasterize(tensors[0], tensors[1][:, :3], *tensors[2:], camera())
    with pytest.raises(InputError, match=r"colours has shape \(4, 3\), expected \(5, 3\)"):
        rasterize(*tensors[:4], tensors[4][:4], camera())


def test_warp_draws_and_pulls_back_the_same():
    pytest.importorskip("warp")
    from treedgs_geo.gaussians.warp_raster import WarpRasteriser

    p, view = cloud(), camera()
    given = torch.tensor(np.random.default_rng(3).normal(size=(8, view.height, view.width)).astype(np.float32))
    grads = []
    for rasteriser in (Rasteriser(), WarpRasteriser("cpu")):
        tensors = tensors_of(p)
        rendered = rasterize(*tensors, view, geometry=True, rasteriser=rasteriser)
        (rendered.planes * given).sum().backward()
        grads.append((rendered.planes.detach(), [t.grad for t in tensors]))
    assert ((grads[0][0] - grads[1][0]).abs() > 2e-4).float().mean() < 0.005
    for mine, other in zip(grads[0][1], grads[1][1], strict=True):
        torch.testing.assert_close(mine, other, atol=1e-2 * float(mine.abs().max()), rtol=0)
