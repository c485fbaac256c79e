"""Adjusting a block: what holds it, which of its numbers are freed, and how sharp its photos are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..core.errors import ReconstructionError
from ..geotags.control import ControlPoints
from ..geotags.stations import are_precise
from .bundle import ROUGH, Observations, Priors, Problem, State, camera_of, shared_of
from .bundle_kernels import CX, CY, K1, K2, K3, LOG_ASPECT, LOG_F, P1, P2, READOUT
from .cameras import Camera
from .tracks import Block, intersect, widest_angle_deg

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
#: Standard error of a mark of a control point, pixels.
MARK_PX = 0.7
#: A photo with fewer observations than this stays where it is.
MIN_OBSERVATIONS = 6
#: Photos are never sharper than this, pixels.
MIN_SIGMA_PX = 0.05
#: A gimbal knows the vertical to this, degrees (half a degree stated), north as well as its compass; and all its photos
#: share how the camera is mounted.
GIMBAL_SD_DEG, COMPASS_SD_DEG, MOUNTING_SD_DEG = 1.0, 10.0, 2.0
#: Seconds between photos that have no time.
PHOTO_GAP_S = 3.0
#: Parts of a photo, columns and rows, and of how many points in each an adjustment on the way needs the observations:
#: those that the most photos see. Where so large a share of the points remains, it takes all.
PHOTO_PARTS, TRACKS_A_PART, _FEW_LEFT_OUT = (8, 6), 5, 0.7
#: A photo that would keep fewer observations than this keeps all of its own.
_FEW_OBSERVATIONS = 40
#: A geotag farther off than this many standard deviations pulls no harder.
TAG_LOSS = 3.0


@dataclass(frozen=True)
class Known:
    """What holds a block, apart from its photos.

    xyz: (N, 3) geotags in the local frame, metres, NaN unknown. sd: (N, 3) m. camera: intrinsics from the metadata.
    lens_sd: (9,) standard deviations of the shared parameters (:mod:`.bundle_kernels`) before the readout time:
    relative for focal length and fy / fx, pixels for the principal point, dimensionless for the distortion.
    readout_sd_s: of ``sensor.readout_s`` before the adjustment, ``readout_s``. drift_sd: of the focal length's change
    between flights, relative. travel_sd_m: of the readout travel that speed and readout time do not explain. control:
    control and check points, in the local frame. gimbal: (N, 3, 3) world -> camera by the gimbal's angles, NaN unknown.
    taken_s: (N,) when each photo was taken, seconds from any instant, NaN unknown; empty where no time is known.
    late_s: (F,) seconds by which the geotags of each flight were moved along its velocities. late_sd_s: (F,) seconds by
    which they may still be those of another instant than the exposures. contradicted: (N,) bool, geotags whose ``sd``
    was raised as the photos contradict them. One of each for all where nobody looks.
    """

    xyz: np.ndarray
    sd: np.ndarray
    camera: Camera
    lens_sd: np.ndarray
    readout_s: float = 0.0
    readout_sd_s: float = 0.0
    drift_sd: float = 5e-4
    travel_sd_m: float = 0.0
    control: ControlPoints | None = None
    gimbal: np.ndarray | None = None
    taken_s: np.ndarray = field(default_factory=lambda: np.zeros(0))
    late_s: np.ndarray = field(default_factory=lambda: np.zeros(1))
    late_sd_s: np.ndarray = field(default_factory=lambda: np.zeros(1))
    contradicted: np.ndarray = field(default_factory=lambda: np.zeros(1, bool))


@dataclass(frozen=True)
class Adjusted:
    """An adjustment's end. sigma_px: standard error of a pixel coordinate, robust, redundancy taken into account."""

    problem: Problem
    state: State
    sigma_px: float

    @property
    def off_geotags_m(self) -> np.ndarray:
        """(N, 3) m from the geotags, less what those of a flight share, to the cameras; NaN without either."""
        off = self.problem.off_tags(self.state, self.flight_error)
        return np.where(self.problem.tagged[:, None], off, np.nan)

    @property
    def flight_error(self) -> np.ndarray:
        """(F, 4) what the geotags of each flight are off together: metres, and seconds too late."""
        self.problem.linearise(self.state)
        weights = self.problem.weigh(self.state, self.sigma_px, TAG_LOSS)
        return self.problem.flight_error(self.state, weights.tags)


