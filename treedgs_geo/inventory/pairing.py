"""Which field tree is which measured tree: co-registration of a plot, then one-to-one pairs, by position alone.

A plot centre taken under canopy is metres off and a compass turns the whole plot, so nearest neighbours alone pair the
wrong trees (``docs/technician/pairing.md``). First the plot is moved and turned as a whole; where two placings explain
the trees almost equally well (planted rows repeat themselves), nothing is paired and the plot is left to a person.
Diameters are never looked at: the pairs are used to judge them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from .options import PairingOptions

#: Chance that a tree of the tally is among the measured ones, while a placing is sought. At 1/2 a missing partner is no
#: evidence against it; higher values placed more plots wrongly where half of the trees were missed.
_DETECTION = 0.5
_CELL_M = 0.25


@dataclass(frozen=True)
class Registration:
    """How a plot's field positions are moved: ``xy' = R(rotation) (xy - centre) + centre + offset``.

    offset_m: (2,) east, north. rotation_deg: clockwise positive, as bearings. sigma_m: residual per axis.
    ratio: score of the best placing over the next best. margin: their difference (log-likelihood).
    share: trees with a partner within 1 m, of the smaller of both sets. status: ``auto`` or ``check``; reason: why.
    """

    offset_m: np.ndarray
    rotation_deg: float
    sigma_m: float
    ratio: float
    margin: float
    share: float
    status: str
    reason: str = ""

    def apply(self, xy: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """(N, 2) field positions -> (N, 2) co-registered positions, same frame."""
        return move(np.asarray(xy, float) - centre, self.offset_m, self.rotation_deg) + centre


@dataclass(frozen=True)
class Pairs:
    """One-to-one pairs. index: (K, 2) int, field and measured. distance_m: (K,). margin: (K,) log-likelihood lost when
    the pair is forbidden and all trees are paired anew as well as possible: small means that another pairing is about
    as good."""

    index: np.ndarray
    distance_m: np.ndarray
    margin: np.ndarray


def move(xy: np.ndarray, offset_m: np.ndarray, rotation_deg: float) -> np.ndarray:
    """Turn (N, 2) about the origin clockwise and shift."""
    angle = np.radians(rotation_deg)
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(xy, float) @ np.array([[c, -s], [s, c]]) + offset_m


def fit_rigid(source: np.ndarray, target: np.ndarray, limit_deg: float = 180.0) -> tuple[np.ndarray, float]:
    """Least-squares ``(offset, rotation_deg)`` that moves (K, 2) ``source`` onto ``target``; one point: a shift."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    p, q = source - a, target - b
    turn = -np.degrees(np.arctan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())) if len(p) > 1 else 0.0
    turn = float(np.clip(turn, -limit_deg, limit_deg))
    return b - move(a[None], np.zeros(2), turn)[0], turn


