"""What can be set about a flight plan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.settings import TABLES, param

#: Patterns that are tried, in the order of the brief.
PATTERNS = ("orbits", "crosshatch", "nadir-oblique")
#: Limits of the height over the canopy and over the ground, m.
MIN_CLEARANCE_M, MAX_HEIGHT_M = 3.0, 500.0


@dataclass(frozen=True, kw_only=True)
class StandNumberSettings:
    """The stand in numbers (part of the settings of ``plan-flight``)."""

    stems_per_ha: float | None = param(
        None, unit="1/ha", minimum=20, maximum=10000, help="stems a hectare, where nothing maps them"
    )
    dbh_mean_cm: float | None = param(None, unit="cm", minimum=4, maximum=150, help="mean DBH")
    dbh_sd_cm: float | None = param(None, unit="cm", minimum=0, maximum=60, help="standard deviation of the DBHs")
    tree_height_m: float | None = param(None, unit="m", minimum=3, maximum=90, help="mean height of the trees")
    crown_base_m: float | None = param(
        None, unit="m", minimum=0, maximum=70, help="mean height of the lowest living branches"
    )
    leaf_area_index: float | None = param(
        None, minimum=0, maximum=12, help="one-sided leaf area over ground area; default: from a LiDAR cloud, else 2.5"
    )


@dataclass(frozen=True, kw_only=True)
class FlyingSettings:
    """Camera, limits and place of the take-off (part of the settings of ``plan-flight``)."""

    camera: str = param(
        "m3e",
        help="camera: m3e, m3m, m4e, p4rtk, p1-35, mini4pro, air3, a photo of it, or width,height,focal in pixels, and "
        "where known the shortest time between two photos in s and the rolling shutter in ms",
    )
    exposure_ms: float = param(1.0, unit="ms", minimum=0.05, maximum=20, help="shutter: 1 ms is 1/1000 s")
    speed_m_s: float = param(8.0, unit="m/s", minimum=0.5, maximum=20, help="most speed to fly at")
    clearance_m: float = param(
        15.0, unit="m", minimum=MIN_CLEARANCE_M, maximum=100, help="least height over the canopy, anywhere on the way"
    )
    highest_m: float = param(
        110.0, unit="m", minimum=20, maximum=MAX_HEIGHT_M, help="most height over the ground, by law or permit"
    )
    take_off: str | None = param(
        None,
        help="place of the take-off, easting,northing in the CRS of the plan; all heights in the mission files are "
        "over it; default: the most open place near the plots",
    )
    flight_date: str | None = param(None, help="day of the flight, year-month-day, for the sun; default: today")


@dataclass(frozen=True, kw_only=True)
class PlanFlightSettings(FlyingSettings, StandNumberSettings):
    """Settings of ``plan-flight``."""

    plots: Path = param(
        help="plots to photograph: CSV as for stand-table, or polygons", suffixes=(*TABLES, "gpkg", "shp", "geojson")
    )
    crs: str | None = param(
        None, kind="crs", help="CRS of the plan, in metres; default: that of the DTM, or of the plots"
    )
    dtm: Path | None = param(
        None, help="terrain model; without one the ground is taken as level", suffixes=("tif", "tiff")
    )
    stand: Path | None = param(
        None,
        help="what stands there: canopy height model (GeoTIFF), LiDAR cloud, or tree layer of an earlier visit; "
        "what it does not say comes from the numbers below",
        suffixes=("tif", "tiff", "las", "laz", "gpkg", "shp", "geojson", "csv"),
    )
    target_error_cm: float = param(
        0.7, unit="cm", minimum=0.1, maximum=10, help="wanted standard error of a DBH, median of the stems"
    )
    target_share_pct: float = param(
        90.0, unit="%", minimum=10, maximum=99.5, help="wanted share of the stems that get a DBH"
    )
    batteries: int | None = param(
        None, minimum=1, maximum=50, help="instead of the targets: the best flight with so many batteries"
    )
    pattern: str = param(
        "auto", choices=("auto", *PATTERNS), help="pattern of the flight; auto: whichever needs the fewest photos"
    )
    #: Of the drawn trees; of the library only.
    seed: int = 0
    output: Path = param(
        kind="output_folder",
        help="folder for the plan's files",
        holds=("plan.gpkg", "plan.kmz", "plan.plan", "plan.json", "brief.html", "brief.pdf"),
        known_by="plan.gpkg",
    )
