"""``plan-flight``: what to fly for a wanted error, as mission files and a brief."""

from __future__ import annotations

from ..core.command import Command, run_by
from ..planning.settings import PlanFlightSettings

_MAIN = (
    "plots", "dtm", "stand", "camera", "target_error_cm", "target_share_pct", "batteries", "stems_per_ha",
    "dbh_mean_cm", "dbh_sd_cm", "tree_height_m", "crown_base_m", "take_off", "output",
)  # fmt: skip
COMMAND = Command(
    name="plan-flight",
    title="Plan the flight",
    group="1 Plan",
    summary="What to fly for a wanted error here: the flight with the fewest photos, as mission files and a brief.",
    help=(
        "Compares flights over the plots (orbits, crosshatch, nadir with oblique lines; two heights, two tilts, "
        "several densities) by a model of what crowns and stems leave to be seen at breast height, and takes the one "
        "with the fewest photos that reaches the wanted standard error and share of stems. The stand is described by a "
        "canopy height model, a LiDAR cloud, the tree layer of an earlier visit, or five numbers. The flight follows "
        "the terrain, keeps its clearance over the canopy everywhere, and is as fast as trigger, blur and rolling "
        "shutter allow; what cannot be flown safely is refused. Heights in the mission files are over the take-off. "
        "Writes plan.kmz (DJI), plan.plan (QGroundControl), plan_litchi_1.csv, plan.gpkg (photos, way, footprints, "
        "plots with what is expected), brief.pdf and brief.html. Expectations are a model's; after the flight "
        "photos-to-dbh, given the plan, reports planned against got. Rules of the air and the pilot's eyes come first."
    ),
    settings=PlanFlightSettings,
    run=run_by("planning.plan", "plan_flight"),
    main=_MAIN,
    example="treedgs plan-flight --plots flight/plots.csv --dtm flight/dtm.tif --stand flight/lidar/flight_uls.laz "
    "--dbh-mean-cm 27 --dbh-sd-cm 7 --crown-base-m 9 --camera m3e --target-error-cm 0.7 --output plan",
    outputs={
        "output": "the plan's folder",
        "layer": "the plan as layers (GeoPackage)",
        "kmz": "mission for DJI Pilot 2 (WPML)",
        "plan": "mission for QGroundControl",
        "litchi": "mission for Litchi (the first file)",
        "brief": "brief for the crew (PDF)",
        "page": "the same as a page",
        "photos": "photos",
        "pattern": "pattern of the flight",
        "height_m": "height over the ground, metres",
        "heading_deg": "heading of the lines, degrees from grid north",
        "share_measured": "expected share of the stems with a DBH",
        "error_cm": "expected standard error of a DBH, median, cm",
        "clear_views": "expected clear views a stem, mean",
        "minutes": "minutes in the air",
        "batteries": "batteries",
        "gigabytes": "gigabytes of photos",
        "processing_s": "seconds to process on one thread",
        "speed_m_s": "speed, metres a second",
        "clearance_m": "lowest height over the canopy, metres",
        "more_share": "share of the stems with 20 photos more",
        "more_error_cm": "standard error with 20 photos more, cm",
    },
)
