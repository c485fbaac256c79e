"""Losses on one crop and their gradients with respect to the rendered planes.

As published (3DGS, RaDe-GS): (1 - l) L1 + l D-SSIM with l = 0.2, plus depth-normal consistency. Pixels carry weights:
what the band model cannot explain (foliage, other stems) must not be explained by fog.
"""

from __future__ import annotations

import cv2
import numpy as np

_C1, _C2 = 0.01**2, 0.03**2


def robust_weight(residual: np.ndarray, scale: float) -> np.ndarray:
    """Geman-McClure weight (H, W) of the colour distance (H, W, 3): 1 at 0, 1/4 at ``scale``."""
    square = np.einsum("hwc,hwc->hw", residual, residual)
    return (scale**2 / (scale**2 + square)) ** 2


def l1(shown: np.ndarray, image: np.ndarray, weight: np.ndarray, softness: float = 0.01) -> tuple[float, np.ndarray]:
    """Weighted mean of sqrt(d^2 + softness^2) - softness (L1 with a differentiable tip) and its gradient (H, W, 3)."""
    difference = shown - image
    size = np.sqrt(difference * difference + np.float32(softness**2))
    scale = weight[..., None] / np.float32(max(3 * weight.sum(), 1e-6))
    return float(((size - softness) * scale).sum()), difference / size * scale


def _blur(image: np.ndarray) -> np.ndarray:
    # Zero borders make the filter its own adjoint, which the gradient below relies on.
    return cv2.GaussianBlur(image, (11, 11), 1.5, borderType=cv2.BORDER_CONSTANT)


def d_ssim(shown: np.ndarray, image: np.ndarray, weight: np.ndarray) -> tuple[float, np.ndarray]:
    """Weighted mean of (1 - SSIM) / 2 (11 x 11 Gaussian window) and its gradient with respect to ``shown``, (H, W, 3)
    float32.
    """
    mu_x, mu_y = _blur(shown), _blur(image)
    xx, yy, xy = _blur(shown * shown), _blur(image * image), _blur(shown * image)
    a1, a2 = 2 * mu_x * mu_y + _C1, 2 * (xy - mu_x * mu_y) + _C2
    b1, b2 = mu_x**2 + mu_y**2 + _C1, xx - mu_x**2 + yy - mu_y**2 + _C2
    ssim = a1 * a2 / (b1 * b2)
    scale = weight[..., None] / np.float32(max(3 * weight.sum(), 1e-6))
    g = -0.5 * scale
    per_b = g / (b1 * b2)
    g_mu = 2 * mu_y * (a2 - a1) * per_b + 2 * mu_x * ssim * g * (1 / b2 - 1 / b1)
    grad = _blur(g_mu) + 2 * shown * _blur(-g * ssim / b2) + image * _blur(2 * a1 * per_b)
    return float(0.5 * ((1 - ssim) * scale).sum()), grad.astype(np.float32)


def normal_consistency(
    planes: np.ndarray, rays: np.ndarray, weight: np.ndarray, least_alpha: float = 0.5
) -> tuple[float, np.ndarray]:
    """Rendered normals against the normals of the expected-depth surface: weighted mean of 1 - cos.

    planes: (9, H, W) of a full forward pass. rays: (H, W, 3) unit directions, camera axes. weight: (H, W). Pixels with
    alpha below ``least_alpha`` (the surface is not there) and the border are left out. Returns the loss and (8, H, W)
    float32 gradients with respect to R, G, B, alpha, sum w d, sum w n (the first three are zero).
    """
    planes = planes.astype(float)
    alpha = 1 - planes[3]
    out = np.zeros((8, *alpha.shape), np.float32)
    safe = np.maximum(alpha, 1e-3)
    depth = planes[4] / safe
    points = depth[..., None] * rays
    along, down = points[1:-1, 2:] - points[1:-1, :-2], points[2:, 1:-1] - points[:-2, 1:-1]
    cross = np.cross(along, down)
    size = np.linalg.norm(cross, axis=-1)
    rendered = np.moveaxis(planes[5 + 1 : 9], 0, -1)[1:-1, 1:-1]
    length = np.linalg.norm(rendered, axis=-1)
    solid = alpha >= least_alpha
    use = (
        solid[1:-1, 1:-1]
        & solid[1:-1, 2:]
        & solid[1:-1, :-2]
        & solid[2:, 1:-1]
        & solid[:-2, 1:-1]
        & (size > 1e-12)
        & (length > 1e-6)
    )
    share = np.where(use, weight[1:-1, 1:-1], 0.0)
    total = max(float(weight.sum()), 1e-6)
    size, length = np.where(use, size, 1.0), np.where(use, length, 1.0)
    # x right, y down, z forward: (right x down) points away from the camera, the normals face it.
    surface, normal = -cross / size[..., None], rendered / length[..., None]
    cosine = np.einsum("hwc,hwc->hw", surface, normal)
    g = -(share / total)[..., None]
    g_normal = g * (surface - normal * cosine[..., None]) / length[..., None]
    g_cross = -g * (normal - surface * cosine[..., None]) / size[..., None]
    g_along, g_down = np.cross(down, g_cross), np.cross(g_cross, along)
    g_points = np.zeros_like(points)
    g_points[1:-1, 2:] += g_along
    g_points[1:-1, :-2] -= g_along
    g_points[2:, 1:-1] += g_down
    g_points[:-2, 1:-1] -= g_down
    g_depth = np.einsum("hwc,hwc->hw", g_points, rays)
    out[4] = g_depth / safe
    out[3] = np.where(alpha > 1e-3, -g_depth * depth / safe, 0)
    out[5:, 1:-1, 1:-1] = np.moveaxis(g_normal, -1, 0)
    return float((share * (1 - cosine)).sum() / total), out
