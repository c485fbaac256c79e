"""Trees of the synthetic plot: where they stand, their curved axes, and their bark-covered triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from ..trees.priors import BREAST_HEIGHT_M
from .settings import SimulateSettings, Sizes
from .terrain import Ground


@dataclass(frozen=True)
class PlantedStem:
    """One stem. axis: (K, 3) local points every ``AXIS_STEP`` metres of arc length from the ground at the stem's foot
    (index 0) upwards; radii: (K,) metres, mean, without relief.

    detail: 2 in the plots, 1 about them, -1 in the photos but far off (grid flights), 0 in none.
    kind: normal, dead, fork_below, fork_above, touch, lean, sapling, or branch (the second leader above a fork, part of
    the tree ``tree_id``).
    """

    tree_id: str
    kind: str
    status: str
    in_plot: bool
    axis: np.ndarray
    radii: np.ndarray
    dbh_m: float
    height_m: float
    crown_base_m: float
    lean_az_rad: float
    detail: int


AXIS_STEP = 0.05
#: Crowns farther from the plots than this are made of larger needles, m.
NEAR_PLOT_M = 36.0
_ORIGIN = np.zeros((1, 2))


def centre_distance(xy: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """(N, 2), (n, 2) -> (N,) metres to the nearest of the plots' centres."""
    return np.min([np.hypot(*(xy - centre).T) for centre in centres], axis=0)


def arc_index(stem: PlantedStem, s_m: np.ndarray) -> np.ndarray:
    """Fractional index into the axis for arc lengths."""
    return np.clip(np.asarray(s_m, float) / AXIS_STEP, 0, len(stem.axis) - 1)


