"""Field tallies and measured maps of simulated plots: what was paired, and what is right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from treedgs_geo.inventory.options import PairingOptions
from treedgs_geo.inventory.pairing import assign, register


@dataclass(frozen=True)
class Scene:
    """field: (N, 2) tallied positions from the surveyed centre. measured: (M, 2), the same frame.

    truth: (N,) index into measured, -1 where the tree was missed.
    """

    field: np.ndarray
    measured: np.ndarray
    truth: np.ndarray


RADIUS_M, BEYOND_M, DENSITY_HA, TURN_DEG, FALSE = 12.0, 8.0, 550.0, 6.0, 0.1
#: Standard errors: the crew's bearings (degrees) and distances, the map's places (metres).
AZIMUTH_SD_DEG, DISTANCE_SD_M, MEASURED_SD_M = 1.0, 0.1, 0.1


def simulate(seed: int, pattern: str, gnss_m: float, missed: float = 0.1) -> Scene:
    """One plot. gnss_m: standard error of the centre per axis; missed: share of the stems that the map lacks."""
    rng = np.random.default_rng(seed)
    half = RADIUS_M + BEYOND_M + 20.0
    if pattern == "planted":
        row = rng.uniform(2.8, 3.7)
        gap = 1e4 / DENSITY_HA / row / 0.85
        i, j = np.meshgrid(np.arange(-half, half, row), np.arange(-half, half, gap), indexing="ij")
        stems = np.column_stack([i.ravel(), j.ravel()]) + rng.normal(0, 0.15, (i.size, 2))
        stems = stems[rng.random(len(stems)) < 0.85] + rng.uniform(-2, 2, 2)
        a = rng.uniform(0, np.pi)
        stems = stems @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    else:
        stems = np.zeros((0, 2))
        wanted = int(DENSITY_HA / 1e4 * (2 * half) ** 2)
        tried = rng.uniform(-half, half, (wanted * 3, 2))
        kept: list[np.ndarray] = []
        for point in tried:
            if len(kept) == wanted:
                break
            if not kept or np.min(np.hypot(*(np.array(kept) - point).T)) > 0.6:
                kept.append(point)
        stems = np.array(kept)
    away = np.hypot(*stems.T)
    inside = np.flatnonzero(away <= RADIUS_M)
    seen = np.flatnonzero(away <= RADIUS_M + BEYOND_M)
    seen = seen[rng.random(len(seen)) >= missed]
    n_false = rng.poisson(FALSE * len(seen))
    ghosts = rng.uniform(-1, 1, (n_false * 3 + 3, 2)) * (RADIUS_M + BEYOND_M)
    ghosts = ghosts[np.hypot(*ghosts.T) <= RADIUS_M + BEYOND_M][:n_false]
    centre_error = rng.normal(0, gnss_m, 2)
    measured = np.vstack([stems[seen] + rng.normal(0, MEASURED_SD_M, (len(seen), 2)), ghosts]) - centre_error
    bearing = np.arctan2(stems[inside, 0], stems[inside, 1]) + np.radians(
        rng.uniform(-TURN_DEG, TURN_DEG) + rng.normal(0, AZIMUTH_SD_DEG, len(inside))
    )
    distance = np.maximum(away[inside] + rng.normal(0, DISTANCE_SD_M, len(inside)), 0)
    field = np.column_stack([distance * np.sin(bearing), distance * np.cos(bearing)])
    place = {int(stem): k for k, stem in enumerate(seen)}
    return Scene(field, measured, np.array([place.get(int(stem), -1) for stem in inside]))


def paired(plots: int, seed: int, **scene) -> dict:
    """Pooled counts of ``plots`` plots, all patterns and errors of the centre in turn; one row of `Scene` a plot."""
    groups = [(pattern, gnss) for pattern in ("random", "planted") for gnss in (0.5, 2.0, 4.0)]
    total = dict.fromkeys(("plots", "to_hand_check", "on_a_wrong_placing", "pairable", "made", "right"), 0)
    for k in range(plots):
        one = simulate(seed + k, *groups[k % len(groups)], **scene)
        placed = register(one.field, one.measured, PairingOptions())
        reach = np.linalg.norm(one.field, axis=1).max()
        inside = int((np.linalg.norm(one.measured - placed.offset_m, axis=1) <= reach).sum())
        moved = placed.apply(one.field, np.zeros(2))
        pairs = assign(moved, one.measured, placed.sigma_m, PairingOptions().gate_m, inside)
        right = one.truth[pairs.index[:, 0]] == pairs.index[:, 1]
        auto = placed.status == "auto"
        sure = (pairs.margin >= PairingOptions().min_margin) & auto
        total["plots"] += 1
        total["to_hand_check"] += not auto
        total["on_a_wrong_placing"] += auto and not (len(right) and right.mean() > 0.5)
        total["pairable"] += int((one.truth >= 0).sum())
        total["made"] += int(sure.sum())
        total["right"] += int((sure & right).sum())
    return total
