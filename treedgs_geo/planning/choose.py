"""Which flight: the fewest photos that reach the target, and what more of them would give."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.costs import CostModel
from ..core.errors import InputError
from ..core.progress import Reporter
from .curves import Curves, Outcome, outcome
from .drones import DroneCamera
from .missions import OVERLAPS_PCT, RING_PHOTOS, TILTS_DEG, PlanFlight, Target, grid, orbits
from .safety import Budget, Unsafe, budget_of, made_safe, speed_of
from .settings import PATTERNS, FlyingSettings, PlanFlightSettings
from .site import PlanSite
from .stand import CELL_M, REACH_M, Scene, about_plot, make_scene
from .views import ViewModel, framed_views, shown_share

#: Stems that the choice rests on, at most; more are left out evenly.
MAX_STEMS = 240
#: Where the stand is drawn, as many stems at least: plots are drawn again with other trees.
LEAST_STEMS = 40
#: Clear views that a height is chosen for: the flight is then as high as the wanted error allows.
VIEWS_OF_HEIGHT = 6.0
#: The lower of two heights over the higher.
LOWER = 0.75
#: More photos than this are no plan for one day.
MAX_PHOTOS = 3000
#: How many photos "a few more" are.
MORE = 20


@dataclass(frozen=True)
class PlotStems:
    """Stems of a plot, or of a draw of it, that a flight is judged by. scene: what stands about it; rows: of the
    scene's stems that are judged; centre: (3,) planning frame."""

    plot_id: str
    scene: Scene
    rows: np.ndarray
    centre: np.ndarray


@dataclass(frozen=True)
class JudgedFlight:
    """A flight with what it gives and costs. clear: (S, P) chance that each photo shows each stem clearly; gsd_cm:
    (S, P) at the stem."""

    flight: PlanFlight
    outcome: Outcome
    budget: Budget
    clear: np.ndarray
    gsd_cm: np.ndarray


@dataclass(frozen=True)
class Choice:
    """plan: the chosen flight. tried: every flight that was judged, (pattern, heights, photos, share, error cm,
    batteries, minutes). more: what :data:`MORE` further photos would give. refused: how many flights of a pattern may
    not be flown, by (pattern, reason)."""

    plan: JudgedFlight
    tried: list[tuple[str, str, int, float, float, int, float]]
    more: Outcome
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)

    def not_flown(self) -> list[str]:
        """A sentence for each pattern of which no flight may be flown."""
        flown = {pattern for pattern, *_ in self.tried}
        names = dict.fromkeys(pattern for pattern, _ in self.refused if pattern not in flown)
        return [f"No {name} can be flown here: {_main_reason(self.refused, name)}." for name in names]


def _main_reason(refused: Counter[tuple[str, str]], pattern: str | None = None) -> str:
    """What most flights (of a pattern) are refused for."""
    counts: Counter[str] = Counter()
    for (name, reason), count in refused.items():
        counts[reason] += count if pattern in (None, name) else 0
    return counts.most_common(1)[0][0]


def stems_of(site: PlanSite, seed: int) -> list[PlotStems]:
    """Scenes about every plot with the stems in it."""
    made: list[PlotStems] = []
    rng = np.random.default_rng(seed)
    for round_ in range(8):
        made += [_about(site, target, rng) for target in site.targets]
        count = sum(len(one.rows) for one in made)
        if count >= LEAST_STEMS or (site.mapped is not None and round_ == 0 and count > 0):
            break
    if not count:
        raise InputError(
            f"{site.numbers.stems_per_ha:g} stems/ha leave no stem in the plots; check the density, the tree layer and "
            "the plots' places."
        )
    every = max(1, int(np.ceil(count / MAX_STEMS)))
    return [replace(one, rows=one.rows[k % every :: every]) for k, one in enumerate(made)]


def _about(site: PlanSite, target: Target, rng: np.random.Generator) -> PlotStems:
    centre, radius = target.centre, target.radius_m
    trees = about_plot(rng, site.mapped, site.numbers, centre, radius, site.mapped_area)
    half = radius + REACH_M
    n = int(np.ceil(2 * half / CELL_M))
    axis = -half + CELL_M * (np.arange(n) + 0.5)
    middle = float(site.ground(centre[None])[0])
    cells = site.ground(np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2) + centre) - middle
    under = site.ground(trees.xy + centre) - middle
    # Far beyond the terrain model the ground goes on level: crowns out there only hide.
    scene = make_scene(trees, np.nan_to_num(under), half, np.nan_to_num(cells).reshape(n, n))
    inside = np.hypot(*trees.xy.T) <= radius
    if site.mapped is not None and trees.known[inside].any():
        inside &= trees.known
    return PlotStems(target.plot_id, scene, np.flatnonzero(inside), np.array([*centre, middle]))


