"""Photos of a block that contradict what is known of them: their geotag or their gimbal's angles."""

from __future__ import annotations

import numpy as np

from ..core.errors import ReconstructionError
from ..core.progress import Reporter
from ..geotags.photos import shorten
from .adjustment import Known
from .georeference import GIMBAL_LIMIT_DEG
from .poses import nearest_rotation, rotation_angle_deg
from .resection import MIN_OBSERVATIONS
from .tracks import Block

#: A photo may be turned this much against its gimbal angles (its vertical: :data:`.georeference.GIMBAL_LIMIT_DEG`).
COMPASS_LIMIT_DEG = 15.0
#: A photo farther from a good geotag than this many standard deviations, and this many metres, is placed again.
STRAY_SD, STRAY_M, MAX_STRAYS = 5.0, 0.15, 1 / 3
#: A photo is left out when it is less sure at the stems than this, pixels, and than so many times the median photo.
LOOSE_PX, LOOSE_TIMES = 0.3, 4.0
#: A geotag is good with a standard error (three axes) below this, metres: PPK fixes, not float solutions.
GOOD_GEOTAG_M = 0.15


def set_loose(block: Block, known: Known, guess: np.ndarray) -> np.ndarray:
    """Take out the photos that contradict what is known of them, to be placed again from there; (N,) bool which.

    Their gimbal is believed where it contradicts them, else their direction.
    """
    stray = strays(block, known)
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
    for chosen, why in (
        (stray, "contradict their geotag or gimbal angles and are left out"),
        (lost, "could not be tied to the others"),
    ):
        if chosen.any():
            reporter.warn(f"{chosen.sum()} photos {why}: {shorten([names[i] for i in np.flatnonzero(chosen)])}.")
    block.unpose(weak | stray)
    return bool((weak | stray).any())


def leave_out_loose(block: Block, poses_px: np.ndarray, names: list[str], reporter: Reporter) -> bool:
    """Take out photos that hang on so few points that they may stand anywhere; whether there were any.

    poses_px: (N,) of :class:`.covariance.Posterior`. A geotag of half a metre does not tell that such a photo is 50 cm
    off and turned by 3 degrees (``plot_h``).
    """
    if not np.isfinite(poses_px).any():
        return False
    with np.errstate(invalid="ignore"):
        unsure = block.is_posed & (poses_px > max(LOOSE_PX, LOOSE_TIMES * float(np.nanmedian(poses_px))))
    if unsure.any():
        named = shorten([names[i] for i in np.flatnonzero(unsure)])
        reporter.warn(
            f"{unsure.sum()} photos hang on too few points to stand anywhere for sure and are left out: {named}."
        )
        block.unpose(unsure)
    return bool(unsure.any())


def leave_out_unconfirmed(block: Block, sure: np.ndarray, names: list[str], reporter: Reporter) -> bool:
    """Take out the photos that the others' points do not confirm; whether there were any.

    sure: (N,) bool of :func:`.resection.confirmed`.
    """
    unsure = _unconfirmed(block, sure)
    if unsure.any():
        named = shorten([names[i] for i in np.flatnonzero(unsure)])
        reporter.warn(f"{unsure.sum()} photos do not show the points of the others and are left out: {named}.")
        block.unpose(unsure)
    return bool(unsure.any())
