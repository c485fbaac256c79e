"""From 3D Gaussians to what a pixel needs, in torch operations: differentiable, on the tensors' device.

Everything follows from one 3 x 3 matrix. Let (u, v, r) be the pixel coordinates and the distance from the camera
centre; J its Jacobian at the Gaussian's centre and V = J W R_q diag(s) (W = world -> camera). Then V V^T is the
covariance in ray space; its upper 2 x 2 block (plus an optional dilation) is the image ellipse (EWA splatting, Zwicker
et al. 2001), and the conditional mean of r given (u, v),

    d(u) = r_k + slope . (u - u_k),     slope = cov_2d^-1 cov(uv, r),

is the ray-distance plane of eq:radegs_depth_plane (g = -slope): to first order the distance at which the ray meets the
Gaussian's maximum. No inverse of the 3D covariance is needed, so flat and needle-like Gaussians need no special
branch. The conditional standard deviation sigma_ray = sqrt(var(r) - slope . cov(uv, r)) is the depth falloff of the
point query (``sample.py``): Delta^T Sigma^-1 Delta of eq:radegs_point_offset equals conic(u) + ((r - d(u)) /
sigma_ray)^2 exactly. The surface normal is the gradient of r - d(u) in camera axes, pointing at the camera.

``tests/gaussian_reference.py`` is the twin in NumPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch

from ..camera import CropCamera
from ..raster import ALPHA_MIN

#: Side of the square tiles that Gaussians are listed by, pixels.
TILE_PX = 8
#: Gaussians by tile: start (tiles + 1,) int32, items int32, tiles along x.
Lists = tuple[torch.Tensor, torch.Tensor, int]


def placed(value: Any, like: torch.Tensor) -> torch.Tensor:
    """A few numbers as a tensor of the dtype and on the device of another, without waiting for a GPU."""
    return torch.as_tensor(value, dtype=like.dtype).to(like.device, non_blocking=True)


def turned(quats: torch.Tensor) -> torch.Tensor:
    """(N, 4) quaternions w x y z of any length -> (N, 3, 3) rotations, Gaussian axes -> world."""
    w, x, y, z = (quats / quats.norm(dim=1, keepdim=True).clamp_min(1e-30)).unbind(1)
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return torch.stack(rows, 1).reshape(-1, 3, 3)


def projected_rows(
    parts: Sequence[torch.Tensor], camera: CropCamera, dilation_px2: float = 0.0, alpha_min: float = ALPHA_MIN
) -> tuple[torch.Tensor, torch.Tensor]:
    """(17, N) rows of every Gaussian, in the order given, and (N,) bool which of them are drawn at all; rows of the
    others may be anything, not finite too.

    Rows: pixel centre (2), conic (3), opacity after dilation, distance, slopes of the plane (2), normal in camera axes
    (3), 1 / sigma_ray^2, largest squared Mahalanobis distance drawn, colour (3). Not drawn: what is not wholly in front
    of the camera (3 sigma; this also covers a camera inside a splat), fainter than ``alpha_min``, off the crop, or
    numerically degenerate.

    dilation_px2: variance added to each ellipse, with the opacity lowered so that its integral stays (Mip-Splatting's
    2D filter). parts: means (N, 3), quats (N, 4), log_scales (N, 3), opacity_logits (N,), colours (N, 3). Computed in
    their dtype.
    """
    means, quats, log_scales, opacity_logits, colours = parts
    turn = placed(camera.rotation, means)
    centre = means @ turn.T + placed(camera.translation, means)
    x, y, z = centre.unbind(1)
    length, zero = centre.norm(dim=1), torch.zeros_like(z)
    axes = turn @ turned(quats) * torch.exp(log_scales)[:, None, :]
    jac_u = torch.stack([camera.fx / z, zero, -camera.fx * x / z**2], 1)
    jac_v = torch.stack([zero, camera.fy / z, -camera.fy * y / z**2], 1)
    jac_r = centre / length[:, None]
    along, down, ray = ((jac[:, :, None] * axes).sum(1) for jac in (jac_u, jac_v, jac_r))
    a0, b, c0 = (along * along).sum(1), (along * down).sum(1), (down * down).sum(1)
    a, c = a0 + dilation_px2, c0 + dilation_px2
    # The conic of a needle more than 300 times longer than wide would lose its determinant in float32.
    hair = torch.where(a * c - b * b < 1e-4 * a * c, 1e-5 * (a + c), zero)
    a, c = a + hair, c + hair
    det = a * c - b * b
    opacity = torch.sigmoid(opacity_logits)
    if dilation_px2 > 0:
        opacity = opacity * ((a0 * c0 - b * b).clamp_min(1e-30) / det).sqrt()
    ka, kb, kc = c / det, -b / det, a / det
    e, f = (along * ray).sum(1), (down * ray).sum(1)
    slope_x, slope_y = ka * e + kb * f, kb * e + kc * f
    variance = (ray * ray).sum(1) - (e * slope_x + f * slope_y)
    # A splat seen face-on may have no thickness: a hundredth of a pixel's footprint keeps the falloff finite.
    variance = torch.maximum(variance, (0.01 * length / camera.fx) ** 2)
    normal = -(jac_r - slope_x[:, None] * jac_u - slope_y[:, None] * jac_v)
    normal = normal / normal.norm(dim=1, keepdim=True)
    u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
    cut = 2 * torch.log(opacity.clamp_min(1e-30) / alpha_min)
    rows = [u, v, ka, kb, kc, opacity, length, slope_x, slope_y, *normal.unbind(1), 1 / variance, cut]
    with torch.no_grad():
        reach_u, reach_v = (cut.clamp_min(0) * a).sqrt(), (cut.clamp_min(0) * c).sqrt()
        drawn = (z > 0) & (z > 3 * axes[:, 2].norm(dim=1)) & (det > 1e-12 * a * c) & (det < 1e30)
        drawn = drawn & (opacity > alpha_min) & (u + reach_u > 0.5) & (u - reach_u < camera.width - 0.5)
        drawn = drawn & (v + reach_v > 0.5) & (v - reach_v < camera.height - 0.5)
    return torch.stack([*rows, *colours.unbind(1)]), drawn


def project(
    parts: Sequence[torch.Tensor], camera: CropCamera, dilation_px2: float, alpha_min: float
) -> tuple[torch.Tensor, torch.Tensor]:
    """(17, n) rows of the Gaussians that are drawn, front to back, and (n,) int64 their numbers. parts: the five
    tensors of :func:`projected_rows`."""
    with torch.no_grad():
        rows, drawn = projected_rows(parts, camera, dilation_px2, alpha_min)
        index = torch.nonzero(drawn)[:, 0]
        index = index[torch.argsort(rows[6, index], stable=True)]
    # Once more for those alone: gradients of what is behind the camera would not be finite.
    rows, _ = projected_rows([part.index_select(0, index) for part in parts], camera, dilation_px2, alpha_min)
    return rows, index


def lists_by_tile(rows: torch.Tensor, width: int, height: int) -> Lists:
    """Gaussians by the tiles that the boxes about their ellipses touch. rows: (17, n), in any order, which stays."""
    tiles_x, tiles_y = (width - 1) // TILE_PX + 1, (height - 1) // TILE_PX + 1
    u, v, ka, kb, kc, cut = rows[0], rows[1], rows[2], rows[3], rows[4], rows[13]
    det = ka * kc - kb * kb
    reach_u, reach_v = (cut * kc / det).sqrt(), (cut * ka / det).sqrt()
    # Kept to the tiles before they become whole numbers, which could not hold the box of a needle seen end on.
    left, top = (((at - reach) / TILE_PX).floor().clamp(0, most).int()
                 for at, reach, most in ((u, reach_u, tiles_x), (v, reach_v, tiles_y)))  # fmt: skip
    right, bottom = (((at + reach) / TILE_PX).floor().clamp(-1, most - 1).int()
                     for at, reach, most in ((u, reach_u, tiles_x), (v, reach_v, tiles_y)))  # fmt: skip
    across = (right - left + 1).clamp_min(0)
    count = across * (bottom - top + 1).clamp_min(0)
    whole: Any = {"dtype": torch.int32, "device": rows.device}
    of = torch.repeat_interleave(torch.arange(len(u), **whole), count)
    place = torch.arange(len(of), **whole) - (torch.cumsum(count, 0, dtype=torch.int32) - count)[of]
    wide = across[of].clamp_min(1)
    tile = (top[of] + place // wide) * tiles_x + left[of] + place % wide
    tile, order = torch.sort(tile, stable=True)
    start = torch.searchsorted(tile, torch.arange(tiles_x * tiles_y + 1, **whole), out_int32=True)
    return start, of[order], tiles_x