def judged(
    flight: PlanFlight, stems: list[PlotStems], camera: DroneCamera, model: ViewModel
) -> tuple[np.ndarray, np.ndarray]:
    """(S, P) chance that each photo shows each stem clearly, and the ground sample distance at the stem, cm."""
    clear, gsd = [], []
    size, focal = np.array([camera.width_px, camera.height_px], float), np.full(len(flight), camera.focal_px)
    for one in stems:
        cameras, mine = flight.xyz - one.centre, one.scene.stems[one.rows]
        framed, depth = framed_views(mine[:, [0, 1, 4]], mine[:, 2], cameras, flight.rotations, focal, size)
        shown = shown_share(one.scene, one.rows, cameras, framed, model)
        clear.append(np.where(framed, model.clear_chance(shown), 0.0))
        gsd.append(100 * depth / camera.focal_px)
    return np.concatenate(clear), np.concatenate(gsd)


def heights_of(
    site: PlanSite, camera: DroneCamera, limits: FlyingSettings, error_cm: float, curves: Curves
) -> tuple[float, float]:
    """The two heights over the ground that are tried, m: the higher gives the wanted error at :data:`VIEWS_OF_HEIGHT`.

    Raises:
        InputError: the canopy and its clearance leave no height, or the photos at the lowest are too coarse.
    """
    ground = np.array([target.centre for target in site.targets])
    top = float(np.nanmax(site.canopy_top(ground) - site.ground(ground)))
    lowest = top + limits.clearance_m
    if lowest > limits.highest_m:
        raise InputError(
            f"--clearance-m: trees of {top:.0f} m and {limits.clearance_m:g} m clearance ask for {lowest:.0f} m over "
            f"the ground, expected at most {limits.highest_m:g} m; a greater --highest-m (with a permit) or a smaller "
            "clearance would do."
        )
    slant = 1 / np.cos(np.radians(min(TILTS_DEG)))
    wanted = curves.coarsest_gsd_cm(error_cm, VIEWS_OF_HEIGHT) / 100 * camera.focal_px / slant
    higher = float(np.clip(wanted, lowest, limits.highest_m))
    return max(lowest, LOWER * higher), higher


def candidates(
    site: PlanSite, camera: DroneCamera, heights: tuple[float, float], heading_deg: float, pattern: str
) -> Iterator[PlanFlight]:
    """Flights that are tried: patterns, heights (each, and both), tilts, densities."""
    levels: list[tuple[float, ...]] = [(heights[1],)]
    if heights[1] > 1.05 * heights[0]:
        levels += [(heights[0],), heights]
    for name in PATTERNS if pattern == "auto" else (pattern,):
        for level in levels:
            for tilt in TILTS_DEG:
                if name == "orbits":
                    for photos in RING_PHOTOS:
                        yield orbits(site.targets, site.ground, level, tilt, photos, heading_deg)
                else:
                    for overlap in OVERLAPS_PCT:
                        yield grid(site.targets, site.ground, camera, name, level, tilt, overlap, heading_deg)


def choose(
    site: PlanSite, stems: list[PlotStems], camera: DroneCamera, settings: PlanFlightSettings, take_off: np.ndarray,
    heading_deg: float, reporter: Reporter,
) -> Choice:  # fmt: skip
    """The flight with the fewest photos that measures the share with the error, or the best with so many batteries.

    Raises:
        InputError: nothing safe, or nothing that reaches the target; says what would do.
    """
    model, curves, costs = ViewModel.load(), Curves.load(), CostModel.load()
    error_cm, share, batteries = settings.target_error_cm, settings.target_share_pct / 100, settings.batteries
    heights = heights_of(site, camera, settings, error_cm, curves)
    plans: list[JudgedFlight] = []
    refused: Counter[tuple[str, str]] = Counter()
    dbh_m = np.concatenate([2 * one.scene.stems[one.rows, 2] for one in stems])
    flights = [
        flight
        for flight in candidates(site, camera, heights, heading_deg, settings.pattern)
        if 0 < len(flight) <= MAX_PHOTOS
    ]
    for number, flight in enumerate(flights):
        try:
            safe = made_safe(flight, site.canopy_top, camera, settings)
        except Unsafe as problem:
            refused[flight.pattern, str(problem)] += 1
            continue
        clear, gsd = judged(safe, stems, camera, model)
        budget = budget_of(safe, camera, speed_of(safe, camera, settings), take_off, costs)
        plans.append(JudgedFlight(safe, outcome(curves, clear, gsd, dbh_m), budget, clear, gsd))
        reporter.progress((number + 1) / len(flights), f"flight {number + 1} of {len(flights)}")
    if not plans:
        raise InputError(_nothing_safe(refused, settings))
    if batteries is None:
        good = [plan for plan in plans if plan.outcome.share >= share and plan.outcome.error_cm <= error_cm]
    else:
        good = [plan for plan in plans if plan.budget.batteries <= batteries]
    if not good:
        raise InputError(_unreachable(plans, error_cm, share, batteries))
    if batteries is None:
        plan = min(good, key=lambda made: (made.budget.photos, made.budget.minutes))
    else:
        # A tenth of a point of share is no reason for twice the photos.
        best = max(made.outcome.share for made in good)
        near = [made for made in good if made.outcome.share >= best - 0.005]
        plan = min(near, key=lambda made: (made.outcome.error_cm, made.budget.photos))
    return Choice(plan, [_row(made) for made in plans], with_more(plan, plans, dbh_m, curves), refused)


