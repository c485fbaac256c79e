"""Ground control and known lengths in a block: bringing a rough block to them, and what is left there."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..geotags.control import BAR_SD_M, ControlPoints, ScaleBars, are_spread
from .poses import Similarity, fit_similarity
from .tracks import Block, ray_normals

#: Standard error of a mark, pixels.
MARK_PX = 0.7
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
    move(block, fitted)
    return fitted


def move(block: Block, by: Similarity) -> None:
    """Move, turn and scale a block."""
    centres = by.apply(block.centres)
    block.rotations = block.rotations @ by.rotation.T
    block.translations = -np.einsum("nij,nj->ni", block.rotations, centres)
    block.points = by.apply(block.points)


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


class BarLengths(NamedTuple):
    """What a block says of known lengths. times: (B,) the length over the block's, NaN where an end has fewer than two
    posed photos or its marks do not meet. sd: (B,) standard error of its logarithm. scale: logarithm of what all of
    them scale the block by, and its standard error, larger where they disagree; zero and infinite without a length."""

    times: np.ndarray
    sd: np.ndarray
    scale: tuple[float, float]

    def contradict(self, scale_sd: float) -> bool:
        """Whether they do the block, whose scale is known to ``scale_sd`` (relative) without them."""
        return abs(self.scale[0]) > CONTRADICTED_TIMES * float(np.hypot(self.scale[1], scale_sd))


def bar_lengths(block: Block, bars: ScaleBars) -> BarLengths:
    """The block's own lengths between the marks of known ones."""
    placed, meet, left = _intersected(block, bars, 2 * len(bars))
    placed[~meet] = np.nan
    first, second = placed[::2], placed[1::2]
    way = second - first
    found = np.linalg.norm(way, axis=1)
    along = way / found[:, None]
    # A mark is off by so much across its ray at the photos' distance (median).
    use = block.is_posed[bars.photo]
    centres, ends = block.centres[bars.photo[use]], bars.point[use]
    across = MARK_PX / block.camera.fx * np.linalg.norm(placed[ends] - centres, axis=1)
    sd = np.full(len(bars), np.nan)
    for k in np.flatnonzero(np.isfinite(found)):
        spread = sum(along[k] @ np.linalg.solve(left[end], along[k]) for end in (2 * k, 2 * k + 1))
        sd[k] = np.hypot(BAR_SD_M, float(np.median(across[ends // 2 == k])) * np.sqrt(spread)) / bars.length_m[k]
    times, known = bars.length_m / found, np.isfinite(found)
    if not known.any():
        return BarLengths(times, sd, (0.0, float("inf")))
    logs, weight = np.log(times[known]), 1 / sd[known] ** 2
    mean = float(np.average(logs, weights=weight))
    spread = np.sum(weight * (logs - mean) ** 2) / max(known.sum() - 1, 1)
    return BarLengths(times, sd, (mean, float(np.sqrt(max(spread, 1.0) / weight.sum()))))


def _placed(block: Block, control: ControlPoints) -> np.ndarray:
    """(K, 3) places by the marks and the posed photos alone, NaN where fewer than two photos show a point or its marks
    do not meet."""
    placed, meet, _ = _intersected(block, control, len(control))
    return np.where(meet[:, None], placed, np.nan)


def marks_meet(block: Block, control: ControlPoints) -> np.ndarray:
    """(K,) bool: not where the marks of a point miss each other in the posed photos: one of them is of another point.
    Such a point is left out."""
    return _intersected(block, control, len(control))[1]


def _intersected(
    block: Block, marked: ControlPoints | ScaleBars, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(K, 3) places by the marks, NaN where fewer than two posed photos show a point; :func:`marks_meet`; and (K, 3, 3)
    the normal matrices of the places, of marks that are off by one across their rays."""
    use = block.is_posed[marked.photo]
    photo, point, pixels = marked.photo[use], marked.point[use], marked.pixels[use]
    starts, rays = block.rays_of(photo, pixels)
    left, right = ray_normals(starts, rays, np.ones(len(rays)), point, count)
    placed, known = np.full((count, 3), np.nan), np.bincount(point, minlength=count) >= 2
    placed[known] = np.linalg.solve(left[known], right[known][:, :, None])[:, :, 0]
    local = np.einsum("mij,mj->mi", block.rotations[photo], placed[point]) + block.translations[photo]
    off = np.linalg.norm(block.sensor.to_pixels(local, photo) - pixels, axis=1)
    meet = np.ones(count, bool)
    meet[point[known[point] & ~(off < APART_SHARE * block.camera.width)]] = False
    return placed, meet, left
