"""``rasterize``: a differentiable picture of Gaussians held in torch tensors.

Tensors of the CPU go through the compiled kernels (projection and compositing in Numba, no copies of pictures); tensors
of a GPU stay there: projected by torch, composited by the kernels of ``warp_raster.py`` (NVIDIA Warp) in the tensors'
own memory. Either way torch sees operations with a backward of their own. Arguments are named as in the field's common
interface (gsplat's ``rasterization``); what differs is in ``docs/analyst/gaussians.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ....core.errors import InputError
from ..devices import make_rasteriser
from ..project import CropCamera
from ..raster import ALPHA_MIN, Rasteriser
from .harmonics import COEFFICIENTS, seen_colours
from .planes import for_kernels, shown_planes
from .project import project

#: Widths of the parts of the packed parameters: means, quaternions, log-scales, opacity logit, colours.
_PARTS = {"means": 3, "quats": 4, "log_scales": 3, "opacity_logits": 1, "colours": 3}


@dataclass(frozen=True)
class Rendered:
    """What one view shows; float32 tensors on the parameters' device.

    planes: (4, H, W) colour (sum of w c, no background) and alpha; with ``geometry`` (8, H, W): sum w d and sum w n
    (3) too, as the kernels make them. median_depth: (H, W) distance where the transmittance passes 0.5, NaN where it
    does not (``None`` without ``geometry``); its gradient goes to the Gaussian it is taken from. pairs: pixel-Gaussian
    pairs composited (on a GPU: looked at). pull: (N, 2) the gradient on each Gaussian's centre in the picture, per
    pixel, once ``backward`` has been called (zero where it is not drawn): what densification goes by.
    """

    planes: torch.Tensor
    median_depth: torch.Tensor | None
    pairs: int
    pull: torch.Tensor

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


class _Compiled(torch.autograd.Function):
    """(N, 14) float64 parameters of the CPU -> the planes and median depth of :class:`Rendered`."""

    @staticmethod
    def forward(ctx: Any, packed: torch.Tensor, camera: CropCamera, rasteriser: Rasteriser, full: bool, kept: dict):
        parameters = packed.detach().numpy()
        done = rasteriser.forward(parameters, camera, full)
        ctx.done, ctx.rasteriser, ctx.parameters, ctx.kept = done, rasteriser, parameters, kept
        ctx.set_materialize_grads(False)
        kept["pairs"] = done.pairs
        return shown_planes(torch.from_numpy(done.planes))

    @staticmethod
    def backward(ctx: Any, *given: torch.Tensor | None) -> Any:
        back = for_kernels(given, torch.from_numpy(ctx.done.planes)).numpy()
        grad = ctx.rasteriser.backward(ctx.parameters, ctx.done, back, pull=ctx.kept["pull"].numpy())
        return torch.from_numpy(grad), None, None, None, None


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
            of standard deviations in metres. opacity_logits: (N,). colours: (N, 3) RGB 0..1, or (N, K, 3) coefficients
            of spherical harmonics, K = 1, 4, 9 or 16 (:mod:`.harmonics`). All float32 or float64, on one device.
            camera: pinhole crop, first pixel's centre at (0.5, 0.5). geometry: depth and normals too
            (eq:radegs_depth_plane).
            dilation_px2, alpha_min: see :class:`~treedgs_geo.stems.splats.raster.Rasteriser`.
            rasteriser: one to use again (its threads, its dilation); default: one thread of the CPU, or Warp on the
            tensors' GPU. A Warp rasteriser takes the path of GPU tensors on the CPU too.

    Raises:
        InputError: tensors of other shapes, or on several devices. MissingComponentError: GPU tensors without Warp.
    """
    if colours.ndim == 3 and colours.shape[1] in COEFFICIENTS and colours.shape[2] == 3:
        colours = seen_colours(colours, means, torch.as_tensor(camera.centre, dtype=means.dtype, device=means.device))
    parts = {
        "means": means,
        "quats": quats,
        "log_scales": log_scales,
        "opacity_logits": opacity_logits.unsqueeze(-1),
        "colours": colours,
    }
    _check(parts)
    if rasteriser is None:
        on_cpu = means.device.type == "cpu"
        rasteriser = (
            Rasteriser(1, dilation_px2, alpha_min) if on_cpu else make_rasteriser(str(means.device), dilation_px2)
        )
    kept: dict = {"pull": torch.zeros((len(means), 2), device=means.device)}
    if isinstance(rasteriser, Rasteriser):
        packed = torch.cat([part.to(torch.float64) for part in parts.values()], dim=1).contiguous()
        planes, median = _Compiled.apply(packed, camera, rasteriser, geometry, kept)
    else:
        from .on_device import CompositeOnDevice

        # As the compiled twin: float64 up to the ellipses, float32 in the picture.
        doubles = [part.to(torch.float64) for part in (means, quats, log_scales, opacity_logits, colours)]
        rows, index = project(doubles, camera, rasteriser.dilation, rasteriser.alpha_min)
        planes, median = CompositeOnDevice.apply(rows, index, camera, geometry, kept)
    return Rendered(planes, median if geometry else None, kept["pairs"], kept["pull"])


def _check(parts: dict[str, torch.Tensor]) -> None:
    means = parts["means"]
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
