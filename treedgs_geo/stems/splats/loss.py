"""Losses on one crop and their gradients with respect to the rendered planes.

(1 - l) L1 + l D-SSIM as published (3DGS). Pixels carry weights: what the band model cannot explain (foliage, other
stems) must not be explained by fog.
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
