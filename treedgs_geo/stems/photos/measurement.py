"""From the explanation that was chosen to a stem with its error, flag and reasons."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np

from ..quality.assessment import Assessment
from ..quality.priors import SECTION_SD
from .evidence.diameter_uncertainty import OPEN, PAIR_SE_CM, UNSURE, UNSURE_SE, Others
from .evidence.double_stem import NO_TWINS, PARTS, Twins
from .evidence.error_budget import (
    LEAN_ERROR,
    azimuth_spread,
    oval_error_cm,
    seen_oval_error_cm,
    standard_error_cm,
    taper_error_cm,
)
from .evidence.opacity_test import ground_correlation, share_through
from .evidence.upper_band import averaged
from .fit.breast_height import breast_height, moved
from .fit.edge_adjustment import FineFit
from .fit.null_model import BREAST, Bands
from .fit.photo_fit import PhotoFit, seen_probability
from .fit.search import Null, Prior
from .fit.selection import Explanation
from .images.axis_patches import StemAxis
from .images.background import Backdrop, Silhouette
from .images.crops import FX, GroundGrid, PhotoStack
from .network.inference import NetworkMaps
from .options import PhotoStemOptions
from .propose.edge_voting import Seed
from .quality_control import FitQuality, verdict, widened_cm

#: A view counts as seeing the stem above this z-score.
CLEAR_Z = 2.5


@dataclass
class Shared:
    """What all fits on one stack of photos share. sun: (flights,) azimuth, rad from east, NaN = unknown. backdrop: the
    ground behind the stems, if enough photos show it; chance: silhouette contrast that places without a stem reach.
    bands: heights at which stems are looked for. soft_px: of the photos (:func:`.images.sharpness.soft_px`)."""

    stack: PhotoStack
    ground: GroundGrid
    options: PhotoStemOptions
    null: Null
    sun: np.ndarray
    prior: Prior = Prior()
    backdrop: Backdrop | None = None
    chance: float = np.inf
    shown: NetworkMaps | None = None
    bands: Bands = BREAST
    soft_px: float = 0.0


class Fitted(NamedTuple):
    """An explanation that was chosen. best: it; fine: its last refinement; gap, sure, gain: as of
    :class:`.fit.photo_fit.PhotoFit`; outline: silhouettes about the place; others: what else was tried; above_cm: the
    diameter read farther up, brought down, NaN where there is none; twins: full stems instead of it."""

    best: Explanation
    fine: FineFit
    gap: float
    sure: float = np.nan
    outline: Silhouette | None = None
    gain: float = 0.0
    others: Others | None = None
    above_cm: float = np.nan
    twins: Twins = NO_TWINS


class _Shape(NamedTuple):
    """The stem at breast height above the ground that its foot is on."""

    axis: StemAxis
    r0: float
    r1: float
    foot_z: float


def judged(shared: Shared, seed: Seed, found: Fitted) -> PhotoFit:
    """The stem of an explanation: its diameter and error, and flag and reasons (:mod:`.quality_control`)."""
    best, outline = found.best, found.outline
    clear = best.z > CLEAR_Z
    weight = found.fine.view_weight * seen_probability(best.z)
    soft_cm = shared.soft_px * px_cm(shared, found.fine.axis, clear)
    kish = float(weight.sum() ** 2 / max((weight**2).sum(), 1e-12))
    fine, se = averaged(found.fine, error_cm(shared, best, found.fine, weight), found.above_cm)
    se = float(np.hypot(se, soft_cm))  # of both readings alike
    dq, foot_z = breast_height(fine.axis, fine.r0, shared.ground)
    shape = _Shape(moved(fine.axis, dq), fine.r0 + fine.r1 * dq, fine.r1, foot_z)
    quality = FitQuality(
        dbh_cm=200 * shape.r0,
        polish_cm=200 * best.mode.r,
        r1=fine.r1,
        lean_deg=float(np.degrees(np.arctan(np.hypot(*found.fine.axis.s)))),
        llr=best.edges,
        gap=found.gap,
        n_views=int(clear.sum()),
        kish=kish if best.mate is None else np.inf,
        se_cm=se,
        rms_px=fine.rms_px,
        sure=found.sure,
        gain=found.gain,
        twins=found.twins.gain,
        twins_share=found.twins.share,
        contrast=np.nan if outline is None else best.contrast / shared.chance,
        outline_cm=np.nan if outline is None or best.mate is not None else 200 * widest(outline, best.vector),
        through=_through(shared, shape, outline, int(clear.sum())),
        oval=float(np.hypot(*fine.oval)) / max(fine.r0, 1e-6),
        network=shared.shown is not None,
        against_cm=0.0 if found.others is None else found.others.choice.against_cm,
    )
    flag, reasons = verdict(quality, shared.options)
    stated = Assessment(quality.dbh_cm, widened_cm(se, quality, reasons), flag=flag, reasons=reasons)
    if found.others is not None and flag == "check" and OPEN & set(reasons):
        stated = _over_explanations(stated, found.others, quality, soft_cm)
    return PhotoFit(
        axis=shape.axis,
        r0=shape.r0,
        r1=fine.r1,
        **asdict(stated),
        seed_score=seed.score,
        llr=best.edges,
        gap=found.gap,
        n_views=quality.n_views,
        kish=kish,
        arc_deg=azimuth_spread(_azimuths(shared, found.fine.axis)[clear]),
        rms_px=fine.rms_px,
        polish_cm=quality.polish_cm,
        seen=seen_probability(best.z),
        contrast=quality.contrast,
        sure=found.sure,
        outline_cm=quality.outline_cm,
        foot_z=foot_z,
        gain=found.gain,
        twins=found.twins.gain,
        twins_share=found.twins.share,
        oval=(float(fine.oval[0]), float(fine.oval[1])),
        soft_cm=soft_cm,
    )


def _over_explanations(stated: Assessment, others: Others, quality: FitQuality, soft_cm: float) -> Assessment:
    """With the error and the interval over all explanations of the place."""
    times = UNSURE_SE if UNSURE & set(stated.reasons) else 1.0
    mixture = others.mixture(stated.dbh_cm, stated.se_cm, times, soft_cm)
    low_cm, high_cm = mixture.interval_cm(stated.dbh_cm)
    if quality.twins_likely:
        low_cm = min(low_cm, PARTS[0] * stated.dbh_cm)  # the thinner one of two
    return stated.explained(mixture.error_cm(stated.dbh_cm), low_cm, high_cm)


def error_cm(shared: Shared, best: Explanation, fine: FineFit, weight: np.ndarray) -> float:
    """Standard error of the diameter in sharp photos before anything speaks against the stem. weight: (V,) of the
    photos."""
    clear = best.z > CLEAR_Z
    se = standard_error_cm(fine, weight, px_cm(shared, fine.axis, clear), int(clear.sum()))
    azimuths, thick_cm = _azimuths(shared, fine.axis), 200 * fine.r0
    if best.mate is None:
        oval = seen_oval_error_cm(thick_cm, 200 * fine.view_r, azimuths, weight)
    else:
        se = PAIR_SE_CM  # hardly any photo shows both of its edges
        oval = oval_error_cm(thick_cm, azimuths, weight)
    lean = float(np.hypot(*fine.axis.s))
    parts = oval, LEAN_ERROR * thick_cm * lean, SECTION_SD * thick_cm, taper_error_cm(fine.r1)
    return float(np.linalg.norm([se, *parts]))


def px_cm(shared: Shared, axis: StemAxis, views: np.ndarray) -> float:
    """Median size of a pixel at the stem, over ``views`` or all."""
    foot = np.array([*axis.p, axis.ground_z + axis.bh_m])
    size = 100 * np.linalg.norm(shared.stack.centre - foot, axis=1) / shared.stack.camera[:, FX]
    return float(np.median(size[views] if views.any() else size))


def widest(outline: Silhouette, vector: np.ndarray) -> float:
    """Radius (m) at which the silhouette around a fitted axis is clearest."""
    radii = np.arange(max(0.3 * vector[4], 0.02), 2.0 * vector[4] + 0.06, 0.004)
    return float(radii[np.argmax([outline.contrast(np.r_[vector[:4], r]) for r in radii])])


def _azimuths(shared: Shared, axis: StemAxis) -> np.ndarray:
    """(V,) direction from each photo to the stem, rad from east."""
    return np.arctan2(axis.p[1] - shared.stack.centre[:, 1], axis.p[0] - shared.stack.centre[:, 0])


def _through(shared: Shared, shape: _Shape, outline: Silhouette | None, n_clear: int) -> float:
    """Share of the photos that show the ground through the stem, 0 where no ground is known."""
    if outline is None or shared.backdrop is None:
        return 0.0
    correlation = ground_correlation(
        shared.stack, shared.ground, shared.backdrop, shape.axis, (shape.r0, shape.r1), shared.bands.fine
    )
    return share_through(correlation, n_clear)
