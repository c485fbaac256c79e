"""From first poses to one block: all photos of all flights, in the frame of the geotags, without those that contradict
what is known of them: their geotag or their gimbal's angles."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..core.errors import ReconstructionError
from ..core.progress import Reporter
from ..core.shown import shorten
from ..geotags.stations import Stations
from .adjustment import MIN_LIMIT_PX, Adjusted, Known, adjust, adjust_roughly, prune, typical_px
from .bundle import GOOD, LAST
from .cameras import Sensor
from .control import align_to_control, as_block_says, bar_lengths, move
from .covariance import posterior_of
from .georeference import GIMBAL_LIMIT_DEG, Placement, as_stored, level_as_held
from .geotag_errors import MIN_M, as_photos_say, in_time, settle_time, usual_speed_m_s
from .ground_alignment import GroundPicture, shown_ground, tie_to_ground
from .poses import Similarity, nearest_rotation, rotation_angle_deg
from .prior_knowledge import WHOLE_LENS, Survey, tell_focal
from .resection import GIMBAL_REACH_DEG, MIN_OBSERVATIONS, confirmed, extend, from_matches, resect, retriangulate
from .rolling_shutter import settle_lens, settle_shutter
from .sift import FeatureStore
from .tracks import Block, triangulate

#: Where the mapper places a smaller share of the photos, geotags and gimbal angles are tried.
MAPPED_SHARE = 0.35
#: Rounds in which geotags are moved in time, and come to count less: a wrong one pulls those beside it.
_ROUNDS = 3
#: Rounds in which photos are tied to the ground, at most: those that one places give the next a better picture of it.
_GROUND_ROUNDS = 4
#: Points that three photos see, from which on a photo needs no others.
_ENOUGH = 40


class Joined(NamedTuple):
    """A finished block, its last adjustment, what held it and was free in that, whether a rolling shutter was looked
    for, which photos are confirmed (N,) (:func:`.resection.confirmed`), how many were placed by their ground, and how
    many have no pose that should show it, because none of it was found in them.
    """

    block: Block
    adjusted: Adjusted
    known: Known
    free: frozenset[str]
    tested_shutter: bool
    confirmed: np.ndarray
    placed_by_ground: int
    left_out_by_ground: int


def join_photos(
    placement: Placement, store: FeatureStore, stations: Stations, survey: Survey, reporter: Reporter
) -> Joined:
    """Adjust the mapped photos, tie in the others through predicted geometry, look for every point in every photo,
    adjust.

    Raises:
        ReconstructionError: no three photos match each other.
    """
    known, sensor, free, names = survey.known, survey.sensor, survey.free, stations.names
    rng = np.random.default_rng(1)
    tested = bool(free & {"readout", "travel"})
    placement = _enough(placement, store, known, sensor, reporter)
    if known.gimbal is not None and np.isfinite(known.gimbal).any():
        mapped = placement.mapped[:, None, None]
        known = replace(known, gimbal=as_stored(np.where(mapped, placement.rotations, np.nan), known.gimbal))
    elif not (known.is_precise or known.is_by_control):
        held = level_as_held(placement)
        known, free = replace(known, gimbal=held), free | WHOLE_LENS if tell_focal(held) else free
    block = _first_block(placement, store, known, replace(sensor, camera=placement.camera), free, reporter)
    given, known = known, _in_time(block, known, free)
    reporter.progress(0.3)
    guess = placement.rotations.copy()
    loose = np.isfinite(placement.translations).all(axis=1) & ~placement.mapped
    loose |= set_loose(block, known, guess)
    _join_loose(block, store, loose, guess, known, free, rng)
    reporter.progress(0.6)
    for radius in (4.0, 1.5):
        # Noisier photos (wind, rolling shutter) need a wider search: six times the usual residual.
        reach = max(radius, 6 * typical_px(block))
        extend(block, store, reach)
        triangulate(block, reach)
        _refine(block, known, free, reach)
        reporter.progress(0.75 if radius > 2 else 0.85)
    on_ground, should, known = _onto_ground(block, store, stations, known, given, free, reach)
    # What the ground shows is believed before geotags whose time is not settled yet.
    loose = set_loose(block, known, guess, on_ground)
    loose |= set_unconfirmed(block, confirmed(block, store) | on_ground, known, guess)
    _join_loose(block, store, loose, guess, known, free, rng)
    # Two rays always meet somewhere along an epipolar line: a point needs three to prove itself, where that leaves
    # every photo tied.
    _keep_proven(block)
    known = _as_control_says(block, known, given)
    known, free = _settle(block, known, given, free)
    adjusted = _refine_strictly(block, known, free)
    for _ in range(_ROUNDS):
        former, known = known, _as_control_says(block, as_photos_say(known, adjusted), given)
        if known is former:
            break
        adjusted = adjust(block, known, free, final=True, iterations=30, tolerance=LAST)
    if known.late_sd_s.any():
        # Geotags that count less by now may have been all that showed another instant.
        again = settle_time(known, given, adjusted, posterior_of(adjusted))
        if not np.array_equal(again.late_s, known.late_s):
            known = replace(again, sd=np.maximum(again.sd, known.sd), contradicted=known.contradicted)
            adjusted = adjust(block, known, free, final=True, iterations=30, tolerance=LAST)
    if leave_out_apart(block, known, names, reporter) | leave_out(block, known, names, reporter):
        adjusted = adjust(block, known, free, final=True, tolerance=LAST)
    poses_px = posterior_of(adjusted).poses_px
    if known.control is not None and known.is_by_control:
        poses_px[known.control.photo] = np.nan  # without the photos that show them no point is left
    if leave_out_loose(block, poses_px, names, reporter):
        adjusted = adjust(block, known, free, final=True, tolerance=LAST)
    if known.control is not given.control and known.control is not None:
        sd_m = np.linalg.norm(known.control.sd_m, axis=1).max()
        reporter.warn(
            f"The control points are far less sure than they state, {sd_m:.2f} m by what the block shows, and count by "
            "that: look at their coordinates and marks, or state their standard deviations (CSV, sd_h_m and sd_v_m)."
        )
    adjusted, known = _scaled_to_bars(block, adjusted, known, free)
    sure = confirmed(block, store) | on_ground
    if leave_out_unconfirmed(block, sure, names, reporter):
        adjusted = adjust(block, known, free, final=True, tolerance=LAST)
    placed, left_out = int((on_ground & block.is_posed).sum()), int((should & ~block.is_posed).sum())
    return Joined(block, adjusted, known, free, tested, sure, placed, left_out)


def _onto_ground(
    block: Block,
    store: FeatureStore,
    stations: Stations,
    known: Known,
    given: Known,
    free: frozenset[str],
    reach_px: float,
) -> tuple[np.ndarray, np.ndarray, Known]:
    """Place the photos that hardly show a point of the ground by its picture (:mod:`.ground_alignment`), and take out
    those that should show it and that crowns alone hold, if that placed any. (N,) bool which it placed, and which
    should show it; what is known then."""
    on_ground, should = np.zeros((2, len(stations)), bool)
    pictures = dict[int, list[GroundPicture]]()
    (shown, ground), before = shown_ground(block), -1
    for _ in range(_GROUND_ROUNDS):
        if shown.sum() <= before:
            break
        turned, shows = tie_to_ground(block, store, stations.paths, known, pictures, shown, ground)
        if not turned.any():
            break
        on_ground, should, before = on_ground | turned, should | shows, int(shown.sum())
        extend(block, store, reach_px)
        triangulate(block, reach_px)
        _refine(block, known, free, reach_px)
        # A flight whose photos stand by now tells whether its geotags are those of another instant.
        known = _in_time(block, given, free)
        shown, ground = shown_ground(block)
    if (on_ground & shown).any():
        block.unpose(block.is_posed & should & ~shown)
    return on_ground, should, known


def _scaled_to_bars(block: Block, adjusted: Adjusted, known: Known, free: frozenset[str]) -> tuple[Adjusted, Known]:
    """The block, and the geotags about its middle, scaled by what known lengths are worth beside what holds it; as it
    is where they contradict that."""
    if known.bars is None:
        return adjusted, known
    lengths, before = bar_lengths(block, known.bars), posterior_of(adjusted).scale
    if lengths.contradict(before) or not np.isfinite(lengths.scale[1]):
        return adjusted, known
    times = np.exp(lengths.scale[0] * before**2 / (before**2 + lengths.scale[1] ** 2))
    middle = block.centres[block.is_posed].mean(axis=0)
    move(block, Similarity(times, np.eye(3), (1 - times) * middle))
    known = replace(known, xyz=middle + times * (known.xyz - middle))
    return adjust(block, known, free, final=True, tolerance=LAST), known


def _as_control_says(block: Block, known: Known, given: Known) -> Known:
    """:func:`.control.as_block_says` where no photo has a geotag."""
    if given.control is None or known.control is None or not known.is_by_control:
        return known
    control = as_block_says(block, given.control)
    if control is not given.control:
        # Held too firmly the block lies at a few of them, and points this loose would hardly move it in an adjustment.
        align_to_control(block, given.control)
        control = as_block_says(block, given.control)
    return known if np.allclose(control.sd_m, known.control.sd_m, rtol=0.1) else replace(known, control=control)


def _first_block(
    placement: Placement, store: FeatureStore, known: Known, sensor: Sensor, free: frozenset[str], reporter: Reporter
) -> Block:
    """The mapped photos, moved onto control points where they are far off, and adjusted."""
    mapped = placement.mapped
    rotations = np.where(mapped[:, None, None], placement.rotations, np.nan)
    translations = np.where(mapped[:, None], placement.translations, np.nan)
    block = from_matches(store, mapped, rotations, translations, sensor)
    triangulate(block, 15.0)
    if known.control is not None:
        moved = align_to_control(block, known.control)
        if moved is not None:
            reporter.info(f"Control points moved the block by {np.linalg.norm(moved.apply(np.zeros((1, 3)))):.1f} m.")
    # Mappers know neither geotags nor a shutter that rolls: the geotags pull first.
    adjust_roughly(block, known, free, tag_loss=np.inf)
    _refine(block, known, free, 4.0)
    return block


def _in_time(block: Block, given: Known, free: frozenset[str]) -> Known:
    """:func:`.geotag_errors.in_time`, until nothing changes: velocities hold for short times only."""
    known = given
    for _ in range(_ROUNDS):
        adjusted = adjust(block, known, free, iterations=30)
        along_m = np.abs(adjusted.flight_error[:, 3]) * usual_speed_m_s(block.sensor)
        if (along_m < MIN_M).all():  # so small a move is none: no need of a posterior
            break
        former, known = known, in_time(known, given, adjusted, posterior_of(adjusted))
        if known is former:
            break
        _refine(block, known, free, 4.0)
    return known


def _settle(block: Block, known: Known, given: Known, free: frozenset[str]) -> tuple[Known, frozenset[str]]:
    """What holds the block (``given`` at first) in the last adjustment, and what is free of lens and shutter."""
    adjusted = adjust(block, known, free, final=True, tolerance=GOOD)
    posterior = posterior_of(adjusted)
    known = settle_time(known, given, adjusted, posterior)
    known, free = settle_shutter(block, known, free, posterior)
    return known, settle_lens(block, known, free, posterior)


def _enough(placement: Placement, store: FeatureStore, known: Known, sensor: Sensor, reporter: Reporter) -> Placement:
    """The placement, or one from geotags and gimbal angles where the mapper placed too few photos and that places more.

    Mappers know no rolling shutter: 8 cm between the first row and the last bend their models until few photos agree
    with their geotags.
    """
    # Geotags that are metres off would tear such a start apart.
    if placement.mapped.sum() < max(3, MAPPED_SHARE * len(placement.mapped) if known.is_precise else 3):
        other = from_gimbal(placement, store, known, sensor)
        if other.mapped.sum() > placement.mapped.sum():
            reporter.info(
                f"The mapper placed {placement.mapped.sum()} photos; {other.mapped.sum()} start from their geotags and "
                "gimbal angles."
            )
            placement = other
    if placement.mapped.sum() < 3:
        raise ReconstructionError(
            f"No three of the {len(placement.mapped)} photos could be matched with each other and their geotags, or, "
            "where they have none, show three control points that are not in a line; they overlap too little, are "
            "blurred, or the geotags or marks are wrong: look at the photos, fly with 80 % overlap."
        )
    return placement


def _join_loose(
    block: Block,
    store: FeatureStore,
    loose: np.ndarray,
    guess: np.ndarray,
    known: Known,
    free: frozenset[str],
    rng: np.random.Generator,
) -> None:
    """Tie the loose photos in, as many as can be."""
    loose = loose.copy()
    for _ in range(6):
        if not loose.any():
            break
        joined = resect(block, store, loose, guess, known, rng)
        if not joined.any():
            break
        loose &= ~joined
        retriangulate(block, store)
        adjust_roughly(block, known, free)
        _refine(block, known, free, 4.0)


def from_gimbal(placement: Placement, store: FeatureStore, known: Known, sensor: Sensor) -> Placement:
    """First poses from geotags and gimbal angles alone, brought together by their matches, intrinsics held.

    For photos with a narrow field of view: there the relative pose of two photos is nearly ambiguous (depth may be
    turned inside out), and mappers that start from pairs reject each other's rotations. Half a degree of gimbal error
    is tens of pixels, so the limit starts wide and closes.
    """
    placed = np.isfinite(placement.translations).all(axis=1) & np.isfinite(known.xyz).all(axis=1)
    if placed.sum() < 3:
        return placement
    sensor = replace(sensor, camera=placement.camera)
    reach_px = 2 * np.tan(np.radians(GIMBAL_REACH_DEG)) * placement.camera.fx
    rotations = np.where(placed[:, None, None], placement.rotations, np.nan)
    translations = np.where(placed[:, None], placement.translations, np.nan)
    for share in (1.0, 0.3, 0.1):
        # Every match again: what was too far off before may fit now.
        block = from_matches(store, placed, rotations, translations, sensor)
        triangulate(block, share * reach_px)
        adjust(block, known, frozenset(), least_sigma_px=max(0.05 * share * reach_px, 1.0))
        placed, rotations, translations = block.is_posed, block.rotations, block.translations
    triangulate(block, 0.05 * reach_px)
    tied = block.is_posed & (np.bincount(block.image, minlength=len(placed)) >= MIN_OBSERVATIONS)
    rotations = np.where(tied[:, None, None], block.rotations, placement.rotations)
    translations = np.where(tied[:, None], block.translations, placement.translations)
    return replace(placement, rotations=rotations, translations=translations, mapped=tied)


def _refine(block: Block, known: Known, free: frozenset[str], limit_px: float) -> None:
    """Prune by the residuals at hand, then adjust, twice: a few wrong matches otherwise bend the focal length."""
    for _ in range(2):
        prune(block, min(limit_px, max(6.0 * typical_px(block), 0.5)))
        adjust_roughly(block, known, free)


def _refine_strictly(block: Block, known: Known, free: frozenset[str]) -> Adjusted:
    """The last adjustment, when every pose is good: residuals beyond three times the median of before are wrong
    matches. On ``plot_a`` it took the scatter of breast-height points from 0.10 to 0.03 px.
    """
    limit_px = max(3.0 * typical_px(block), MIN_LIMIT_PX)
    prune(block, limit_px)
    adjust(block, known, free, final=True, iterations=30, tolerance=GOOD)
    prune(block, limit_px)
    return adjust(block, known, free, final=True, iterations=30, tolerance=LAST)


def _keep_proven(block: Block) -> None:
    """Drop two-view points, except those of photos that would keep fewer than :data:`_ENOUGH` others."""
    views = np.bincount(block.point, minlength=len(block.points))
    proven = views[block.point] >= 3
    count = np.bincount(block.image[proven], minlength=len(block.keypoints))
    needed = np.zeros(len(block.points), bool)
    needed[block.point[~proven & (count[block.image] < _ENOUGH)]] = True
    block.keep(proven | needed[block.point])


#: A photo may be turned this much against its gimbal angles (its vertical: :data:`.georeference.GIMBAL_LIMIT_DEG`).
COMPASS_LIMIT_DEG = 15.0
#: A photo farther from a good geotag than this many standard deviations, and this many metres, is placed again.
STRAY_SD, STRAY_M, MAX_STRAYS = 5.0, 0.15, 1 / 3
#: A photo is left out when it is less sure at the stems than this, pixels, and than so many times the median photo.
LOOSE_PX, LOOSE_TIMES = 0.3, 4.0
#: Photos that show so many points together hold each other; a group of less than this share of the largest is no plot.
TOGETHER_POINTS, APART_SHARE = 6, 0.25
#: A geotag is good with a standard error (three axes) below this, metres: PPK fixes, not float solutions.
GOOD_GEOTAG_M = 0.15


def set_loose(block: Block, known: Known, guess: np.ndarray, sure: np.ndarray | bool = False) -> np.ndarray:
    """Take out the photos that contradict what is known of them, to be placed again from there; (N,) bool which.

    Their gimbal is believed where it contradicts them, else their direction. sure: (N,) bool, those that stay.
    """
    stray = strays(block, known) & ~np.asarray(sure)
    kept = stray & ~_turned(block, known)
    guess[kept] = block.rotations[kept]
    block.unpose(stray)
    return stray


def set_unconfirmed(block: Block, sure: np.ndarray, known: Known, guess: np.ndarray) -> np.ndarray:
    """Take out the photos that the others' points do not confirm, to be placed again as their gimbals say; (N,) bool
    which. sure: (N,) bool of :func:`.resection.confirmed`."""
    unsure = _unconfirmed(block, sure)
    if known.gimbal is not None:
        aimed = unsure & np.isfinite(known.gimbal).all(axis=(1, 2))
        guess[aimed] = known.gimbal[aimed]
    block.unpose(unsure)
    return unsure


def _unconfirmed(block: Block, sure: np.ndarray) -> np.ndarray:
    """(N,) bool: posed photos that are not sure; none where they are more than the sure ones, because then the block as
    a whole is not (:data:`.options.CONFIRMED_SHARE`)."""
    unsure = block.is_posed & ~sure
    return unsure if unsure.sum() <= sure.sum() else np.zeros(len(sure), bool)


def strays(block: Block, known: Known) -> np.ndarray:
    """(N,) bool: posed photos that contradict a good geotag (:data:`STRAY_SD`, :data:`STRAY_M`) or their gimbal; none
    where a third would: then geotags or angles are not as good as they state, or the block is far from done.
    """
    found = _far(block, known) | _turned(block, known)
    return found if found.sum() <= MAX_STRAYS * block.is_posed.sum() else np.zeros(len(found), bool)


def _far(block: Block, known: Known) -> np.ndarray:
    """(N,) bool: posed photos that stand too far from a good geotag."""
    off = np.where(block.is_posed[:, None], block.centres, np.nan) - known.xyz
    with np.errstate(invalid="ignore"):
        far = np.linalg.norm(off / known.sd, axis=1) > STRAY_SD * np.sqrt(3)
        far &= np.linalg.norm(known.sd, axis=1) < GOOD_GEOTAG_M
        return far & (np.linalg.norm(off, axis=1) > STRAY_M)


def _turned(block: Block, known: Known) -> np.ndarray:
    """(N,) bool: posed photos that look elsewhere than their gimbal says, the mounting error that all share taken out.

    Such a photo stands on its geotag and hangs on wrong matches alone: its centre does not show it. A gimbal knows the
    vertical, but north only by a compass: on a real flight (``drone_brighton_beach``) the two directions of the lines
    differ by 5 degrees.
    """
    found = np.zeros(len(block.translations), bool)
    if known.gimbal is None:
        return found
    both = np.flatnonzero(block.is_posed & np.isfinite(known.gimbal).all(axis=(1, 2)))
    if len(both) < 3:
        return found
    rotations, gimbal = block.rotations[both], known.gimbal[both]
    error = rotations @ gimbal.transpose(0, 2, 1)
    # Twice: the first mean still holds the turned ones.
    near = np.ones(len(both), bool)
    for _ in range(2):
        mounting = nearest_rotation(error[near].sum(axis=0))
        away = rotation_angle_deg(error @ mounting.T)
        cosine = np.einsum("nk,nk->n", rotations[:, :, 2], gimbal[:, :, 2] @ mounting.T)
        tilted = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        near = away <= max(COMPASS_LIMIT_DEG, 3 * float(np.median(away)))
        near &= tilted <= max(GIMBAL_LIMIT_DEG, 3 * float(np.median(tilted)))
    found[both[~near]] = True
    return found


def leave_out(block: Block, known: Known, names: list[str], reporter: Reporter) -> bool:
    """Take out photos that few points tie and those that contradict what is known of them; whether there were any.

    Raises:
        ReconstructionError: so many contradict good geotags that block or geotags are wrong.
    """
    far, posed = _far(block, known), int(block.is_posed.sum())
    if far.sum() > MAX_STRAYS * posed:
        stated = np.median(np.linalg.norm(known.sd[far], axis=1))
        raise ReconstructionError(
            f"{far.sum()} of {posed} photos stand more than {STRAY_M * 100:.0f} cm and {STRAY_SD:.0f} standard "
            f"deviations from geotags that claim {stated * 100:.0f} cm; the block is bent or the geotags are wrong: "
            "check lever arm, datum, and that the geotags belong to these photos."
        )
    weak = block.is_posed & (np.bincount(block.image, minlength=len(names)) < MIN_OBSERVATIONS)
    stray = strays(block, known)
    lost = ~block.is_posed | (weak & ~stray)
    _take_out(block, stray, "contradict their geotag or gimbal angles and are left out", names, reporter)
    _take_out(block, lost, "could not be tied to the others", names, reporter)
    return bool((weak | stray).any())


def _take_out(block: Block, photos: np.ndarray, why: str, names: list[str], reporter: Reporter) -> bool:
    """Take photos, (N,) bool, out of the block with a warning; whether there were any."""
    if photos.any():
        reporter.warn(f"{photos.sum()} photos {why}: {shorten([names[i] for i in np.flatnonzero(photos)])}.")
        block.unpose(photos)
    return bool(photos.any())


def leave_out_loose(block: Block, poses_px: np.ndarray, names: list[str], reporter: Reporter) -> bool:
    """Take out photos that hang on so few points that they may stand anywhere; whether there were any.

    poses_px: (N,) of :class:`.covariance.Posterior`. A geotag of half a metre does not tell that such a photo is 50 cm
    off and turned by 3 degrees (``plot_h``).
    """
    if not np.isfinite(poses_px).any():
        return False
    with np.errstate(invalid="ignore"):
        unsure = block.is_posed & (poses_px > max(LOOSE_PX, LOOSE_TIMES * float(np.nanmedian(poses_px))))
    why = "hang on too few points to stand anywhere for sure and are left out"
    return _take_out(block, unsure, why, names, reporter)


def groups_of(block: Block) -> list[np.ndarray]:
    """Registered photos by groups of three and more that share no points, the largest first."""
    count = len(block.keypoints)
    shows = coo_array((np.ones(len(block.image), np.int32), (block.image, block.point)), (count, len(block.points)))
    together = shows.tocsr() @ shows.T.tocsr() >= TOGETHER_POINTS
    label = connected_components(together, directed=False)[1]
    found = [np.flatnonzero((label == each) & block.is_posed) for each in np.unique(label[block.is_posed])]
    return sorted((group for group in found if len(group) > 2), key=lambda group: (-len(group), group[0]))


def leave_out_apart(block: Block, known: Known, names: list[str], reporter: Reporter) -> bool:
    """Take out the few photos that share no points with the others where their geotags alone would hold them, metres
    off; whether there were any. Groups that are large beside the largest stay: plots of their own."""
    groups = groups_of(block)
    if known.is_precise or known.is_by_control or not groups:
        return False
    kept = np.concatenate([group for group in groups if len(group) >= APART_SHARE * len(groups[0])])
    apart = block.is_posed & ~np.isin(np.arange(len(names)), kept)
    why = (
        "share no points with the others, and their geotags do not tell where they stand beside them; they are left out"
    )
    return _take_out(block, apart, why, names, reporter)


def leave_out_unconfirmed(block: Block, sure: np.ndarray, names: list[str], reporter: Reporter) -> bool:
    """Take out the photos that the others' points do not confirm; whether there were any.

    sure: (N,) bool of :func:`.resection.confirmed`.
    """
    why = "do not show the points of the others and are left out"
    return _take_out(block, _unconfirmed(block, sure), why, names, reporter)
