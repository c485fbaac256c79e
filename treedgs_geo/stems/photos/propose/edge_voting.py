"""Stems found without any dense cloud: edge pairs of many photos accumulated on a grid, in layers of height.

Each view's pair scores are turned into normal scores by their own rank (so no threshold on contrast), each into the
log likelihood ratio of "this view sees a stem here", and these are summed over views per layer. Layers are then added
along straight, possibly leaning, lines. How high a sum chance reaches is measured on decoys: the same views, each
shifted by a random offset, so that nothing agrees any more.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from scipy.ndimage import maximum_filter
from scipy.special import ndtri

from ....core.machine import FAST
from ....reconstruction.area import Area
from ..images.crops import GroundGrid, PhotoStack
from ..images.vertical_rectification import PlumbGrid, PlumbMap, make_map
from ..options import PhotoStemOptions
from ..tuned import (
    ABOVE_CHANCE,
    APART_M,
    DECOY_M,
    EDGE_CELL_M,
    LAYER_M,
    LEAN_COST,
    MIN_THRESHOLD,
    N_LAYERS,
    RIM_M,
    SEEN_MEAN_Z,
    SEEN_PRIOR,
    SIGN_WEIGHT,
    SINGLE_WEIGHT,
    UPRIGHT_MAX_DEG,
)

#: Of the histograms of scores.
N_BINS = 512
#: Width of a ring, m, and ratios of one photo that are kept at once: memory.
RING_M, RATIOS = 0.18, 4_000_000


@dataclass(frozen=True)
class Seed:
    """A possible stem: x, y at breast height; lx, ly lean (m/m); r radius; score in log likelihood units. sure: a stem
    stands here, whatever its fit says."""

    x: float
    y: float
    lx: float
    ly: float
    r: float
    score: float
    sure: bool = False


class Proposals(NamedTuple):
    """Places where stems may stand, clearest first."""

    #: In and near the area, :data:`.tuned.APART_M` apart.
    seeds: list[Seed]
    #: The same, half as far apart: limbs of low forks, twins.
    beside: list[Seed]
    #: Score that chance hardly reaches.
    threshold: float


#: No place at all.
NO_PROPOSALS = Proposals([], [], np.inf)


class _Rings(NamedTuple):
    """Distances from a camera: the first and the step, metres, and how many."""

    first_m: float
    step_m: float
    n: int


class _Tile(NamedTuple):
    """The grid that evidence is summed on. mask: (rows, columns) bool, cells that count; row 0 at ``y0``."""

    x0: float
    y0: float
    cell: float
    mask: np.ndarray


@njit(inline="always", **FAST)
def _ground(z, x0, y0, cell, x, y):
    rows, columns = z.shape
    u = min(max((x - x0) / cell, 0.0), columns - 1.001)
    v = min(max((y - y0) / cell, 0.0), rows - 1.001)
    i, j = int(v), int(u)
    a, b = v - i, u - j
    return (z[i, j] * (1 - a) + z[i + 1, j] * a) * (1 - b) + (z[i, j + 1] * (1 - a) + z[i + 1, j + 1] * a) * b


@njit(inline="always", **FAST)
def _look_along(plumb, d, heights, ground_grid, look):
    """The rows of the map that each height takes at one distance ``d`` from the camera: (heights, knots), -1 outside.
    Ground is looked up every 16th column."""
    azimuth0, step_a, nadir0, step_n, ridge, _, centre, _ = plumb
    gx0, gy0, gcell, gz = ground_grid
    n_rows, knots = ridge.shape[0], look.shape[1] + 1
    before = 0.0
    for m in range(knots):
        a = azimuth0 + m * 16 * step_a
        here = _ground(gz, gx0, gy0, gcell, centre[0] + d * np.cos(a), centre[1] + d * np.sin(a))
        if m > 0:
            for b in range(heights.size):
                nadir = np.arctan2(d, centre[2] - 0.5 * (before + here) - heights[b])
                row = int((nadir - nadir0) / step_n + 0.5)
                look[b, m - 1] = row if 0 <= row < n_rows else -1
        before = here


@njit(inline="always", **FAST)
def _add_pairs(plumb, look, d, radii, share, edge, score):
    """Pair scores of one height at a distance ``d``, times ``share``, onto ``score`` (radius, azimuth column).

    look: (knots,) its rows. edge: (4, columns) to work with."""
    step_a, ridge, unit = plumb.step_a, plumb.ridge, plumb.unit
    n_cols = score.shape[1]
    sign, single, zero = np.float32(SIGN_WEIGHT), np.float32(SINGLE_WEIGHT), np.float32(0.0)
    e, f0, f1, f2 = edge[0], edge[1], edge[2], edge[3]
    for m in range(look.size):
        row, first, last = look[m], m * 16, min(m * 16 + 16, n_cols)
        if row < 0:
            for j in range(first, last):
                e[j] = zero
                f0[j] = zero
                f1[j] = zero
                f2[j] = zero
        else:
            for j in range(first, last):
                value = ridge[row, j] * np.float32(1 / 255)
                e[j] = value
                value *= np.float32(1 / 127)
                f0[j] = value * unit[row, j, 0]
                f1[j] = value * unit[row, j, 1]
                f2[j] = value * unit[row, j, 2]
    for r in range(radii.size):
        half = int(np.arcsin(radii[r] / d) / step_a * 2 + 0.5)  # rounded to half columns
        left = half // 2
        n = n_cols - half
        if n <= 0:
            continue
        out = score[r, left : left + n]
        e1, e2 = e[:n], e[half : half + n]
        a1, a2 = f0[:n], f0[half : half + n]
        b1, b2 = f1[:n], f1[half : half + n]
        c1, c2 = f2[:n], f2[half : half + n]
        for j in range(n):
            dot = a1[j] * a2[j] + b1[j] * b2[j] + c1[j] * c2[j]
            out[j] += share * (e1[j] * e2[j] - sign * dot + single * (e1[j] + e2[j]))


@njit(inline="always", **FAST)
def _layer_bins(plumb, look, d, radii, edge, score, bins):
    """Pair scores of a layer at a distance ``d``, mean over its blocks, as histogram bins (radius, column).

    look: (blocks, knots) as for :func:`_add_pairs`. score: as large as ``bins``, to work with."""
    zero, top, scale = np.float32(0.0), np.float32(N_BINS - 1), np.float32(N_BINS / np.sqrt(2.2))
    score[:] = zero
    for b in range(len(look)):
        _add_pairs(plumb, look[b], d, radii, np.float32(1.0 / len(look)), edge, score)
    for r in range(len(score)):
        line, to = score[r], bins[r]
        for j in range(line.size):
            to[j] = np.uint16(min(np.sqrt(max(line[j], zero)) * scale, top))


@njit(parallel=True, **FAST)
def _count_scores(plumb, rings, heights, blocks, radii, ground_grid, step, counts):
    """Histograms of the pair scores, (part, layer, radius, bin), of every ``step``-th ring and every second column;
    parts are those of the rings, whatever the number of threads."""
    d0, dd, n_d = rings
    parts, n_cols = len(counts), plumb.ridge.shape[1]
    for part in prange(parts):
        look = np.empty((heights.size, n_cols // 16 + 1), np.int64)
        edge = np.empty((4, n_cols), np.float32)
        score = np.empty((radii.size, n_cols), np.float32)
        bins = np.empty((radii.size, n_cols), np.uint16)
        for k in range(part * step, n_d, parts * step):
            d = d0 + k * dd
            _look_along(plumb, d, heights, ground_grid, look)
            for layer in range(heights.size // blocks):
                _layer_bins(plumb, look[layer * blocks : (layer + 1) * blocks], d, radii, edge, score, bins)
                for r in range(radii.size):
                    for j in range(0, n_cols, 2):
                        counts[part, layer, r, bins[r, j]] += 1


@njit(parallel=True, **FAST)
def _ratios(plumb, rings, heights, blocks, radii, ground_grid, lut, out):
    """Log likelihood ratios on (distance, azimuth column, layer, radius): pair scores, mean over the blocks of a layer,
    looked up by their bin."""
    d0, dd, n_d = rings
    n_cols = plumb.ridge.shape[1]
    for k in prange(n_d):
        d = d0 + k * dd
        look = np.empty((heights.size, n_cols // 16 + 1), np.int64)
        edge = np.empty((4, n_cols), np.float32)
        score = np.empty((radii.size, n_cols), np.float32)
        bins = np.empty((radii.size, n_cols), np.uint16)
        _look_along(plumb, d, heights, ground_grid, look)
        for layer in range(heights.size // blocks):
            _layer_bins(plumb, look[layer * blocks : (layer + 1) * blocks], d, radii, edge, score, bins)
            values = lut[layer]
            for j in range(n_cols):
                to = out[k, j, layer]
                for r in range(radii.size):
                    to[r] = values[r, bins[r, j]]


@njit(parallel=True, **FAST)
def _accumulate(llr, plumb, rings, tile, shift_x, shift_y, total):
    """Add one photo's ratios, (rings, columns, layers, radii), to every cell of the tile in these rings that it shows,
    seen from a shifted camera; what it does not show it says nothing of. total: (rows, layers, columns, radii)."""
    azimuth0, step_a, centre = plumb.azimuth0, plumb.step_a, plumb.centre
    cx, cy, d0, dd = centre[0], centre[1], rings.first_m, rings.step_m
    x0, y0, cell, mask = tile
    n_y, n_x = mask.shape
    n_d, n_cols, n_layers, n_r = llr.shape
    for i in prange(n_y):
        for j in range(n_x):
            if not mask[i, j]:
                continue
            x = x0 + j * cell + shift_x - cx
            y = y0 + i * cell + shift_y - cy
            k = int(np.floor((np.sqrt(x * x + y * y) - d0) / dd + 0.5))
            if not 0 <= k < n_d:
                continue
            swing = np.arctan2(y, x) - azimuth0
            swing -= 2 * np.pi * np.floor((swing + 0.2) / (2 * np.pi))
            column = int(swing / step_a + 0.5)
            if 0 <= column < n_cols:
                for m in range(n_layers):
                    to, values = total[i, m, j], llr[k, column, m]
                    for r in range(n_r):
                        to[r] += values[r]


@njit(parallel=True, **FAST)
def _lines(layers, mask, leans, lever, cell, penalty, best, which_lean, which_r):
    """Best sum of layers along straight lines through every cell. layers: (Y, M, X, R)."""
    n_y, n_layers, n_x, n_r = layers.shape
    for i in prange(n_y):
        line = np.empty(n_x * n_r, np.float32)
        for k in range(leans.shape[0]):
            line[:] = -penalty * (leans[k, 0] ** 2 + leans[k, 1] ** 2)
            for m in range(n_layers):
                aside = int(np.round(leans[k, 0] * lever[m] / cell))
                a = i + int(np.round(leans[k, 1] * lever[m] / cell))
                first, last = max(0, -aside), min(n_x, n_x - aside)
                if a < 0 or a >= n_y or last <= first:
                    continue
                values = layers[a, m].reshape(-1)[(first + aside) * n_r : (last + aside) * n_r]
                to = line[first * n_r : last * n_r]
                for c in range(values.size):
                    to[c] += values[c]
            for j in range(n_x):
                if not mask[i, j]:
                    continue
                for r in range(n_r):
                    if line[j * n_r + r] > best[i, j]:
                        best[i, j] = line[j * n_r + r]
                        which_lean[i, j] = k
                        which_r[i, j] = r


def rank_lut(counts: np.ndarray) -> np.ndarray:
    """(..., N_BINS) histogram of scores -> (..., N_BINS) log likelihood ratio of each, by the rank of its middle."""
    cumulative = np.cumsum(counts, axis=-1)
    total = np.maximum(cumulative[..., -1:], 1)
    rank = (cumulative - 0.5 * counts) / total
    z = ndtri(np.clip(rank, 1e-6, 1 - 1e-6))
    z = np.clip(np.where(counts.sum(axis=-1, keepdims=True) > 0, z, 0.0), -4, 4.2)
    return np.log(1 - SEEN_PRIOR + SEEN_PRIOR * np.exp(SEEN_MEAN_Z * z - 0.5 * SEEN_MEAN_Z**2)).astype(np.float32)


def lean_grid(max_lean_deg: float, step: float = 0.04) -> np.ndarray:
    """(K, 2) leans in m/m on a hexagonal grid, upright first."""
    limit = np.tan(np.radians(max_lean_deg)) + 1e-9
    n = int(limit / step) + 2
    points = []
    for a in range(-n, n + 1):
        for b in range(-n, n + 1):
            point = np.array([a + 0.5 * b, b * np.sqrt(0.75)]) * step
            if np.hypot(*point) <= limit:
                points.append(point)
    grid = np.array(points)
    return grid[np.argsort(np.hypot(grid[:, 0], grid[:, 1]), kind="stable")]


def best_lines(
    layers: np.ndarray, mask: np.ndarray, leans: np.ndarray, lever: np.ndarray, cell: float, penalty: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Best sum of (M, rows, columns, R) layers along a line through every cell of ``mask``, which of the (K, 2) leans
    that is, and which of the R radii.

    lever: (M,) heights of the layers above breast height, m. penalty: of a lean, per (m/m)^2.
    """
    best = np.full(mask.shape, -np.inf, np.float32)
    lean, radius = np.zeros(best.shape, np.int64), np.zeros(best.shape, np.int64)
    by_row = np.ascontiguousarray(layers.transpose(1, 0, 2, 3))
    _lines(by_row, mask, leans, lever, cell, penalty, best, lean, radius)
    return best, lean, radius


