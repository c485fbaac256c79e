"""Which flight: the fewest photos that reach the target, and what more of them would give."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.costs import CostModel
from ..core.errors import InputError
from ..core.progress import Reporter
from .curves import Curves, Outcome, outcome
from .drones import DroneCamera
from .missions import OVERLAPS_PCT, RING_PHOTOS, TILTS_DEG, PlanFlight, Target, grid, orbits
from .safety import Budget, Unsafe, budget_of, made_safe, speed_of
from .settings import MAX_HEIGHT_M, MIN_CLEARANCE_M, PATTERNS, PlanFlightSettings
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
    batteries, minutes). more: what :data:`MORE` further photos would give. not_flown: a sentence for each pattern of
    which no flight may be flown, with what would do."""

    plan: JudgedFlight
    tried: list[tuple[str, str, int, float, float, int, float]]
    more: Outcome
    not_flown: list[str] = field(default_factory=list)


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


def heights_of(site: PlanSite, camera: DroneCamera, settings: PlanFlightSettings) -> tuple[float, float]:
    """The two heights over the ground that are tried, m: the higher gives the wanted error at :data:`VIEWS_OF_HEIGHT`;
    none is above the limit, even where the canopy asks for more."""
    ground = np.array([target.centre for target in site.targets])
    top = float(np.nanmax(site.canopy_top(ground) - site.ground(ground)))
    lowest = min(top + settings.clearance_m, settings.highest_m)
    slant = 1 / np.cos(np.radians(min(TILTS_DEG)))
    coarsest = Curves.load().coarsest_gsd_cm(settings.target_error_cm, VIEWS_OF_HEIGHT)
    higher = float(np.clip(coarsest / 100 * camera.focal_px / slant, lowest, settings.highest_m))
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


Refused = list[tuple[str, Unsafe]]
#: The flights for some settings, judged, and those that may not be flown: with it advice is tried before it is given.
Search = Callable[[PlanFlightSettings], tuple[list[JudgedFlight], Refused]]


def safe_flights(
    site: PlanSite, camera: DroneCamera, settings: PlanFlightSettings, heading_deg: float
) -> tuple[list[PlanFlight], Refused]:
    """The flights that may be flown, and the pattern of every other one with what stands against it (``dtm``: how far
    beyond the plots the terrain model would have to reach for it, m)."""
    flights: list[PlanFlight] = []
    refused: Refused = []
    for flight in candidates(site, camera, heights_of(site, camera, settings), heading_deg, settings.pattern):
        if not 0 < len(flight) <= MAX_PHOTOS:
            continue
        try:
            flights.append(made_safe(flight, site.canopy_top, camera, settings))
        except Unsafe as problem:
            if problem.option == "dtm":
                problem.needed = flight.beyond_m(site.targets) + settings.clearance_m
            refused.append((flight.pattern, problem))
    return flights, refused


def choose(
    site: PlanSite, stems: list[PlotStems], camera: DroneCamera, settings: PlanFlightSettings, take_off: np.ndarray,
    heading_deg: float, reporter: Reporter,
) -> Choice:  # fmt: skip
    """The flight with the fewest photos that measures the share with the error, or the best with so many batteries.

    Raises:
        InputError: nothing safe, or nothing that reaches the target; says what would do, which was tried.
    """
    model, curves, costs = ViewModel.load(), Curves.load(), CostModel.load()
    dbh_m = np.concatenate([2 * one.scene.stems[one.rows, 2] for one in stems])

    def search(asked: PlanFlightSettings) -> tuple[list[JudgedFlight], Refused]:
        flights, refused = safe_flights(site, camera, asked, heading_deg)
        plans = []
        for number, flight in enumerate(flights):
            clear, gsd = judged(flight, stems, camera, model)
            budget = budget_of(flight, camera, speed_of(flight, camera, asked), take_off, costs)
            plans.append(JudgedFlight(flight, outcome(curves, clear, gsd, dbh_m), budget, clear, gsd))
            reporter.progress((number + 1) / len(flights), f"flight {number + 1} of {len(flights)}")
        return plans, refused

    plans, refused = search(settings)
    if not plans and not refused:
        raise InputError(
            f"--plots: no flight of fewer than {MAX_PHOTOS} photos shows them; plan the plots in groups that lie near "
            "one another."
        )
    if not plans:
        option, why, advice = _against(refused, settings, search)
        raise InputError(f"--{option.replace('_', '-')}: {why}; {advice}.")
    good = _good(plans, settings)
    if not good:
        raise InputError(_unreachable(plans, refused, settings, search))
    if settings.batteries is None:
        plan = min(good, key=lambda made: (made.budget.photos, made.budget.minutes))
    else:
        # A tenth of a point of share is no reason for twice the photos.
        best = max(made.outcome.share for made in good)
        near = [made for made in good if made.outcome.share >= best - 0.005]
        plan = min(near, key=lambda made: (made.outcome.error_cm, made.budget.photos))
    flown = {made.flight.pattern for made in plans}
    not_flown = []
    for pattern in dict.fromkeys(pattern for pattern, _ in refused if pattern not in flown):
        own = [row for row in refused if row[0] == pattern]
        _, why, advice = _against(own, replace(settings, pattern=pattern), search)
        not_flown.append(f"No {pattern} can be flown here: {why}; {advice}.")
    tried = []
    for made in plans:
        heights, found, taken = " + ".join(f"{m:.0f} m" for m in made.flight.heights_m), made.outcome, made.budget
        measured = (found.share, found.error_cm)
        where = f"{heights}, {made.flight.tilt_deg:.0f}°"
        tried.append((made.flight.pattern, where, taken.photos, *measured, taken.batteries, taken.minutes))
    return Choice(plan, tried, with_more(plan, plans, dbh_m, curves), not_flown)


