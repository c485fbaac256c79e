"""Scans, flight lines and walks that do not fit together: what each of them shows of a stem, brought onto one axis.

A pass is what the scanner saw of a stem without a pause: one scan, one flight line, one visit of a walk. Each may lie
some centimetres off the others: the shifts are fitted with the stem, and where the passes then agree clearly better,
the points are measured as moved. Where later passes see bark farther out in every direction, the stem has grown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit

from ....pointcloud.cloud import grouped
from ...geometry.cone import Cone
from ...geometry.cone_kernels import cholesky_solve
from ...geometry.section_kernels import SECTORS
from .track import FACED_DEG

#: A scanner that did not see a stem for so long, s, or whose angle is so far away, degrees, comes back in another pass.
PAUSE_S, APART_DEG = 2.0, 5.0
#: File order: a stem's points that lie farther apart in the file than this share of it are of two visits, each with at
#: least this share of the stem's points.
FILE_GAP, VISIT = 0.01, 0.02
#: Prior sd of a pass's shift, m, and of each wave (2 to 4 about the stem) of its section, share of the radius; unknowns
#: before the shifts.
SHIFT_SD_M, SECTION_SD = 0.03, 0.02
_FIRST = 12
#: Points within this of the bark are looked at, m; scales of the robust fit, m, from coarse to fine.
REACH_M, SCALES_M = 0.13, (0.08, 0.05, 0.03, 0.02, 0.015, 0.0, 0.0, 0.0)
#: A pass that shows one side has a mean direction this long or longer.
ONE_SIDED = 0.3
#: Heights (below, above breast height) that are looked at, m: the first with so many points.
WINDOWS_M, ENOUGH_POINTS = ((0.5, 0.6), (0.7, 1.0), (0.95, 2.8)), 500
#: Log likelihood that shifts have to gain for each pass, and passes that are told apart at most.
GAIN_A_PASS, MAX_PASSES = 5.0, 60
#: A pass with fewer points of a stem cannot be placed by it; what shows less of it could be an oval stem's side;
#: passes are moved where those that can be hold this share of the points, and the farthest lies this far off, m.
PASS_POINTS, PASS_ARC_DEG, PLACED_SHARE, OFF_M = 50, 240.0, 0.8, 0.005
#: What is seen without a longer pause anywhere in the cloud, s, may have moved as one: a scan, a flight line. Its shift
#: is what so many stems say; they agree within so much, m, or this share of the largest shift.
STILL_S, AGREEING, AGREE_M, AGREE_SHARE = 20.0, 3, 0.008, 0.15
#: Two dates are told apart in so many sectors or more that both show with so many points each; what their rings are
#: apart has to be so many standard errors, and so many times what is uneven about it.
DATE_SECTORS, DATE_POINTS, DATE_SE, DATE_EVEN = 16, 4, 5.0, 1.5


@dataclass(frozen=True)
class PassFit:
    """keys: (K,) of :meth:`Passes.keys`, one of each pass. shift: (K, 2), m. count: (K,) points. arc_deg: (K,) seen.
    gain: log likelihood over passes that fit together. se_cm: what the shifts leave unknown of the diameter.
    dates_cm: how far apart the diameters are that earlier and later passes show, 0 where they agree."""

    keys: np.ndarray
    shift: np.ndarray
    count: np.ndarray
    arc_deg: np.ndarray
    gain: float
    se_cm: float
    dates_cm: float

    @property
    def placed(self) -> np.ndarray:
        """(K,) bool: passes that this stem alone can place."""
        return (self.count >= PASS_POINTS) & (self.arc_deg >= PASS_ARC_DEG)

    @property
    def sure(self) -> bool:
        """The passes agree clearly better once each is moved."""
        placed = self.placed
        if placed.sum() < 2 or self.count[placed].sum() < PLACED_SHARE * self.count.sum():
            return False
        off = self.shift[placed] - np.average(self.shift[placed], axis=0, weights=self.count[placed])
        return bool(self.gain > GAIN_A_PASS * len(self.shift) and np.hypot(off[:, 0], off[:, 1]).max() > OFF_M)


class Passes:
    """Which pass each point of a cloud belongs to, by what the cloud has: times, point sources, angles, file order."""

    def __init__(self, attributes: Mapping[str, np.ndarray], count: int, stems: list[np.ndarray]) -> None:
        time = attributes.get("gps_time")
        self._time = time if time is not None and len(time) and np.ptp(time) > PAUSE_S else None
        self._source = attributes.get("point_source_id")
        self._angle = attributes.get("scan_angle", attributes.get("scan_angle_rank"))
        self._step_deg = 0.006 if "scan_angle" in attributes else 1.0
        self._cuts = file_cuts(stems, count)
        self._segments = np.empty(0)
        if self._time is not None and stems:
            seen = np.unique(np.asarray(self._time[np.concatenate(stems)], float))
            self._segments = seen[1:][np.diff(seen) > STILL_S]

    def keys(self, index: np.ndarray) -> np.ndarray:
        """(M,) what in the cloud each of the (M,) points was seen with, and may have moved with."""
        edges, at = (self._cuts, index) if self._time is None else (self._segments, self._time[index])
        key = np.searchsorted(edges, at, side="right").astype(np.int64, copy=False)
        if self._source is not None:
            key *= 65536
            key += self._source[index]
        return key

    def of(self, index: np.ndarray) -> np.ndarray:
        """(M,) pass of each of the (M,) points around one stem, from 0, in the order of time (or of the file)."""
        label, first = np.zeros(len(index), np.int64), index
        if self._source is not None:
            label = np.unique(self._source[index], return_inverse=True)[1].astype(np.int64)
        if self._time is not None:
            first = np.asarray(self._time[index], float)
            label = _split(label, first, PAUSE_S)
        if not label.any() and self._angle is not None:
            label = _split(label, self._step_deg * self._angle[index].astype(float), APART_DEG)
        if not label.any():
            label = np.searchsorted(self._cuts, index, side="right").astype(np.int64)
        if label.max(initial=0) >= MAX_PASSES:
            return np.zeros(len(index), np.int64)
        begin = np.full(label.max(initial=0) + 1, np.inf)
        np.minimum.at(begin, label, first)
        return np.unique(begin[label], return_inverse=True)[1].astype(np.int64)


def _split(label: np.ndarray, value: np.ndarray, gap: float) -> np.ndarray:
    """Labels divided where the values of a label leave a gap."""
    order = np.lexsort((value, label))
    new = (np.diff(label[order]) != 0) | (np.diff(value[order]) > gap)
    out = np.empty(len(label), np.int64)
    out[order] = np.r_[0, np.cumsum(new)] if len(label) else 0
    return out


def file_cuts(stems: list[np.ndarray], count: int) -> np.ndarray:
    """Places in a file of ``count`` points where one scan ends and the next begins: each stem is visited anew after
    them. stems: the point indices of each. Empty where the file is not a row of scans."""
    visits = []
    for number, index in enumerate(stems):
        index = np.sort(index)
        if len(index) < 20:
            continue
        ends = np.flatnonzero(np.diff(index) > FILE_GAP * count)
        for first, last in zip(np.r_[0, ends + 1], np.r_[ends, len(index) - 1], strict=True):
            if last - first < VISIT * len(index):
                continue  # strays
            visits.append((int(index[first]), int(index[last]), number))
    visits.sort()
    cuts: list[int] = []
    seen: set[int] = set()
    reach = -1
    for first, last, number in visits:
        if number in seen:
            if first <= reach:
                return np.empty(0, np.int64)
            cuts.append(first)
            seen = set()
        seen.add(number)
        reach = max(reach, last)
    several = len({number for _, _, number in visits}) > 1
    return np.array(cuts, np.int64) if several else np.empty(0, np.int64)


def fit_passes(
    points: np.ndarray,
    label: np.ndarray,
    key: np.ndarray,
    cone: Cone,
    bh_m: float,
    floor_m: float,
    towards: np.ndarray | None = None,
) -> PassFit:
    """The stem and the shift of each pass fitted to the (N, 3) points around a first ``cone``, near breast height or as
    far from it as points are needed.

    label, key: (N,) pass of each point, from 0, and its key. floor_m: least noise of a point. towards: (N,) complex,
    horizontal direction to the scanner, NaN where it is not known."""
    passes = int(label.max()) + 1
    keys = np.zeros(passes, np.int64)
    keys[label] = key
    near = np.abs(cone.residuals(points)) < REACH_M
    if towards is None:
        towards = np.full(len(points), np.nan, complex)
    points, label, towards = points[near], label[near], towards[near]
    for below, above in WINDOWS_M:
        inside = (points[:, 2] > bh_m - below) & (points[:, 2] < bh_m + above)
        if inside.sum() >= ENOUGH_POINTS:
            break
    points, label, towards = points[inside], label[inside], towards[inside]
    t = points[:, 2] - cone.h_ref
    sector = cone.sectors(points, SECTORS)
    seen = np.bincount(label * SECTORS + sector, minlength=passes * SECTORS).reshape(passes, SECTORS)
    count = seen.sum(axis=1)
    arc = 360.0 / SECTORS * (seen > 0.02 * count[:, None]).sum(axis=1)
    faced = _faced(cone.azimuths(points), label, passes, towards)
    points, label, t = points[faced], label[faced], t[faced]
    about = points[:, :2] - cone.centre(points[:, 2]), cone.radius(points[:, 2]), cone.r, t, label
    plain, *_ = _solve(*about, 0, floor_m)
    moved, state, variance = _solve(*about, passes, floor_m)
    shift, se_cm = state[_FIRST:].reshape(passes, 2), 200 * float(np.sqrt(variance))
    return PassFit(keys, shift, count, arc, plain - moved, se_cm, dates_apart_cm(points, label, cone))


def _faced(azimuth: np.ndarray, label: np.ndarray, passes: int, towards: np.ndarray) -> np.ndarray:
    """(N,) bool: not at the rim of what its pass sees, about the direction to the scanner or else the middle of what
    the pass shows. Shifts would follow the rim, which lies outside the bark (:mod:`.track`)."""
    turn = np.exp(1j * azimuth)
    total = np.bincount(label, turn.real, passes) + 1j * np.bincount(label, turn.imag, passes)
    one_sided = np.abs(total) > ONE_SIDED * np.maximum(np.bincount(label, minlength=passes), 1)
    known = np.isfinite(towards)
    off = np.abs(np.angle(turn * np.conj(np.where(known, towards, total[label]))))
    return ~(one_sided[label] | known) | (off < np.radians(FACED_DEG))


def common_shifts(fits: list[PassFit]) -> dict[int, np.ndarray]:
    """Shift (2,), m, of what moved as one, by key, that the stems agree on; empty where they do not, or nothing moved.

    Each stem tells only how the passes lie to one another: its own place is estimated with them."""
    rows = [
        (number, int(key), *shift, count)
        for number, fit in enumerate(fits)
        for key, shift, count in zip(fit.keys, fit.shift, fit.count, strict=True)
        if count >= 6
    ]
    if not rows:
        return {}
    table = np.array(rows, float)
    stem, (names, key) = table[:, 0].astype(int), np.unique(table[:, 1].astype(np.int64), return_inverse=True)
    shift, weight = table[:, 2:4], table[:, 4]
    (stems, of_stem), of_key = grouped(stem + 1), grouped(key + 1)[1]
    enough = np.array([len(np.unique(stem[part])) >= AGREEING for part in of_key])
    if enough.sum() < 2:
        return {}
    place, common = np.zeros((len(fits), 2)), np.zeros((len(names), 2))
    for _ in range(20):
        off = shift - place[stem]
        common = np.array([_middle(off[part], weight[part]) for part in of_key])
        common -= np.average(common, axis=0, weights=np.bincount(key, weight))
        off = shift - common[key]
        place[stems - 1] = [_middle(off[part], weight[part]) for part in of_stem]
    # The pass that shows most of a stem has placed it: the others say whether they agree.
    heaviest = np.zeros(len(stem), bool)
    heaviest[[part[np.argmax(weight[part])] for part in of_stem]] = True
    off = np.hypot(*(shift - place[stem] - common[key])[enough[key] & ~heaviest].T)
    far = float(np.hypot(*common[enough].T).max())
    if far < OFF_M or not len(off) or np.median(off) > max(AGREE_M, AGREE_SHARE * far):
        return {}
    return {int(names[k]): common[k] for k in np.flatnonzero(enough)}


def _middle(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(C,) weighted medians of (N, C) values."""
    order = np.argsort(values, axis=0)
    total = np.cumsum(weight[order], axis=0)
    at = np.argmax(total >= 0.5 * total[-1], axis=0)
    return np.take_along_axis(values, np.take_along_axis(order, at[None], axis=0), axis=0)[0]


