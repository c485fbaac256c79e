"""Photos that show the ground, or another stem, where a stem should stand. It is opaque: they say that there is none.

Where other stems line up, before or behind a place, their edges make a stem there: four to six photos from different
sides are enough, and silhouettes say the same, since something does hide the ground there. What such a stem cannot do
is hide the ground from all the others. How often a photo merely lacks a stem says little (leaves hide it); how often
the very ground behind is seen through it says nearly all. Colour alone does not tell ground from dry twigs: the pattern
of the ground behind (:mod:`.images.background`) has to come again, as the correlation of the photo with it inside the
outline. Figures: ``docs/evidence/photos.md``.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from ....core.machine import EXACT
from ....reconstruction.cameras import View
from ..fit.null_model import BREAST
from ..fit.photo_fit import PhotoFit
from ..images.axis_patches import BH_M, GROUND_Z, NEAREST_M, StemAxis, across_view, axis_at, crop_place, fetch
from ..images.background import Backdrop
from ..images.background_kernels import TONES, behind_on_ground
from ..images.crops import GroundGrid, PhotoStack
from ..tuned import CORE, ROW_M, SEEN_CORRELATION

#: No fastmath: places whose ground no photo shows are NaN.


@njit(parallel=True, **EXACT)
def _correlations(photos, ground, backdrop, lut, axis, heights, radii, out):
    """Correlation of luma with the ground's inside an outline, (V,); NaN where a photo holds too little of it."""
    centre = photos.centre
    bx0, by0, bcell, mean, _, layer = backdrop
    rows, columns = mean.shape[1], mean.shape[2]
    for v in prange(len(centre)):
        colour = np.empty(3, np.float32)
        out[v] = np.nan
        nx, ny, widen = across_view(axis, centre[v])
        if nx == 0.0 and ny == 0.0:
            continue
        asked, n, s, g, ss, gg, sg = 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(heights.size):
            ax, ay = axis_at(axis, heights[i] - axis[BH_M])
            z = axis[GROUND_Z] + heights[i]
            half = CORE * widen * radii[i]
            steps = int(np.ceil(half / 0.02))
            for j in range(-steps, steps + 1):
                asked += 1
                x, y = ax + nx * half * j / steps, ay + ny * half * j / steps
                u, w, shown = crop_place(photos, v, x, y, z)
                if not shown:
                    continue
                hx, hy = behind_on_ground(ground, centre[v], axis[GROUND_Z], x, y, z)
                fy, fx = (hy - by0) / bcell, (hx - bx0) / bcell
                if fy < 0.0 or fx < 0.0 or fy >= rows - 1 or fx >= columns - 1:
                    continue
                a, b = int(fy), int(fx)
                fy -= a
                fx -= b
                m = mean[layer[v]]
                behind = (m[a, b, 0] * (1 - fx) + m[a, b + 1, 0] * fx) * (1 - fy)
                behind += (m[a + 1, b, 0] * (1 - fx) + m[a + 1, b + 1, 0] * fx) * fy
                if not (behind > -9.0 and behind < 9.0):
                    continue
                fetch(photos, v, u, w, lut, colour)
                n += 1
                s += colour[0]
                g += behind
                ss += colour[0] * colour[0]
                gg += behind * behind
                sg += colour[0] * behind
        if n >= 0.8 * asked and n > 1:
            spread = (ss - s * s / n) * (gg - g * g / n)
            out[v] = (sg - s * g / n) / np.sqrt(max(spread, 1e-12))


def ground_correlation(
    stack: PhotoStack,
    ground: GroundGrid,
    backdrop: Backdrop,
    axis: StemAxis,
    radius: tuple[float, float],
    band_m: tuple[float, float],
) -> np.ndarray:
    """(V,) correlation of each photo inside a stem's outline with the ground behind it; NaN where it holds too little
    of either.

    radius: at breast height (m) and its slope (m/m). band_m: heights above the ground that are looked at.
    """
    heights = np.arange(band_m[0], band_m[1], ROW_M)
    radii = np.maximum(radius[0] + radius[1] * (heights - axis.bh_m), 0.01)
    out = np.empty(len(stack))
    _correlations(stack.arrays, ground, backdrop, TONES.lut, axis.row, heights, radii, out)
    return out


def showing_ground(correlation: np.ndarray) -> int:
    """How many photos show the ground through a stem. correlation: of :func:`ground_correlation`."""
    return int((correlation > SEEN_CORRELATION).sum())


#: A photo shows a stem for certain from this probability on.
_SHOWS = 0.9


def seen_behind(fit: PhotoFit, other: PhotoFit, centre: np.ndarray) -> np.ndarray:
    """(V,) bool: the photo shows ``other``, an edge of which ``fit`` would hide from it at all heights. centre: (V, 3)
    cameras of the photos of ``other``."""
    to_fit = fit.axis.p - centre[:, :2]
    away = np.maximum(np.hypot(*to_fit.T), NEAREST_M)[:, None]
    along = to_fit / away
    rays = other.axis.at(np.linspace(*BREAST.fine, 5)) - centre[:, None]
    with np.errstate(divide="ignore"):
        # The part of the way to the other stem on which the ray passes this one.
        share = away / np.einsum("vhk,vk->vh", rays[..., :2], along)
    at = centre[:, None] + share[..., None] * rays
    height = at[..., 2] - fit.axis.ground_z
    q = height - fit.axis.bh_m
    off = at[..., :2] - fit.axis.p - q[..., None] * fit.axis.s
    across = np.abs(off[..., 0] * along[:, None, 1] - off[..., 1] * along[:, None, 0])
    hidden = np.abs(across - share * other.r0) < CORE * (fit.r0 + fit.r1 * q)
    hidden &= (share > 0) & ((1 - share) * away > share * fit.r0) & (height > 0) & (height < BREAST.fine[1])
    return hidden.all(axis=1) & (other.seen >= _SHOWS)


def without_seen_through(fits: list[PhotoFit], views: list[View]) -> list[PhotoFit]:
    """The fits, which know how many photos show clearer stems through them (``see_through``)."""
    centre, out = {view.name: view.centre for view in views}, list(fits)
    for k in sorted(range(len(fits)), key=lambda k: -fits[k].evidence.llr):
        fit, shown = fits[k], set[str]()
        for other in out:
            if fit.measured and other.measured and other.evidence.llr > fit.evidence.llr:
                behind = seen_behind(fit, other, np.array([centre[name] for name in other.photos]))
                shown |= {name for name, seen in zip(other.photos, behind, strict=True) if seen}
        out[k] = fit.knowing(n_through=fit.evidence.n_through + len(shown))
    return out