def register(
    field_xy: np.ndarray, measured_xy: np.ndarray, options: PairingOptions, anchors: np.ndarray | None = None
) -> Registration:
    """Find how to move a plot's field trees onto the measured ones.

    field_xy: (N, 2), measured_xy: (M, 2), metres from the surveyed plot centre, float64. anchors: (K, 2) int pairs that
    a person confirmed; with two or more that agree within a metre the placing follows from them.
    """
    field_xy, measured_xy = np.asarray(field_xy, float).reshape(-1, 2), np.asarray(measured_xy, float).reshape(-1, 2)
    if anchors is not None and len(anchors) >= 2:
        source, target = field_xy[anchors[:, 0]], measured_xy[anchors[:, 1]]
        start = fit_rigid(source, target, options.rotation_deg)
        # One line drawn to a tree far away must not turn the whole plot: then the search decides as if there were none.
        if np.linalg.norm(move(source, *start) - target, axis=1).max() <= _ANCHOR_M:
            offset, turn = _polish(field_xy, measured_xy, *start, options, fixed=anchors)
            return confirmed(field_xy, measured_xy, offset, turn)
    if len(field_xy) < 3 or len(measured_xy) < 3:
        which = "field" if len(field_xy) < 3 else "measured"
        return _unplaced(f"fewer than 3 {which} trees")
    places = [_polish(field_xy, measured_xy, *place, options) for place in _candidates(field_xy, measured_xy, options)]
    if not places:
        return _unplaced("no measured tree within reach")
    best = -1
    for _ in range(3):
        sigma = _SIGMA_START if best < 0 else _spread(field_xy, measured_xy, *places[best])
        # Log-likelihood of each placing against "no tree has a partner", with the centre's error as a prior.
        costs = (_costs(move(field_xy, *place), measured_xy, sigma, options.gate_m) for place in places)
        priors = (float((place[0] ** 2).sum()) / (2 * _centre_sd(options) ** 2) for place in places)
        scores = np.array([-_solve(cost)[2] - prior for cost, prior in zip(costs, priors, strict=True)])
        best = int(np.argmax(scores))
    offset, turn = places[best]
    moved = move(field_xy, offset, turn)
    others = [
        scores[k]
        for k, place in enumerate(places)
        if np.sqrt(((move(field_xy, *place) - moved) ** 2).sum(axis=1).mean()) > 1.0
    ]
    second = max(max(others, default=0.0), 1.0)
    share = _share(moved, measured_xy)
    ratio, margin = float(scores[best] / second), float(scores[best] - second)
    reason = ""
    if scores[best] <= 0 or share < options.min_share:
        reason = f"only {share:.0%} of the trees find a partner within 1 m"
    elif ratio < options.min_ratio + _doubt(moved, measured_xy, sigma, options) or margin < _MIN_NATS:
        reason = f"another placing explains the trees almost as well (ratio {ratio:.2f})"
    elif np.hypot(*offset) > 3 * _centre_sd(options):
        reason = f"the best placing is {np.hypot(*offset):.1f} m off, beyond the search"
    elif at_limit(turn, options.rotation_deg):
        reason = f"it fits best at the largest turn searched ({turn:+.1f} degrees), so perhaps beyond it"
    return Registration(offset, turn, sigma, ratio, margin, share, "check" if reason else "auto", reason)


def at_limit(turn_deg: float, limit_deg: float) -> bool:
    """Whether a plot is turned by the most that is searched; never where no turn is."""
    return abs(turn_deg) >= 0.99 * limit_deg > 0


def assign(
    field_xy: np.ndarray, measured_xy: np.ndarray, sigma_m: float, gate_m: float, among: int | None = None
) -> Pairs:
    """One-to-one pairs that maximise the likelihood, with the choice to leave a tree single (a dummy partner).

    How likely a field tree was missed and how densely other stems stand is estimated from the pairs themselves, in
    three rounds: where nearly all trees have a partner, a lone pair half a metre apart is most likely the same tree.

    field_xy: (N, 2) co-registered, measured_xy: (M, 2). sigma_m: residual per axis. among: measured trees inside the
    plot (default: all of them).
    """
    field_xy, measured_xy = np.asarray(field_xy, float).reshape(-1, 2), np.asarray(measured_xy, float).reshape(-1, 2)
    among = len(measured_xy) if among is None else among
    found, single = _DETECTION, 1.0
    for _ in range(3):
        cost = _costs(field_xy, measured_xy, sigma_m, gate_m, found, single)
        rows, columns, total = _solve(cost)
        found = float(np.clip((len(rows) + 1) / (len(field_xy) + 2), 0.5, 0.95))
        single = float(np.clip((among - len(rows) + 1) / (among + 2), 0.1, 1.0))
    margin = np.empty(len(rows))
    for k, (i, j) in enumerate(zip(rows, columns, strict=True)):
        kept, cost[i, j] = cost[i, j], np.inf
        margin[k] = _solve(cost)[2] - total
        cost[i, j] = kept
    distance = np.linalg.norm(field_xy[rows] - measured_xy[columns], axis=1)
    return Pairs(np.column_stack([rows, columns]).astype(int).reshape(-1, 2), distance, margin)