def edge_seeds(
    stack: PhotoStack,
    ground: GroundGrid,
    plumbs: list[PlumbGrid],
    area: Area,
    box: tuple[float, float, float, float],
    options: PhotoStemOptions,
    rng: np.random.Generator,
) -> Proposals:
    """Seeds of a piece of ground. plumbs: one a photo. box: x0, y0, x1, y1 of the piece, m, local frame."""
    cell, x0, y0 = EDGE_CELL_M, box[0] - RIM_M, box[1] - RIM_M
    columns, rows = (int((box[k + 2] - box[k] + 2 * RIM_M) / cell) + 1 for k in (0, 1))
    gx, gy = np.meshgrid(x0 + cell * np.arange(columns), y0 + cell * np.arange(rows))
    mask = area.contains(np.column_stack([gx.ravel(), gy.ravel()]), options.margin_m + RIM_M).reshape(gx.shape)
    radii = np.arange(0.04, options.max_dbh_cm / 200 + 0.01, 0.025)
    maps = (make_map(stack, view, ground, plumb) for view, plumb in enumerate(plumbs))
    leans = lean_grid(min(options.max_lean_deg, UPRIGHT_MAX_DEG))
    lever = LAYER_M + (np.arange(N_LAYERS) + 0.5) * LAYER_M - options.bh_m

    def lines(layers: np.ndarray) -> tuple[np.ndarray, ...]:
        for layer, above_m in zip(layers, lever, strict=True):
            if above_m > 1.0:  # the stem may be one radius thinner there
                np.maximum(layer[..., 1:], layer[..., :-1].copy(), out=layer[..., 1:])
        return best_lines(layers, mask, leans, lever, cell, LEAN_COST)

    def peaks(found: tuple[np.ndarray, ...], apart_m: float) -> list[Seed]:
        """Local maxima, best first, at least half of ``apart_m`` apart along each axis."""
        best, lean, radius = found
        tops = np.argwhere((best >= maximum_filter(best, 2 * int(apart_m / cell / 2) + 1)) & np.isfinite(best))
        order = np.argsort(-best[tuple(tops.T)], kind="stable")[:400]
        seeds = []
        for i, j in tops[order]:
            (lx, ly), r = leans[lean[i, j]].tolist(), float(radii[radius[i, j]])
            seeds.append(Seed(x0 + j * cell, y0 + i * cell, lx, ly, r, float(best[i, j])))
        return seeds

    total, chance = _votes(maps, radii, ground, _Tile(x0, y0, cell, mask), rng)
    found = lines(total)
    seeds, half_as_far = (peaks(found, apart) for apart in (APART_M, APART_M / 2))
    decoys = peaks(lines(chance), APART_M)
    threshold = max(MIN_THRESHOLD, decoys[0].score + ABOVE_CHANCE if decoys else 0.0)
    near = area.contains(np.array([(seed.x, seed.y) for seed in seeds]).reshape(-1, 2), options.margin_m + 0.1)
    seeds = [seed for seed, keep in zip(seeds, near, strict=True) if keep]

    beside = [
        seed
        for seed in half_as_far
        if seed.score > threshold and not any(np.hypot(done.x - seed.x, done.y - seed.y) < 0.02 for done in seeds)
    ]
    return Proposals(seeds, beside, threshold)


