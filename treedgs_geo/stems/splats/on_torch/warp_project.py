"""The projection of ``project.py`` for a GPU, through NVIDIA Warp: a hundred small operations in one, and their
gradients, which Warp derives from the same lines. Import needs ``warp-lang``."""

# Warp reads annotations when a kernel is made: no postponed annotations in this file, and mypy cannot know its types.
# mypy: disable-error-code="valid-type,misc,attr-defined,arg-type,empty-body,assignment,operator,index,call-overload"
from collections.abc import Sequence
from typing import Any

import torch
import warp as wp

from ..camera import CropCamera
from .warp_raster import stream

_D = wp.float64
#: Rows of :func:`.project.projected_rows`.
_ROWS = 17


@wp.struct
class _View:
    """A camera, and how it draws."""

    turn: wp.mat33d
    shift: wp.vec3d
    fx: wp.float64
    fy: wp.float64
    cx: wp.float64
    cy: wp.float64
    width: wp.float64
    height: wp.float64
    dilation: wp.float64
    alpha_min: wp.float64


@wp.func
def _turned(quat: wp.vec4d):
    """As :func:`.project.turned`."""
    one, two = _D(1.0), _D(2.0)
    unit = quat / wp.max(wp.length(quat), _D(1e-30))
    a, b, c, d = unit[0], unit[1], unit[2], unit[3]
    return wp.mat33d(
        one - two * (c * c + d * d), two * (b * c - a * d), two * (b * d + a * c),
        two * (b * c + a * d), one - two * (b * b + d * d), two * (c * d - a * b),
        two * (b * d - a * c), two * (c * d + a * b), one - two * (b * b + c * c),
    )  # fmt: skip


@wp.kernel
def _project(
    index: wp.array(dtype=wp.int64),
    means: wp.array(dtype=wp.vec3),
    quats: wp.array(dtype=wp.vec4),
    log_scales: wp.array(dtype=wp.vec3),
    logits: wp.array(dtype=wp.float32),
    colours: wp.array(dtype=wp.vec3),
    view: _View,
    rows: wp.array2d(dtype=wp.float32),
    drawn: wp.array(dtype=wp.bool),
):
    t = wp.tid()
    g = index[t]
    zero, one, two = _D(0.0), _D(1.0), _D(2.0)
    fx, fy = view.fx, view.fy
    centre = view.turn * wp.vec3d(means[g]) + view.shift
    x, y, z = centre[0], centre[1], centre[2]
    length = wp.length(centre)
    size = wp.vec3d(log_scales[g])
    axes = (
        view.turn * _turned(wp.vec4d(quats[g])) * wp.diag(wp.vec3d(wp.exp(size[0]), wp.exp(size[1]), wp.exp(size[2])))
    )
    jac_u = wp.vec3d(fx / z, zero, -fx * x / (z * z))
    jac_v = wp.vec3d(zero, fy / z, -fy * y / (z * z))
    jac_r = centre / length
    across = wp.transpose(axes)
    along, down, ray = across * jac_u, across * jac_v, across * jac_r
    plain_u, skew, plain_v = wp.dot(along, along), wp.dot(along, down), wp.dot(down, down)
    wide_u, wide_v = plain_u + view.dilation, plain_v + view.dilation
    hair = wp.where(wide_u * wide_v - skew * skew < _D(1e-4) * wide_u * wide_v, _D(1e-5) * (wide_u + wide_v), zero)
    var_u, var_v = wide_u + hair, wide_v + hair
    det = var_u * var_v - skew * skew
    full = one / (one + wp.exp(-_D(logits[g])))
    opacity = full
    if view.dilation > zero:
        opacity = full * wp.sqrt(wp.max(plain_u * plain_v - skew * skew, _D(1e-30)) / det)
    ka, kb, kc = var_v / det, -skew / det, var_u / det
    e, f = wp.dot(along, ray), wp.dot(down, ray)
    slope_x, slope_y = ka * e + kb * f, kb * e + kc * f
    least = _D(0.01) * length / fx
    variance = wp.max(wp.dot(ray, ray) - (e * slope_x + f * slope_y), least * least)
    facing = slope_x * jac_u + slope_y * jac_v - jac_r
    normal = facing / wp.length(facing)
    u, v = fx * x / z + view.cx, fy * y / z + view.cy
    cut = two * wp.log(wp.max(opacity, _D(1e-30)) / view.alpha_min)
    rows[t, 0] = wp.float32(u)
    rows[t, 1] = wp.float32(v)
    rows[t, 2] = wp.float32(ka)
    rows[t, 3] = wp.float32(kb)
    rows[t, 4] = wp.float32(kc)
    rows[t, 5] = wp.float32(opacity)
    rows[t, 6] = wp.float32(length)
    rows[t, 7] = wp.float32(slope_x)
    rows[t, 8] = wp.float32(slope_y)
    rows[t, 12] = wp.float32(one / variance)
    rows[t, 13] = wp.float32(cut)
    for k in range(3):
        rows[t, 9 + k] = wp.float32(normal[k])
        rows[t, 14 + k] = colours[g][k]
    reach = wp.max(cut, zero)
    reach_u, reach_v = wp.sqrt(reach * var_u), wp.sqrt(reach * var_v)
    deep = wp.sqrt(axes[2, 0] * axes[2, 0] + axes[2, 1] * axes[2, 1] + axes[2, 2] * axes[2, 2])
    near = z > zero and z > _D(3.0) * deep and det > _D(1e-12) * var_u * var_v and det < _D(1e30)
    half = _D(0.5)
    inside = u + reach_u > half and u - reach_u < view.width - half
    inside = inside and v + reach_v > half and v - reach_v < view.height - half
    drawn[t] = near and inside and opacity > view.alpha_min