_SIGMA_START = 0.35
_SIGMA_LIMITS = (0.12, 0.6)
_MIN_NATS = 6.0
_ANCHOR_M = 1.0
_MAP_ERROR_M = 0.3


def _costs(
    field_xy: np.ndarray,
    measured_xy: np.ndarray,
    sigma: float,
    gate_m: float,
    found: float = _DETECTION,
    single: float = 1.0,
) -> np.ndarray:
    """(N, M) negative log-likelihood ratio of "is this tree" against "stands there by chance"; inf beyond the gate.

    found: chance that a field tree was measured. single: share of the measured trees that are nobody's partner.
    """
    if not len(field_xy) or not len(measured_xy):
        return np.full((len(field_xy), len(measured_xy)), np.inf)
    distance = cdist(field_xy, measured_xy)
    square = distance**2 / (2 * sigma**2)
    # One tree in ten is placed worse by a factor of three: a misread bearing, a leaning stem.
    density = (0.9 * np.exp(-square) + 0.1 / 9 * np.exp(-square / 9)) / (2 * np.pi * sigma**2)
    chance = (1 - found) / found * single * _density(measured_xy)
    cost = -np.log(np.maximum(density / chance, 1e-12))
    return np.where((distance <= gate_m) & (cost < 0), cost, np.inf)


