"""The stand as the planner sees it: where trees stand, their crowns and leaves about each plot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree
from shapely import contains_xy
from shapely.geometry.base import BaseGeometry

#: Naturally grown trees stand no nearer to each other than this, m, or than this share of their mean distance.
MIN_DISTANCE_M, MIN_SHARE = 1.2, 0.45
#: Spread of the logarithm of natural density from place to place, and the size of those places, m.
CLUSTER_SPREAD, CLUSTER_M = 0.5, 6.0


def least_distance(stems_per_ha: float) -> float:
    """The least distance between naturally grown trees, m."""
    return min(MIN_DISTANCE_M, MIN_SHARE * 100 / np.sqrt(stems_per_ha))


def natural(rng: np.random.Generator, stems_per_ha: float, stand_radius_m: float) -> np.ndarray:
    """(N, 2) trees at random, none nearer to another than :func:`least_distance`, denser in some places than others:
    trees that are drawn one after the other are kept where there is room."""
    wanted = round(stems_per_ha / 1e4 * np.pi * stand_radius_m**2)
    cells = int(2 * stand_radius_m) + 2
    dense = gaussian_filter(rng.standard_normal((cells, cells)), CLUSTER_M / 2, mode="wrap")
    dense = np.exp(CLUSTER_SPREAD * dense / dense.std())
    tries = rng.uniform(-stand_radius_m, stand_radius_m, (20 * wanted + 200, 2))
    odds = map_coordinates(dense, (tries + stand_radius_m).T, order=1, mode="nearest") / dense.max()
    tries = tries[(rng.random(len(tries)) < odds) & (np.hypot(*tries.T) < stand_radius_m)]
    least = least_distance(stems_per_ha)
    # Of two that are too near the one drawn later goes, unless what it was too near to has gone before.
    near = cKDTree(tries).query_ball_point(tries, least)
    kept = np.zeros(len(tries), bool)
    count = 0
    for k, others in enumerate(near):
        if count == wanted:
            break
        kept[k] = not kept[others].any()
        count += int(kept[k])
    return tries[kept]


#: Crowns up to this far outside a plot can hide its stems, m.
REACH_M = 30.0
#: Side of a cell of the leaf grid, m.
CELL_M = 0.5
#: Leaf area of a tree goes with this power of its DBH, crown reach is ``a + b DBH`` (m): the curves of the simulator's
#: pines (``treedgs_lab/simulate``: ``vegetation.py``, ``crown`` of ``foliage.py``).
LEAF_POWER, CROWN_REACH = 1.6, (1.0, 4.0)
#: A leaf's mean shadow over its area, leaves facing anywhere (Ross 1981).
LEAF_SHADOW = 0.5


@dataclass(frozen=True)
class StandNumbers:
    """A stand in numbers. leaf_area_index: one-sided leaf area over ground area. crown_radius_m: of the tree of mean
    DBH, 0 = as that of the simulator's pines (:data:`CROWN_REACH`)."""

    stems_per_ha: float
    dbh_mean_cm: float
    dbh_sd_cm: float
    height_m: float
    crown_base_m: float
    leaf_area_index: float
    crown_radius_m: float = 0.0

    def crown_m(self, dbh_m: np.ndarray) -> np.ndarray:
        """Largest reach of the crowns of trees of these DBHs, m."""
        reach = CROWN_REACH[0] + CROWN_REACH[1] * np.asarray(dbh_m, float)
        usual = CROWN_REACH[0] + CROWN_REACH[1] * self.dbh_mean_cm / 100
        return reach * (self.crown_radius_m / usual if self.crown_radius_m else 1.0)


@dataclass(frozen=True)
class Trees:
    """Trees of a stand. xy: (N, 2) planning frame, m. The others (N,): dbh_m, height_m, crown_base_m, crown_m
    (largest reach), leaf_m2. known: (N,) bool, a mapped tree (the others are drawn in, where nobody mapped any)."""

    xy: np.ndarray
    dbh_m: np.ndarray
    height_m: np.ndarray
    crown_base_m: np.ndarray
    crown_m: np.ndarray
    leaf_m2: np.ndarray
    known: np.ndarray

    def __len__(self) -> int:
        return len(self.xy)

    def take(self, index: np.ndarray) -> Trees:
        """Some of them."""
        return Trees(*(values[index] for values in vars(self).values()))


def dressed_trees(
    xy: np.ndarray, dbh_m: np.ndarray, numbers: StandNumbers, height_m: np.ndarray | None = None, known: bool = True
) -> Trees:
    """Trees with the heights, crown bases and leaves that the stand's numbers give them.

    height_m: (N,) where measured, NaN elsewhere. Heights go with the square root of the DBH about the stand's.
    """
    dbh_m = np.asarray(dbh_m, float)
    share = np.maximum(dbh_m, 0.02) * 100 / numbers.dbh_mean_cm
    guess = 1.3 + (numbers.height_m - 1.3) * np.clip(np.sqrt(share), 0.4, 1.3)
    height = guess if height_m is None else np.where(np.isfinite(height_m), height_m, guess)
    base = np.minimum(numbers.crown_base_m * height / numbers.height_m, 0.9 * height)
    spread = 1 + (numbers.dbh_sd_cm / numbers.dbh_mean_cm) ** 2 * LEAF_POWER * (LEAF_POWER - 1) / 2
    leaf = numbers.leaf_area_index * 1e4 / numbers.stems_per_ha * share**LEAF_POWER / spread
    xy, mapped = np.asarray(xy, float).reshape(-1, 2), np.full(len(dbh_m), known)
    return Trees(xy, dbh_m, height, base, numbers.crown_m(dbh_m), leaf, mapped)


