"""Bundle adjustment: photos, points, lens and shutter fitted to the pixels, with everything known as a normal prior.

Own solver, because COLMAP's and Ceres' Python wheels have neither a rolling shutter nor priors on a lens, nor the full
posterior of both. Levenberg-Marquardt on the reduced normal equations (points eliminated; Triggs et al. 2000, Bundle
Adjustment - A Modern Synthesis), with a dense Cholesky factor: a thousand photos are 9,000 unknowns. Losses are soft
L1, the pixels' Cauchy at the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from ..geotags.control import ControlPoints
from . import bundle_kernels as kernels
from .bundle_kernels import CX, CY, FIRST_FLIGHT, K1, K2, K3, LOG_ASPECT, LOG_F, N_POSE, P1, P2, READOUT
from .cameras import Camera
from .control import MARK_PX, marks_meet
from .tracks import Block

if TYPE_CHECKING:
    from .adjustment import Known

#: Parts of lens and shutter that can be freed, with their shared parameters (:mod:`.bundle_kernels`).
PARTS = {
    "focal": (LOG_F,),
    "aspect": (LOG_ASPECT,),
    "principal_point": (CX, CY),
    "radial": (K1, K2),
    "tangential": (P1, P2),
    "k3": (K3,),
    "readout": (READOUT,),
    "drift": (),
    "travel": (),
}
#: A photo with fewer observations than this stays where it is.
MIN_OBSERVATIONS = 6
#: A gimbal knows the vertical to this, degrees (half a degree stated), north as well as its compass; and all its photos
#: share how the camera is mounted.
GIMBAL_SD_DEG, COMPASS_SD_DEG, MOUNTING_SD_DEG = 1.0, 10.0, 2.0
_AIM_SD, _MOUNTING_SD = np.radians([GIMBAL_SD_DEG, GIMBAL_SD_DEG, COMPASS_SD_DEG]), float(np.radians(MOUNTING_SD_DEG))
#: Seconds between photos that have no time.
PHOTO_GAP_S = 3.0

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
    """One adjustment: what the photos of a block show, what is known besides, and the numbers that stay as they are.

    free: parts of lens and shutter that may change (:data:`PARTS`). final: the matches are clean. ``start``: the block
    as it is.
    """

    def __init__(self, block: Block, known: Known, free: frozenset[str], *, final: bool = False) -> None:
        self.final, self.known, self.sensor = final, known, block.sensor
        posed = block.is_posed
        #: (N,) bool: photos whose pose stays.
        self.held = ~posed | (np.bincount(block.image, minlength=len(posed)) < MIN_OBSERVATIONS)
        self._observe(block, known.control)
        sensor, self.photos, self.points = block.sensor, len(posed), len(self.start.points)
        self.shared = FIRST_FLIGHT + len(sensor.drift) - 1
        self.by_image = _rows_of(self.seen.photo, self.photos, self.seen.point)
        self.by_point = _rows_of(self.seen.point, self.points, self.seen.photo)
        rows = len(self.seen.photo)
        self.places = np.empty(rows, np.int64)
        self.places[self.by_point[1]] = np.arange(rows)
        self.linear = Linear(
            np.zeros((rows, 2)), np.zeros((rows, 2, N_POSE)), np.zeros((rows, 2, self.shared)), np.zeros((rows, 2, 3))
        )
        travel_sd = known.travel_sd_m if "travel" in free else 0.0
        self.coupled = np.zeros((rows, 3, N_POSE if travel_sd > 0 else kernels.STILL))
        # Standard deviations of what has a prior mean: 0 holds a number, infinity leaves it to the photos.
        pose_sd = np.full((self.photos, N_POSE), np.inf)
        pose_sd[:, _TRAVEL] = travel_sd
        pose_sd[self.held] = 0
        chosen = [place for part in free for place in PARTS[part]]
        shared_sd = np.zeros(FIRST_FLIGHT)
        shared_sd[chosen] = np.append(known.lens_sd, known.readout_sd_s)[chosen]
        drift_sd = np.full(self.shared - FIRST_FLIGHT, known.drift_sd if "drift" in free else 0.0)
        sd = np.concatenate([pose_sd.ravel(), shared_sd, drift_sd])
        self.free = np.flatnonzero(sd > 0)
        self.weight = np.where(sd > 0, 1 / np.maximum(sd, 1e-12) ** 2, 0.0)
        lens = shared_of(known.camera, known.readout_s)
        self.mean = np.concatenate([np.zeros(self.photos * N_POSE), lens, np.zeros(len(drift_sd))])
        self.tagged = ~self.held & np.isfinite(known.xyz).all(axis=1) & np.isfinite(known.sd).all(axis=1)
        # What the geotags of a flight share: errors of a PPK hardly change within it, half of what is stated counts as
        # common; and an instant beside the exposures, which moves each along its velocity.
        self.flight_sd = np.ones((len(sensor.drift), 4))
        self.flight_sd[:, 3] = known.late_sd_s
        for flight in range(len(sensor.drift)):
            own = self.tagged & (sensor.flight == flight)
            if own.any():
                self.flight_sd[flight, :3] = np.median(known.sd[own], axis=0)
        # (N, 3, 4) how a geotag follows what its flight shares.
        self.follows = np.concatenate(
            [np.broadcast_to(np.eye(3), (self.photos, 3, 3)), sensor.velocity_m_s[:, :, None]], axis=2
        )
        # Gimbals count where geotags do not level the block.
        self.aimed = np.zeros(0, int)
        if known.gimbal is not None and not known.is_precise:
            self.aimed = np.flatnonzero(~self.held & np.isfinite(known.gimbal).all(axis=(1, 2)))

    def _observe(self, block: Block, control: ControlPoints | None) -> None:
        """Observations and marks of control points (``seen``), their own error beside that of all (``extra_px``, (M,)),
        that of all over the usual one (``noise``, (M,)); where the points are (``point_xyz``), with what weight
        (``point_weight``, 0 for what only photos show)."""
        sensor, posed, pixels = block.sensor, block.is_posed, block.observed()
        image, point, points, sd = block.image, block.point, block.points, np.full((len(block.points), 3), np.inf)
        self.extra_px = np.zeros(len(image))
        if control is not None:
            used = ~control.is_check & marks_meet(block, control)
            use = posed[control.photo] & used[control.point]
            kept, number = np.unique(control.point[use], return_inverse=True)
            image, pixels = np.concatenate([image, control.photo[use]]), np.concatenate([pixels, control.pixels[use]])
            point = np.concatenate([point, len(points) + number])
            points, sd = np.concatenate([points, control.xyz[kept]]), np.concatenate([sd, control.sd_m[kept]])
            self.extra_px = np.concatenate([self.extra_px, np.full(len(number), MARK_PX)])
        self.noise = np.ones(len(image))
        self.seen = kernels.Seen(image, point, pixels, sensor.share(pixels[:, 1]), sensor.flight)
        self.point_weight = 1 / sd**2
        self.point_xyz = np.where(np.isfinite(sd), points, 0.0)
        self.start = State(
            shared_of(block.camera, sensor.readout_s),
            sensor.drift,
            np.where(posed[:, None, None], block.rotations, np.eye(3)),
            np.where(posed[:, None], block.centres, 0.0),
            sensor.extra_travel_m,
            points,
        )

    @property
    def taken_s(self) -> np.ndarray:
        """(N,) ``Known.taken_s``, one after the other where a photo has no time."""
        order, taken_s = PHOTO_GAP_S * np.arange(self.photos), self.known.taken_s
        if not np.isfinite(taken_s).any():
            return order
        return np.where(np.isfinite(taken_s), taken_s, np.nanmin(taken_s) + order)

    def linearise(self, x: State) -> None:
        """Residuals and derivatives at ``x`` into ``linear``."""
        model = kernels.Model(x.shared, x.drift, x.rotations, x.centres, x.travel, x.points, self.sensor.velocity_m_s)
        kernels.linearise(model, self.seen, *self.linear)

    def weigh(self, x: State, sigma_px: float, tag_loss: float) -> Weights:
        """Robust weights at the linearised state."""
        variance = (sigma_px * self.noise) ** 2 + self.extra_px**2
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
            off = self.off_tags(x, shared) / self.known.sd
            square = np.where(self.tagged, np.einsum("nk,nk->n", off, off), 0.0)
            loss, weight, _ = _soft_l1(square, tag_loss)
            tags = np.where(self.tagged, weight, 0.0)
        cost += float(loss.sum()) + float(np.sum((shared / np.maximum(self.flight_sd, 1e-12)) ** 2))
        away, aim, _, mounting = self._aim(x)
        cost += float(np.einsum("ni,nij,nj->", away, aim, away) + np.sum((mounting / _MOUNTING_SD) ** 2))
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
        kernels.reduce_photos(
            linear,
            weights.pixels,
            self.seen.point,
            self.seen.photo[by_point.order],
            by_image,
            by_point,
            self.places,
            self.coupled,
            points,
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
        held = np.eye(3) / _MOUNTING_SD**2
        if self.known.gimbal is None or not len(self.aimed):
            return np.zeros((0, 3)), np.zeros((0, 3, 3)), np.linalg.inv(held), np.zeros(3)
        rotations, gimbal = x.rotations[self.aimed], self.known.gimbal[self.aimed]
        away = Rotation.from_matrix(gimbal @ rotations.transpose(0, 2, 1)).as_rotvec()
        weight = 1 / _AIM_SD**2
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
        return x.centres - self.known.xyz - np.einsum("nij,nj->ni", self.follows, shared[self.sensor.flight])

    def flight_error(self, x: State, tags: np.ndarray) -> np.ndarray:
        """(F, 4): by what the geotags of a flight are most likely off together, three metres and the seconds."""
        found = np.zeros_like(self.flight_sd)
        for flight, (own, _weight, pulled, covariance) in enumerate(self._by_flight(tags)):
            found[flight] = covariance @ (pulled.T @ (x.centres - self.known.xyz)[own].ravel())
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
            weight = (tags[own, None] / self.known.sd[own] ** 2).ravel()
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

    def place_points(self, x: State, sigma_px: float) -> State:
        """``x`` with its points alone moved to where their observations want them."""
        for _ in range(2):
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