def _row(plan: JudgedFlight) -> tuple[str, str, int, float, float, int, float]:
    heights = " + ".join(f"{height:.0f} m" for height in plan.flight.heights_m)
    where = f"{heights}, {plan.flight.tilt_deg:.0f}°"
    found = plan.outcome
    costs = plan.budget
    return plan.flight.pattern, where, costs.photos, found.share, found.error_cm, costs.batteries, costs.minutes


def with_more(plan: JudgedFlight, plans: list[JudgedFlight], dbh_m: np.ndarray, curves: Curves) -> Outcome:
    """What :data:`MORE` further photos would give: those of the denser flights that add most, one after the other."""
    mine = plan.flight
    key = (mine.pattern, mine.heights_m)
    alike = [other for other in plans if (other.flight.pattern, other.flight.heights_m) == key]
    denser = [other for other in alike if len(other.flight) > len(mine)]
    if not denser:
        return plan.outcome
    pool = max(denser, key=lambda other: len(other.flight))
    clear, gsd, left = plan.clear, plan.gsd_cm, list(range(len(pool.flight)))
    for _ in range(min(MORE, len(left))):
        need = 1 / (1 + clear.sum(axis=1))
        best = max(left, key=lambda p: float(need @ pool.clear[:, p]))
        left.remove(best)
        clear, gsd = (np.column_stack([a, b[:, best]]) for a, b in ((clear, pool.clear), (gsd, pool.gsd_cm)))
    return outcome(curves, clear, gsd, dbh_m)


def _nothing_safe(refused: Counter[tuple[str, str]], limits: FlyingSettings) -> str:
    if not refused:
        return (
            "--plots: no flight of fewer than 3000 photos shows them; plan the plots in groups that lie near one "
            "another."
        )
    why = _main_reason(refused)
    if "terrain model" in why:
        return f"--dtm: {why}; give a DTM that reaches 100 m beyond the plots."
    if "gimbal" in why:
        return f"--camera: {why}; choose a camera whose gimbal reaches it."
    return (
        f"--clearance-m: {why}, expected at most {limits.highest_m:g} m; a greater --highest-m (with a permit) or a "
        "smaller clearance would do."
    )


def _unreachable(plans: list[JudgedFlight], error_cm: float, share: float, batteries: int | None) -> str:
    if batteries is not None:
        least = min(plan.budget.batteries for plan in plans)
        return (
            f"--batteries: {batteries} carry no flight over these plots, expected at least {least}; give {least}, or "
            "fewer plots."
        )
    sharp = [plan for plan in plans if plan.outcome.error_cm <= error_cm]
    if not sharp:
        best = min(plans, key=lambda plan: plan.outcome.error_cm)
        return (
            f"--target-error-cm: {error_cm:g} cm is out of reach, the best found is {best.outcome.error_cm:.2f} cm "
            f"with {best.budget.photos} photos; give that, a longer focal length, or a smaller --clearance-m."
        )
    best = max(sharp, key=lambda plan: plan.outcome.share)
    return (
        f"--target-share-pct: {100 * share:g} % is out of reach in this stand, the most found is "
        f"{100 * best.outcome.share:.0f} % with {best.budget.photos} photos ({best.flight.pattern}); give at most "
        f"{int(100 * best.outcome.share)}, or fly without leaves, or use LiDAR where crowns close."
    )