def drawn_stand(rng: np.random.Generator, numbers: StandNumbers, reach_m: float) -> Trees:
    """A stand of these numbers within ``reach_m`` of the origin: natural spacing, normal diameters."""
    xy = natural(rng, numbers.stems_per_ha, reach_m)
    dbh = rng.normal(numbers.dbh_mean_cm, numbers.dbh_sd_cm, len(xy))
    return dressed_trees(xy, np.maximum(dbh, 0.25 * numbers.dbh_mean_cm) / 100, numbers, known=False)


def about_plot(
    rng: np.random.Generator, mapped: Trees | None, numbers: StandNumbers, centre: np.ndarray, radius_m: float,
    mapped_area: BaseGeometry | None = None,
) -> Trees:  # fmt: skip
    """Trees about one plot, relative to its centre: the mapped ones, and drawn ones where nobody mapped any.

    mapped_area: ground on which all trees are mapped, planning frame; ``None`` = the plot's circle out to its farthest
    mapped tree.
    """
    reach = radius_m + REACH_M
    drawn = drawn_stand(rng, numbers, reach)
    if mapped is None:
        return drawn
    away = mapped.xy - centre
    near = np.hypot(*away.T) < reach
    if not near.any():
        return drawn
    own = replace(mapped.take(near), xy=away[near])
    if mapped_area is None:
        outside = np.hypot(*drawn.xy.T) > max(radius_m, float(np.hypot(*own.xy.T).max()))
    else:
        outside = ~contains_xy(mapped_area, *(drawn.xy + centre).T)
    beside = drawn.take(outside)
    return Trees(*map(np.concatenate, zip(vars(own).values(), vars(beside).values(), strict=True)))


@dataclass(frozen=True)
class Scene:
    """What stands about one plot. low: (3,) corner of the leaf grid, metres from the plot's centre on its ground.
    leaves: (nx, ny, nz) float32 optical depth of leaves a metre of ray. stems: (N, 4) x, y, radius at breast height,
    height. ground: (nx, ny) float32 height of the ground over that at the centre."""

    low: np.ndarray
    leaves: np.ndarray
    stems: np.ndarray
    ground: np.ndarray


def crown_profile(share: np.ndarray) -> np.ndarray:
    """Reach of a crown over its largest, at shares of its length from the base up (a conifer's)."""
    share = np.asarray(share, float)
    inside = (share >= 0) & (share <= 1)
    wide = np.minimum(1.0, 0.55 + 2.2 * share) * np.maximum(1.02 - share, 0) ** 0.75
    return np.where(inside, np.clip(wide, 0.06, 1), 0.0)


def make_scene(trees: Trees, ground_at: np.ndarray, half_m: float, ground_grid: np.ndarray) -> Scene:
    """The leaf grid and stems about a plot.

    ground_at: (N,) height of the ground at every tree over that at the centre. half_m: half side of the grid.
    ground_grid: (n, n) the same on the grid's cells, n = ceil(2 half / cell).
    """
    n = ground_grid.shape[0]
    z_low = float(ground_grid.min()) - 1.0
    tops = ground_at + trees.height_m
    nz = int(np.ceil((float(tops.max(initial=ground_grid.max() + 5)) - z_low) / CELL_M)) + 1
    low = np.array([-half_m, -half_m, z_low])
    leaves = np.zeros((n, n, nz), np.float32)
    for k in range(len(trees)):
        _put_crown(leaves, low, trees, k, float(ground_at[k]))
    stems = np.column_stack([trees.xy, trees.dbh_m / 2, trees.height_m, ground_at])
    return Scene(low, leaves, stems, ground_grid.astype(np.float32))


def _put_crown(leaves: np.ndarray, low: np.ndarray, trees: Trees, k: int, ground: float) -> None:
    """Add one tree's leaves, evenly over its crown's volume."""
    base, top = trees.crown_base_m[k], trees.height_m[k]
    reach = trees.crown_m[k]
    first = np.floor((np.array([*(trees.xy[k] - reach), ground + base]) - low) / CELL_M).astype(int)
    last = np.ceil((np.array([*(trees.xy[k] + reach), ground + top]) - low) / CELL_M).astype(int)
    first, last = np.maximum(first, 0), np.minimum(last, leaves.shape)
    if (first >= last).any():
        return
    axes = [low[a] + (np.arange(first[a], last[a]) + 0.5) * CELL_M for a in range(3)]
    away = np.hypot(axes[0][:, None] - trees.xy[k, 0], axes[1][None, :] - trees.xy[k, 1])
    wide = reach * crown_profile((axes[2] - ground - base) / max(top - base, 0.1))
    inside = away[:, :, None] <= wide[None, None, :]
    volume = inside.sum() * CELL_M**3
    # A crown cut by the grid's edge keeps its density.
    whole = np.pi * np.sum(wide**2) * CELL_M
    if volume:
        part = leaves[first[0] : last[0], first[1] : last[1], first[2] : last[2]]
        part += (inside * (LEAF_SHADOW * trees.leaf_m2[k] / max(whole, volume))).astype(np.float32)
