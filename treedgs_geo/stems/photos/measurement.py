"""From the explanation that was chosen to a stem with its error and the evidence about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .evidence.double_stem import NO_TWINS, Twins
from .evidence.error_budget import (
    azimuth_spread,
    formal_error_cm,
    scatter_cm,
    seen_oval_error_cm,
    taper_excess_cm,
)
from .evidence.opacity_test import ground_correlation, showing_ground
from .evidence.other_explanations import other_explanations
from .evidence.surface import surface_likeness
from .evidence.upper_band import averaged
from .fit.breast_height import breast_height, moved
from .fit.edge_adjustment import FineFit
from .fit.null_model import BREAST, Bands
from .fit.photo_fit import PhotoFit, seen_probability
from .fit.search import Null, Prior
from .fit.selection import Explanation, Selected
from .images.axis_patches import StemAxis
from .images.background import Backdrop, Silhouette
from .images.crops import FX, GroundGrid, PhotoStack
from .images.sharpness import clipped_px
from .network.inference import OddsMaps
from .options import PhotoStemOptions
from .propose.edge_voting import Seed
from .quality_control import ErrorParts, Evidence
from .tuned import MIN_PHOTOS, PRIOR_SDS, SEEN_MEAN_Z


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
    shown: OddsMaps | None = None
    bands: Bands = BREAST
    soft_px: float = 0.0


class Fitted(NamedTuple):
    """An explanation that was chosen. best: it; fine: its last refinement; sure: as of
    :class:`.quality_control.Evidence`; silhouette: of the place; choice: ``None`` in a first look, which weighs nothing
    yet; above_cm: the diameter read farther up, brought down, NaN where there is none; twins: full stems instead of
    it."""

    best: Explanation
    fine: FineFit
    sure: float = np.nan
    silhouette: Silhouette | None = None
    choice: Selected | None = None
    above_cm: float = np.nan
    twins: Twins = NO_TWINS


class Found(NamedTuple):
    """A fitted stem about which evidence is sought."""

    shared: Shared
    #: The explanation that was chosen.
    chosen: Fitted
    #: The stem, after the reading from farther up.
    fine: FineFit
    #: Axis at breast height above the ground that its foot is on; the foot's height, local m.
    axis: StemAxis
    foot_z: float
    #: Radius at breast height, m.
    r0: float
    #: Error of the diameter before anything speaks against it.
    error: ErrorParts
    #: (V,) weight of each photo in the diameter, 0: it does not count; (V,) bool, it shows the stem clearly.
    weight: np.ndarray
    clear: np.ndarray


def by_edges(found: Found) -> dict[str, float]:
    """What the edges' fit and its photos say."""
    best, weight = found.chosen.best, found.weight
    return {
        "polish_cm": 200 * best.hypothesis.r,
        "r1": found.fine.r1,
        "lean_deg": float(np.degrees(np.arctan(np.hypot(*found.chosen.fine.axis.s)))),
        "llr": best.edges,
        "n_views": int(found.clear.sum()),
        "kish": _kish(weight),
        "arc_deg": azimuth_spread(_azimuths(found.shared, found.chosen.fine.axis)[found.clear]),
        "rms_px": found.fine.rms_px,
    }


def by_selection(found: Found) -> dict[str, Any]:
    """What the other explanations of the place say."""
    chosen = found.chosen
    numbers: dict[str, Any] = {"sure": chosen.sure}
    if chosen.choice is None:
        return numbers
    return numbers | {"others": other_explanations(chosen.choice, 200 * found.r0, found.error.se_cm)}


def by_twins(found: Found) -> dict[str, float]:
    """Whether it is two stems."""
    twins, stand = found.chosen.twins, found.shared.prior
    thicker_sd = (found.r0 - stand.r) / (stand.r_sd / PRIOR_SDS)
    return {"twins": twins.gain, "twins_share": twins.share, "thicker_sd": thicker_sd}


def by_silhouette(found: Found) -> dict[str, float]:
    """How wide it is as the ground or the network shows it."""
    best, silhouette = found.chosen.best, found.chosen.silhouette
    if silhouette is None or (~silhouette.blind).sum() < MIN_PHOTOS:
        return {}
    width_cm = 200 * widest(silhouette, best.vector)
    return {"outline_cm": width_cm, "contrast": best.contrast / found.shared.chance}


def by_opacity(found: Found) -> dict[str, float]:
    """Whether the ground shows through it."""
    shared = found.shared
    if found.chosen.silhouette is None or shared.backdrop is None:
        return {}
    radius = found.r0, found.fine.r1
    seen = ground_correlation(shared.stack, shared.ground, shared.backdrop, found.axis, radius, shared.bands.fine)
    return {"n_through": showing_ground(seen)}


