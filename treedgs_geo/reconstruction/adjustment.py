"""Adjusting a block: what holds it, which of its numbers are freed, and how sharp its photos are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..core.errors import ReconstructionError
from ..geotags.control import ControlPoints, ScaleBars
from ..geotags.stations import are_precise
from .bundle import ROUGH, Problem, State, camera_of
from .bundle_kernels import READOUT
from .cameras import Camera
from .tracks import MIN_ANGLE_DEG, Block, intersect, widest_angle_deg

#: Photos are never sharper than this, pixels.
MIN_SIGMA_PX = 0.05
#: Parts of a photo, columns and rows, and of how many points in each an adjustment on the way needs the observations:
#: those that the most photos see. Where so large a share of the points remains, it takes all.
PHOTO_PARTS, TRACKS_A_PART, _FEW_LEFT_OUT = (8, 6), 5, 0.7
#: A photo that would keep fewer observations than this keeps all of its own.
_FEW_OBSERVATIONS = 40
#: Layers of height that have a noise of their own, at most; observations of each, at least; and the least, over the
#: median one.
_HEIGHTS, _OF_A_HEIGHT, _MIN_NOISE = 8, 200, 0.1
#: A residual smaller than this is no reason to drop an observation, pixels.
MIN_LIMIT_PX = 0.4
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
    control and check points, in the local frame. bars: known lengths. gimbal: (N, 3, 3) world -> camera by the gimbal's
    angles, NaN unknown. taken_s: (N,) when each photo was taken, seconds from any instant, NaN unknown; empty where no
    time is known. late_s: (F,) seconds by which the geotags of each flight were moved along its velocities. late_sd_s:
    (F,) seconds by which they may still be those of another instant than the exposures. contradicted: (N,) bool,
    geotags whose ``sd`` was raised as the photos contradict them. One of each for all where nobody looks.
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
    bars: ScaleBars | None = None
    gimbal: np.ndarray | None = None
    taken_s: np.ndarray = field(default_factory=lambda: np.zeros(0))
    late_s: np.ndarray = field(default_factory=lambda: np.zeros(1))
    late_sd_s: np.ndarray = field(default_factory=lambda: np.zeros(1))
    contradicted: np.ndarray = field(default_factory=lambda: np.zeros(1, bool))

    @property
    def is_precise(self) -> bool:
        """Whether the geotags can level a block, or start one."""
        return are_precise(self.xyz, self.sd)

    @property
    def is_by_control(self) -> bool:
        """Whether control points alone hold the block: no photo has a geotag."""
        return self.control is not None and not np.isfinite(self.xyz).all(axis=1).any()


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
    """Adjust the block in place: poses, points and the freed parts (:data:`.bundle.PARTS`) of lens and shutter.

    The photos' standard error follows from their own residuals, so geotags weigh as much as they are worth.

    Args:
        free: names of :data:`.bundle.PARTS`. tag_loss: standard deviations from which a geotag pulls no harder. final:
        the matches are clean; what is left of large residuals hardly counts. tolerance: how far the last step may
        still move the cameras (:data:`.bundle.ROUGH` …).

    Raises:
        ReconstructionError: no point is left that two photos see alike.
    """
    nothing_left = ReconstructionError(
        f"No point is left that two of the {int(block.is_posed.sum())} placed photos see alike; they overlap too "
        "little, show too little texture or have wrong geotags: use preset balanced, or fly with 80 % overlap."
    )
    if not len(block.points):
        raise nothing_left
    problem = Problem(block, known, free, final=final)
    state = problem.start
    sigma = max(typical_px(block) / _MEDIAN_OF_RAYLEIGH, least_sigma_px)
    # The first time for the photos' standard error, which the last residuals decide.
    for rounds, reached in ((iterations // 3, max(tolerance, ROUGH)), (iterations, tolerance)):
        problem.linearise(state)
        own = slice(len(block.point))
        problem.noise[own] = relative_noise(
            np.linalg.norm(problem.linear.residual[own], axis=1), block.point, state.points[block.point, 2]
        )
        state = problem.solve(state, sigma, tag_loss, rounds, reached)
        sigma = max(_sigma_px(problem, state), least_sigma_px)
    if not np.isfinite(sigma):
        raise nothing_left
    _apply(block, state)
    return Adjusted(problem, state, sigma)


def adjust_roughly(block: Block, known: Known, free: frozenset[str], *, tag_loss: float = TAG_LOSS) -> None:
    """:func:`adjust` on the way, by as many points as poses need (:data:`TRACKS_A_PART`); the others follow.

    Raises:
        ReconstructionError: as :func:`adjust`.
    """
    chosen = block.long_tracks(*PHOTO_PARTS, TRACKS_A_PART)
    count = np.bincount(block.image[chosen[block.point]], minlength=len(block.keypoints))
    chosen[block.point[count[block.image] < _FEW_OBSERVATIONS]] = True
    if chosen.sum() > _FEW_LEFT_OUT * len(chosen):
        adjust(block, known, free, tag_loss=tag_loss)
        return
    some = block.part(chosen)
    adjusted = adjust(some, known, free, tag_loss=tag_loss)
    block.sensor, block.rotations, block.translations = some.sensor, some.rotations, some.translations
    others = block.part(~chosen)
    intersect(others)
    block.points[chosen], block.points[~chosen] = some.points, others.points
    # A wrong observation must not pull its point off the right ones.
    problem = Problem(block, known, frozenset())
    block.points = problem.place_points(problem.start, adjusted.sigma_px).points[: len(block.points)]


#: Median length of a two-dimensional normal error of unit standard deviation.
_MEDIAN_OF_RAYLEIGH = float(np.sqrt(2 * np.log(2)))


def typical_px(block: Block) -> float:
    """Median reprojection error, pixels; 0.3 when there is nothing to measure."""
    error = np.linalg.norm(block.residuals(), axis=1)
    error = error[np.isfinite(error)]
    return float(np.median(error)) if len(error) else 0.3


def relative_noise(error_px: np.ndarray, point: np.ndarray, height_m: np.ndarray) -> np.ndarray:
    """(M,) standard error of observations of about the same height, over that of all: crowns sway in wind, the ground
    and the stems' feet do not.

    error_px, height_m: (M,) length of the residual, and height of the point that is observed. point: (M,) its number.
    """
    noise, known = np.ones(len(point)), np.isfinite(error_px) & np.isfinite(height_m)
    if known.sum() < 2 * _OF_A_HEIGHT:
        return noise
    views = np.bincount(point)[point]
    # What the point itself took up: of 2 v coordinates three.
    error_px = error_px / np.sqrt(np.maximum(2 * views - 3, 1) / (2 * views))
    edges = np.quantile(height_m[known], np.linspace(0, 1, min(_HEIGHTS, known.sum() // _OF_A_HEIGHT) + 1))
    layer = np.clip(np.searchsorted(edges, height_m, side="right") - 1, 0, len(edges) - 2)
    usual = np.median(error_px[known])
    for k in range(len(edges) - 1):
        inside = layer == k
        if usual > 0 and (inside & known).any():
            noise[inside] = max(float(np.median(error_px[inside & known]) / usual), _MIN_NOISE)
    return noise


def _sigma_px(problem: Problem, state: State) -> float:
    """Robust standard error of a pixel coordinate: the median residual over the share of it that the fit left."""
    problem.linearise(state)
    error = np.linalg.norm(problem.linear.residual[problem.extra_px == 0], axis=1)
    error = error[np.isfinite(error)]
    adjusted = int((~problem.held).sum())
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


def prune(block: Block, limit_px: float) -> None:
    """Drop observations beyond ``limit_px`` (where their height has the usual noise), and points whose rays meet under
    too small an angle."""
    error = np.linalg.norm(block.residuals(), axis=1)
    noise = relative_noise(error, block.point, block.points[block.point, 2])
    block.keep(np.isfinite(error) & (error <= np.maximum(limit_px * noise, min(limit_px, MIN_LIMIT_PX))))
    if len(block.point):
        block.keep(widest_angle_deg(block, block.rays())[block.point] >= MIN_ANGLE_DEG)