def axis_at(stem: PlantedStem, s_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc lengths (N,) -> points (N, 3), unit tangents (N, 3), radii (N,); linear between axis points."""
    q = arc_index(stem, s_m)
    k = np.arange(len(stem.axis))
    point = np.column_stack([np.interp(q, k, stem.axis[:, c]) for c in range(3)])
    slope = np.gradient(stem.axis, axis=0)
    tangent = np.column_stack([np.interp(q, k, slope[:, c]) for c in range(3)])
    return point, tangent / np.linalg.norm(tangent, axis=1, keepdims=True), np.interp(q, k, stem.radii)


def plant(
    rng: np.random.Generator,
    stems_per_ha: float,
    radius_m: float,
    stand_radius_m: float,
    centres: np.ndarray = _ORIGIN,
) -> np.ndarray:
    """(N, 2) stem positions in jittered rows; the count inside the plots is that of the density, +- 15 % or one."""
    spacing = 3.4 * np.sqrt(700 / stems_per_ha)
    along = 1e4 / stems_per_ha / spacing * 0.94
    expected = len(centres) * stems_per_ha / 1e4 * np.pi * radius_m**2
    half = int(stand_radius_m / min(spacing, along)) + 3
    best = None
    for _ in range(60):
        azimuth, shift = rng.uniform(0, np.pi), rng.uniform(-0.5, 0.5, 2)
        steps = np.arange(-half, half + 1)
        u, v = np.meshgrid((steps + shift[0]) * spacing, (steps + shift[1]) * along)
        q = np.column_stack([u.ravel(), v.ravel()]) + rng.normal(0, 0.32, (u.size, 2)) * [1.0, 1.4]
        q = q[rng.random(len(q)) < 0.94]
        xy = q @ np.array([[np.cos(azimuth), np.sin(azimuth)], [-np.sin(azimuth), np.cos(azimuth)]])
        xy = xy[np.hypot(*xy.T) < stand_radius_m]
        pairs = cKDTree(xy).query_pairs(min(1.5, 0.55 * along), output_type="ndarray")
        xy = np.delete(xy, np.unique(pairs[:, 1]) if len(pairs) else [], axis=0)
        away = centre_distance(xy, centres)
        miss = abs((away < radius_m - 0.05).sum() - expected)
        # Which of the trees on the rim of many plots are inside, the truth knows.
        edge = np.abs(away - radius_m).min() < 0.05 and len(centres) == 1
        if not edge and (best is None or miss < best[0]):
            best = miss, xy
        if best is not None and best[0] <= max(1.0, 0.15 * expected):
            break
    assert best is not None
    return best[1]


def total_height(dbh_m: np.ndarray) -> np.ndarray:
    """Height-diameter curve of a loblolly-like stand, metres."""
    return BREAST_HEIGHT_M + 24.0 * (1 - np.exp(-5.5 * np.asarray(dbh_m)))


def grow_stem(
    rng: np.random.Generator,
    ground: Ground,
    xy: np.ndarray,
    dbh_m: float,
    height_m: float,
    lean_rad: float,
    lean_az_rad: float,
    sweep_m: float = 0.0,
    flare_m: float = 0.0,
    **fields,
) -> PlantedStem:
    """Axis and radii: lean, slight sweep, a taper curve through the DBH and butt flare.

    Taper: d(s) = dbh ((H - s) / (H - breast height))^p, p about 0.6, i.e. 0.5-1.2 cm/m at breast height. sweep_m:
    sideways bow over the lowest 4 m. flare_m: height over which the butt flare falls to a third, 0 = drawn.
    """
    count = int(height_m / AXIS_STEP) + 1
    s = AXIS_STEP * np.arange(count)
    direction = np.array([np.cos(lean_az_rad), np.sin(lean_az_rad)])
    along = np.sin(lean_rad) * s
    side = np.zeros(count)
    for wavelength, size in ((rng.uniform(9, 16), 0.05), (rng.uniform(4, 7), 0.012)):
        phase = rng.uniform(0, 2 * np.pi, 2)
        bend = size * rng.uniform(0.3, 1.0, 2)
        along = along + bend[0] * (np.sin(2 * np.pi * s / wavelength + phase[0]) - np.sin(phase[0]))
        side = side + bend[1] * (np.sin(2 * np.pi * s / wavelength + phase[1]) - np.sin(phase[1]))
    if sweep_m:
        side = side + sweep_m * np.sin(np.pi * np.clip(s / 4.0, 0, 1)) ** 2
    horizontal = along[:, None] * direction + side[:, None] * np.array([-direction[1], direction[0]])
    step = np.diff(horizontal, axis=0)
    rise = np.sqrt(np.maximum(AXIS_STEP**2 - (step**2).sum(1), 1e-6))
    base = float(ground.height(np.asarray(xy)[None])[0])
    z = base + np.concatenate([[0], np.cumsum(rise)])
    axis = np.column_stack([np.asarray(xy) + horizontal, z])
    power = rng.uniform(0.48, 0.72)
    radii = dbh_m / 2 * (np.maximum(height_m - s, 0) / max(height_m - BREAST_HEIGHT_M, 0.3)) ** power
    lobe, length = rng.uniform(0.2, 0.4), rng.uniform(0.16, 0.28)
    flare = lobe * dbh_m / 2 * np.exp(-s / (flare_m or length))
    return PlantedStem(
        axis=axis,
        radii=np.maximum(radii + flare, 0.004),
        dbh_m=dbh_m,
        height_m=height_m,
        lean_az_rad=lean_az_rad,
        **fields,
    )


def grow_stand(
    rng: np.random.Generator,
    settings: SimulateSettings,
    sizes: Sizes,
    ground: Ground,
    near_m: float,
    stand_radius_m: float,
    centres: np.ndarray = _ORIGIN,
) -> list[PlantedStem]:
    """Every stem of the stand, the plots' own first (T001 is nearest a centre); saplings carry ids S001 ...

    near_m: beyond this distance from the origin no crown shows in a photo, and coarse ones will do.
    centres: (n, 2) of the plots.
    """
    xy = plant(rng, settings.stems_per_ha, sizes.radius_m, stand_radius_m, centres)
    xy = xy[np.argsort(centre_distance(xy, centres))]
    if settings.clearing_m:
        xy = xy[centre_distance(xy, centres) > settings.clearing_m]
    count = len(xy)
    dbh = np.clip(rng.normal(settings.dbh_mean_cm, settings.dbh_sd_cm, count), 8.2, 56.0) / 100
    height = total_height(dbh) * rng.normal(1, 0.035, count)
    limit = np.radians(settings.lean_max_deg)
    lean = np.minimum(np.abs(rng.normal(0, np.radians(1.7), count)), limit)
    kinds = np.full(count, "normal", dtype=object)
    away = centre_distance(xy, centres)
    inside = np.flatnonzero(away < sizes.radius_m)
    draw = iter(rng.permutation(inside))
    for kind, number in (
        ("fork_below", settings.forks_below_bh),
        ("fork_above", settings.forks_above_bh),
        ("touch", settings.touching_saplings),
        ("lean", settings.strong_leans),
        ("dead", settings.dead_trees),
        ("twin", settings.twins),
    ):
        for _ in range(number):
            index = next(draw, None)
            if index is not None:
                kinds[index] = kind
    lean[kinds == "lean"] = rng.uniform(0.75, 1.0, (kinds == "lean").sum()) * limit
    stems: list[PlantedStem] = []
    for k in range(count):
        distance = float(away[k])
        shown = 0 if np.hypot(*xy[k]) >= near_m else 1 if distance < NEAR_PLOT_M else -1
        detail = 2 if distance < sizes.radius_m + 5 else shown
        common = {
            "tree_id": f"T{k + 1:03d}",
            "kind": kinds[k],
            "status": "dead" if kinds[k] == "dead" else "live",
            "in_plot": distance < sizes.radius_m,
            "detail": detail,
            "crown_base_m": height[k] * rng.uniform(0.46, 0.56),
        }
        azimuth = rng.uniform(0, 2 * np.pi)
        if common["in_plot"]:
            common.update(sweep_m=settings.sweep_cm / 100, flare_m=settings.butt_flare_m)
        if kinds[k] == "fork_below":
            # Two leaders from one foot, far enough apart at breast height to be two stems there.
            for suffix, turn in (("a", 0.0), ("b", np.pi)):
                size = dbh[k] * rng.uniform(0.62, 0.78)
                tilt = np.arctan2(0.5 * size + 0.06, BREAST_HEIGHT_M)
                stems.append(
                    grow_stem(
                        rng,
                        ground,
                        xy[k],
                        size,
                        height[k] * rng.uniform(0.92, 1),
                        tilt,
                        azimuth + turn,
                        **{**common, "tree_id": common["tree_id"] + suffix},
                    )
                )
            continue
        stem = grow_stem(rng, ground, xy[k], dbh[k], height[k], lean[k], azimuth, **common)
        stems.append(stem)
        if kinds[k] == "fork_above":
            stems.append(_second_leader(rng, stem))
        if kinds[k] == "twin":
            stems.append(_twin(rng, ground, stem, settings.twin_gap_m, common))
        if kinds[k] == "touch":
            size = rng.uniform(0.045, 0.07)
            reach = stem.dbh_m / 2 + size / 2
            turn = rng.uniform(0, 2 * np.pi)
            point = axis_at(stem, np.array([BREAST_HEIGHT_M]))[0][0, :2]
            point = point + reach * np.array([np.cos(turn), np.sin(turn)])
            stems.append(_sapling(rng, ground, point, size, rng.uniform(4, 6), len(stems)))
    reach = min(stand_radius_m, float(np.hypot(*centres.T).max()) + sizes.radius_m + 16)
    return stems + _saplings(rng, settings.saplings_per_m2, ground, xy, reach, len(stems))


def _twin(rng: np.random.Generator, ground: Ground, stem: PlantedStem, gap_m: float, common: dict) -> PlantedStem:
    """A second full stem whose bark stands ``gap_m`` from the first one's at breast height."""
    size = stem.dbh_m * rng.uniform(0.7, 1.0)
    turn = rng.uniform(0, 2 * np.pi)
    reach = stem.dbh_m / 2 + size / 2 + gap_m
    point = axis_at(stem, np.array([BREAST_HEIGHT_M]))[0][0, :2] + reach * np.array([np.cos(turn), np.sin(turn)])
    return grow_stem(
        rng,
        ground,
        point,
        size,
        0.95 * stem.height_m,
        0.0,
        turn,
        **{**common, "tree_id": common["tree_id"] + "t", "sweep_m": 0.0},
    )


def _second_leader(rng: np.random.Generator, stem: PlantedStem) -> PlantedStem:
    start = int(rng.uniform(2.6, 5.0) / AXIS_STEP)
    s = AXIS_STEP * np.arange(len(stem.axis) - start)
    turn = rng.uniform(0, 2 * np.pi)
    spread = 1.4 * (1 - np.exp(-s / 3.5))
    axis = stem.axis[start:] + spread[:, None] * np.array([np.cos(turn), np.sin(turn), 0])
    return PlantedStem(
        stem.tree_id,
        "branch",
        stem.status,
        stem.in_plot,
        axis,
        0.72 * stem.radii[start:],
        stem.dbh_m,
        stem.height_m - start * AXIS_STEP,
        max(stem.crown_base_m - start * AXIS_STEP, 1.0),
        turn,
        stem.detail,
    )


def _sapling(
    rng: np.random.Generator, ground: Ground, xy: np.ndarray, dbh_m: float, height_m: float, number: int
) -> PlantedStem:
    return grow_stem(
        rng,
        ground,
        xy,
        dbh_m,
        height_m,
        np.radians(rng.uniform(0, 2)),
        rng.uniform(0, 2 * np.pi),
        tree_id=f"S{number + 1:03d}",
        kind="sapling",
        status="live",
        in_plot=False,
        detail=1,
        crown_base_m=0.35 * height_m,
    )


def _saplings(
    rng: np.random.Generator, per_m2: float, ground: Ground, trees: np.ndarray, reach_m: float, number: int
) -> list[PlantedStem]:
    count = rng.poisson(per_m2 * np.pi * reach_m**2)
    spot = reach_m * np.sqrt(rng.random(count))
    turn = rng.uniform(0, 2 * np.pi, count)
    xy = np.column_stack([spot * np.cos(turn), spot * np.sin(turn)])
    if count:
        xy = xy[cKDTree(trees).query(xy)[0] > 0.6]
    return [
        _sapling(rng, ground, point, rng.uniform(0.02, 0.07), rng.uniform(2, 6), number + k)
        for k, point in enumerate(xy)
    ]


@dataclass(frozen=True)
class StemMesh:
    """vertices (V, 3) float64; triangles (F, 3) int64; uv (V, 2): around (turns) and along (m); owner (F,) stem index;
    normals (V, 3) outward; first (S + 1,) first triangle of each stem."""

    vertices: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray
    normals: np.ndarray
    owner: np.ndarray
    first: np.ndarray


def mesh_stems(rng: np.random.Generator, stems: list[PlantedStem], ellipticity_pct: float = 0.0) -> StemMesh:
    """Tubes around the axes with ellipticity (0 = drawn), bark relief (plates of some millimetres) and a lobed butt."""
    parts: list[tuple] = []
    offset, faces = 0, [0]
    for index, stem in enumerate(stems):
        length = AXIS_STEP * (len(stem.axis) - 1)
        if stem.detail == 2:
            sides, s = (
                36,
                np.concatenate([np.arange(0, min(5.0, length), 0.06), np.arange(5.0, max(length, 5.0), 0.25)]),
            )
        elif stem.detail == 1:
            sides, s = 16, np.concatenate([np.arange(0, 0.6, 0.15), np.arange(0.6, length, 0.4)])
        else:
            sides, s = 8, np.concatenate([[0.0, 0.4], np.arange(1.0, length, 1.2)])
        s = np.append(s[s < length - 0.01], length)
        point, tangent, radius = axis_at(stem, s)
        if stem.kind != "branch":
            # A root end below the ground, so that no gap shows on the downhill side.
            s, radius = np.concatenate([[-0.35], s]), np.concatenate([[radius[0] * 1.25], radius])
            point, tangent = np.vstack([point[0] - 0.35 * tangent[0], point]), np.vstack([tangent[:1], tangent])
        theta = 2 * np.pi * np.arange(sides) / sides
        e1 = np.cross(np.array([0.0, 1.0, 0.0]), tangent)
        e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
        e2 = np.cross(tangent, e1)
        relief = gaussian_filter(rng.standard_normal((len(s), sides)), (0.9, 0.8), mode=("nearest", "wrap"))
        relief *= (0.011 * radius + 0.0012)[:, None] / max(relief.std(), 1e-9)
        oval = rng.uniform(0.002, 0.03)
        ellipse = (ellipticity_pct / 200 or oval) * np.cos(2 * (theta - rng.uniform(0, np.pi)))
        lobes = 0.16 * np.cos(rng.integers(3, 6) * theta + rng.uniform(0, 6.28))
        lobes = lobes * np.exp(-np.maximum(s, 0) / 0.22)[:, None]
        shape = radius[:, None] * (1 + ellipse + lobes) + relief
        outward = np.cos(theta)[None, :, None] * e1[:, None] + np.sin(theta)[None, :, None] * e2[:, None]
        # One column more than sides: the seam has its own texture coordinate.
        ring = np.concatenate(
            [point[:, None] + shape[..., None] * outward, (point[:, None] + shape[..., None] * outward)[:, :1]], axis=1
        )
        normal = np.concatenate([outward, outward[:, :1]], axis=1)
        rows, columns = ring.shape[:2]
        u = np.broadcast_to(np.arange(columns) / sides, (rows, columns))
        v = np.broadcast_to(s[:, None], (rows, columns))
        node = np.arange(rows * columns).reshape(rows, columns) + offset
        a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:]
        triangles = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])
        parts.append(
            (
                ring.reshape(-1, 3),
                triangles,
                np.stack([u, v], -1).reshape(-1, 2),
                normal.reshape(-1, 3),
                np.full(len(triangles), index),
            )
        )
        offset += rows * columns
        faces.append(faces[-1] + len(triangles))
    vertices, triangles, uv, normals, owner = (np.concatenate([part[k] for part in parts]) for k in range(5))
    return StemMesh(vertices, triangles, uv, normals, owner, np.array(faces))