def _solve(cost: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Assignment with a free dummy for every row: rows, columns and the total cost of the real pairs."""
    if not np.isfinite(cost).any():
        return np.zeros(0, int), np.zeros(0, int), 0.0
    # Every real cost is below 0 and a dummy is 0, so that 0 in place of "impossible" is the dummy.
    wide = np.where(np.isfinite(cost), cost, 0.0)
    rows, columns = linear_sum_assignment(wide)
    real = np.isfinite(cost[rows, columns])
    return rows[real], columns[real], float(cost[rows[real], columns[real]].sum())


def _density(xy: np.ndarray) -> float:
    """Stems per m2 from the nearest neighbours' distances (unaffected by holes in the cover and by the outline)."""
    if len(xy) < 3:
        return 0.05
    second = cKDTree(xy).query(xy, k=3)[0][:, 2]
    return float(np.clip(2 / (np.pi * np.mean(second**2)), 0.002, 1.0))


def _candidates(
    field_xy: np.ndarray, measured_xy: np.ndarray, options: PairingOptions
) -> list[tuple[np.ndarray, float]]:
    """The thirty placings with the most votes: every (field, measured) pair votes for the shift that joins it."""
    reach = 3 * _centre_sd(options) + 1.0
    turns = _angles(field_xy, options.rotation_deg)
    size = int(np.ceil(2 * reach / _CELL_M))
    votes = np.zeros((len(turns), size, size))
    edges = -reach + _CELL_M * np.arange(size + 1)
    for k, turn in enumerate(turns):
        shifts = (measured_xy[None] - move(field_xy, np.zeros(2), turn)[:, None]).reshape(-1, 2)
        votes[k] = np.histogram2d(shifts[:, 0], shifts[:, 1], bins=[edges, edges])[0]
    votes = gaussian_filter(votes, (0, 0.42 / _CELL_M, 0.42 / _CELL_M), mode="constant")
    peaks = (votes == maximum_filter(votes, size=(3, 5, 5))) & (votes > 0)
    where = np.argwhere(peaks)
    where = where[np.argsort(-votes[peaks], kind="stable")][:30]
    return [((cell[1:] + 0.5) * _CELL_M - reach, float(turns[cell[0]])) for cell in where]


def _centre_sd(options: PairingOptions) -> float:
    """Standard error of a plot's offset, m: the centre's, and some decimetres of the measured map's own."""
    return float(np.hypot(options.centre_error_m, _MAP_ERROR_M))


def _angles(field_xy: np.ndarray, limit_deg: float) -> np.ndarray:
    """Angles to try: the outermost tree moves by at most about 0.4 m from one to the next."""
    radius = max(float(np.linalg.norm(field_xy, axis=1).max()), 1.0)
    count = int(np.ceil(limit_deg / np.degrees(0.4 / radius)))
    return np.linspace(-limit_deg, limit_deg, 2 * count + 1) if count else np.zeros(1)


def _polish(
    field_xy: np.ndarray,
    measured_xy: np.ndarray,
    offset: np.ndarray,
    turn: float,
    options: PairingOptions,
    fixed: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Iterated closest points, one-to-one, the gate closing from 1.5 to 0.7 m; ``fixed`` pairs always take part."""
    tree = cKDTree(measured_xy)
    for gate in (1.5, 1.5, 1.0, 1.0, 0.7, 0.7):
        distance, nearest = tree.query(move(field_xy, offset, turn))
        # One-to-one: of several field trees with the same nearest stem only the closest keeps it.
        order = np.lexsort((distance, nearest))
        first = np.r_[True, np.diff(nearest[order]) != 0]
        mine = order[first & (distance[order] <= gate)]
        source, target = field_xy[mine], measured_xy[nearest[mine]]
        if fixed is not None:
            source = np.vstack([source, np.repeat(field_xy[fixed[:, 0]], 3, axis=0)])
            target = np.vstack([target, np.repeat(measured_xy[fixed[:, 1]], 3, axis=0)])
        if len(source) < 3 and fixed is None:
            break
        offset, turn = fit_rigid(source, target, options.rotation_deg)
    return offset, turn


def _spread(field_xy: np.ndarray, measured_xy: np.ndarray, offset: np.ndarray, turn: float) -> float:
    """Residual per axis from the median distance of the trees with a partner within 1.2 m (Rayleigh)."""
    distance = cKDTree(measured_xy).query(move(field_xy, offset, turn))[0]
    near = distance[distance <= 1.2]
    if len(near) < 3:
        return _SIGMA_LIMITS[1]
    return float(np.clip(np.median(near) / 1.1774, *_SIGMA_LIMITS))


def _share(moved: np.ndarray, measured_xy: np.ndarray) -> float:
    """Trees with a one-to-one partner within 1 m, of the smaller of the field trees and the stems among them."""
    rows, columns = linear_sum_assignment(np.minimum(cdist(moved, measured_xy), 3.0))
    close = np.linalg.norm(moved[rows] - measured_xy[columns], axis=1) <= 1.0
    middle = moved.mean(axis=0)
    among = int((np.linalg.norm(measured_xy - middle, axis=1) <= np.linalg.norm(moved - middle, axis=1).max()).sum())
    return min(float(close.sum() / max(min(len(moved), among), 1)), 1.0)


def _doubt(moved: np.ndarray, measured_xy: np.ndarray, sigma: float, options: PairingOptions) -> float:
    """What is added to the ratio asked for where many field trees have no partner: 0 above 80 %, 0.36 at 50 %.

    In planted rows any shift by a whole spacing finds as many partners as chance leaves trees out; with half of them
    missing, that chance alone makes ratios up to 1.3.
    """
    rows = _solve(_costs(moved, measured_xy, sigma, options.gate_m))[0]
    return 1.2 * max(0.8 - len(rows) / len(moved), 0.0)


def confirmed(field_xy: np.ndarray, measured_xy: np.ndarray, offset_m: np.ndarray, rotation_deg: float) -> Registration:
    """The registration of a plot whose offset and rotation a person vouches for."""
    sigma = _spread(field_xy, measured_xy, offset_m, rotation_deg)
    share = _share(move(field_xy, offset_m, rotation_deg), measured_xy)
    return Registration(offset_m, rotation_deg, sigma, np.nan, np.nan, share, "ok")


def _unplaced(reason: str) -> Registration:
    return Registration(np.zeros(2), 0.0, _SIGMA_START, np.nan, np.nan, 0.0, "check", reason)
