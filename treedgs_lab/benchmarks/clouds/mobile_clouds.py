"""Clouds as hand-held laser scanners with SLAM make them, with known diameters: thick bark, double walls, stray points.

Each walk past the plot sees the side of a stem that faces it; the walks together see all of it. A walk is off by a
centimetre or two at each stem (drift: double walls), its points spread by the range noise. Mixed pixels lie inside the
rings and beside them, twigs grow from the stems, and saplings and shrubs stand between them. No code of the library is
used here, so that the truth does not depend on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BH_M = 1.37


@dataclass(frozen=True)
class MobileScan:
    """Settings. noise_m: sd of a point about the bark. drift_m: sd of a walk's place at a stem, each axis. bark: points
    on a stem of 20 cm between 0.2 and 6 m. ghosts: share of points inside a ring of those on it. walks: azimuths that
    the scanner passes in; each sees ``seen_deg`` of a stem."""

    stems: int = 29
    size_m: float = 15.0
    dbh_cm: tuple[float, float] = (11.0, 30.0)
    noise_m: float = 0.015
    drift_m: float = 0.010
    bark: int = 30_000
    ghosts: float = 0.02
    walks: int = 4
    seen_deg: float = 165.0
    twigs: int = 10
    shrubs: int = 25
    saplings: int = 12
    crowns: bool = True


@dataclass(frozen=True)
class MobileCloud:
    """xyz: (N, 3) metres in random order, so that the first points are a thinned cloud. trees: (S, 3) x, y at breast
    height, dbh_cm. saplings: (P, 2)."""

    xyz: np.ndarray
    trees: np.ndarray
    saplings: np.ndarray

    def thinned(self, share: float) -> np.ndarray:
        """(M, 3) a share of the points, the same ones each time."""
        return self.xyz[: int(len(self.xyz) * share)]


def ground(xy: np.ndarray) -> np.ndarray:
    """(N,) height of the ground."""
    return 100 + 0.06 * xy[:, 0] + 0.15 * np.sin(xy[:, 1] / 4)


def mobile_cloud(seed: int, scan: MobileScan | None = None) -> MobileCloud:
    """A seeded cloud; noise, drift and ghosts are the settings', twigs and undergrowth differ from stem to stem."""
    scan = scan or MobileScan()
    rng = np.random.default_rng(seed)
    places = _places(rng, scan.stems + scan.saplings, scan.size_m)
    dbh = rng.permutation(np.linspace(*scan.dbh_cm, scan.stems))
    count = int(scan.size_m**2 * scan.bark / 40)
    floor = rng.uniform(0, scan.size_m, (count, 2))
    parts = [np.column_stack([floor, ground(floor) + rng.normal(0, 0.02, count)])]
    trees = []
    for xy, size in zip(places[: scan.stems], dbh, strict=True):
        parts.append(stem(rng, xy, size, scan))
        parts += [_twig(rng, xy, size, scan) for _ in range(rng.poisson(scan.twigs))]
        trees.append([*xy, size])
        if scan.crowns:
            n = scan.bark // 10
            parts.append(_above(np.column_stack([rng.normal(xy, 0.9, (n, 2)), rng.uniform(8, 14, n)])))
    for xy in places[scan.stems :]:
        parts.append(_sapling(rng, xy, scan))
    parts += [_shrub(rng, rng.uniform(0, scan.size_m, 2), scan) for _ in range(scan.shrubs)]
    xyz = np.concatenate(parts)
    return MobileCloud(xyz[rng.permutation(len(xyz))], np.array(trees), places[scan.stems :])


