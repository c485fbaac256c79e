"""A second measurement, of the texture, where the edges leave low confidence: a stem primitive.

Edges and silhouettes fail where half of a stem lies in the dark or another edge runs along it. The primitive
(:mod:`treedgs_geo.stems.splats.primitive.fit`) looks at neither: it asks which cylinder lets every photo be predicted
from the others. The two are wrong in different places, so a stem that was refused for want of a decision can have a DBH
after all, and one whose two diameters differ is flagged. It costs some seconds a stem, so only stems of low confidence
are measured again, unless all are wanted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.low_confidence import may_be_settled
from ..stems.photos.tuned import GAIN_LOW_CONFIDENCE
from ..stems.quality.assessment import Assessment
from ..stems.quality.limits import judge
from ..stems.quality.tree import Tree
from ..stems.splats.primitive.fit import PrimitiveFit
from ..stems.splats.train import FoundStem
from ..stems.splats.trees import place_of

#: The primitive is one stem with nothing beside it: where a companion is likely, or a measured stem this close (m), it
#: takes the two for one.
ALONE_M = 0.6
#: A primitive whose diameter is off by more than this share of the edges' is of something else if the silhouette, which
#: stands out, is within half of that of the edges.
SOMETHING_ELSE = 0.5
#: Most stems measured again in a plot; the clearest first.
MAX_MEASURED_AGAIN = 16


@dataclass(frozen=True)
class SecondMeasurement:
    """What was measured again, for ``run.json``: stems measured, agreed, with a diameter that they had not, and flagged
    because the two differ."""

    measured: int = 0
    agreed: int = 0
    gained: int = 0
    flagged: int = 0


def stems_to_measure_again(fits: list[PhotoFit], inside: np.ndarray, everyone: bool = False) -> list[int]:
    """Indices of the fits worth a second measurement, clearest first. inside: (N,) bool, in the area that counts."""
    chosen = []
    for number, fit in enumerate(fits):
        if fit.evidence.gain > GAIN_LOW_CONFIDENCE or not _alone(number, fits):
            continue
        if inside[number] and (may_be_settled(fit) or (everyone and fit.flag == "ok")):
            chosen.append(number)
    chosen.sort(key=lambda number: (fits[number].flag == "ok", -fits[number].evidence.llr))
    return chosen if everyone else chosen[:MAX_MEASURED_AGAIN]


def with_second_measurements(
    trees: list[Tree], fits: list[PhotoFit], found: dict[int, FoundStem], bh_m: float
) -> tuple[list[Tree], SecondMeasurement]:
    """Trees after the second measurement, in the same order.

    trees: of the fits, project coordinates. found: primitives by index of the fit, local frame. A primitive of low
    confidence says nothing, nor does one that edges and silhouette contradict together. Wherever the two diameters
    differ the error is widened by half of the difference; a stem whose diameter that leaves open is refused.
    """
    places = {number: place_of(stem, bh_m) for number, stem in found.items()}
    settled, counts = list(trees), {"agreed": 0, "gained": 0, "flagged": 0}
    for number, stem in found.items():
        fit, primitive = fits[number], stem.primitive
        unusable = (primitive.findings + judge("gaussians", {"dbh_cm": primitive.dbh_cm})).reasons
        if unusable or _taken(number, fits, places, stem) or _of_something_else(fit, primitive):
            continue
        apart_cm = abs(primitive.dbh_cm - fit.dbh_cm)
        differ = judge("second measurement", {"other_off_cm": apart_cm}, fit.dbh_cm).reasons
        counts["agreed"] += not differ
        if fit.measured:
            counts["flagged"] += bool(differ)
            settled[number] = _of_measured(trees[number], fit, primitive, differ)
        else:
            tree = _of_refused(trees[number], fit, primitive, differ, places[number])
            counts["gained"] += tree is not None
            settled[number] = tree or trees[number]
    return settled, SecondMeasurement(measured=len(found), **counts)


def _of_measured(tree: Tree, fit: PhotoFit, primitive: PrimitiveFit, differ: tuple[str, ...]) -> Tree:
    """A stem that the photos measured. Both differ: to check. They agree on one of several explanations: that one it
    is, with the primitive's error. differ: reasons for a check, none where both agree."""
    half_cm, stated = 0.5 * abs(primitive.dbh_cm - fit.dbh_cm), fit.assessment
    if differ:
        se_cm = float(np.hypot(fit.se_cm, half_cm))
        open_ = judge("photos", {"se_cm": se_cm}, fit.dbh_cm)
        stated = stated.settled(se_cm, found=differ)
        return _settled(tree, stated.adding(open_) if open_.refused else stated)
    if np.isfinite(fit.assessment.lo_cm):
        return _settled(tree, stated.settled(_error_cm(fit, primitive.se_cm, half_cm)))
    return tree