def _good(plans: list[JudgedFlight], settings: PlanFlightSettings) -> list[JudgedFlight]:
    """Those that reach what is wanted."""
    if settings.batteries is not None:
        return [plan for plan in plans if plan.budget.batteries <= settings.batteries]
    share, error_cm = settings.target_share_pct / 100, settings.target_error_cm
    return [plan for plan in plans if plan.outcome.share >= share and plan.outcome.error_cm <= error_cm]


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


def _against(refused: Refused, settings: PlanFlightSettings, search: Search) -> tuple[str, str, str]:
    """What stands against most of these flights: the option, the reason of that which lacks least, what would do."""
    option = Counter(problem.option for _, problem in refused).most_common(1)[0][0]
    least = min((problem for _, problem in refused if problem.option == option), key=lambda problem: problem.needed)
    if option == "dtm":
        return option, str(least), f"give a DTM that reaches {reach_to_give_m(least.needed):.0f} m beyond the plots"
    if option == "camera":
        return option, str(least), "choose a camera whose gimbal reaches it"
    higher, nearer = (_tried_limit(name, settings, search) for name in ("highest_m", "clearance_m"))
    advice = " or ".join(filter(None, [higher and f"{higher} (with a permit)", nearer]))
    return option, str(least), f"give {advice}" if advice else "no other height or clearance would do"


def reach_to_give_m(needed_m: float) -> float:
    """How far beyond the plots a terrain model is asked to reach, m."""
    return 10 * float(np.ceil(needed_m / 10))


def _tried_limit(name: str, settings: PlanFlightSettings, search: Search) -> str:
    """``highest_m`` or ``clearance_m`` with which a flight reaches what is wanted, or may be flown at all, as an
    option; '' where none is found."""
    value, at_all = getattr(settings, name), ""
    for _ in range(8):
        tried = replace(settings, **{name: value})
        plans, refused = search(tried)
        option = f"--{name.replace('_', '-')} {value:g}"
        if _good(plans, tried):
            return option
        if plans:
            at_all, lacks = at_all or f"{option} (for less than is wanted)", 2.0
        else:
            needed = min((problem.needed for _, problem in refused if problem.option == "highest_m"), default=np.inf)
            lacks = max(needed - tried.highest_m, 0.1)
        value = np.ceil(value + lacks) if name == "highest_m" else np.ceil(value - lacks) - 1
        if not MIN_CLEARANCE_M <= value <= MAX_HEIGHT_M:
            break
    return at_all


def _unreachable(plans: list[JudgedFlight], refused: Refused, settings: PlanFlightSettings, search: Search) -> str:
    """What is out of reach, and what would do; the flights that may not be flown are part of it."""
    others = ""
    if refused:
        _, why, advice = _against(refused, settings, search)
        others = f"; {len(refused)} of {len(plans) + len(refused)} flights cannot be flown here ({why}): {advice}"
    error_cm, share = settings.target_error_cm, settings.target_share_pct / 100
    if settings.batteries is not None:
        least = min(plan.budget.batteries for plan in plans)
        return (
            f"--batteries: {settings.batteries} carry no flight over these plots, expected at least {least}; give "
            f"{least}, or fewer plots{others}."
        )
    sharp = [plan for plan in plans if plan.outcome.error_cm <= error_cm]
    if sharp:
        most, photos = _max_share(sharp, share)
        return (
            f"--target-share-pct: {100 * share:g} % is out of reach in this stand; give at most {most:g} ({photos} "
            f"photos), or fly without leaves, or use LiDAR where crowns close{others}."
        )
    best = min(plan.outcome.error_cm for plan in plans)
    enough = [plan for plan in plans if plan.outcome.share >= share]
    given_cm = np.ceil(100 * min(plan.outcome.error_cm for plan in enough or plans)) / 100
    ways = ["a camera with a longer focal length"]
    while given_cm <= 10 and not sharp:
        # Another error is flown for from another height.
        tried, _ = search(replace(settings, target_error_cm=given_cm))
        sharp = [plan for plan in tried if plan.outcome.error_cm <= given_cm]
        if sharp:
            most, photos = _max_share(sharp, share)
            less = f" and --target-share-pct {most:g}" if most < 100 * share else ""
            ways.insert(0, f"--target-error-cm {given_cm:g}{less} ({photos} photos)")
        given_cm = np.ceil(110 * given_cm) / 100
    return (
        f"--target-error-cm: {error_cm:g} cm is out of reach, the best found is {best:.3f} cm; give "
        f"{', or '.join(ways)}{others}."
    )


def _max_share(plans: list[JudgedFlight], wanted: float) -> tuple[float, int]:
    """Per cent of the stems that can be asked of these flights, at most what was wanted, and the photos it takes."""
    most = min(100 * wanted, float(np.floor(100 * max(plan.outcome.share for plan in plans))))
    return most, min(plan.budget.photos for plan in plans if 100 * plan.outcome.share >= most)