def adjust(
    block: Block,
    known: Known,
    free: frozenset[str],
    *,
    iterations: int = 12,
    tag_loss: float = TAG_LOSS,
    least_sigma_px: float = MIN_SIGMA_PX,
    final: bool = False,
    tolerance: float = ROUGH,
) -> Adjusted:
    """Adjust the block in place: poses, points and the freed parts (:data:`PARTS`) of lens and shutter.

    The photos' standard error follows from their own residuals, so geotags weigh as much as they are worth.

    Args:
        free: names of :data:`PARTS`. tag_loss: standard deviations from which a geotag pulls no harder. final: the
        matches are clean; what is left of large residuals hardly counts. tolerance: how far the last step may still
        move the cameras (:data:`.bundle.ROUGH` …).

    Raises:
        ReconstructionError: no point is left that two photos see alike.
    """
    if not len(block.points):
        raise ReconstructionError(
            f"No point is left that two of the {int(block.is_posed.sum())} placed photos see alike; they overlap too "
            "little, show too little texture or have wrong geotags: use preset balanced, or fly with 80 % overlap."
        )
    problem, state = _problem(block, known, free, final)
    sigma = max(typical_px(block) / _MEDIAN_OF_RAYLEIGH, least_sigma_px)
    # The first time for the photos' standard error, which the last residuals decide.
    for rounds, reached in ((iterations // 3, max(tolerance, ROUGH)), (iterations, tolerance)):
        state = problem.solve(state, sigma, tag_loss, rounds, reached)
        sigma = max(_sigma_px(problem, state), least_sigma_px)
    _apply(block, state)
    return Adjusted(problem, state, sigma)


def adjust_roughly(
    block: Block, known: Known, free: frozenset[str], *, iterations: int = 12, tag_loss: float = TAG_LOSS
) -> None:
    """:func:`adjust` on the way, by as many points as poses need (:data:`TRACKS_A_PART`); the others follow.

    Raises:
        ReconstructionError: as :func:`adjust`.
    """
    chosen = block.long_tracks(*PHOTO_PARTS, TRACKS_A_PART)
    count = np.bincount(block.image[chosen[block.point]], minlength=len(block.keypoints))
    chosen[block.point[count[block.image] < _FEW_OBSERVATIONS]] = True
    if chosen.sum() > _FEW_LEFT_OUT * len(chosen):
        adjust(block, known, free, iterations=iterations, tag_loss=tag_loss)
        return
    some = block.part(chosen)
    adjusted = adjust(some, known, free, iterations=iterations, tag_loss=tag_loss)
    block.sensor, block.rotations, block.translations = some.sensor, some.rotations, some.translations
    others = block.part(~chosen)
    intersect(others)
    block.points[chosen], block.points[~chosen] = some.points, others.points
    # A wrong observation must not pull its point off the right ones.
    problem, state = _problem(block, known, frozenset(), False)
    block.points = problem.place_points(state, adjusted.sigma_px, 2).points[: len(block.points)]


#: Median length of a two-dimensional normal error of unit standard deviation.
_MEDIAN_OF_RAYLEIGH = float(np.sqrt(2 * np.log(2)))


def typical_px(block: Block) -> float:
    """Median reprojection error, pixels; 0.3 when there is nothing to measure."""
    error = np.linalg.norm(block.residuals(), axis=1)
    error = error[np.isfinite(error)]
    return float(np.median(error)) if len(error) else 0.3


def _problem(block: Block, known: Known, free: frozenset[str], final: bool) -> tuple[Problem, State]:
    sensor, posed = block.sensor, block.is_posed
    centres = np.where(posed[:, None], block.centres, 0.0)
    marks, places, place_sd = _control_rows(known.control, posed)
    pixels = np.concatenate([block.observed(), marks.pixels])
    seen = Observations(
        np.concatenate([block.image, marks.photo]),
        np.concatenate([block.point, len(block.points) + marks.point]),
        pixels,
        sensor.share(pixels[:, 1]),
        np.concatenate([np.zeros(len(block.image)), np.full(len(marks.photo), MARK_PX)]),
    )
    points = np.concatenate([block.points, places])
    count = np.bincount(block.image, minlength=len(posed))
    priors = Priors(
        shared=shared_of(known.camera, known.readout_s),
        shared_sd=_shared_sd(known, free),
        drift_sd=known.drift_sd if "drift" in free else 0.0,
        centres=known.xyz,
        centre_sd=known.sd,
        late_sd=known.late_sd_s,
        taken_s=_times_s(known),
        travel_sd=np.full(len(posed), known.travel_sd_m if "travel" in free else 0.0),
        rotations=_aimed(known),
        rotation_sd=np.radians([GIMBAL_SD_DEG, COMPASS_SD_DEG]),
        mounting_sd=float(np.radians(MOUNTING_SD_DEG)),
        held=~posed | (count < MIN_OBSERVATIONS),
        point_xyz=points,
        point_sd=np.concatenate([np.full((len(block.points), 3), np.inf), place_sd]),
    )
    rotations = np.where(posed[:, None, None], block.rotations, np.eye(3))
    shared = shared_of(block.camera, sensor.readout_s)
    state = State(shared, sensor.drift, rotations, centres, sensor.extra_travel_m, points)
    return Problem(seen, priors, sensor, len(points), final=final), state


class _Marks(NamedTuple):
    photo: np.ndarray
    point: np.ndarray
    pixels: np.ndarray


def _control_rows(control: ControlPoints | None, posed: np.ndarray) -> tuple[_Marks, np.ndarray, np.ndarray]:
    """Marks of control points in posed photos, and the points' places and standard errors, (K, 3)."""
    if control is None:
        return _Marks(np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2))), np.zeros((0, 3)), np.zeros((0, 3))
    use = posed[control.photo] & ~control.is_check[control.point]
    kept, point = np.unique(control.point[use], return_inverse=True)
    return _Marks(control.photo[use], point, control.pixels[use]), control.xyz[kept], control.sd_m[kept]


