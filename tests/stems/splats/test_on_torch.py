"""Gaussians as torch tensors: pictures and gradients against a float64 twin in torch operations, losses against those
in numpy, a fit by a loss of one's own, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from gaussian_reference import normal_consistency, seen, structural_dissimilarity

from tests.stems.splats.test_raster import camera, cloud

torch = pytest.importorskip("torch")

from treedgs_geo.core.errors import InputError  # noqa: E402
from treedgs_geo.stems.splats import kernels  # noqa: E402
from treedgs_geo.stems.splats.on_torch import losses  # noqa: E402
from treedgs_geo.stems.splats.on_torch.harmonics import constant_of, harmonics  # noqa: E402
from treedgs_geo.stems.splats.on_torch.project import (  # noqa: E402
    TILE_PX,
    lists_by_tile,
    project,
    projected_rows,
    turned,
)
from treedgs_geo.stems.splats.on_torch.rasterize import draw, projected, rasterize, tensors_of  # noqa: E402


def twin(means, quats, log_scales, logits, colours, view):
    """(9, H, W) float64: colour, alpha, sum w d, sum w n, median depth (0: none), from 3D precisions (no ray-space
    algebra), all Gaussians over all pixels, no cut-off."""
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
    median = torch.full((view.height, view.width), torch.nan, dtype=torch.float64)
    trans = torch.ones(view.height, view.width, dtype=torch.float64)
    for k in torch.argsort(centre.detach().norm(dim=1), stable=True):
        d = grid - uv[k]
        alpha = torch.sigmoid(logits[k]) * torch.exp(-0.5 * torch.einsum("hwi,ij,hwj->hw", d, conic[k], d))
        weight = alpha.clamp(max=0.99) * trans
        shown = [*colours[k], torch.ones(()), centre[k].norm() + (d * slope[k]).sum(-1), *normal[k]]
        planes = [plane + weight * part for plane, part in zip(planes, shown, strict=True)]
        median = torch.where(trans > 0.5, shown[4], median)
        trans = trans - weight
    return torch.stack([*planes, torch.where(trans <= 0.5, median, 0.0)])


def test_the_twin_passes_gradcheck():
    p = cloud(2, 3)
    small = camera(6, 5)
    assert torch.autograd.gradcheck(lambda *t: twin(*t, small), tensors_of(p, dtype=torch.float64), atol=1e-6)


def test_pictures_and_gradients_are_those_of_the_twin():
    p, view = cloud(9, 3), camera(24, 22)
    p[:, 10] += 2
    given = torch.tensor(np.random.default_rng(2).normal(size=(9, 22, 24)))
    ours, theirs = tensors_of(p), tensors_of(p, dtype=torch.float64)
    rendered = rasterize(*ours, view, geometry=True, alpha_min=1e-7)
    expected = twin(*theirs, view)
    shown = torch.cat([rendered.planes, torch.nan_to_num(rendered.median_depth)[None]])
    assert (shown[8] > 0).float().mean() > 0.1
    torch.testing.assert_close(shown.double(), expected, atol=1e-4, rtol=1e-4)
    (shown * given).sum().backward()
    (expected * given).sum().backward()
    for mine, other in zip(ours, theirs, strict=True):
        assert mine.grad.dtype == torch.float32
        torch.testing.assert_close(mine.grad.double(), other.grad, atol=1e-3 * float(other.grad.abs().max()), rtol=0)


def test_the_projection_passes_gradcheck_against_finite_differences():
    p, view = cloud(4, 5), camera(60, 50)

    def rows(*tensors):
        # Conic, opacity, plane, normal, falloff and colour too: everything that pixels are made of.
        return projected_rows(tensors, view, dilation_px2=0.3)[0]

    assert torch.autograd.gradcheck(rows, tensors_of(p, dtype=torch.float64), atol=1e-5)
    assert rows(*tensors_of(p, dtype=torch.float64)).shape == (17, 4)


def test_what_is_behind_the_camera_or_too_faint_is_not_drawn():
    p, view = cloud(40, 2), camera(60, 50)
    whole = projected(p, view)
    p[3, :3] -= 1000 * view.rotation[2]
    p[5, 10] = -9.0
    rows = projected(p, view)
    assert 20 < rows.shape[1] == whole.shape[1] - 2 and (np.diff(rows[6]) >= 0).all()  # front to back


def test_lists_by_tile_hold_each_gaussian_wherever_its_ellipse_is_drawn():
    view = camera(60, 50)
    rows = projected(cloud(40, 2), view)
    start, items, across = lists_by_tile(torch.from_numpy(rows), view.width, view.height)
    v, u = np.mgrid[: view.height, : view.width] + 0.5
    for g in range(rows.shape[1]):
        dx, dy = u - rows[0, g], v - rows[1, g]
        inside = rows[2, g] * dx * dx + 2 * rows[3, g] * dx * dy + rows[4, g] * dy * dy < rows[13, g]
        touched = set((v[inside] // TILE_PX * across + u[inside] // TILE_PX).astype(int))
        assert all(g in items[start[tile] : start[tile + 1]] for tile in touched)
    assert all((items[a:b].diff() > 0).all() for a, b in zip(start[:-1], start[1:], strict=True))  # front to back


def test_harmonics_are_orthonormal_and_colours_change_with_the_view():
    rng = np.random.default_rng(0)
    z = np.polynomial.legendre.leggauss(8)
    angle = (np.arange(16) + 0.5) * np.pi / 8
    height, turn = (part.ravel() for part in np.meshgrid(z[0], angle, indexing="ij"))
    flat = np.sqrt(1 - height**2)
    sphere = torch.tensor(np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height]))
    weight = torch.tensor(np.repeat(z[1], 16) * np.pi / 8)
    basis = harmonics(sphere, 3)
    torch.testing.assert_close((basis * weight[:, None]).T @ basis, torch.eye(16, dtype=torch.float64))
    p, view = cloud(6, 2), camera()
    tensors = tensors_of(p)
    constant = constant_of(tensors[4].detach())[:, None]
    plain, same = rasterize(*tensors, view), rasterize(*tensors[:4], constant, view)
    torch.testing.assert_close(plain.colour, same.colour)
    many = torch.cat([constant, torch.tensor(rng.normal(0, 0.3, (6, 8, 3)).astype(np.float32))], 1).requires_grad_()
    other = rasterize(*tensors[:4], many, view)
    assert (other.colour - plain.colour).abs().max() > 0.02
    other.colour.sum().backward()
    assert many.grad.abs().sum(dim=(0, 2)).min() > 0


def test_the_pull_on_centres_is_that_of_moving_them_in_the_picture():
    p, view = cloud(9, 3), camera(24, 22)
    given = torch.tensor(np.random.default_rng(2).normal(size=(4, 22, 24)).astype(np.float32))
    tensors = tensors_of(p)
    rendered = rasterize(*tensors, view, alpha_min=1e-7)
    assert float(rendered.pull.abs().max()) == 0
    (rendered.planes * given).sum().backward()

    def value(moved):
        """The loss with all rows of the projection kept but one centre."""
        drawn, index = project(tensors_of(p, dtype=torch.float64), view, 0.0, 1e-7)
        rows = drawn.detach().numpy().astype(np.float32)
        rows[0, index.tolist().index(4)] += moved
        cells = np.zeros((view.height, 3, 4, 8), np.float32)
        cells[:, :, 3] = 1
        kernels.forward_colour(rows, len(index), view.height, view.width, cells.reshape(-1))
        planes = kernels.from_cells(cells.reshape(-1), 4, view.height, view.width)
        planes[3] = 1 - planes[3]
        return float((planes * given.numpy()).sum())

    assert (value(0.05) - value(-0.05)) / 0.1 == pytest.approx(float(rendered.pull[4, 0]), rel=0.02, abs=1e-3)


def test_depth_and_normals_are_those_of_the_kernels_and_carry_gradients():
    p, view = cloud(), camera()
    tensors = tensors_of(p)
    rendered, plain = rasterize(*tensors, view, geometry=True), seen(p, view)
    for name, value in (("colour", plain.colour), ("alpha", plain.alpha), ("depth", plain.depth),
                        ("normal", plain.normals), ("median_depth", plain.median_depth)):  # fmt: skip
        np.testing.assert_allclose(getattr(rendered, name).detach().numpy(), value, atol=2e-4, err_msg=name)
    assert rendered.median_depth.requires_grad
    torch.nansum(rendered.depth + rendered.normal[..., 2]).backward()
    assert all(torch.isfinite(t.grad).all() for t in tensors) and tensors[0].grad.abs().sum() > 0
    assert tensors[4].grad.abs().sum() == 0  # colours move no depth


def test_without_geometry_there_are_four_planes():
    shown = rasterize(*tensors_of(cloud()), camera(60, 90))
    assert shown.planes.shape == (4, 90, 60) and shown.median_depth is None
    with pytest.raises(InputError, match="geometry=True"):
        _ = shown.depth


def test_losses_are_those_of_numpy_and_pull_down():
    rng = np.random.default_rng(4)
    shown, image = rng.uniform(0, 1, (2, 14, 13, 3))
    weight = rng.uniform(0, 1, (14, 13))
    share = weight[..., None] / (3 * weight.sum())
    off = (np.sqrt((shown - image) ** 2 + 1e-6) - 1e-3) * share
    expected = {"l1": off.sum(), "d_ssim": (structural_dissimilarity(shown, image) * share).sum()}
    given = torch.tensor(image), torch.tensor(weight)
    for name, value in expected.items():
        loss = getattr(losses, name)
        tensor = torch.tensor(shown, requires_grad=True)
        assert float(loss(tensor, *given).detach()) == pytest.approx(value, rel=1e-5)
        assert torch.autograd.gradcheck(lambda x, loss=loss: loss(x, *given), tensor, atol=1e-6, nondet_tol=1e-12)
    both = float(losses.photometric(torch.tensor(shown), *given))
    assert both == pytest.approx(0.8 * expected["l1"] + 0.4 * expected["d_ssim"], rel=1e-5)
    assert float(losses.photometric(torch.tensor(image), *given)) == pytest.approx(0, abs=1e-9)


def test_normal_consistency_is_that_of_a_numpy_twin():
    p, view = cloud(60, 7), camera()
    p[:, 10] = 3.0
    planes = draw(p, view, True)
    rays, weight = view.pixel_rays(), np.random.default_rng(1).uniform(0, 1, planes.shape[1:])
    eight = np.concatenate([planes[:3], 1 - planes[3:4], planes[4:5], planes[6:9]]).astype(float)
    value = normal_consistency(eight, rays, weight)
    tensor = torch.tensor(eight, requires_grad=True)
    found = losses.normal_consistency(tensor, torch.tensor(rays), torch.tensor(weight))
    found.backward()
    assert value > 0.01 and float(found.detach()) == pytest.approx(value, rel=1e-5)
    gradient = tensor.grad.numpy()
    for at in zip(*np.unravel_index(np.argsort(-np.abs(gradient[4:]), axis=None)[:6], gradient[4:].shape), strict=True):
        place, step = (at[0] + 4, *at[1:]), np.zeros_like(eight)
        step[place] = 1e-6
        numeric = (
            normal_consistency(eight + step, rays, weight) - normal_consistency(eight - step, rays, weight)
        ) / 2e-6
        assert gradient[place] == pytest.approx(numeric, rel=1e-3)


def test_unit_rays_are_those_of_the_camera():
    np.testing.assert_allclose(
        losses.unit_rays(camera(), torch.device("cpu")).numpy(), camera().pixel_rays(), atol=1e-6
    )


def test_a_loss_of_ones_own_fits_in_ten_lines():
    """The example of docs/analyst/gaussians.md: moved and dulled Gaussians find back to a picture."""
    p, view = cloud(20, 1), camera()
    image = torch.tensor(seen(p, view).colour)
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
    found = tensors[0].detach().numpy()
    assert np.abs(found - p[:, :3]).mean() < 0.8 * np.abs(start[:, :3] - p[:, :3]).mean()


def test_nothing_to_draw_has_zero_gradients():
    tensors = tensors_of(cloud(3))
    with torch.no_grad():
        tensors[0][:, 2] -= 1000.0
    rendered = rasterize(*tensors, camera(), geometry=True)
    assert torch.isnan(rendered.depth).all() and float(rendered.alpha.detach().sum()) == 0
    rendered.planes.sum().backward()
    assert float(tensors[0].grad.abs().sum()) == 0


def test_wrong_shapes_are_named():
    tensors = tensors_of(cloud(5))
    with pytest.raises(InputError, match=r"quats has shape \(5, 3\), expected \(5, 4\)"):
        rasterize(tensors[0], tensors[1][:, :3], *tensors[2:], camera())
    with pytest.raises(InputError, match=r"colours has shape \(4, 3\), expected \(5, 3\)"):
        rasterize(*tensors[:4], tensors[4][:4], camera())
