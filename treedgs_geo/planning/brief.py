"""The brief for the crew: one page with what to fly, why, when, and what to check."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..core.costs import time_text
from ..report.blocks import Cards, Document, Picture, Sentences, Table, facts_table
from ..report.charts import BLUE, GREEN, VERMILION, chart_png, new_chart
from ..report.pdf import write_pages
from .choose import MORE, Choice, JudgedFlight
from .drones import RESERVE, DroneCamera
from .missions import Target
from .settings import FlyingSettings, PlanFlightSettings
from .site import PlanSite
from .sun import LOWEST_SUN_DEG, SunDay


def write_brief(
    folder: Path, choice: Choice, site: PlanSite, camera: DroneCamera, settings: PlanFlightSettings, clearance_m: float,
    heading: tuple[float, str], sun: SunDay, take_off: tuple[float, float, float], take_off_xy: np.ndarray,
) -> list[Path]:  # fmt: skip
    """``brief.html`` and ``brief.pdf``. take_off: longitude, latitude, height; take_off_xy: the same place, (2,) in the
    planning frame."""
    plan = choice.plan
    budget, found = plan.budget, plan.outcome
    more = f"No denser flight of this pattern was tried: what {MORE} photos more would give is not known."
    if choice.more is not found:
        more = (
            f"{MORE} photos more, at the best places, would give {100 * choice.more.share:.0f} % of the stems (now "
            f"{100 * found.share:.0f} %) and {choice.more.error_cm:.2f} cm (now {found.error_cm:.2f} cm)."
        )
    cards = [
        ("Photos", f"{budget.photos}", f"{budget.gigabytes:.1f} GB"),
        ("In the air", f"{budget.minutes:.0f} min", batteries_of(budget.batteries)),
        ("Stems measured", f"{100 * found.share:.0f} %", "expected"),
        ("Standard error of DBH", f"{found.error_cm:.2f} cm", "expected, median"),
        ("Clear views a stem", f"{found.views:.1f}", "expected, mean"),
        ("Processing", time_text(budget.processing_s), "one thread" + (", rough" if budget.outside else "")),
    ]
    figure, axes = new_chart(10.4, 4.6, mosaic=[["map", "share"], ["map", "error"]], width_ratios=(1.15, 1))
    _map(axes["map"], plan, site.targets, take_off_xy)
    _charts(axes["share"], axes["error"], choice, settings.target_error_cm, settings.target_share_pct / 100)
    document = Document(
        f"Flight plan: {Path(settings.plots).stem}",
        f"{camera.name}; TreeDGS {__version__}; figures are expectations of a model",
        [
            Cards(cards),
            Sentences(site.notes, "Read this first"),
            Picture("map of the flight; photos against share measured and error", chart_png(figure)),
            _flight_table(choice, site, camera, settings, clearance_m, heading, take_off),
            Sentences([more]),
            Sentences(checklist(choice, camera, settings, sun, clearance_m)),
        ],
    )
    return write_pages(folder / "brief", document)


def batteries_of(count: int) -> str:
    """``1 battery``, ``2 batteries``."""
    return f"{count} {'battery' if count == 1 else 'batteries'}"


def _flight_table(
    choice: Choice, site: PlanSite, camera: DroneCamera, limits: FlyingSettings, clearance_m: float,
    heading: tuple[float, str], take_off: tuple[float, float, float],
) -> Table:  # fmt: skip
    flight, budget = choice.plan.flight, choice.plan.budget
    heights = " and ".join(f"{height:.0f}" for height in flight.heights_m)
    gsd = 100 * min(flight.heights_m) / camera.focal_px
    numbers = site.numbers
    rows = [
        ("Pattern", f"{flight.pattern}, {flight.density}; oblique photos {flight.tilt_deg:.0f}° from straight down"),
        (
            "Height",
            f"{heights} m over the ground ({gsd:.2f} cm a pixel straight down), following the terrain; lowest "
            f"clearance over the canopy {clearance_m:.0f} m (wanted {limits.clearance_m:g} m)",
        ),
        ("Heading", f"{heading[0]:.0f}° grid ({(heading[0] + site.convergence_deg) % 360:.0f}° true): {heading[1]}"),
        ("Speed", f"{budget.speed_m_s:.1f} m/s, limited by {budget.speed_limit}; way {budget.length_m / 1000:.1f} km"),
        (
            "Take-off",
            f"{take_off[1]:.6f}, {take_off[0]:.6f} (latitude, longitude), ground at {take_off[2]:.1f} m "
            f"({site.datum}); all heights in the files are over this place",
        ),
        (
            "Stand",
            f"{numbers.stems_per_ha:.0f} stems/ha, DBH {numbers.dbh_mean_cm:.0f} ± {numbers.dbh_sd_cm:.0f} cm, height "
            f"{numbers.height_m:.0f} m, crowns from {numbers.crown_base_m:.0f} m, leaf area index "
            f"{numbers.leaf_area_index:.1f}",
        ),
    ]
    return facts_table("flight", "The flight", rows)


def checklist(
    choice: Choice, camera: DroneCamera, limits: FlyingSettings, sun: SunDay, clearance_m: float
) -> list[str]:
    """What the crew checks, in the order of the day."""
    budget = choice.plan.budget
    return [
        f"Sun: {sun_text(sun)}; an even overcast all day is better still. Fly without a break: shadows move.",
        "Wind below 4 m/s at the crowns, leaves and ground dry, no people under the flight; permits and airspace "
        "checked.",
        "Take off within 3 m of the stated place. Elsewhere every height is wrong by the difference of the ground: "
        f"plan again with that take-off. Watch the first line: {clearance_m:.0f} m over the crowns, no less.",
        "Base station or RTK corrections: fixed before take-off, logging raw data from 10 min before to 10 min after; "
        "note antenna height and point.",
        f"Camera: shutter priority 1/{1000 / limits.exposure_ms:.0f} s or shorter, "
        f"{'mechanical shutter, ' if camera.readout_ms == 0 else ''}ISO as low as that allows; focus on the ground "
        "from flying height, then manual; distortion correction off; JPEG, full size.",
        f"{batteries_of(budget.batteries)} flown to {100 * RESERVE:.0f} % and one spare; card with "
        f"{max(1.0, 2 * budget.gigabytes):.0f} GB free.",
        f"After landing: {budget.photos} photos on the card, sharp at 100 %; tape a sample (tape-sample). Then "
        "photos-to-dbh, given plan.gpkg as the flight plan, reports planned against got.",
    ]


def sun_text(sun: SunDay) -> str:
    """The hours with enough sun, UTC, and how high it gets."""
    top, noon = sun.elevation_deg[sun.noon], sun.utc[sun.noon]
    day = noon.date().isoformat()
    if not sun.windows:
        return f"on {day} it stays below {LOWEST_SUN_DEG:.0f}° (highest {top:.0f}°): fly around noon, or under overcast"
    hours = " and ".join(f"{begin:%H:%M} to {end:%H:%M}" for begin, end in sun.windows)
    around = max(abs((edge - noon).total_seconds()) / 3600 for window in sun.windows for edge in window)
    return (
        f"on {day} above {LOWEST_SUN_DEG:.0f}° from {hours} UTC, {around:.1f} h either side of the highest sun "
        f"({top:.0f}° at {noon:%H:%M})"
    )


#: Colours and marks of the patterns (Okabe-Ito: apart in every kind of colour blindness).
STYLE = {"orbits": (BLUE, "o"), "crosshatch": (VERMILION, "s"), "nadir-oblique": (GREEN, "^")}


def _map(axis: Any, plan: JudgedFlight, targets: list[Target], take_off: np.ndarray) -> None:
    flight = plan.flight
    for leg in np.unique(flight.leg):
        own = flight.xy[flight.leg == leg]
        axis.plot(*own.T, color="#8a958d", lw=0.9, zorder=1)
    way = np.column_stack([np.sin(np.radians(flight.yaw_deg)), np.cos(np.radians(flight.yaw_deg))])
    down = flight.pitch_deg < -85
    axis.quiver(
        *flight.xy[~down].T, *way[~down].T, angles="xy", color=BLUE, width=0.0035, scale=30, zorder=3, pivot="tail"
    )
    axis.plot(*flight.xy[down].T, "s", ms=4, mfc="none", mec=BLUE, zorder=3)
    for target in targets:
        rim = target.rim(5)
        axis.fill(*rim.T, facecolor="#17753c40", edgecolor="#17753c", lw=1.2)
        axis.annotate(target.plot_id, target.centre, ha="center", va="center", fontsize=7.5 if len(targets) < 25 else 5)
    axis.plot(*take_off, "P", color=VERMILION, ms=11, mec="white", zorder=5)
    axis.annotate("take-off", take_off, xytext=(7, 5), textcoords="offset points", color=VERMILION, fontsize=8)
    axis.set_aspect("equal")
    axis.margins(0.06)
    axis.annotate(
        "N", (0.035, 0.99), (0.035, 0.90), xycoords="axes fraction", ha="center", va="bottom", fontsize=10,
        arrowprops={"arrowstyle": "-|>", "color": "black"},
    )  # fmt: skip
    axis.set_xlabel("m east of the plots' middle; arrows: oblique photos, squares: straight down", fontsize=8)
    axis.set_ylabel("m north", fontsize=8)
    axis.tick_params(labelsize=7.5)


def _charts(upper: Any, lower: Any, choice: Choice, error_cm: float, share: float) -> None:
    """Share measured and error by photos; what is wanted of both is a dotted line."""
    for pattern, (colour, mark) in STYLE.items():
        own = sorted((row for row in choice.tried if row[0] == pattern), key=lambda row: row[2])
        if own:
            table = np.array([[row[2], 100 * row[3], row[4]] for row in own])
            for axis, column in ((upper, 1), (lower, 2)):
                axis.plot(table[:, 0], table[:, column], mark, ms=3.4, mfc="none", mec=colour, mew=0.8, label=pattern)
    found, more = choice.plan.outcome, choice.more
    photos = choice.plan.budget.photos
    for axis, here, there in ((upper, 100 * found.share, 100 * more.share), (lower, found.error_cm, more.error_cm)):
        axis.plot([photos], [here], "*", color="black", ms=13, zorder=5, label="this plan")
        axis.plot([photos, photos + 20], [here, there], "-", color="black", lw=1.2, zorder=4, label="20 photos more")
        axis.set_xscale("log")
        axis.tick_params(labelsize=7.5)
        low, high = axis.get_xlim()
        ticks = [n for n in (10, 20, 30, 50, 100, 200, 300, 500, 1000, 2000, 3000) if low <= n <= high]
        axis.set_xticks(ticks, [str(n) for n in ticks])
        axis.set_xticks([], minor=True)
    upper.axhline(100 * share, color="0.35", lw=0.9, ls=":")
    lower.axhline(error_cm, color="0.35", lw=0.9, ls=":")
    upper.set_ylabel("stems measured, %", fontsize=8)
    lower.set_ylabel("standard error of DBH, cm", fontsize=8)
    lower.set_xlabel("photos of the flight", fontsize=8)
    lower.set_ylim(0, None)
    upper.legend(fontsize=6.8, loc="lower right")