def by_surface(found: Found) -> dict[str, float]:
    """Where no ground is seen behind it: whether what its edges enclose is bark."""
    shared, seen = found.shared, seen_probability(found.chosen.best.z)
    if shared.backdrop is not None or found.chosen.choice is None:
        return {}
    radius = found.r0, found.fine.r1
    alike, lead = surface_likeness(shared.stack, found.axis, radius, shared.bands.fine, seen)
    return {"on_bark": alike, "bark_lead": lead}


def by_section(found: Found) -> dict[str, float]:
    """How far its section is off a circle."""
    return {"oval": float(np.hypot(*found.fine.oval)) / max(found.fine.r0, 1e-6)}


#: What is found out about every fit: each returns fields of :class:`.quality_control.Evidence`.
EVIDENCE = (by_edges, by_selection, by_twins, by_silhouette, by_opacity, by_surface, by_section)


def measured(shared: Shared, seed: Seed, chosen: Fitted) -> PhotoFit:
    """The stem of an explanation: its diameter and error, and the evidence about it."""
    best = chosen.best
    clear = best.z > SEEN_MEAN_Z
    weight = chosen.fine.view_weight * seen_probability(best.z)
    first = chosen.fine
    clipped = clipped_px(shared.stack, first.axis, (first.r0, first.r1), shared.bands.fine, clear)
    soft_cm = float(np.hypot(shared.soft_px, clipped)) * px_cm(shared, first.axis, clear)
    fine, error = averaged(chosen.fine, error_parts(shared, chosen.fine, weight), chosen.above_cm)
    error = error._replace(soft=soft_cm)  # of both readings alike
    dq, foot_z = breast_height(fine.axis, fine.r0, shared.ground)
    axis, r0 = moved(fine.axis, dq), fine.r0 + fine.r1 * dq
    found = Found(shared, chosen, fine, axis, foot_z, r0, error, weight, clear)
    numbers: dict[str, Any] = {name: value for step in EVIDENCE for name, value in step(found).items()}
    options = shared.options
    return PhotoFit(
        axis=axis,
        r0=r0,
        r1=fine.r1,
        evidence=Evidence(
            dbh_cm=200 * r0,
            error=error,
            network=shared.shown is not None,
            min_dbh_cm=options.min_dbh_cm,
            max_dbh_cm=options.max_dbh_cm,
            **numbers,
        ),
        seed_score=seed.score,
        seen=seen_probability(best.z),
        foot_z=foot_z,
        oval=(float(fine.oval[0]), float(fine.oval[1])),
    )


def _kish(weight: np.ndarray) -> float:
    return float(weight.sum() ** 2 / max((weight**2).sum(), 1e-12))


def error_parts(shared: Shared, fine: FineFit, weight: np.ndarray) -> ErrorParts:
    """Of the diameter in sharp photos, at breast height alone. weight: (V,) of the photos."""
    thick_cm, lean = 200 * fine.r0, float(np.hypot(*fine.axis.s))
    parts = ErrorParts(section=thick_cm, lean=lean * thick_cm, taper=taper_excess_cm(fine.r1))
    formal, oval = formal_error_cm(fine)
    scatter = scatter_cm(fine.view_r, weight)
    seen = seen_oval_error_cm(thick_cm, 200 * fine.view_r, _azimuths(shared, fine.axis), weight)
    return parts._replace(scatter=scatter, formal=formal, oval=oval, seen_oval=seen)


def px_cm(shared: Shared, axis: StemAxis, views: np.ndarray) -> float:
    """Median size of a pixel at the stem, over ``views`` or all."""
    foot = np.array([*axis.p, axis.ground_z + axis.bh_m])
    size = 100 * np.linalg.norm(shared.stack.centre - foot, axis=1) / shared.stack.camera[:, FX]
    return float(np.median(size[views] if views.any() else size))


def widest(silhouette: Silhouette, vector: np.ndarray) -> float:
    """Radius (m) at which the silhouette around a fitted axis is clearest."""
    radii = np.arange(max(0.3 * vector[4], 0.02), 2.0 * vector[4] + 0.06, 0.004)
    return float(radii[np.argmax([silhouette.contrast(np.r_[vector[:4], r]) for r in radii])])


def _azimuths(shared: Shared, axis: StemAxis) -> np.ndarray:
    """(V,) direction from each photo to the stem, rad from east."""
    return np.arctan2(axis.p[1] - shared.stack.centre[:, 1], axis.p[0] - shared.stack.centre[:, 0])
