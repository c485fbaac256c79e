"""Ground control in a block: bringing a rough block to it, and what is left at control and check points."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..geotags.control import ControlPoints, are_spread
from .poses import Similarity, fit_similarity
from .tracks import Block, ray_normals

#: A block is moved as a whole before it is adjusted where its control points lie further off than this, metres.
_FAR_M = 0.2
#: Marks of a point miss it by less than this, share of the photo's width.
APART_SHARE = 0.04
#: Points that alone hold a block count by how far it is off, where that is so many times what they state.
CONTRADICTED_TIMES = 3.0


def align_to_control(block: Block, control: ControlPoints) -> Similarity | None:
    """Move, turn and scale the block onto three or more control points; None where it is close already or they are
    too few.

    Navigation-grade geotags are metres off together; the adjustment alone would have to walk there.
    """
    fitted = fit_to_control(block, control, _FAR_M)
    if fitted is None:
        return None
    centres = fitted.apply(block.centres)
    block.rotations = block.rotations @ fitted.rotation.T
    block.translations = -np.einsum("nij,nj->ni", block.rotations, centres)
    block.points = fitted.apply(block.points)
    return fitted


def fit_to_control(block: Block, control: ControlPoints, far_m: float = 0.0) -> Similarity | None:
    """From the block to the control points that its photos show; None where they are fewer than three or lie in a line,
    or are no further off than ``far_m`` (median)."""
    placed = _placed(block, control)
    use = np.isfinite(placed).all(axis=1) & ~control.is_check
    source, target = placed[use], control.xyz[use]
    if not are_spread(target) or np.median(np.linalg.norm(source - target, axis=1)) < far_m:
        return None
    return fit_similarity(source, target, np.ones(len(source)))


def as_block_says(block: Block, control: ControlPoints) -> ControlPoints:
    """Control points that alone hold a block, with standard errors as large as it shows where that is far more than
    they state: their distances from it, less the seven numbers that were fitted to them."""
    off = ((_placed(block, control) - control.xyz) / control.sd_m)[~control.is_check]
    off = off[np.isfinite(off).all(axis=1)]
    times = float(np.sqrt(np.sum(off**2) / (off.size - 7))) if len(off) > 2 else 1.0
    return replace(control, sd_m=times * control.sd_m) if times > CONTRADICTED_TIMES else control


def control_residuals(block: Block, control: ControlPoints) -> list[dict[str, Any]]:
    """What the block says of each point, less what was surveyed: ``label, is_check, photos, e_m, n_m, u_m, px``.

    px: RMS of its marks about the surveyed place. Points with fewer than two posed photos, or whose marks do not meet,
    have no numbers.
    """
    placed = _placed(block, control)
    rows = []
    for k, label in enumerate(control.labels):
        own = np.flatnonzero((control.point == k) & block.is_posed[control.photo])
        row: dict[str, Any] = {"label": label, "is_check": bool(control.is_check[k]), "photos": len(own)}
        if np.isfinite(placed[k]).all():
            off = placed[k] - control.xyz[k]
            seen = np.array([block.view(control.photo[m]).project(control.xyz[k][None])[0][0] for m in own])
            error = np.linalg.norm(seen - control.pixels[own], axis=1)
            row |= {name: round(float(value), 4) for name, value in zip(("e_m", "n_m", "u_m"), off, strict=True)}
            row["px"] = round(float(np.sqrt(np.mean(error**2))), 2)
        rows.append(row)
    return rows


def rms_of(rows: list[dict[str, Any]], is_check: bool) -> list[float] | None:
    """RMS E, N, U of :func:`control_residuals`, metres; None without such points."""
    off = np.array(
        [[row["e_m"], row["n_m"], row["u_m"]] for row in rows if row["is_check"] == is_check and "px" in row]
    )
    return [round(float(value), 4) for value in np.sqrt(np.mean(off**2, axis=0))] if len(off) else None


def _placed(block: Block, control: ControlPoints) -> np.ndarray:
    """(K, 3) places by the marks and the posed photos alone, NaN where fewer than two photos show a point or its marks
    do not meet."""
    placed, meet = _intersected(block, control)
    return np.where(meet[:, None], placed, np.nan)


def marks_meet(block: Block, control: ControlPoints) -> np.ndarray:
    """(K,) bool: not where the marks of a point miss each other in the posed photos: one of them is of another point.
    Such a point is left out."""
    return _intersected(block, control)[1]


def _intersected(block: Block, control: ControlPoints) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) places by the marks, NaN where fewer than two posed photos show a point, and :func:`marks_meet`."""
    use = block.is_posed[control.photo]
    photo, point, pixels = control.photo[use], control.point[use], control.pixels[use]
    starts, rays = block.rays_of(photo, pixels)
    left, right = ray_normals(starts, rays, np.ones(len(rays)), point, len(control))
    placed, known = np.full((len(control), 3), np.nan), np.bincount(point, minlength=len(control)) >= 2
    placed[known] = np.linalg.solve(left[known], right[known][:, :, None])[:, :, 0]
    local = np.einsum("mij,mj->mi", block.rotations[photo], placed[point]) + block.translations[photo]
    off = np.linalg.norm(block.sensor.to_pixels(local, photo) - pixels, axis=1)
    meet = np.ones(len(control), bool)
    meet[point[known[point] & ~(off < APART_SHARE * block.camera.width)]] = False
    return placed, meet
