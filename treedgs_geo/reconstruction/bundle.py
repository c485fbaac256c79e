"""Bundle adjustment: photos, points, lens and shutter fitted to the pixels, with everything known as a normal prior.

Own solver, because COLMAP's and Ceres' Python wheels have neither a rolling shutter nor priors on a lens, nor the full
posterior of both. Levenberg-Marquardt on the reduced normal equations (points eliminated; Triggs et al. 2000, Bundle
Adjustment - A Modern Synthesis), with a dense Cholesky factor: a thousand photos are 9,000 unknowns. Losses are soft
L1, the pixels' Cauchy at the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from . import bundle_kernels as kernels
from .bundle_kernels import CX, FIRST_FLIGHT, LOG_ASPECT, LOG_F, N_POSE, READOUT
from .cameras import Camera, Sensor

#: Standard deviations at which a pixel's loss turns from a parabola: soft L1 on the way, Cauchy at the end, where the
#: wrong matches are out and what is left moves in the wind, each point as much as its plant.
PIXEL_LOSS = 2.0
#: The curvature of a loss along its residual counts with at least this share of its weight: above a half no step can
#: raise the cost of a block that is otherwise linear, and the points of wrong matches do not run away.
MIN_BEND = 0.55
#: An adjustment ends when a step moves the cameras (poses, lens, shutter) by less than this, in standard errors,
#: squared and summed over all of their numbers: on the way, where a choice hangs on it, and the last one. The cost says
#: less: single points that creep along their rays lower it for long, and move no camera.
ROUGH, GOOD, LAST = 1.0, 0.03, 1e-3
#: A step that is damped more than this says nothing about how far the end is.
_HARDLY_DAMPED = 1e-3
#: A step that is this short and still raises the cost is one of rounding.
_NOTHING = 1e-8
_CENTRE, _TRAVEL = slice(3, 6), slice(6, 9)
_MAX_DAMPING = 1e4
#: Up to so many unknowns BLAS gets one thread: its others wait busily for the next matrix, on the cores that the
#: compiled loops between need.
_FEW_UNKNOWNS = 1500


@dataclass(frozen=True)
class Priors:
    """What is known before the photos are looked at, as normal distributions.

    A standard deviation of 0 holds a number, one of infinity leaves it to the photos.

    shared, shared_sd: (10,) see :mod:`.bundle_kernels`. drift_sd: of the log of a later flight's focal length over the
    first's. centres, centre_sd: (N, 3) m, NaN = no geotag. late_sd: (F,) or (1,) seconds, of the instant that a
    flight's geotags belong to, less that of its exposures. taken_s: (N,) when, seconds. travel_sd: (N,) m, of
    ``Sensor.extra_travel_m``. rotations: (N, 3, 3) world -> camera, NaN = none; rotation_sd: (2,) radians, of their
    vertical and of their north; mounting_sd: radians, of a turn that all photos share. held: (N,) bool, photos whose
    pose stays. point_xyz, point_sd: (P, 3) m of points whose place is known (ground control), infinite for the others.
    """

    shared: np.ndarray
    shared_sd: np.ndarray
    drift_sd: float
    centres: np.ndarray
    centre_sd: np.ndarray
    late_sd: np.ndarray
    taken_s: np.ndarray
    travel_sd: np.ndarray
    rotations: np.ndarray
    rotation_sd: np.ndarray
    mounting_sd: float
    held: np.ndarray
    point_xyz: np.ndarray
    point_sd: np.ndarray


class Observations(NamedTuple):
    """M observations: photo, point, (M, 2) pixels, share of the readout (row / height - 0.5), and their own error
    beside that of all, (M,) px."""

    photo: np.ndarray
    point: np.ndarray
    pixels: np.ndarray
    share: np.ndarray
    extra_px: np.ndarray


@dataclass(frozen=True)
class State:
    """All unknowns: shared (10,), drift (F,), rotations (N, 3, 3), centres (N, 3), travel (N, 3), points (P, 3)."""

    shared: np.ndarray
    drift: np.ndarray
    rotations: np.ndarray
    centres: np.ndarray
    travel: np.ndarray
    points: np.ndarray


class Weights(NamedTuple):
    """cost: twice the negative log posterior. pixels: (M,) 1/px2. tags: (N,) share of a geotag that is believed.
    bend: (M,) curvature of a pixel's loss along its residual, as a share of that of its weight (Triggs et al. 2000,
    section 4.3), not below :data:`MIN_BEND`."""

    cost: float
    pixels: np.ndarray
    tags: np.ndarray
    bend: np.ndarray


class Linear(NamedTuple):
    """Residuals (M, 2) px and their derivatives by pose (M, 2, 9), shared (M, 2, S) and point (M, 2, 3)."""

    residual: np.ndarray
    by_pose: np.ndarray
    by_shared: np.ndarray
    by_point: np.ndarray


class PointNormals(NamedTuple):
    """The points' normal equations: inverse (P, 3, 3), right side (P, 3), share in the shared parameters (P, 3, S)."""

    inverse: np.ndarray
    right: np.ndarray
    mixed: np.ndarray