def _aimed(known: Known) -> np.ndarray:
    """(N, 3, 3) directions of the photos that count: those of the gimbals, where geotags do not level the block."""
    none = np.full((len(known.xyz), 3, 3), np.nan)
    return none if known.gimbal is None or geotags_are_precise(known) else known.gimbal


def geotags_are_precise(known: Known) -> bool:
    """Whether the geotags can level a block, or start one."""
    return are_precise(known.xyz, known.sd)


def _times_s(known: Known) -> np.ndarray:
    """(N,) ``Known.taken_s``, one after the other where a photo has no time."""
    order = PHOTO_GAP_S * np.arange(len(known.xyz))
    if not np.isfinite(known.taken_s).any():
        return order
    return np.where(np.isfinite(known.taken_s), known.taken_s, np.nanmin(known.taken_s) + order)


def _shared_sd(known: Known, free: frozenset[str]) -> np.ndarray:
    """(10,) standard deviations of the shared parameters, 0 where they are not free."""
    chosen = [place for part in free for place in PARTS[part]]
    sd = np.zeros(READOUT + 1)
    sd[chosen] = np.append(known.lens_sd, known.readout_sd_s)[chosen]
    return sd


def _sigma_px(problem: Problem, state: State) -> float:
    """Robust standard error of a pixel coordinate: the median residual over the share of it that the fit left."""
    problem.linearise(state)
    error = np.linalg.norm(problem.linear.residual[problem.seen.extra_px == 0], axis=1)
    error = error[np.isfinite(error)]
    adjusted = int((~problem.priors.held).sum())
    left = 1 - (3 * problem.points + 6 * adjusted) / max(2 * len(error), 1)
    return float(np.median(error)) / _MEDIAN_OF_RAYLEIGH / float(np.sqrt(max(left, 0.2)))


def _apply(block: Block, state: State) -> None:
    posed = block.is_posed
    block.sensor = replace(
        block.sensor,
        camera=camera_of(state.shared, block.camera),
        drift=state.drift,
        readout_s=float(state.shared[READOUT]),
        extra_travel_m=state.travel,
    )
    block.rotations[posed] = state.rotations[posed]
    block.translations[posed] = -np.einsum("nij,nj->ni", state.rotations, state.centres)[posed]
    block.points = state.points[: len(block.points)]


def prune(block: Block, limit_px: float, min_angle_deg: float = 1.5) -> None:
    """Drop observations beyond ``limit_px`` and points whose rays meet under too small an angle."""
    error = np.linalg.norm(block.residuals(), axis=1)
    block.keep(np.isfinite(error) & (error <= limit_px))
    if len(block.point):
        block.keep(widest_angle_deg(block)[block.point] >= min_angle_deg)