def _of_refused(
    tree: Tree, fit: PhotoFit, primitive: PrimitiveFit, differ: tuple[str, ...], place: np.ndarray
) -> Tree | None:
    """A stem that the photos refused. Both agree: the photos' diameter, to check. They differ: the primitive's, to
    check, or ``None``, still refused, where that leaves the diameter open. place: (2,) the primitive's, local frame."""
    half_cm = 0.5 * abs(primitive.dbh_cm - fit.dbh_cm)
    if not differ:
        se_cm = _error_cm(fit, min(fit.se_cm, primitive.se_cm), half_cm)
        return _settled(tree, fit.assessment.settled(se_cm), taper_cm_m=200 * fit.r1)
    se_cm = _error_cm(fit, primitive.se_cm, half_cm)
    if judge("photos", {"open_se_cm": se_cm}, primitive.dbh_cm).refused:
        return None
    move = place - fit.axis.p
    return _settled(
        tree,
        fit.assessment.settled(se_cm, primitive.dbh_cm, differ),
        x=tree.x + float(move[0]),
        y=tree.y + float(move[1]),
        taper_cm_m=200 * float(primitive.shape[7]),
        method="gaussians-stem",
        n_views=primitive.n_views,
        lean_deg=float(np.degrees(np.arctan(np.hypot(*primitive.shape[2:4])))),
    )


def _error_cm(fit: PhotoFit, se_cm: float, half_cm: float) -> float:
    """Of a diameter that the primitive bears out or reads: half of the difference on top, and what soft photos add,
    which both were measured in."""
    return float(np.linalg.norm([se_cm, half_cm, fit.soft_cm]))


def _settled(tree: Tree, stated: Assessment, **changes: Any) -> Tree:
    """The tree of which that is stated, where it is symmetrical."""
    return replace(tree, **stated.of_tree(), **changes).finish()


def _of_something_else(fit: PhotoFit, primitive: PrimitiveFit) -> bool:
    """Is the primitive's diameter far from both the edges' and the silhouette's, which agree?"""
    most_cm = SOMETHING_ELSE * fit.dbh_cm
    outline_agrees = fit.evidence.contrast > 1.0 and abs(fit.evidence.outline_cm - fit.dbh_cm) < 0.5 * most_cm
    return fit.measured and outline_agrees and abs(primitive.dbh_cm - fit.dbh_cm) > most_cm


def _alone(number: int, fits: list[PhotoFit]) -> bool:
    """No other measured stem beside it."""
    return not any(
        fit.measured and other != number and np.hypot(*(fit.axis.p - fits[number].axis.p)) < ALONE_M
        for other, fit in enumerate(fits)
    )


def _taken(number: int, fits: list[PhotoFit], places: dict[int, np.ndarray], stem: FoundStem) -> bool:
    """Does the primitive stand where another stem is measured?"""
    return any(
        np.hypot(*(places[number] - fit.axis.p)) < 0.7 * (fit.r0 + stem.primitive.shape[6]) + 0.05
        for other, fit in enumerate(fits)
        if other != number and fit.measured
    )