def shared_of(camera: Camera, readout_s: float) -> np.ndarray:
    """(10,) the shared parameters of a camera."""
    first = [np.log(camera.fx), np.log(camera.fy / camera.fx), camera.cx, camera.cy]
    return np.array([*first, *camera.distortion, readout_s])


def camera_of(shared: np.ndarray, camera: Camera) -> Camera:
    """The camera of (10,) shared parameters; its size is that of ``camera``."""
    fx = float(np.exp(shared[LOG_F]))
    fy = fx * float(np.exp(shared[LOG_ASPECT]))
    return Camera(camera.width, camera.height, fx, fy, *(float(value) for value in shared[CX:READOUT]))


def _rows_of(index: np.ndarray, count: int, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Start of each number's rows in an order that sorts by number, and those of one number by the second."""
    order = np.lexsort((second, index))
    return np.searchsorted(index[order], np.arange(count + 1)), order


def _soft_l1(square: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Loss, weight and bend of squared normalised errors: linear far out, so that no error ever stops to pull."""
    if not np.isfinite(scale):
        return square, np.ones_like(square), np.ones_like(square)
    root = np.sqrt(1 + square / scale**2)
    return 2 * scale**2 * (root - 1), 1 / root, 1 / root**2


def _cauchy(square: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Loss, weight and bend of squared normalised errors: what is far out hardly counts."""
    far = square / scale**2
    return scale**2 * np.log1p(far), 1 / (1 + far), (1 - far) / (1 + far)


def _damped(matrix: np.ndarray, right: np.ndarray, damping: float) -> np.ndarray:
    """Solution of the upper triangle of ``matrix`` (overwritten), its diagonal raised by a share ``damping``."""
    diagonal = np.arange(len(matrix))
    matrix[diagonal, diagonal] *= 1 + damping
    return cho_solve(cho_factor(matrix, lower=False, overwrite_a=True, check_finite=False), right)


class Problem:
    """One adjustment: observations, priors, and the numbers that stay as they are."""

    def __init__(
        self, observations: Observations, priors: Priors, sensor: Sensor, points: int, *, final: bool = False
    ) -> None:
        self.final = final
        self.seen, self.priors, self.sensor = observations, priors, sensor
        self.photos, self.points = len(priors.centres), points
        self.shared = FIRST_FLIGHT + len(sensor.drift) - 1
        self.by_image = _rows_of(observations.photo, self.photos, observations.point)
        self.by_point = _rows_of(observations.point, points, observations.photo)
        rows = len(observations.photo)
        self.places = np.empty(rows, np.int64)
        self.places[self.by_point[1]] = np.arange(rows)
        self.coupled = np.zeros((rows, 3, kernels.STILL))
        self.travels = bool((priors.travel_sd > 0).any())
        self.linear = Linear(
            np.zeros((rows, 2)),
            np.zeros((rows, 2, N_POSE)),
            np.zeros((rows, 2, self.shared)),
            np.zeros((rows, 2, 3)),
        )
        used = ~priors.held
        pose_sd = np.full((self.photos, N_POSE), np.inf)
        pose_sd[:, _TRAVEL] = priors.travel_sd[:, None]
        pose_sd[~used] = 0
        sd = np.concatenate([pose_sd.ravel(), priors.shared_sd, np.full(self.shared - FIRST_FLIGHT, priors.drift_sd)])
        self.free = np.flatnonzero(sd > 0)
        self.weight = np.where(sd > 0, 1 / np.maximum(sd, 1e-12) ** 2, 0.0)
        self.mean = np.concatenate(
            [np.zeros(self.photos * N_POSE), priors.shared, np.zeros(self.shared - FIRST_FLIGHT)]
        )
        self.tagged = used & np.isfinite(priors.centres).all(axis=1) & np.isfinite(priors.centre_sd).all(axis=1)
        # What the geotags of a flight share: errors of a PPK hardly change within it, half of what is stated counts as
        # common; and an instant beside the exposures, which moves each along its velocity.
        self.flight_sd = np.ones((len(sensor.drift), 4))
        self.flight_sd[:, 3] = priors.late_sd
        for flight in range(len(sensor.drift)):
            own = self.tagged & (sensor.flight == flight)
            if own.any():
                self.flight_sd[flight, :3] = np.median(priors.centre_sd[own], axis=0)
        # (N, 3, 4) how a geotag follows what its flight shares.
        self.follows = np.concatenate(
            [np.broadcast_to(np.eye(3), (self.photos, 3, 3)), sensor.velocity_m_s[:, :, None]], axis=2
        )
        self.aimed = np.flatnonzero(used & np.isfinite(priors.rotations).all(axis=(1, 2)))
        self.point_weight = np.where(np.isfinite(priors.point_sd), 1 / priors.point_sd**2, 0.0)
        self.point_xyz = np.where(np.isfinite(priors.point_sd), priors.point_xyz, 0.0)

    def linearise(self, x: State) -> None:
        """Residuals and derivatives at ``x`` into ``linear``."""
        seen, sensor = self.seen, self.sensor
        kernels.linearise(
            kernels.Model(x.shared, x.drift, x.rotations, x.centres, x.travel, x.points, sensor.velocity_m_s),
            kernels.Seen(seen.photo, seen.point, seen.pixels, seen.share, sensor.flight),
            *self.linear,
        )

    def weigh(self, x: State, sigma_px: float, tag_loss: float) -> Weights:
        """Robust weights at the linearised state."""
        variance = sigma_px**2 + self.seen.extra_px**2
        square = np.einsum("mk,mk->m", self.linear.residual, self.linear.residual) / variance
        lost = ~np.isfinite(square)
        square[lost] = 1e6
        loss, weight, bend = (_cauchy if self.final else _soft_l1)(square, PIXEL_LOSS)
        cost = float(loss.sum())
        pixels = np.where(lost, 0.0, weight / variance)
        self.linear.residual[lost] = 0
        tags = self.tagged.astype(float)
        for _ in range(2):
            shared = self.flight_error(x, tags)
            off = self.off_tags(x, shared) / self.priors.centre_sd
            square = np.where(self.tagged, np.einsum("nk,nk->n", off, off), 0.0)
            loss, weight, _ = _soft_l1(square, tag_loss)
            tags = np.where(self.tagged, weight, 0.0)
        cost += float(loss.sum()) + float(np.sum((shared / np.maximum(self.flight_sd, 1e-12)) ** 2))
        away, aim, _, mounting = self._aim(x)
        cost += float(np.einsum("ni,nij,nj->", away, aim, away) + np.sum((mounting / self.priors.mounting_sd) ** 2))
        cost += float(np.sum(self.weight * (self._numbers(x) - self.mean) ** 2))
        cost += float(np.sum(self.point_weight * (x.points - self.point_xyz) ** 2))
        return Weights(cost, pixels, tags, np.maximum(bend, MIN_BEND))

    def normal(self, x: State, weights: Weights, damping: float) -> tuple[np.ndarray, np.ndarray, PointNormals]:
        """Reduced normal equations (upper triangle), right side, and the points' own."""
        linear, points = self.linear, self._eliminated(x, weights, damping)
        size = self.photos * N_POSE + self.shared
        matrix, right = np.zeros((size, size)), np.zeros(size)
        by_image, by_point = kernels.Rows(*self.by_image), kernels.Rows(*self.by_point)
        kernels.couple(linear, weights.pixels, by_point, self.coupled)
        order = self.by_point[1]
        seen = self.seen.point, self.seen.share, self.seen.photo[order], self.seen.share[order]
        kernels.reduce_photos(
            linear,
            weights.pixels,
            seen,
            by_image,
            by_point,
            self.places,
            self.coupled,
            points,
            self.travels,
            matrix,
            right,
        )
        kernels.reduce_shared(linear, weights.pixels, points, matrix, right)
        self._add_tags(x, weights.tags, matrix, right)
        self._add_aim(x, matrix, right)
        diagonal = np.arange(size)
        matrix[diagonal, diagonal] += self.weight
        right -= self.weight * (self._numbers(x) - self.mean)
        return matrix, right, points

    def _aim(self, x: State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rotation vectors (K, 3) from the photos to what is known of their directions, camera frame, less what all
        share (the camera's mounting); their inverse covariances (K, 3, 3), 1/rad2; the covariance (3, 3) of the
        mounting, and itself (3,)."""
        rotations = x.rotations[self.aimed]
        held = np.eye(3) / self.priors.mounting_sd**2
        if not len(self.aimed):
            return np.zeros((0, 3)), np.zeros((0, 3, 3)), np.linalg.inv(held), np.zeros(3)
        away = Rotation.from_matrix(self.priors.rotations[self.aimed] @ rotations.transpose(0, 2, 1)).as_rotvec()
        weight = 1 / self.priors.rotation_sd[[0, 0, 1]] ** 2
        aim = np.einsum("nij,j,nkj->nik", rotations, weight, rotations)
        covariance = np.linalg.inv(aim.sum(axis=0) + held)
        mounting = covariance @ np.einsum("nij,nj->i", aim, away)
        return away - mounting, aim, covariance, mounting

    def _add_aim(self, x: State, matrix: np.ndarray, right: np.ndarray) -> None:
        """The photos' known directions in the normal equations, the mounting that they share marginalised."""
        away, aim, covariance, _ = self._aim(x)
        if not len(self.aimed):
            return
        at = (self.aimed[:, None] * N_POSE + np.arange(3)).ravel()
        stacked = aim.reshape(-1, 3)
        matrix[np.ix_(at, at)] -= stacked @ covariance @ stacked.T
        for photo, each, off in zip(self.aimed, aim, away, strict=True):
            own = slice(photo * N_POSE, photo * N_POSE + 3)
            matrix[own, own] += each
            right[own] += each @ off

    def off_tags(self, x: State, shared: np.ndarray) -> np.ndarray:
        """(N, 3) m from the geotags, less what their flights share (F, 4), to the centres."""
        return x.centres - self.priors.centres - np.einsum("nij,nj->ni", self.follows, shared[self.sensor.flight])

    def flight_error(self, x: State, tags: np.ndarray) -> np.ndarray:
        """(F, 4): by what the geotags of a flight are most likely off together, three metres and the seconds."""
        found = np.zeros_like(self.flight_sd)
        for flight, (own, _weight, pulled, covariance) in enumerate(self._by_flight(tags)):
            found[flight] = covariance @ (pulled.T @ (x.centres - self.priors.centres)[own].ravel())
        return found

    def flight_error_sd(self, tags: np.ndarray, centres: np.ndarray) -> np.ndarray:
        """(F, 4) standard errors of :meth:`flight_error`, where the centres have a covariance (3 N, 3 N)."""
        found = np.zeros_like(self.flight_sd)
        for flight, (own, _, pulled, covariance) in enumerate(self._by_flight(tags)):
            at = (own[:, None] * 3 + np.arange(3)).ravel()
            moved = covariance @ pulled.T
            found[flight] = np.sqrt(np.diag(covariance + moved @ centres[np.ix_(at, at)] @ moved.T))
        return found

    def _by_flight(self, tags: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """By flight: its K tagged photos, the weights of their geotags (3 K,), those times how they follow what the
        flight shares (3 K, 4), and the covariance (4, 4) of that where the centres are known."""
        for flight in range(len(self.flight_sd)):
            own = np.flatnonzero(self.tagged & (self.sensor.flight == flight))
            weight = (tags[own, None] / self.priors.centre_sd[own] ** 2).ravel()
            design = self.follows[own].reshape(-1, 4)
            pulled = weight[:, None] * design
            # A number that is held has no variance: divided by its square it would be infinite.
            sd = self.flight_sd[flight]
            inner = np.eye(4) + sd[:, None] * (design.T @ pulled) * sd
            yield own, weight, pulled, sd[:, None] * np.linalg.inv(inner) * sd

    def _add_tags(self, x: State, tags: np.ndarray, matrix: np.ndarray, right: np.ndarray) -> None:
        """The geotags in the normal equations, the errors that a flight's geotags share marginalised."""
        off = self.off_tags(x, self.flight_error(x, tags))
        for own, weight, precision in self.tag_precisions(tags):
            at = (own[:, None] * N_POSE + 3 + np.arange(3)).ravel()
            # Rows of a flight stand in their order: the upper triangle is filled with the lower.
            matrix[np.ix_(at, at)] += precision
            right[at] -= weight * off[own].ravel()

    def tag_precisions(self, tags: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """By flight: its K tagged photos, the weights (3 K,) of their geotags and inverse covariance (3 K, 3 K), 1/m2.

        tags: (N,) share of each geotag that is believed.
        """
        for own, weight, pulled, covariance in self._by_flight(tags):
            yield own, weight, np.diag(weight) - pulled @ covariance @ pulled.T

    def solve(self, x: State, sigma_px: float, tag_loss: float, iterations: int, tolerance: float) -> State:
        """Levenberg-Marquardt from ``x``; ends when a step moves the cameras by less than ``tolerance``."""
        with threadpool_limits(1 if len(self.free) <= _FEW_UNKNOWNS else None, "blas"):
            return self._solve(x, sigma_px, tag_loss, iterations, tolerance)

    def _solve(self, x: State, sigma_px: float, tag_loss: float, iterations: int, tolerance: float) -> State:
        # Principal point, p1 and p2 form a long flat valley: strong damping would end on its side.
        damping = 1e-6
        weights = self._around(x, sigma_px, tag_loss)
        for _ in range(iterations):
            matrix, right, points = self.normal(x, weights, damping)
            step = np.zeros(len(right))
            try:
                step[self.free] = _damped(matrix[np.ix_(self.free, self.free)], right[self.free], damping)
            except LinAlgError:
                # What neither photos nor geotags hold (photos with few matches, no geotags): damping does.
                damping = max(10 * damping, 1e-4)
                if damping > _MAX_DAMPING:
                    break
                continue
            trial = self._moved(x, weights, points, step)
            found = self._around(trial, sigma_px, tag_loss)
            if found.cost < weights.cost:
                x, weights = trial, found
                if step @ right < tolerance and damping < _HARDLY_DAMPED:
                    break
                damping = max(damping / 10, 1e-10)
            else:
                if step @ right < _NOTHING:
                    break
                damping *= 10
                if damping > _MAX_DAMPING:
                    break
                weights = self._around(x, sigma_px, tag_loss)
        return x

    def place_points(self, x: State, sigma_px: float, rounds: int) -> State:
        """``x`` with its points alone moved to where their observations want them."""
        for _ in range(rounds):
            weights = self._around(x, sigma_px, np.inf)
            points = self._eliminated(x, weights, _HARDLY_DAMPED)
            x = self._moved(x, weights, points, np.zeros(self.photos * N_POSE + self.shared))
        return x

    def _eliminated(self, x: State, weights: Weights, damping: float) -> PointNormals:
        """The points' own normal equations."""
        points = PointNormals(
            np.zeros((self.points, 3, 3)), np.zeros((self.points, 3)), np.zeros((self.points, 3, self.shared))
        )
        prior = self.point_weight, x.points - self.point_xyz
        kernels.eliminate(self.linear, weights.pixels, kernels.Rows(*self.by_point), prior, damping, *points)
        return points

    def _around(self, x: State, sigma_px: float, tag_loss: float) -> Weights:
        """Robust weights at ``x``, and ``linear`` with the losses' own curvature there."""
        self.linearise(x)
        weights = self.weigh(x, sigma_px, tag_loss)
        kernels.bend(*self.linear, weights.bend)
        return weights

    def _numbers(self, x: State) -> np.ndarray:
        """The unknowns that have a prior mean, in the order of the normal equations."""
        pose = np.zeros((self.photos, N_POSE))
        pose[:, _TRAVEL] = x.travel
        return np.concatenate([pose.ravel(), x.shared, x.drift[1:]])

    def _moved(self, x: State, weights: Weights, points: PointNormals, step: np.ndarray) -> State:
        move = np.zeros((self.points, 3))
        kernels.move_points(
            self.linear, weights.pixels, self.seen.photo, kernels.Rows(*self.by_point), points, step, move
        )
        pose = step[: self.photos * N_POSE].reshape(self.photos, N_POSE)
        shared = step[self.photos * N_POSE :]
        return State(
            x.shared + shared[:FIRST_FLIGHT],
            x.drift + np.concatenate([[0.0], shared[FIRST_FLIGHT:]]),
            Rotation.from_rotvec(pose[:, :3]).as_matrix() @ x.rotations,
            x.centres + pose[:, _CENTRE],
            x.travel + pose[:, _TRAVEL],
            x.points + move,
        )
