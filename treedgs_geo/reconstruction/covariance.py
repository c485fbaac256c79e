"""How sure an adjusted block is of its lens, its shutter, and the size of what stands on its ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from .adjustment import TAG_LOSS, Adjusted
from .bundle import Linear, PointNormals, Problem
from .bundle_kernels import FIRST_FLIGHT, LOG_F, N_POSE, Model, Seen, linearise
from .cameras import OBLIQUE_DEG

#: Real errors over formal ones: within a photo the pixels' errors are not independent (wind, gimbal rates), and
#: geotags of one flight share theirs. From focal lengths and principal points of blocks with truth
#: (``docs/evidence/reconstruction.md``).
SYSTEMATIC = 2.0
#: Errors of a receiver at two instants so far apart, seconds, are alike by 1 / e (multipath, atmosphere: minutes).
GEOTAG_DRIFT_S = 300.0
#: Share of the normal equations' diagonal that is added to it.
_MIN_HELD = 1e-9
#: Places on the ground at which the poses' errors are looked at.
_MAX_PLACES = 24


@dataclass(frozen=True)
class Posterior:
    """Standard errors, :data:`SYSTEMATIC` included. NaN where a number was held.

    scale: relative, of lengths across the line of sight at the ground (and so of diameters). focal: relative.
    shared_sd: (S,) of the shared parameters (:mod:`.bundle_kernels`). poses_px: (N,) of a place on the ground in each
    photo against the others (``_poses_px``), NaN where none is seen. late_s, late_sd_s: (F,) seconds by which the
    geotags of a flight are too early for its exposures; held ones included.
    """

    scale: float
    focal: float
    shared_sd: np.ndarray
    poses_px: np.ndarray
    late_s: np.ndarray
    late_sd_s: np.ndarray


def posterior_of(adjusted: Adjusted, geotag_factor: float = 1.0) -> Posterior:
    """The posterior of an adjustment from its normal equations (Gauss-Newton), points and poses marginalised.

    A width of w pixels is w * depth / f metres: the error of the scale is that of depth / f, averaged over what the
    oblique photos see (all photos, where none is oblique).

    Errors of geotags that change in minutes come on top, as large as the geotags state.

    Args:
        geotag_factor: by how much the geotags are worse than they state, at least 1.
    """
    problem, state = adjusted.problem, adjusted.state
    problem.linearise(state)
    weights = problem.weigh(state, adjusted.sigma_px, TAG_LOSS)
    weights = weights._replace(tags=weights.tags / max(geotag_factor, 1.0) ** 2)
    matrix, _, points = problem.normal(state, weights, 0.0)
    matrix = np.triu(matrix) + np.triu(matrix, 1).T
    # What nothing holds (a photo all of whose points lie in one place) stays unsure instead of ending the work.
    matrix[np.diag_indices_from(matrix)] *= 1 + _MIN_HELD
    free = problem.free
    factor = cho_factor(matrix[np.ix_(free, free)], check_finite=False)
    # Of all unknowns, zero for those that are held.
    covariance = np.zeros_like(matrix)
    covariance[np.ix_(free, free)] = cho_solve(factor, np.eye(len(free)))
    sd = np.full(len(matrix), np.nan)
    sd[free] = SYSTEMATIC * np.sqrt(np.maximum(np.diag(covariance)[free], 0))
    first_shared = problem.photos * N_POSE
    gradient = _scale_gradient(adjusted, weights.pixels, points)
    scale = SYSTEMATIC * float(np.sqrt(max(gradient @ covariance @ gradient, 0.0)))
    # How scale and shared parameters follow the cameras.
    follow = np.column_stack([covariance @ gradient, covariance[:, first_shared:]])
    drifting = _drift_sd(problem, weights.tags, follow) * max(geotag_factor, 1.0)
    shared = np.hypot(sd[first_shared:], drifting[1:])
    centres = np.arange(first_shared).reshape(-1, N_POSE)[:, 3:6]
    of_centres = covariance[np.ix_(centres.ravel(), centres.ravel())]
    return Posterior(
        float(np.hypot(scale, drifting[0])),
        float(shared[LOG_F]),
        shared,
        SYSTEMATIC * _poses_px(adjusted, covariance),
        problem.flight_error(state, weights.tags)[:, 3],
        SYSTEMATIC * problem.flight_error_sd(weights.tags, of_centres)[:, 3],
    )


def _poses_px(adjusted: Adjusted, covariance: np.ndarray) -> np.ndarray:
    """(N,) px: how far a place on the ground may lie, in each photo, from where the other photos that show it have it.

    What a stem's edges are read with: a shift of the whole block moves all photos alike and does not count. Places are
    where the axes of up to :data:`_MAX_PLACES` photos meet the ground; each is intersected anew from all its photos.

    Args:
        covariance: (S, S) of all unknowns, 0 for those that are held.
    """
    problem = adjusted.problem
    photo, place, linear = _places_seen(adjusted)
    shared = problem.photos * N_POSE + np.arange(problem.shared)
    square, count = np.zeros(problem.photos), np.zeros(problem.photos)
    for k in np.unique(place):
        rows = np.flatnonzero(place == k)
        own = photo[rows]
        if len(own) < 3:
            continue
        columns = np.concatenate([(own[:, None] * N_POSE + np.arange(N_POSE)).ravel(), shared])
        by_all = np.zeros((len(own), 2, len(columns)))
        for at, row in enumerate(rows):
            by_all[at, :, at * N_POSE : (at + 1) * N_POSE] = linear.by_pose[row]
        by_all[:, :, len(own) * N_POSE :] = linear.by_shared[rows]
        moves, toward = by_all.reshape(2 * len(own), -1), linear.by_point[rows].reshape(-1, 3)
        span = np.linalg.qr(toward)[0]
        moves -= span @ (span.T @ moves)
        variance = np.sum((moves @ covariance[np.ix_(columns, columns)]) * moves, axis=1).reshape(-1, 2).mean(axis=1)
        square[own] += np.maximum(variance, 0)
        count[own] += 1
    with np.errstate(invalid="ignore"):
        return np.sqrt(square / count)


def _places_seen(adjusted: Adjusted) -> tuple[np.ndarray, np.ndarray, Linear]:
    """Photo and place (M,) of each place of :func:`_poses_px` in each photo that shows it, and derivatives there."""
    problem, state, sensor = adjusted.problem, adjusted.state, adjusted.problem.sensor
    posed = np.flatnonzero(~problem.held)
    axes = state.rotations[posed, 2]
    looking = posed[axes[:, 2] < -0.3]
    looking = looking[:: max(-(-len(looking) // _MAX_PLACES), 1)]
    low = np.percentile(state.points[:, 2], 20) if len(state.points) else 0.0
    down = (low - state.centres[looking, 2]) / state.rotations[looking, 2, 2]
    places = state.centres[looking] + down[:, None] * state.rotations[looking, 2]
    photo, place = (each.ravel() for each in np.meshgrid(posed, np.arange(len(places)), indexing="ij"))
    share = np.zeros(len(photo))
    linear = Linear(*(np.zeros((len(photo), 2, *size)) for size in ((), (N_POSE,), (problem.shared,), (3,))))
    model = Model(state.shared, state.drift, state.rotations, state.centres, state.travel, places, sensor.velocity_m_s)
    # Residuals from (0, 0) are the places' pixels; those say when their row was read.
    for _ in range(2):
        linearise(model, Seen(photo, place, np.zeros((len(photo), 2)), share, sensor.flight), *linear)
        share = sensor.share(np.nan_to_num(linear.residual[:, 1]))
    with np.errstate(invalid="ignore"):
        shown = (linear.residual > 0).all(axis=1)
        shown &= (linear.residual < [sensor.camera.width, sensor.camera.height]).all(axis=1)
    return photo[shown], place[shown], Linear(*(each[shown] for each in linear))


def _drift_sd(problem: Problem, tags: np.ndarray, follow: np.ndarray) -> np.ndarray:
    """(G,) standard errors by what the geotags of a flight err together for some minutes and then otherwise.

    The adjustment takes the errors for independent but for a shift of the whole flight; a slow drift stretches a flight
    and the more photos there are, the less of that would show.

    Args:
        follow: (S, G) products of the inverse normal matrix and the gradients of G numbers.
    """
    variance = np.zeros(follow.shape[1])
    for own, _, precision in problem.tag_precisions(tags):
        at = (own[:, None] * N_POSE + 3 + np.arange(3)).ravel()
        pulls = (precision @ follow[at]).reshape(len(own), 3, follow.shape[1])
        apart_s = np.abs(np.subtract.outer(problem.taken_s[own], problem.taken_s[own]))
        for axis in range(3):
            sd, pull = problem.known.sd[own, axis], pulls[:, axis]
            variance += np.einsum("ig,ij,jg->g", pull, np.outer(sd, sd) * np.exp(-apart_s / GEOTAG_DRIFT_S), pull)
    return np.sqrt(np.maximum(variance, 0))


def _scale_gradient(adjusted: Adjusted, weight: np.ndarray, points: PointNormals) -> np.ndarray:
    """Derivative of the mean log(depth / f) by photos and shared parameters, the points following."""
    problem, state = adjusted.problem, adjusted.state
    seen, linear = problem.seen, problem.linear
    rotations = state.rotations[seen.photo]
    offset = state.points[seen.point] - state.centres[seen.photo]
    local = np.einsum("mij,mj->mi", rotations, offset)
    oblique = np.degrees(np.arccos(np.clip(-state.rotations[:, 2, 2], -1, 1))) > OBLIQUE_DEG
    use = oblique[seen.photo] if oblique[seen.photo].any() else np.ones(len(local), bool)
    use &= weight > 0
    share = use / (use.sum() * np.maximum(local[:, 2], 0.1))
    by_depth = share[:, None] * rotations[:, 2]
    gradient = np.zeros(problem.photos * N_POSE + problem.shared)
    pose = gradient[: problem.photos * N_POSE].reshape(-1, N_POSE)
    np.add.at(pose[:, 3:6], seen.photo, -by_depth)
    np.add.at(pose[:, :2], seen.photo, share[:, None] * np.column_stack([local[:, 1], -local[:, 0]]))
    by_point = np.zeros((problem.points, 3))
    np.add.at(by_point, seen.point, by_depth)
    # The points move with photos and lens: less what elimination took out.
    moved = np.einsum("pij,pj->pi", points.inverse, by_point)
    gradient[problem.photos * N_POSE :] -= np.einsum("pjs,pj->s", points.mixed, moved)
    pull = weight[:, None] * np.einsum("mkj,mj->mk", linear.by_point, moved[seen.point])
    np.add.at(pose, seen.photo, -np.einsum("mkd,mk->md", linear.by_pose, pull))
    gradient[problem.photos * N_POSE + LOG_F] -= 1.0
    flights = np.bincount(problem.sensor.flight[seen.photo[use]], minlength=len(state.drift)) / max(use.sum(), 1)
    gradient[problem.photos * N_POSE + FIRST_FLIGHT :] -= flights[1:]
    return gradient
