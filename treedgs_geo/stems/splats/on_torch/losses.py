"""The published losses in torch operations, on the tensors' device; and what one writes a loss of one's own beside."""

from __future__ import annotations

from functools import cache
from typing import Any

import cv2
import numpy as np
import torch
from torch.nn.functional import conv2d

from ..camera import CropCamera
from .rasterize import Rendered

_C1, _C2 = 0.01**2, 0.03**2
#: Window of the structural similarity: pixels and their standard deviation (as OpenCV's, and the published one).
_WINDOW, _SIGMA = 11, 1.5
#: Of the absolute colour error about zero.
_SOFT = 1e-3
#: Least alpha of a pixel that shows a surface.
_SOLID = 0.5
#: Share of the structural similarity in the loss, as published.
_SSIM = 0.2


def l1(shown: torch.Tensor, image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Weighted mean of sqrt(d^2 + s^2) - s, s = ``_SOFT``. shown, image: (H, W, 3). weight: (H, W)."""
    size = ((shown - image) ** 2 + _SOFT**2).sqrt() - _SOFT
    return (size * _share(weight)).sum()


def d_ssim(shown: torch.Tensor, image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Weighted mean of (1 - SSIM) / 2 (11 x 11 Gaussian window, zero borders). shown, image: (H, W, 3)."""
    blur = _Blur.apply
    mu_x, mu_y = blur(shown), blur(image)
    xx, yy, xy = blur(shown * shown), blur(image * image), blur(shown * image)
    over = (2 * mu_x * mu_y + _C1) * (2 * (xy - mu_x * mu_y) + _C2)
    under = (mu_x**2 + mu_y**2 + _C1) * (xx - mu_x**2 + yy - mu_y**2 + _C2)
    return 0.5 * ((1 - over / under) * _share(weight)).sum()


def photometric(shown: torch.Tensor, image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """0.8 L1 + 0.2 (1 - SSIM), as the published fits have it (3DGS, RaDe-GS)."""
    return (1 - _SSIM) * l1(shown, image, weight) + _SSIM * 2 * d_ssim(shown, image, weight)


def normal_consistency(
    planes: torch.Tensor, rays: torch.Tensor, weight: torch.Tensor, distance: torch.Tensor | None = None
) -> torch.Tensor:
    """Rendered normals against those of a surface of distances: weighted mean of 1 - cos.

    planes: (8, H, W) of :class:`.rasterize.Rendered`. rays: (H, W, 3) unit directions, camera axes
    (``CropCamera.pixel_rays``). weight: (H, W). distance: (H, W) from the camera centre, NaN where there is none
    (``Rendered.median_depth``); default: the expected distance. Pixels with alpha below ``_SOLID`` or without a
    distance, and the border, are left out.
    """
    alpha = planes[3]
    solid = alpha >= _SOLID
    if distance is None:
        distance = planes[4] / alpha.clamp_min(1e-3)
    else:
        solid = solid & torch.isfinite(distance)
        distance = torch.where(solid, distance, torch.ones_like(distance))
    points = distance[..., None] * rays
    along, down = points[1:-1, 2:] - points[1:-1, :-2], points[2:, 1:-1] - points[:-2, 1:-1]
    cross = torch.linalg.cross(along, down)
    rendered = planes[5:].permute(1, 2, 0)[1:-1, 1:-1]
    size, length = ((vector**2).sum(dim=-1) for vector in (cross, rendered))
    use = solid[1:-1, 1:-1] & solid[1:-1, 2:] & solid[1:-1, :-2] & solid[2:, 1:-1] & solid[:-2, 1:-1]
    use = use & (size > 1e-24) & (length > 1e-12)
    # The inner where keeps the gradient of pixels that are left out finite.
    norm = torch.where(use, size * length, torch.ones_like(size)).sqrt()
    # x right, y down, z forward: (right x down) points away from the camera, the normals face it.
    cosine = -(cross * rendered).sum(dim=-1) / norm
    return (torch.where(use, 1 - cosine, 0.0) * weight[1:-1, 1:-1]).sum() / weight.sum().clamp_min(1e-6)


def depth_normal(rendered: Rendered, rays: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """The depth-normal term of RaDe-GS: 0.4 x against the expected depth + 0.6 x against the median depth."""
    expected = normal_consistency(rendered.planes, rays, weight)
    median = normal_consistency(rendered.planes, rays, weight, distance=rendered.median_depth)
    return 0.4 * expected + 0.6 * median


def unit_rays(camera: CropCamera, device: torch.device) -> torch.Tensor:
    """(H, W, 3) float32 ``CropCamera.pixel_rays`` on a device."""
    x = (torch.arange(camera.width, device=device) + 0.5 - camera.cx) / camera.fx
    y = (torch.arange(camera.height, device=device) + 0.5 - camera.cy) / camera.fy
    down, along = torch.meshgrid(y, x, indexing="ij")
    rays = torch.stack([along, down, torch.ones_like(along)], dim=-1)
    return rays / (1 + along**2 + down**2).sqrt()[..., None]


def _share(weight: torch.Tensor) -> torch.Tensor:
    return weight[..., None] / (3 * weight.sum()).clamp_min(1e-6)


class _Blur(torch.autograd.Function):
    """(H, W, 3) smoothed, zeros beyond the border; such a filter is its own adjoint. OpenCV's on the CPU, where torch's
    convolutions of one channel take twenty times as long."""

    @staticmethod
    def forward(ctx: Any, image: torch.Tensor) -> torch.Tensor:
        return _smoothed(image)

    @staticmethod
    def backward(ctx: Any, *given: torch.Tensor) -> torch.Tensor:
        return _smoothed(given[0])


def _smoothed(image: torch.Tensor) -> torch.Tensor:
    if image.device.type == "cpu":
        plain = np.ascontiguousarray(image.detach().numpy())
        window = (_WINDOW, _WINDOW)
        return torch.from_numpy(cv2.GaussianBlur(plain, window, _SIGMA, borderType=cv2.BORDER_CONSTANT))
    # One group a channel, contiguous: torch's own kernel, which for one channel is many times faster than cuDNN's.
    moved, line = image.detach().permute(2, 0, 1).contiguous(), _line(image.device).expand(image.shape[2], 1, 1, -1)
    moved = conv2d(moved, line.mT, padding=(_WINDOW // 2, 0), groups=len(moved))
    return conv2d(moved, line, padding=(0, _WINDOW // 2), groups=len(moved)).permute(1, 2, 0)


@cache
def _line(device: torch.device) -> torch.Tensor:
    line = torch.exp(-0.5 * ((torch.arange(_WINDOW, device=device) - _WINDOW // 2) / _SIGMA) ** 2)
    return line / line.sum()
