"""The brief for the crew: one page with what to fly, why, when, and what to check."""

from __future__ import annotations

from pathlib import Path

from .. import __version__
from ..core.costs import time_text
from ..report.blocks import Cards, Document, Picture, Sentences, Table, facts_table
from ..report.html import write_html
from ..report.pdf import write_pdf
from .choose import MORE, Choice
from .drones import RESERVE, DroneCamera
from .safety import Limits
from .site import PlanSite
from .sun import LOWEST_SUN_DEG, SunDay


def write_brief(
    folder: Path, title: str, choice: Choice, site: PlanSite, camera: DroneCamera, limits: Limits, clearance_m: float,
    heading: tuple[float, str], sun: SunDay, take_off: tuple[float, float, float], picture: bytes,
) -> list[Path]:  # fmt: skip
    """``brief.html`` and ``brief.pdf``. take_off: longitude, latitude, height."""
    plan = choice.plan
    budget, found = plan.budget, plan.outcome
    cards = [
        ("Photos", f"{budget.photos}", f"{budget.gigabytes:.1f} GB"),
        ("In the air", f"{budget.minutes:.0f} min", batteries_of(budget.batteries)),
        ("Stems measured", f"{100 * found.share:.0f} %", "expected"),
        ("Standard error of DBH", f"{found.error_cm:.2f} cm", "expected, median"),
        ("Clear views a stem", f"{found.views:.1f}", "expected, mean"),
        ("Processing", time_text(budget.processing_s), "one thread" + (", rough" if budget.outside else "")),
    ]
    document = Document(
        title,
        f"{camera.name}; TreeDGS {__version__}; figures are expectations of a model",
        [
            Cards(cards),
            Sentences(site.notes, "Read this first"),
            Picture("map of the flight; photos against share measured and error", picture),
            _flight_table(choice, site, camera, limits, clearance_m, heading, take_off),
            Sentences(_more(choice)),
            Sentences(checklist(choice, camera, limits, sun, clearance_m)),
        ],
    )
    return [write_html(folder / "brief.html", document), write_pdf(folder / "brief.pdf", document)]


def batteries_of(count: int) -> str:
    """``1 battery``, ``2 batteries``."""
    return f"{count} {'battery' if count == 1 else 'batteries'}"


def _more(choice: Choice) -> list[str]:
    found, more = choice.plan.outcome, choice.more
    if more is found:
        return [f"No denser flight of this pattern was tried: what {MORE} photos more would give is not known."]
    return [
        f"{MORE} photos more, at the best places, would give {100 * more.share:.0f} % of the stems (now "
        f"{100 * found.share:.0f} %) and {more.error_cm:.2f} cm (now {found.error_cm:.2f} cm)."
    ]


def _flight_table(
    choice: Choice, site: PlanSite, camera: DroneCamera, limits: Limits, clearance_m: float, heading: tuple[float, str],
    take_off: tuple[float, float, float],
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


def checklist(choice: Choice, camera: DroneCamera, limits: Limits, sun: SunDay, clearance_m: float) -> list[str]:
    """What the crew checks, in the order of the day."""
    budget = choice.plan.budget
    return [
        f"Sun: {sun_text(sun)}; an even overcast all day is better still. Fly without a break: shadows move.",
        "Wind below 4 m/s at the crowns, leaves and ground dry, no people under the flight; permits and airspace "
        "checked.",
        "Take off within 3 m of the stated place. Elsewhere every height is wrong by the difference of the ground: "
        f"plan again with --take-off. Watch the first line: {clearance_m:.0f} m over the crowns, no less.",
        "Base station or RTK corrections: fixed before take-off, logging raw data from 10 min before to 10 min after; "
        "note antenna height and point.",
        f"Camera: shutter priority 1/{1000 / limits.exposure_ms:.0f} s or shorter, "
        f"{'mechanical shutter, ' if camera.readout_ms == 0 else ''}ISO as low as that allows; focus on the ground "
        "from flying height, then manual; distortion correction off; JPEG, full size.",
        f"{batteries_of(budget.batteries)} flown to {100 * RESERVE:.0f} % and one spare; card with "
        f"{max(1.0, 2 * budget.gigabytes):.0f} GB free.",
        f"After landing: {budget.photos} photos on the card, sharp at 100 %; tape a sample (tape-sample). Then "
        "photos-to-dbh with --flight-plan plan.gpkg reports planned against got.",
    ]


def sun_text(sun: SunDay) -> str:
    """The hours with enough sun, UTC, and how high it gets."""
    top = sun.elevation_deg[sun.noon]
    day = (sun.utc[sun.noon]).date().isoformat()
    if not sun.windows:
        return f"on {day} it stays below {LOWEST_SUN_DEG:.0f}° (highest {top:.0f}°): fly around noon, or under overcast"
    hours = " and ".join(f"{begin:%H:%M} to {end:%H:%M}" for begin, end in sun.windows)
    noon = sun.utc[sun.noon]
    around = max(abs((edge - noon).total_seconds()) / 3600 for window in sun.windows for edge in window)
    return (
        f"on {day} above {LOWEST_SUN_DEG:.0f}° from {hours} UTC, {around:.1f} h either side of the highest sun "
        f"({top:.0f}° at {noon:%H:%M})"
    )