def dates_apart_cm(points: np.ndarray, label: np.ndarray, cone: Cone) -> float:
    """How much thicker or thinner passes before and after some moment show the stem, cm; 0 where they do not.

    Compared sector by sector: an oval stem, a scan from one side and a shift of a scan to one side are no growth."""
    e, sector = cone.residuals(points), cone.sectors(points, SECTORS)
    middle = (np.arange(SECTORS) + 0.5) / SECTORS * 2 * np.pi - np.pi
    best, apart_cm = DATE_SE, 0.0
    for cut in range(1, int(label.max(initial=0)) + 1):
        sides = [_by_sector(e[side], sector[side]) for side in (label < cut, label >= cut)]
        both = np.minimum(sides[0][0], sides[1][0]) >= DATE_POINTS
        if both.sum() < DATE_SECTORS:
            continue
        gap = sides[1][1][both] - sides[0][1][both]
        weight = 1 / (sides[0][2][both] + sides[1][2][both])
        design = np.column_stack([np.ones(both.sum()), np.cos(middle[both]), np.sin(middle[both])])
        inverse = np.linalg.inv((design * weight[:, None]).T @ design)
        change = inverse @ ((design * weight[:, None]).T @ gap)
        uneven = float(np.sqrt(np.mean((gap - design @ change) ** 2)))
        surely = abs(change[0]) / np.sqrt(inverse[0, 0])
        if surely > best and abs(change[0]) > DATE_EVEN * uneven:
            best, apart_cm = surely, 200 * abs(float(change[0]))
    return apart_cm


