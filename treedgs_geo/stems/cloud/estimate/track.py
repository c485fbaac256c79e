"""Where a scanner was, by the beams of its own returns, and so which side of a stem each point shows.

Two returns of one pulse lie on one beam; the beams of half a second meet where the scanner was (Gatziolis and McGaughey
2019; ``track_sensor`` of lidR, Roussel and others 2020). At the rim of what a pass sees of a stem, half of a beam
passes it: what that returns lies up to half a footprint outside the bark, never inside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ....pointcloud.cloud import evenly, slices
from ...geometry.cone import Cone

#: Time in which a scanner hardly moves, s; returns of a pulse that far apart tell its direction, m.
STEP_S, APART_M = 0.5, 1.5
#: Beams that settle a position; spread of their directions (square of the sine) below which they do not; a beam that
#: passes it by more, m, is of another place.
BEAMS, SPREAD, PAST_M = 10, 1e-4, 1.0
#: Points that are asked where the scanner was, at most: those of so many pulses.
MAX_POINTS = 1_000_000
#: Points farther than this to the side of what faces the scanner are at the rim, degrees; distance to the bark, m.
FACED_DEG, RIM_M = 60.0, 0.06


@dataclass(frozen=True)
class SensorTrack:
    """time: (K,) ascending, s. place: (K, 3) of the scanner, in the cloud's frame. xyz: (N, 3), seen: (N,) s, of the
    cloud's points."""

    time: np.ndarray
    place: np.ndarray
    xyz: np.ndarray
    seen: np.ndarray

    @classmethod
    def of(cls, xyz: np.ndarray, attributes: Mapping[str, np.ndarray]) -> SensorTrack | None:
        """Of (N, 3) points; ``None`` without times, or without enough pulses of two returns."""
        if "gps_time" not in attributes:
            return None
        whole = xyz, np.asarray(attributes["gps_time"], float)
        some = np.zeros(len(xyz), bool)
        for part in slices(len(xyz)):
            some[part] = evenly(whole[1][part].view(np.uint64)) < MAX_POINTS / len(xyz)
        xyz, when = xyz[some], whole[1][some]
        if "return_number" in attributes:
            first, last = _pulses(when, np.asarray(attributes["return_number"])[some])
        else:
            # What has one time is one pulse: its highest and its lowest return.
            order = np.lexsort((-xyz[:, 2], when))
            starts = np.flatnonzero(np.r_[True, np.diff(when[order]) > 0])
            first, last = order[starts], order[np.r_[starts[1:], len(order)] - 1]
            first, last = first[first != last], last[first != last]
        if len(first) < BEAMS:
            return None
        way = xyz[first] - xyz[last]
        length = np.linalg.norm(way, axis=1)
        far = (length > APART_M) & (way[:, 2] > 0.5 * length)
        first, way = first[far], way[far] / length[far, None]
        if len(first) < BEAMS:
            return None
        step = np.unique(np.floor(when[first] / STEP_S), return_inverse=True)[1]
        here, time = xyz[first] - xyz[first[0]], when[first]
        place, held = _meeting(here, way, step, np.ones(len(first), bool))
        off = here - place[step]
        near = np.linalg.norm(off - (off * way).sum(axis=1)[:, None] * way, axis=1) < PAST_M
        place, held = _meeting(here, way, step, near)
        # Beams that do not meet are no beams: several pulses had one time.
        count = np.bincount(step[near], minlength=len(held))
        held &= count > 0.5 * np.bincount(step)
        middle = np.bincount(step[near], time[near], len(held)) / np.maximum(count, 1)
        return cls(middle[held], place[held] + xyz[first[0]], *whole) if held.any() else None

    def at(self, time: np.ndarray) -> np.ndarray:
        """(M, 3) places of the scanner at (M,) times: between two known ones, or the nearer where they lie apart."""
        after = np.clip(np.searchsorted(self.time, time), min(1, len(self.time) - 1), len(self.time) - 1)
        before = np.maximum(after - 1, 0)
        gap = self.time[after] - self.time[before]
        share = np.clip((time - self.time[before]) / np.maximum(gap, 1e-9), 0.0, 1.0)
        share = np.where(gap > 4 * STEP_S, np.round(share), share)[:, None]
        return self.place[before] * (1 - share) + self.place[after] * share

    def towards(self, index: np.ndarray) -> np.ndarray:
        """(M,) complex: horizontal direction (east + 1j north) from the points of ``index`` (M,) to the scanner, NaN
        where it is not known."""
        time = self.seen[index]
        after = np.searchsorted(self.time, time)
        nearest = np.abs(time - self.time[np.clip([after - 1, after], 0, len(self.time) - 1)]).min(axis=0)
        way = (self.at(time) - self.xyz[index])[:, :2] @ [1, 1j]
        return np.where(nearest < 2 * STEP_S, way / np.abs(way), np.nan)

    def at_rim(self, points: np.ndarray, cone: Cone, index: np.ndarray) -> np.ndarray:
        """(M,) bool: bark at the rim of what its beam sees. points: (M, 3) about ``cone``, those of ``index`` (M,)."""
        off = np.abs(np.angle(np.exp(1j * cone.azimuths(points)) * np.conj(self.towards(index))))
        return (off > np.radians(FACED_DEG)) & (np.abs(cone.residuals(points)) < RIM_M)


def _pulses(when: np.ndarray, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(P,) (P,) points that are the first and the second return of one pulse, by time: neighbours in the file where
    several pulses have one time. when: (N,) s, number: (N,)."""
    order = np.flatnonzero((number == 1) | (number == 2))
    order = order[np.argsort(when[order], kind="stable")]
    first, last = order[:-1], order[1:]
    pair = (when[first] == when[last]) & (number[first] == 1) & (number[last] == 2)
    return first[pair], last[pair]


def _meeting(here: np.ndarray, way: np.ndarray, step: np.ndarray, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) points nearest to the beams of each step, and (K,) bool where they are known. used: (N,) bool, of the
    beams from (N, 3) ``here`` along ``way``."""
    steps = int(step.max()) + 1
    total, pull = np.zeros((steps, 3, 3)), np.zeros((steps, 3))
    along, step = way[used], step[used]
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    right = np.einsum("nij,nj->ni", across, here[used])
    count = np.bincount(step, minlength=steps)
    for i in range(3):
        pull[:, i] = np.bincount(step, right[:, i], steps)
        for j in range(3):
            total[:, i, j] = np.bincount(step, across[:, i, j], steps)
    held = (count >= BEAMS) & (np.linalg.eigvalsh(total)[:, 0] > SPREAD * np.maximum(count, 1))
    total[~held] = np.eye(3)
    return np.linalg.solve(total, pull[:, :, None])[:, :, 0], held
