"""The stem curve: sections of each measured stem every half metre, from its foot to where crown hides it, with errors.

Up and down from breast height, each circle is started where those before it lead: the points of half a metre of stem,
sheared along the axis to one plane, give a circle with a taper. It holds with enough of its circumference seen, points
that lie on it and not about it, a radius that follows from its neighbour's and is not thicker than those below, and an
error that is small beside it. Where three in a row do not hold, the curve ends. The DBH does not come from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from ....core.machine import in_threads
from ....pointcloud.cloud import grouped
from ...geometry.cone import Cone, fit_cone
from ...geometry.cone_kernels import bark_distances, fit_vector
from ...geometry.section_kernels import SECTORS, lobes, sector_about
from ...quality.priors import USUAL_TAPER
from ...quality.tree import Tree
from .surface_quality import FLOOR_CM, FLOOR_SHARE, ROUNDNESS

#: Distance of sections, and lowest one, m.
STEP_M, LOWEST_M = 0.5, 0.5
#: Half the length of a section, m: the second where the first holds fewer points than this.
HALVES_M, PLENTY, MIN_POINTS = (0.1, 0.25, 0.5), 60, 16
#: Share of the spread of the points that counts in the error of the diameter.
NOISE_SHARE = 0.2
#: Spread of bark points about a circle: not below, not above, m.
_FLOOR_M, _CAP_M = 0.005, 0.025
#: The circumference that has to be seen, degrees.
MIN_ARC_DEG = 150.0
#: A section holds with a radius within this share of what its neighbour leads to, a centre within this of it (m, and
#: radii), and a standard error below this share of the diameter.
_CHANGE, _OFF_M, _OFF_SHARE, _SE_SHARE = 0.12, 0.04, 0.15, 0.08
#: Points inside a circle may be this dense, in densities of those on it: bark is opaque, a crown is not.
_INSIDE = 0.5
#: 90 % intervals of a section and of one below it that do not meet.
_SURE = 1.645
#: So many sections in a row that do not hold end the curve.
_MISSES = 3
#: Points beyond this many of a section add nothing but time.
_MAX_POINTS = 1000


@dataclass(frozen=True)
class _Section:
    height: float
    centre: np.ndarray
    radius: float
    se_cm: float
    rms_m: float
    n_points: int
    arc_deg: float


def stem_sections(xyz: np.ndarray, tree_id: np.ndarray, trees: list[Tree]) -> list[dict[str, Any]]:
    """Sections of each tree with a DBH and a ground height, by tree and height: ``tree_id, height_m`` (above the ground
    at the foot), ``d_cm, d_se_cm, rms_cm, n_pts, arc_deg`` and the centre ``x, y`` in project metres.

    xyz: (N, 3) project metres. tree_id: (N,) integers.
    """
    ids, parts = grouped(tree_id)
    groups = dict(zip(ids.tolist(), parts, strict=True))
    measured = [t for t in trees if t.dbh_cm is not None and t.z_ground is not None and t.tree_id in groups]

    def of(tree: Tree) -> list[_Section]:
        assert tree.dbh_cm is not None and tree.z_ground is not None
        return sections_of(xyz[groups[tree.tree_id]] - [tree.x, tree.y, tree.z_ground], tree.dbh_cm, tree.bh_m)

    return [
        {
            "tree_id": int(tree.tree_id),
            "height_m": round(section.height, 2),
            "d_cm": round(200 * section.radius, 2),
            "d_se_cm": round(section.se_cm, 2),
            "rms_cm": round(100 * section.rms_m, 2),
            "n_pts": section.n_points,
            "arc_deg": section.arc_deg,
            "x": float(section.centre[0] + tree.x),
            "y": float(section.centre[1] + tree.y),
        }
        for tree, sections in zip(measured, in_threads(of, measured), strict=True)
        for section in sections
    ]


def sections_of(points: np.ndarray, dbh_cm: float, bh_m: float) -> list[_Section]:
    """The sections that hold of one stem's (N, 3) points: metres from its axis at breast height and its ground."""
    points = np.ascontiguousarray(points[np.argsort(points[:, 2], kind="stable")])
    low, high = np.searchsorted(points[:, 2], [bh_m - 0.8, bh_m + 0.8])
    some = points[low : high : max((high - low) // (3 * _MAX_POINTS), 1)]
    upright = Cone(0.0, 0.0, 0.0, 0.0, dbh_cm / 200, USUAL_TAPER, bh_m)
    start = fit_cone(some, upright, None, (0.06, 0.04, 0.02), _FLOOR_M, _CAP_M) or upright
    if abs(start.r / upright.r - 1) > 2 * _CHANGE:
        start = upright
    found: list[_Section] = []
    top = points[-1, 2] if len(points) else 0.0
    at_bh = STEP_M * round(bh_m / STEP_M)
    for heights in (np.arange(at_bh, top, STEP_M), np.arange(at_bh - STEP_M, LOWEST_M - 0.01, -STEP_M)):
        way = found[:1]  # the second way begins where the first did
        cone, misses = start, 0
        for height in heights:
            predicted = _leading_to(float(height), way, cone)
            x, y, radius, se_cm, rms, on, arc = _circle(points, predicted.vector, predicted.h_ref)
            # Surely thicker than one below it, as foliage about a stem is and no stem.
            thinnest = min((200 * below.radius + _SURE * below.se_cm for below in way), default=np.inf)
            if not radius > 0 or height > bh_m and 200 * radius - _SURE * se_cm > thinnest:
                misses += 1
                if misses == _MISSES:
                    break
                continue
            misses = 0
            centre = predicted.centre(height) + [x, y]
            section = _Section(float(height), centre, radius, se_cm, rms, int(on), arc)
            way.append(section)
            found.append(section)
            cone = _leading_to(float(height), way, predicted)
    return sorted(found, key=lambda section: section.height)


def _leading_to(height: float, way: list[_Section], cone: Cone) -> Cone:
    """The cone that the last sections of a way lead to at a height: straight on through them, with the usual taper."""
    slope = np.array([cone.dx, cone.dy])
    if not way:
        centre, radius = cone.centre(height), float(cone.radius(height))
    else:
        last = way[-1]
        near = [section for section in way[-4:-1] if abs(section.height - last.height) > 0.7]
        if near:
            slope = (last.centre - near[0].centre) / (last.height - near[0].height)
        centre = last.centre + slope * (height - last.height)
        radius = max(last.radius + USUAL_TAPER * (height - last.height), 0.01)
    return Cone(float(centre[0]), float(centre[1]), float(slope[0]), float(slope[1]), radius, USUAL_TAPER, height)


@njit(cache=True, nogil=True)
def _circle(points, predicted, height):  # pragma: no cover - compiled
    """The circle about a predicted cone's vector (8,) at a height: x and y from its axis, radius, standard error of the
    diameter cm, spread m, points, arc deg; zeros where it does not hold."""
    none, expected = np.zeros(7), predicted[4]
    here, away = points, np.empty(0)
    for half in HALVES_M:
        low, high = np.searchsorted(points[:, 2], height - half), np.searchsorted(points[:, 2], height + half)
        here = points[low:high]
        away = bark_distances(here, predicted, height)
        count = np.count_nonzero(np.abs(away) < max(0.05, 0.25 * expected))
        if count >= PLENTY:
            break
    if count < MIN_POINTS:
        return none
    near = here[np.abs(away) < max(0.05, 0.25 * expected)]
    near = near[:: max(len(near) // _MAX_POINTS, 1)]
    # Sheared along the axis to one plane, the lean's stretch undone.
    flat = np.empty((len(near), 3))
    square = predicted[2] ** 2 + predicted[3] ** 2
    stretch = (1 / np.sqrt(1 + square) - 1) / square if square > 1e-18 else 0.0
    for m in range(len(near)):
        t = near[m, 2] - height
        x, y = near[m, 0] - predicted[0] - predicted[2] * t, near[m, 1] - predicted[1] - predicted[3] * t
        along = stretch * (x * predicted[2] + y * predicted[3])
        flat[m, 0], flat[m, 1], flat[m, 2] = x + along * predicted[2], y + along * predicted[3], near[m, 2]
    upright = np.array([0.0, 0.0, 0.0, 0.0, expected, USUAL_TAPER, 0.0, 0.0])
    vector, covariance, sigma = fit_vector(
        flat, np.ones(len(flat)), upright, height, np.array([0.04, 0.02]), _FLOOR_M, _CAP_M, 0.02, 0.002, 0.0, 6
    )
    if not sigma > 0 or abs(vector[4] / expected - 1) > _CHANGE:
        return none
    if np.hypot(vector[0], vector[1]) > _OFF_M + _OFF_SHARE * expected:
        return none
    residual = bark_distances(flat, vector, height)
    on = np.abs(residual) < max(3 * sigma, 0.01)
    bark, residual = flat[on], residual[on]
    if len(bark) < MIN_POINTS:
        return none
    # Points fill the place where a stem should be, and do not lie on its bark.
    deep = max(3 * sigma, 0.02)
    inside = np.count_nonzero(away < -deep)
    if expected > 1.2 * deep and inside / (expected - deep) ** 2 > _INSIDE * len(bark) / (4 * expected * deep):
        return none
    seen = np.zeros(SECTORS, np.bool_)
    for m in range(len(bark)):
        seen[sector_about(bark[m], vector, height)] = True
    arc = 360.0 / SECTORS * np.count_nonzero(seen)
    if arc < MIN_ARC_DEG:
        return none
    rms = np.sqrt(np.mean(residual**2))
    d_cm = 200 * vector[4]
    shape_cm = d_cm * max(ROUNDNESS, lobes(bark, vector, height, sigma)) / np.sqrt(arc / 60.0)
    fit_cm, curve_cm, noise_cm = 200 * np.sqrt(covariance[4, 4]), 100 * rms**2 / vector[4], NOISE_SHARE * 200 * rms
    parts = np.array([fit_cm, shape_cm, curve_cm, noise_cm, FLOOR_CM, FLOOR_SHARE * d_cm])
    se_cm = np.sqrt(np.sum(parts**2))
    if se_cm > _SE_SHARE * d_cm:
        return none
    return np.array([vector[0], vector[1], vector[4], se_cm, rms, len(bark), arc])
