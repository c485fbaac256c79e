"""``rasterize``: a differentiable picture of Gaussians held in torch tensors.

The compiled kernels do the work, on the CPU those of ``kernels.py`` (Numba), on a GPU those of ``warp_raster.py``
(NVIDIA Warp); torch holds the parameters and sees one operation with a backward of its own. Pictures and their
gradients pass between both without a copy on the CPU. Arguments are named as in the field's common interface (gsplat's
``rasterization``); what differs is in ``docs/analyst/gaussians.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ...core.errors import InputError
from ..devices import make_rasteriser
from ..project import CropCamera
from ..raster import ALPHA_MIN, Rasteriser

#: Widths of the parts of the packed parameters: means, quaternions, log-scales, opacity logit, colours.
_PARTS = {"means": 3, "quats": 4, "log_scales": 3, "opacity_logits": 1, "colours": 3}


@dataclass(frozen=True)
class Rendered:
    """What one view shows; float32 tensors on the parameters' device.

    planes: (4, H, W) colour (sum of w c, no background) and alpha; with ``geometry`` (8, H, W): sum w d and sum w n
    (3) too, as the kernels make them. median_depth: (H, W) distance where the transmittance passes 0.5, NaN where it
    does not (``None`` without ``geometry``); it carries no gradient. pairs: pixel-Gaussian pairs composited.
    """

    planes: torch.Tensor
    median_depth: torch.Tensor | None
    pairs: int

    @property
    def colour(self) -> torch.Tensor:
        """(H, W, 3) sum of w c."""
        return self.planes[:3].permute(1, 2, 0)

    @property
    def alpha(self) -> torch.Tensor:
        """(H, W) 1 - transmittance."""
        return self.planes[3]

    @property
    def depth(self) -> torch.Tensor:
        """(H, W) expected distance from the camera centre, sum w d / sum w; NaN where nothing is drawn.

        Raises:
            InputError: drawn without ``geometry``.
        """
        sums, drawn = self._geometry()[0], self.alpha > 0
        # The inner where keeps the gradient of what is not drawn finite.
        return torch.where(drawn, sums / torch.where(drawn, self.alpha, 1.0), torch.nan)

    @property
    def normal(self) -> torch.Tensor:
        """(H, W, 3) unit, camera axes, facing the camera; NaN where nothing is drawn.

        Raises:
            InputError: drawn without ``geometry``.
        """
        sums, drawn = self._geometry()[1:].permute(1, 2, 0), (self.alpha > 0)[..., None]
        safe = torch.where(drawn, sums, torch.ones_like(sums))
        return torch.where(drawn, safe / safe.norm(dim=-1, keepdim=True), torch.nan)

    def _geometry(self) -> torch.Tensor:
        if len(self.planes) == 4:
            raise InputError("This picture was drawn without depth and normals; call rasterize with geometry=True.")
        return self.planes[4:]


class _Composite(torch.autograd.Function):
    """(N, 14) float64 parameters -> (4 or 8, H, W) float32 planes, (H, W) median distance."""

    @staticmethod
    def forward(ctx: Any, packed: torch.Tensor, camera: CropCamera, rasteriser: Any, full: bool, kept: dict) -> Any:
        parameters = packed.detach().cpu().numpy()
        done = rasteriser.forward(parameters, camera, full)
        ctx.done, ctx.rasteriser, ctx.parameters, ctx.device = done, rasteriser, parameters, packed.device
        kept["pairs"] = done.pairs
        planes = np.empty((8 if full else 4, camera.height, camera.width), np.float32)
        planes[:3], planes[3] = done.planes[:3], 1 - done.planes[3]
        median = np.empty((0, 0), np.float32)
        if full:
            planes[4], planes[5:] = done.planes[4], done.planes[6:9]
            median = np.where(done.planes[3] <= 0.5, done.planes[5], np.nan).astype(np.float32)
        shown, depth = (torch.from_numpy(part).to(packed.device) for part in (planes, median))
        ctx.mark_non_differentiable(depth)
        return shown, depth

    @staticmethod
    def backward(ctx: Any, *given: torch.Tensor) -> Any:
        planes = given[0].detach().to("cpu", torch.float32).contiguous().numpy()
        grad = ctx.rasteriser.backward(ctx.parameters, ctx.done, planes)
        return torch.from_numpy(grad).to(ctx.device), None, None, None, None


def rasterize(
    means: torch.Tensor,
    quats: torch.Tensor,
    log_scales: torch.Tensor,
    opacity_logits: torch.Tensor,
    colours: torch.Tensor,
    camera: CropCamera,
    *,
    geometry: bool = False,
    dilation_px2: float = 0.0,
    alpha_min: float = ALPHA_MIN,
    rasteriser: Any = None,
) -> Rendered:
    """Draw Gaussians; gradients reach all five tensors.

    Args:
        means: (N, 3) metres, local frame. quats: (N, 4) w x y z, of any length. log_scales: (N, 3) natural logarithms
            of standard deviations in metres. opacity_logits: (N,). colours: (N, 3) RGB 0..1. All float32 or float64,
            on one device. camera: pinhole crop, first pixel's centre at (0.5, 0.5). geometry: depth and normals too
            (eq:radegs_depth_plane). dilation_px2, alpha_min: see :class:`~treedgs_geo.gaussians.raster.Rasteriser`.
            rasteriser: one to use again (its threads, its device); default: one thread of the CPU, or Warp on the
            tensors' GPU.

    Raises:
        InputError: tensors of other shapes, or on several devices. MissingComponentError: GPU tensors without Warp.
    """
    parts = {
        "means": means,
        "quats": quats,
        "log_scales": log_scales,
        "opacity_logits": opacity_logits.unsqueeze(-1),
        "colours": colours,
    }
    for name, part in parts.items():
        if part.ndim != 2 or part.shape != (len(means), _PARTS[name]):
            raise InputError(
                f"rasterize: {name} has shape {tuple(part.shape)}, expected ({len(means)}, {_PARTS[name]}) for "
                f"{len(means)} Gaussians (opacity_logits without its second axis)."
            )
        if part.device != means.device:
            raise InputError(
                f"rasterize: {name} is on {part.device} and means on {means.device}; put them on one device."
            )
    packed = torch.cat([part.to(torch.float64) for part in parts.values()], dim=1).contiguous()
    if rasteriser is None:
        on_cpu = means.device.type == "cpu"
        rasteriser = (
            Rasteriser(1, dilation_px2, alpha_min) if on_cpu else make_rasteriser(str(means.device), dilation_px2)
        )
    kept: dict = {}
    planes, median = _Composite.apply(packed, camera, rasteriser, geometry, kept)
    return Rendered(planes, median if geometry else None, kept["pairs"])


def tensors_of(parameters: np.ndarray, device: str = "cpu", dtype: torch.dtype = torch.float32) -> list[torch.Tensor]:
    """The five tensors of an (N, 14) parameter matrix (``GaussianField.packed``), as leaves that want gradients, in the
    order of :func:`rasterize`."""
    columns = np.split(np.asarray(parameters), np.cumsum(list(_PARTS.values()))[:-1], axis=1)
    columns[3] = columns[3][:, 0]
    return [torch.tensor(part, device=device, dtype=dtype).requires_grad_() for part in columns]


def packed_of(tensors: list[torch.Tensor]) -> np.ndarray:
    """(N, 14) float64 parameter matrix of the five tensors."""
    parts = [part.detach().cpu().to(torch.float64) for part in tensors]
    parts[3] = parts[3].unsqueeze(-1)
    return torch.cat(parts, dim=1).numpy()