def project(
    parts: Sequence[torch.Tensor], camera: CropCamera, dilation_px2: float, alpha_min: float
) -> tuple[torch.Tensor, torch.Tensor]:
    """As :func:`.project.project`, of float32 tensors."""
    every = torch.arange(len(parts[0]), device=parts[0].device)
    rows = torch.empty((len(every), _ROWS), device=every.device)
    drawn = torch.empty(len(every), dtype=torch.bool, device=every.device)
    _launch(every, parts, camera, dilation_px2, alpha_min, rows, drawn)
    index = torch.nonzero(drawn)[:, 0]
    index = index[torch.argsort(rows[index, 6], stable=True)]
    return rows[index].T, index


def pull_back(
    index: torch.Tensor,
    grad: torch.Tensor,
    parts: Sequence[torch.Tensor],
    camera: CropCamera,
    dilation_px2: float,
    alpha_min: float,
) -> list[torch.Tensor]:
    """Gradients of the five tensors. index, and grad (17, n) float32 of the rows: of :func:`project`, as the rest."""
    pulled = [torch.zeros_like(part, memory_format=torch.contiguous_format) for part in parts]
    drawn = torch.empty(len(index), dtype=torch.bool, device=index.device)
    _launch(index, parts, camera, dilation_px2, alpha_min, grad.T.contiguous(), drawn, pulled)
    return pulled


def _launch(
    index: torch.Tensor,
    parts: Sequence[torch.Tensor],
    camera: CropCamera,
    dilation_px2: float,
    alpha_min: float,
    rows: torch.Tensor,
    drawn: torch.Tensor,
    pulled: Sequence[torch.Tensor] | None = None,
) -> None:
    """Forward; with ``pulled`` backward: rows are their gradients then, and those of the parts are added to it."""
    if not len(index):
        return
    view = _View()
    view.turn, view.shift = wp.mat33d(*camera.rotation.ravel()), wp.vec3d(*camera.translation)
    view.fx, view.fy, view.cx, view.cy = camera.fx, camera.fy, camera.cx, camera.cy
    view.width, view.height, view.dilation, view.alpha_min = camera.width, camera.height, dilation_px2, alpha_min
    types = (wp.vec3, wp.vec4, wp.vec3, wp.float32, wp.vec3)

    def arrays(tensors: Sequence[torch.Tensor]) -> list[Any]:
        return [
            wp.from_torch(part.detach().contiguous(), dtype=kind) for part, kind in zip(tensors, types, strict=True)
        ]

    with stream(index.device):
        shown = wp.from_torch(rows)
        inputs, outputs = [wp.from_torch(index), *arrays(parts), view], [shown, wp.from_torch(drawn)]
        back = {} if pulled is None else {
            "adjoint": True, "adj_inputs": [None, *arrays(pulled), view], "adj_outputs": [shown, None],
        }  # fmt: skip
        wp.launch(_project, len(index), inputs, outputs, device=shown.device, **back)
