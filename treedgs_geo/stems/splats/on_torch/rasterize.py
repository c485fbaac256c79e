"""``rasterize``: a differentiable picture of Gaussians held in torch tensors.

They are projected by torch, and composited by the compiled kernels on the CPU (Numba), by those of ``warp_raster.py``
on a GPU (NVIDIA Warp), in the tensors' own memory: for torch one operation with a backward of its own. Arguments are
named as in the field's common interface (gsplat's ``rasterization``); what differs is in ``docs/analyst/gaussians.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ....core.errors import InputError
from .. import raster
from ..camera import CropCamera
from ..field import COLUMNS
from ..kernels import N_PLANES
from ..raster import ALPHA_MIN
from .harmonics import COEFFICIENTS, seen_colours
from .project import placed, project

#: Widths of the parts of the packed parameters: means, quaternions, log-scales, opacity logit, colours.
_PARTS = {"means": 3, "quats": 4, "log_scales": 3, "opacity_logits": 1, "colours": 3}


@dataclass(frozen=True)
class Rendered:
    """What one view shows; float32 tensors on the parameters' device.

    planes: (4, H, W) colour (sum of w c, no background) and alpha; with ``geometry`` (8, H, W): sum w d and sum w n
    (3) too, as the kernels make them. median_depth: (H, W) distance where the transmittance passes 0.5, NaN where it
    does not (``None`` without ``geometry``); its gradient goes to the Gaussian it is taken from.
    pull: (N, 2) the gradient on each Gaussian's centre in the picture, per pixel, once ``backward`` has been called
    (zero where it is not drawn): what densification goes by.
    """

    planes: torch.Tensor
    median_depth: torch.Tensor | None
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


class _Project(torch.autograd.Function):
    """:func:`.project.project` by Warp, of float32 tensors."""

    @staticmethod
    def forward(ctx: Any, camera: CropCamera, dilation_px2: float, alpha_min: float, *parts: torch.Tensor) -> Any:
        from . import warp_project

        ctx.how = (parts, camera, dilation_px2, alpha_min)
        rows, ctx.index = warp_project.project(*ctx.how)
        ctx.mark_non_differentiable(ctx.index)
        return rows, ctx.index

    @staticmethod
    def backward(ctx: Any, *given: torch.Tensor) -> Any:
        from . import warp_project

        return None, None, None, *warp_project.pull_back(ctx.index, given[0], *ctx.how)


class _Composite(torch.autograd.Function):
    """(17, n) rows of the projection, front to back -> the planes and median depth of :class:`Rendered`: by the
    compiled kernels, or by Warp's in the tensors' own memory."""

    @staticmethod
    def forward(
        ctx: Any,
        rows: torch.Tensor,
        index: torch.Tensor,
        camera: CropCamera,
        full: bool,
        warp: bool,
        pull: torch.Tensor,
    ) -> Any:
        ctx.rows = rows.detach().to(torch.float32).contiguous()
        ctx.index, ctx.pull, ctx.lists = index, pull, None
        if warp:
            from . import warp_raster

            ctx.planes, ctx.lists = warp_raster.composite(ctx.rows, camera.height, camera.width, full)
        else:
            ctx.planes = torch.from_numpy(raster.composite(ctx.rows.numpy(), camera.height, camera.width, full))
        ctx.set_materialize_grads(False)
        # The kernels' planes are R, G, B, T and with geometry sum w d, median d, sum w n.
        raw = ctx.planes
        planes = torch.empty((8 if full else 4, *raw.shape[1:]), device=raw.device)
        planes[:3], planes[3] = raw[:3], 1 - raw[3]
        if not full:
            return planes, torch.empty(0, device=raw.device)
        planes[4], planes[5:] = raw[4], raw[6:9]
        return planes, torch.where(raw[3] <= 0.5, raw[5], torch.nan)

    @staticmethod
    def backward(ctx: Any, *given: torch.Tensor | None) -> Any:
        (planes, median), raw = given, ctx.planes
        # As the kernels want them: of colour, alpha, sum w d, sum w n, median depth.
        back = torch.zeros((len(raw), *raw.shape[1:]), device=raw.device)
        if planes is not None:
            back[: len(planes)] = planes.detach()
        if median is not None and len(raw) == N_PLANES:
            # Where there is no median there is nothing to pull at, whatever a loss says there.
            back[8] = torch.where(raw[3] <= 0.5, torch.nan_to_num(median.detach().to(torch.float32)), 0.0)
        if ctx.lists is not None:
            from . import warp_raster

            grad = warp_raster.pull_back(ctx.rows, ctx.lists, back, ctx.planes)
        else:
            grad = torch.from_numpy(raster.pull_back(ctx.rows.numpy(), ctx.planes.numpy(), back.numpy()))
        ctx.pull[ctx.index] = grad[:2].T
        out = torch.zeros_like(ctx.rows)
        out[:12], out[14:] = grad[:12], grad[12:]
        return out, None, None, None, None, None


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
    warp: bool | None = None,
) -> Rendered:
    """Draw Gaussians; gradients reach all five tensors.

    Args:
        means: (N, 3) metres, local frame. quats: (N, 4) w x y z, of any length. log_scales: (N, 3) natural logarithms
            of standard deviations in metres. opacity_logits: (N,). colours: (N, 3) RGB 0..1, or (N, K, 3) coefficients
            of spherical harmonics, K = 1, 4, 9 or 16 (:mod:`.harmonics`). All float32 or float64, on one device.
            camera: pinhole crop, first pixel's centre at (0.5, 0.5). geometry: depth and normals too
            (eq:radegs_depth_plane).
            dilation_px2: see :func:`.project.projected_rows`. alpha_min: fainter than this a Gaussian is not drawn.
            warp: draw with Warp; default: for tensors of a GPU.

    Raises:
        InputError: tensors of other shapes, or on several devices. ImportError: GPU tensors without warp-lang.
    """
    if colours.ndim == 3 and colours.shape[1] in COEFFICIENTS and colours.shape[2] == 3:
        colours = seen_colours(colours, means, placed(camera.centre, means))
    inputs = (means, quats, log_scales, opacity_logits, colours)
    _check(means, quats, log_scales, opacity_logits.unsqueeze(-1), colours)
    # Float64 up to the ellipses, float32 in the picture.
    warp = means.device.type != "cpu" if warp is None else warp
    if warp and all(part.dtype == torch.float32 for part in inputs):
        rows, index = _Project.apply(camera, dilation_px2, alpha_min, *inputs)
    else:
        rows, index = project([part.to(torch.float64) for part in inputs], camera, dilation_px2, alpha_min)
    pull = torch.zeros((len(means), 2), device=means.device)
    planes, median = _Composite.apply(rows, index, camera, geometry, warp, pull)
    return Rendered(planes, median if geometry else None, pull)


def _check(*parts: torch.Tensor) -> None:
    means = parts[0]
    for (name, width), part in zip(_PARTS.items(), parts, strict=True):
        if part.shape != (len(means), width):
            raise InputError(
                f"rasterize: {name} has shape {tuple(part.shape)}, expected ({len(means)}, {width}) for {len(means)} "
                "Gaussians (opacity_logits without its second axis)."
            )
        if part.device != means.device:
            raise InputError(
                f"rasterize: {name} is on {part.device} and means on {means.device}; put them on one device."
            )


def tensors_of(parameters: np.ndarray, device: str = "cpu", dtype: torch.dtype = torch.float32) -> list[torch.Tensor]:
    """The five tensors of an (N, 14) parameter matrix (``GaussianField.packed``), as leaves that want gradients, in the
    order of :func:`rasterize`."""
    columns = [np.asarray(parameters)[:, part] for part in COLUMNS]
    return [torch.tensor(part, device=device, dtype=dtype).requires_grad_() for part in columns]


def draw(
    parameters: np.ndarray,
    camera: CropCamera,
    full: bool = False,
    dilation_px2: float = 0.0,
    alpha_min: float = ALPHA_MIN,
) -> np.ndarray:
    """(4 or 9, H, W) float32 planes of ``kernels.py``, on the CPU: a picture without gradients.

    parameters: (N, 14) as :func:`tensors_of`. full: depth and normals too. dilation_px2, alpha_min: as for
    :func:`rasterize`.
    """
    return raster.composite(projected(parameters, camera, dilation_px2, alpha_min), camera.height, camera.width, full)


def projected(
    parameters: np.ndarray, camera: CropCamera, dilation_px2: float = 0.0, alpha_min: float = ALPHA_MIN
) -> np.ndarray:
    """(17, n) float32 rows of :mod:`.project` of the Gaussians that are drawn, front to back. parameters: (N, 14)."""
    with torch.no_grad():
        parts = tensors_of(parameters, dtype=torch.float64)
        return project(parts, camera, dilation_px2, alpha_min)[0].to(torch.float32).contiguous().numpy()