def stem(rng: np.random.Generator, xy: np.ndarray, dbh_cm: float, scan: MobileScan, top_m: float = 8.0) -> np.ndarray:
    """(N, 3) bark, mixed pixels inside and beside it."""
    lean, turn = abs(rng.normal(0, 0.025)), rng.uniform(0, 2 * np.pi)
    slope = lean * np.array([np.cos(turn), np.sin(turn)])
    oval, oval_turn = abs(rng.normal(0, 0.02)), rng.uniform(0, np.pi)
    first = rng.uniform(0, 2 * np.pi)
    parts = []
    for walk in range(scan.walks):
        towards = first + 2 * np.pi * walk / scan.walks
        off = rng.normal(0, scan.drift_m, 2)
        # Denser where the walk came nearer; fewer points where the beam grazes the bark.
        n = int(scan.bark * (top_m - 0.1) / 5.8 * dbh_cm / 20 / scan.walks * np.exp(rng.normal(0, 0.3)))
        half = np.radians(scan.seen_deg / 2)
        away = np.arcsin(rng.uniform(-np.sin(min(half, np.pi / 2)), np.sin(min(half, np.pi / 2)), n))
        angle, h = towards + away, 0.1 + (top_m - 0.1) * rng.beta(1.0, 1.4, n)
        shape = 1 + oval * np.cos(2 * (angle - oval_turn))
        r = (dbh_cm - 0.9 * (h - BH_M)) / 200 * shape + rng.normal(0, scan.noise_m, n)
        ghost = rng.random(n) < scan.ghosts
        r[ghost] *= np.sqrt(rng.uniform(0, 1, ghost.sum()))
        beside = rng.random(n) < scan.ghosts
        r[beside] += rng.exponential(0.05, beside.sum())
        flat = np.column_stack([np.cos(angle), np.sin(angle)]) * r[:, None]
        parts.append(np.column_stack([flat + xy + off + (h - BH_M)[:, None] * slope, h]))
    return _above(np.concatenate(parts))


def _above(points: np.ndarray) -> np.ndarray:
    return points + np.column_stack([np.zeros((len(points), 2)), ground(points[:, :2])])


def _places(rng: np.random.Generator, count: int, size_m: float) -> np.ndarray:
    """(count, 2) at least 1.2 m apart."""
    places = np.empty((0, 2))
    while len(places) < count:
        place = rng.uniform(1.0, size_m - 1.0, 2)
        if not len(places) or np.hypot(*(places - place).T).min() > 1.2:
            places = np.vstack([places, place])
    return places


def _twig(rng: np.random.Generator, xy: np.ndarray, dbh_cm: float, scan: MobileScan) -> np.ndarray:
    """A dead branch: thin, from the bark outwards."""
    length, turn, rise = rng.uniform(0.1, 0.9), rng.uniform(0, 2 * np.pi), rng.uniform(-0.4, 0.6)
    n = int(scan.bark / 150 * length)
    along = rng.uniform(0, length, n)
    side = np.array([np.cos(turn), np.sin(turn)])
    points = np.column_stack([xy + side * (dbh_cm / 200 + along)[:, None], rng.uniform(0.7, 5.5) + rise * along])
    return _above(points + rng.normal(0, scan.noise_m, (n, 3)))


def _sapling(rng: np.random.Generator, xy: np.ndarray, scan: MobileScan) -> np.ndarray:
    """A whip of 1 to 3 cm with leaves."""
    n, top = scan.bark // 30, rng.uniform(1.0, 4.0)
    whip = np.column_stack([np.tile(xy, (n, 1)), rng.uniform(0.1, top, n)])
    whip += rng.normal(0, 1, (n, 3)) * (np.array([1, 1, 0]) * np.hypot(scan.noise_m, rng.uniform(0.005, 0.015)))
    leaves = np.column_stack([rng.normal(xy, 0.2, (2 * n, 2)), rng.uniform(0.3, top + 0.3, 2 * n)])
    return _above(np.concatenate([whip, leaves]))


def _shrub(rng: np.random.Generator, xy: np.ndarray, scan: MobileScan) -> np.ndarray:
    """Leaves in clumps up to a metre or two."""
    n = scan.bark // 15
    clumps = np.column_stack([rng.normal(xy, 0.35, (12, 2)), rng.uniform(0.2, rng.uniform(0.6, 2.0), 12)])
    points = clumps[rng.integers(0, 12, n)] + rng.normal(0, 0.12, (n, 3))
    return _above(points[points[:, 2] > 0])
