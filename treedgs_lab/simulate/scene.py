"""Trees of the synthetic plot: their curved axes, radii and kinds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from treedgs_geo.planning.stand import natural
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M

from .settings import SimulateSettings, Sizes
from .spacing import ORIGIN, centre_distance, plant
from .terrain import Ground


@dataclass(frozen=True)
class Lobes:
    """Lobes of a stem's section. flute: depth of the hollows between them, share of the radius; butt: height of the
    buttresses at the ground, share of the radius, falling to a third over ``butt_m``."""

    number: int
    phase_rad: float
    flute: float = 0.0
    butt: float = 0.0
    butt_m: float = 1.0

    def share(self, theta_rad: np.ndarray, s_m: np.ndarray) -> np.ndarray:
        """(S, T) what they add to the radius, as a share of it, at arc lengths (S,) and directions (T,)."""
        wave = np.cos(self.number * theta_rad - self.phase_rad)
        fall = np.exp(-np.log(3) * np.maximum(s_m, 0) / self.butt_m)
        return self.flute / 2 * wave + self.butt * fall[:, None] * (0.5 + 0.5 * wave) ** 2


@dataclass(frozen=True)
class StemLook:
    """What a stem looks like. bark: its tile (:data:`.barks.BARKS`); moss, lichen: shares of the bark under them;
    ivy_m, wrap_m: height up to which ivy grows on it and shrubs about it, 0 = none."""

    bark: int = 0
    moss: float = 0.0
    lichen: float = 0.0
    hardwood: bool = False
    ivy_m: float = 0.0
    wrap_m: float = 0.0
    lobes: Lobes | None = None


@dataclass(frozen=True)
class PlantedStem:
    """One stem. axis: (K, 3) local points every ``AXIS_STEP`` metres of arc length from the ground at the stem's foot
    (index 0) upwards; radii: (K,) metres, mean, without relief.

    detail: 2 in the plots, 1 about them, -1 in the photos but far off (grid flights), 0 in none.
    kind: normal, snag, fork_below, fork_above, touch, lean, sapling, or branch (the second leader above a fork,
    part of the tree ``tree_id``).
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
    look: StemLook = StemLook()


AXIS_STEP = 0.05
#: Crowns in the photos that stand farther outside the plots than this are made of larger needles, m.
NEAR_PLOT_M = {"rings": 24.0, "grid": 12.0}


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


def _diameters(rng: np.random.Generator, settings: SimulateSettings, count: int) -> np.ndarray:
    """(count,) DBH, m; at most 56 cm where they are normal, 90 cm where a lognormal has its long tail."""
    mean, sd = settings.dbh_mean_cm, settings.dbh_sd_cm
    if settings.dbh_distribution == "normal":
        return np.clip(rng.normal(mean, sd, count), 8.2, 56.0) / 100
    spread = np.sqrt(np.log1p((sd / mean) ** 2))
    return np.clip(rng.lognormal(np.log(mean) - spread**2 / 2, spread, count), 8.2, 90.0) / 100


def grow_stand(
    rng: np.random.Generator,
    settings: SimulateSettings,
    sizes: Sizes,
    ground: Ground,
    near_m: float,
    stand_radius_m: float,
    centres: np.ndarray = ORIGIN,
    own: np.random.Generator | None = None,
) -> list[PlantedStem]:
    """Every stem of the stand, the plots' own first (T001 is nearest a centre); saplings carry ids S001 ...

    near_m: beyond this distance from the origin no crown shows in a photo, and coarse ones will do.
    centres: (n, 2) of the plots. own: the stream of natural spacing (``None`` = ``rng``).
    """
    if settings.spacing == "natural":
        xy = plant(own or rng, settings.stems_per_ha, sizes.radius_m, stand_radius_m, centres, natural)
    else:
        xy = plant(rng, settings.stems_per_ha, sizes.radius_m, stand_radius_m, centres)
    xy = xy[np.argsort(centre_distance(xy, centres))]
    if settings.clearing_m:
        xy = xy[centre_distance(xy, centres) > settings.clearing_m]
    count = len(xy)
    dbh = _diameters(rng, settings, count)
    height = total_height(dbh) * rng.normal(1, 0.035, count)
    limit = np.radians(settings.lean_max_deg)
    lean = np.minimum(np.abs(rng.normal(0, np.radians(1.7), count)), limit)
    kinds = np.full(count, "normal", dtype=object)
    away, near_plot = (
        centre_distance(xy, centres),
        sizes.radius_m + NEAR_PLOT_M.get(settings.flight, NEAR_PLOT_M["grid"]),
    )
    inside = np.flatnonzero(away < sizes.radius_m)
    draw = iter(rng.permutation(inside))
    for kind, number in (
        ("fork_below", settings.forks_below_bh),
        ("fork_above", settings.forks_above_bh),
        ("touch", settings.touching_saplings),
        ("lean", settings.strong_leans),
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
        shown = 0 if np.hypot(*xy[k]) >= near_m else 1 if distance < near_plot else -1
        detail = 2 if distance < sizes.radius_m + 5 else shown
        common = {
            "tree_id": f"T{k + 1:03d}",
            "kind": kinds[k],
            "status": "live",
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