def _votes(
    maps: Iterable[PlumbMap], radii: np.ndarray, ground: GroundGrid, tile: _Tile, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """The views' evidence, (layers, rows, columns, radii), and the same of views shifted at random (decoys). maps: of
    each view; each is read once, so that they need not all be in memory."""
    rows, columns = tile.mask.shape
    total, chance = (np.zeros((rows, N_LAYERS, columns, len(radii)), np.float32) for _ in range(2))
    heights = LAYER_M + (np.arange(2 * N_LAYERS) + 0.5) * LAYER_M / 2
    # Two blocks a layer; one ring in three is counted for the ranks of scores, in eight parts at once.
    for plumb in maps:
        (first, last), n_cols = plumb.distance.tolist(), plumb.ridge.shape[1]
        rings = _Rings(first, RING_M, int((last - first) / RING_M) + 2)
        counts = np.zeros((8, N_LAYERS, len(radii), N_BINS), np.int64)
        _count_scores(plumb, rings, heights, 2, radii, ground, 3, counts)
        lut = rank_lut(counts.sum(axis=0))
        angle, far = rng.uniform(0, 2 * np.pi), rng.uniform(*DECOY_M)
        at_once = max(RATIOS // (n_cols * N_LAYERS * len(radii)), 1)
        for k in range(0, rings.n, at_once):
            some = _Rings(first + k * RING_M, RING_M, min(at_once, rings.n - k))
            llr = np.empty((some.n, n_cols, N_LAYERS, len(radii)), np.float32)
            _ratios(plumb, some, heights, 2, radii, ground, lut, llr)
            where = llr, plumb, some, tile
            _accumulate(*where, 0.0, 0.0, total)
            _accumulate(*where, far * np.cos(angle), far * np.sin(angle), chance)
    return total.transpose(1, 0, 2, 3), chance.transpose(1, 0, 2, 3)