def _by_sector(e: np.ndarray, sector: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(SECTORS,) points, mean distances from the bark and squares of their errors."""
    count = np.bincount(sector, minlength=SECTORS)
    mean = np.bincount(sector, e, SECTORS) / np.maximum(count, 1)
    square = np.bincount(sector, (e - mean[sector]) ** 2, SECTORS) / np.maximum(count - 1, 1)
    return count, mean, np.maximum(square, 1e-6) / np.maximum(count, 1)


@njit(cache=True, nogil=True)
def _solve(flat, radius, r, t, label, passes, floor_m):  # pragma: no cover - compiled
    """Minus log likelihood (own spread), changes (x, y, lean, lean, radius, taper, section, shifts of ``passes``),
    variance of the radius, of (N, 2) points about a cone's axis, at (N,) ``t`` above the height where its radius is
    ``r``; its radius at each (N,), their passes (N,). passes: 0 = none is moved.

    The section is free to be no circle: what one pass shows is then its own, and only where two passes show one side
    at different distances do they not fit together."""
    n = len(t)
    state, sd = np.zeros(_FIRST + 2 * passes), np.full(_FIRST + 2 * passes, SHIFT_SD_M)
    sd[:6] = np.array([1.0, 1.0, 0.05, 0.05, 1.0, 0.002])
    sd[6:_FIRST] = SECTION_SD * r
    e, basis = np.empty(n), np.ones((n, _FIRST))
    step, normal = np.zeros(len(state)), np.eye(len(state))
    spread = 0.02
    for scale in SCALES_M:
        for m in range(n):
            x, y = flat[m, 0] - state[0] - state[2] * t[m], flat[m, 1] - state[1] - state[3] * t[m]
            if passes:
                x, y = x - state[_FIRST + 2 * label[m]], y - state[_FIRST + 1 + 2 * label[m]]
            away = max(np.hypot(x, y), 1e-6)
            turn = complex(x, y) / away
            row = basis[m]
            row[0], row[1], row[2], row[3], row[5] = turn.real, turn.imag, turn.real * t[m], turn.imag * t[m], t[m]
            wave = turn
            for k in range(6, _FIRST, 2):
                wave *= turn
                row[k], row[k + 1] = wave.real, wave.imag
            e[m] = away - radius[m]
            for k in range(4, _FIRST):
                e[m] -= row[k] * state[k]
        limit = scale if scale > 0 else max(3 * spread, 2 * floor_m)
        near = np.abs(e)
        near = near[near < 2.5 * limit]
        spread = max(1.4826 * np.median(near), floor_m) if len(near) else floor_m
        normal, right = np.diag(1 / sd**2), -state / sd**2
        for m in range(n):
            weight = 1 / (1 + (e[m] / limit) ** 2) ** 2 / spread**2
            c, s, k = basis[m, 0], basis[m, 1], _FIRST + 2 * label[m]
            for a in range(_FIRST):
                w = weight * basis[m, a]
                right[a] += w * e[m]
                for b in range(a + 1):
                    normal[a, b] += w * basis[m, b]
                if passes:
                    normal[k, a] += w * c
                    normal[k + 1, a] += w * s
            if passes:
                right[k] += weight * c * e[m]
                right[k + 1] += weight * s * e[m]
                normal[k, k] += weight * c * c
                normal[k + 1, k] += weight * c * s
                normal[k + 1, k + 1] += weight * s * s
        cholesky_solve(normal.copy(), right, step)
        state += step
    # A t distribution's likelihood: what lies off every bark costs the same everywhere.
    cost = n * np.log(spread) + 0.5 * np.sum((state[6:] / sd[6:]) ** 2)
    for m in range(n):
        cost += 1.5 * np.log1p((e[m] / spread) ** 2 / 2)
    alone = np.zeros(len(state))
    alone[4] = 1.0
    cholesky_solve(normal, alone, step)
    return cost, state, step[4]
