"""The rasteriser of Gaussians in plain torch: 16 x 16 tiles, culled by tile, autograd; what ours is put beside."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from treedgs_geo.stems.splats.on_torch.project import turned
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.raster import Rasteriser

TILE_PX = 16


def project(t: torch.Tensor, camera: CropCamera) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """(N, 14) Gaussians nearest first, their (N, 2) centres in pixels and (N, 2, 2) covariances in square pixels."""
    rotation = torch.tensor(camera.rotation, dtype=torch.float32)
    centre = t[:, :3] @ rotation.T + torch.tensor(camera.translation, dtype=torch.float32)
    order = torch.argsort(centre.norm(dim=1))
    t, centre = t[order], centre[order]
    axes = rotation @ turned(t[:, 3:7]) * torch.exp(t[:, None, 7:10])
    depth, zero = centre[:, 2], torch.zeros(len(t))
    across, down = -camera.fx * centre[:, 0] / depth**2, -camera.fy * centre[:, 1] / depth**2
    jac = torch.stack([camera.fx / depth, zero, across, zero, camera.fy / depth, down], 1).reshape(-1, 2, 3)
    middle = torch.stack([camera.fx * centre[:, 0] / depth, camera.fy * centre[:, 1] / depth], 1)
    return t, middle + torch.tensor([camera.cx, camera.cy]), jac @ axes @ axes.transpose(1, 2) @ jac.transpose(1, 2)


def picture(t: torch.Tensor, camera: CropCamera) -> tuple[torch.Tensor, torch.Tensor]:
    """(H, W, 3) colour and (H, W) transmittance of (N, 14) Gaussians."""
    t, middle, cov = project(t, camera)
    conic, opacity = torch.linalg.inv(cov), torch.sigmoid(t[:, 10])
    cut = 2 * torch.log(255 * opacity).clamp(min=0)
    reach = torch.sqrt(cut[:, None] * torch.diagonal(cov, dim1=1, dim2=2)).detach()
    low, high = (middle.detach() - reach).unbind(1), (middle.detach() + reach).unbind(1)
    colour, trans = torch.zeros(camera.height, camera.width, 3), torch.ones(camera.height, camera.width)
    for top in range(0, camera.height, TILE_PX):
        for left in range(0, camera.width, TILE_PX):
            bottom, right = min(top + TILE_PX, camera.height), min(left + TILE_PX, camera.width)
            near = (high[0] > left) & (low[0] < right) & (high[1] > top) & (low[1] < bottom)
            pixels = torch.arange(left, right) + 0.5, torch.arange(top, bottom) + 0.5
            grid = torch.stack(torch.meshgrid(*pixels, indexing="xy"), -1).reshape(-1, 2)
            d, k = grid[None] - middle[near, None], conic[near]
            square = k[:, 0, 0, None] * d[..., 0] ** 2 + k[:, 1, 1, None] * d[..., 1] ** 2
            alpha = opacity[near, None] * torch.exp(-0.5 * square - k[:, 0, 1, None] * d[..., 0] * d[..., 1])
            alpha = torch.where(alpha >= 1 / 255, alpha.clamp(max=0.99), torch.zeros(()))
            passed = torch.cumprod(torch.cat([torch.ones(1, alpha.shape[1]), 1 - alpha]), 0)
            shape = bottom - top, right - left
            colour[top:bottom, left:right] = ((alpha * passed[:-1]).T @ t[near, 11:]).reshape(*shape, 3)
            trans[top:bottom, left:right] = passed[-1].reshape(shape)
    return colour, trans


def torch_rasteriser(parameters: np.ndarray, camera: CropCamera, given: np.ndarray) -> tuple[Callable, Callable]:
    """(forward, forward + backward) on one thread. given: (4, H, W) gradient of colour and opacity.

    Raises:
        SystemExit: the picture is another one than ours.
    """
    torch.set_num_threads(1)
    weight = torch.tensor(given, dtype=torch.float32)

    def forward():
        with torch.no_grad():
            return picture(torch.tensor(parameters, dtype=torch.float32), camera)

    def both():
        t = torch.tensor(parameters, dtype=torch.float32, requires_grad=True)
        colour, trans = picture(t, camera)
        ((weight[:3] * colour.permute(2, 0, 1)).sum() + (weight[3] * (1 - trans)).sum()).backward()
        return t.grad

    ours = np.moveaxis(Rasteriser().forward(parameters, camera).planes[:3], 0, -1)
    if np.abs(forward()[0].numpy() - ours).max() > 1e-2:
        raise SystemExit("the torch twin draws another picture; the comparison would be meaningless")
    return forward, both
