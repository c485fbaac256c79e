"""Which of several explanations of a place is the stem, and how probable that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...quality.priors import TAPER_SD, USUAL_TAPER
from ..tuned import EDGES_A_LOG_ODD, LEAD_LLR, NETWORK_ODDS, PLAIN_ODDS, SAME_DBH_CM
from .edge_adjustment import FineFit
from .search import Hypothesis, Prior

#: Explanations this far below the clearest edges (log likelihood units) are none, unless one holds the other. The
#: largest difference that was right on 93 stems: 29.
FAR_BELOW = 2 * LEAD_LLR


@dataclass(frozen=True)
class Explanation:
    """One way to explain a place: edge score, silhouette contrast, where the search and the fit put the stem.

    z: (V,) how clearly each photo sees it. evidence, rms_px: sub-pixel evidence and edge residual over the photos that
    see a stem here under any explanation: each is judged by the same photos, also by those that speak against it.
    """

    edges: float
    contrast: float
    hypothesis: Hypothesis
    fine: FineFit
    vector: np.ndarray
    z: np.ndarray
    evidence: float = 0.0
    rms_px: float = 0.5


@dataclass(frozen=True)
class Selected:
    """The explanation taken, and what was left of the others.

    best: of those tried. sure: how probable its diameter is among all that were tried. rivals: the explanations of this
    very stem (not of a neighbour), ``best`` first; share: (N,) their probabilities, of sum 1.
    """

    best: Explanation
    sure: float
    rivals: tuple[Explanation, ...]
    share: np.ndarray


def log_odds(tried: list[Explanation], trust: float, chance: float, stand: Prior, network: bool = False) -> np.ndarray:
    """(N,) how well each explanation is supported by witnesses that fail in different ways, and by the stand.

    Edges alone mistake the lit half of a stem for the stem, silhouettes alone a bush beside it for a part of it.
    trust: 0..1, how much the silhouettes say here. chance: contrast that places without a stem reach. stand: its
    stems' radii. network: the silhouettes are also those of the network (:mod:`.network.silhouettes`).
    """
    odds = witnesses(tried, trust, chance) @ (NETWORK_ODDS if network else PLAIN_ODDS)
    return odds + stand.log_density(np.array([item.fine.r0 for item in tried]))


def witnesses(tried: list[Explanation], trust: float, chance: float) -> np.ndarray:
    """(N, 4) silhouette contrast, sub-pixel evidence, taper, raggedness."""
    return np.array(
        [
            [
                trust * item.contrast / chance,
                item.evidence / 300,
                min(((item.fine.r1 - USUAL_TAPER) / (2 * TAPER_SD)) ** 2, 9.0),
                10 * (item.rms_px - 0.5),
            ]
            for item in tried
        ]
    )


def choose(
    tried: list[Explanation], trust: float, chance: float, stand: Prior, sun: np.ndarray, network: bool = False
) -> Selected:
    """Which of the explanations of a place is the stem. trust, chance, stand, network: as for :func:`log_odds`. sun:
    (flights,) azimuth, rad from east, NaN = unknown."""
    tried = plausible(tried)
    # Where no silhouettes are to be had, finer edges and taper are the other witnesses.
    solid = trust > 0.5 or not np.isfinite(chance)
    if solid:
        odds = log_odds(tried, trust, chance, stand, network)
        best = tried[int(np.argmax(odds))]
    else:
        odds = np.array([item.edges for item in tried]) / EDGES_A_LOG_ODD
        best = prefer_whole(sorted(tried, key=lambda item: -item.edges), sun)
    weight = np.exp(odds - odds.max())
    # By edges alone a part of the chosen stem is no rival of the whole.
    same = [
        abs(item.fine.r0 - best.fine.r0) < SAME_DBH_CM / 200 or (not solid and contains(best.vector, item.vector))
        for item in tried
    ]
    listed = [i for i, item in enumerate(tried) if item is best or different(item.vector, best.vector)]
    listed.sort(key=lambda i: tried[i] is not best)
    share = weight[listed] / weight[listed].sum()
    return Selected(best, float(weight[same].sum() / weight.sum()), tuple(tried[i] for i in listed), share)


def plausible(tried: list[Explanation]) -> list[Explanation]:
    """Without those far below the clearest edges that neither hold it nor are part of it: between two limbs of a fork a
    third stem would have the best silhouette."""
    top = max(tried, key=lambda item: item.edges)
    return [
        item
        for item in tried
        if item.edges > top.edges - FAR_BELOW or contains(item.vector, top.vector) or contains(top.vector, item.vector)
    ]


def different(a: np.ndarray, b: np.ndarray) -> bool:
    """Two refined explanations of one place that would give different diameters; a neighbour is no rival."""
    distance = float(np.hypot(a[0] - b[0], a[1] - b[1]))
    if distance > max(a[4], b[4]) + 0.3 * min(a[4], b[4]):
        return False
    return distance > 0.03 or abs(a[4] - b[4]) > 0.0125


def contains(a: np.ndarray, b: np.ndarray) -> bool:
    """Disc a holds disc b (within 2 cm) and is clearly larger."""
    return a[4] > b[4] + 0.012 and np.hypot(a[0] - b[0], a[1] - b[1]) + b[4] < a[4] + 0.02


def prefer_whole(tried: list[Explanation], sun: np.ndarray) -> Explanation:
    """The best explanation by its edges, or a larger one that holds it and explains nearly as much (the shaded part of
    a stem is no stem); less is enough where the larger one grows towards the sun."""
    best = tried[0]
    for item in tried[1:]:
        if not contains(item.vector, best.vector):
            continue
        grown = np.arctan2(item.vector[1] - best.vector[1], item.vector[0] - best.vector[0])
        sunward = np.isfinite(sun).any() and np.nanmax(np.cos(grown - sun)) > 0.6
        if item.edges > (0.6 if sunward else 0.8) * best.edges:
            best = item
    return best
