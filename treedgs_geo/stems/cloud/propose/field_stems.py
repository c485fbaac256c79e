"""Field stems as seeds of the segmentation: where to look twice, and what the stems are called."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from ....core.field_stems import FieldStems
from .segment import StemMap

#: A field stem and a found one further apart than this are two, metres, however inexact the positions.
FIELD_MATCH_M = 1.0
#: The distance allowed, in medians of the pairs' distances, but not less than this, m; pairs needed to know it.
LIMIT_SHARE, MIN_LIMIT_M, MIN_PAIRS = 3.0, 0.3, 3
#: From this distance on, m, a pair is unsure where another stem is less than this many times as far.
FAR_M, AMBIGUOUS_SHARE = 0.5, 1.5
#: An answer of the search is a place's own within the first; a tree of another field stem takes the place up to this
#: distance from its bark, m.
SAME_PLACE_M, TAKEN_M = 0.1, 0.35


@dataclass(frozen=True)
class Answer:
    """What was found at one field stem. answer: ``found`` (named after it), ``unsure`` (a stem stands near, but it may
    be another), ``refused`` (seen, not measurable) or ``missing``; reason: of the latter two, a key of the list of
    reasons. gap_m: to the stem meant, ``None`` where there is none. stem: its index."""

    name: str
    answer: str
    reason: str = ""
    gap_m: float | None = None
    stem: int | None = None


def answer_stems(stems: StemMap, field: FieldStems) -> list[Answer]:
    """One answer for each field stem, in their order.

    Field stems and found ones are paired one to one, the distances' sum least, within :data:`FIELD_MATCH_M`. How far a
    pair may be apart follows from how exact the positions are: :data:`LIMIT_SHARE` times the pairs' median. A pair half
    a metre apart or more is unsure where another stem is hardly farther."""
    feet = np.array([stem.cone.centre(1.3) for stem in stems.stems]).reshape(-1, 2) + stems.origin
    unseen = np.array([stem.cone.centre(1.3) for stem in stems.unseen]).reshape(-1, 2) + stems.origin
    gap = np.linalg.norm(feet[:, None] - field.xy[None], axis=2)
    # A cost above the gate lets a stem stay single instead of pushing its neighbour out of a good pair.
    pairs = [
        (i, j)
        for i, j in zip(*linear_sum_assignment(np.where(gap <= FIELD_MATCH_M, gap, 10 * FIELD_MATCH_M)), strict=True)
        if gap[i, j] <= FIELD_MATCH_M
    ]
    gate = FIELD_MATCH_M
    if len(pairs) >= MIN_PAIRS:
        gate = float(np.clip(LIMIT_SHARE * np.median([gap[i, j] for i, j in pairs]), MIN_LIMIT_M, FIELD_MATCH_M))
    partner = {j: i for i, j in pairs}
    answers = []
    for j, name in enumerate(field.names):
        i = partner.get(j)
        if i is None or gap[i, j] > gate:
            reason = _reason_missing(stems, field.xy[j], unseen, gap[:, j])
            answers.append(Answer(name, "missing", reason, None if i is None else float(gap[i, j])))
            continue
        found, near = stems.stems[i], float(gap[i, j])
        others = np.r_[np.delete(gap[:, j], i), np.delete(gap[i], j)]
        unsure = near >= FAR_M and len(others) > 0 and others.min() < AMBIGUOUS_SHARE * near
        answers.append(
            Answer(name, "refused" if found.refused else "unsure" if unsure else "found", found.refused, near, i)
        )
    return answers


def _reason_missing(stems: StemMap, place: np.ndarray, unseen: np.ndarray, gap: np.ndarray) -> str:
    """Why none was found at (2,) ``place``: what the search says of it; another field stem's tree stands there; or the
    cloud has no points there at all."""
    at = np.linalg.norm(unseen - place, axis=1)
    if len(at) and at.min() < SAME_PLACE_M:
        return stems.unseen[int(at.argmin())].refused
    radii = np.array([float(stem.cone.radius(1.3)) for stem in stems.stems])
    return "merged" if (gap < radii + TAKEN_M).any() else "few_points"


def named(stems: StemMap, field: FieldStems, answers: list[Answer]) -> np.ndarray:
    """(S + 1,) new ids by old tree_id, by :func:`answer_stems`.

    A stem that is only perhaps the field's is not named. Stems without a name are numbered on from the largest field
    id."""
    new = np.zeros(len(stems.stems) + 1, np.int32)
    for number, answer in zip(field.ids, answers, strict=True):
        if answer.stem is not None and answer.answer in ("found", "refused"):
            new[answer.stem + 1] = number
    rest = np.flatnonzero(new[1:] == 0) + 1
    new[rest] = int(field.ids.max()) + 1 + np.arange(len(rest))
    return new
