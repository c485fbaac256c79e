"""``geotag``: MRK + RTKLIB .pos (or EXIF/XMP, or a table) -> camera stations layer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.files import ensure_writable
from ..core.progress import Reporter
from ..core.settings import param
from ..reconstruction.options import geotags_crs_option, project_crs_option


@dataclass(frozen=True, kw_only=True)
class GeotagSettings:
    """Parameters of ``geotag``."""

    photos: Path = param(kind="folder", help="Folder with the original drone photos (searched with its subfolders).")
    geotags: Path | None = param(
        None,
        kind="files",
        help="Folder or file with MRK and RTKLIB .pos or RINEX (PPK), or a CSV with name, lat, lon, h; "
        "without it EXIF/XMP positions are used.",
    )
    crs: str | None = project_crs_option()
    output: Path = param(kind="output_file", help="Camera stations layer to write.", suffixes=(".gpkg",))
    geotags_crs: str | None = geotags_crs_option()
    base: Path | None = param(
        None, help="RINEX observations of the base station, when they do not lie with the geotags."
    )
    base_position: str | None = param(
        None,
        help="Base station 'latitude, longitude, height' (degrees, ellipsoidal m), for RINEX; default: its header's.",
    )
    tagged_photos: Path | None = param(
        None,
        kind="output_folder",
        help="New folder for copies of the photos with the corrected EXIF/XMP position; originals are never changed.",
    )
    camera_delay_ms: float = param(
        0.0, help="Exposure minus mark time, for cameras triggered by cable.", unit="ms", minimum=-1000, maximum=1000
    )


def run(settings: GeotagSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, pair, interpolate, write."""
    ensure_writable(settings.output)
    from ..core.geopackage import ensure_unlocked
    from ..geotags import read_stations, write_stations
    from ..geotags.stations import OWN_LAYERS
    from ..geotags.tagged import check_target, write_tagged_copies

    ensure_unlocked(settings.output, OWN_LAYERS)
    if settings.tagged_photos is not None:
        check_target(settings.photos, settings.tagged_photos)
    with reporter.stage("geotags"):
        stations = read_stations(
            settings.photos,
            settings.geotags,
            settings.crs,
            camera_delay_ms=settings.camera_delay_ms,
            frame=settings.geotags_crs,
            base=settings.base,
            base_position=settings.base_position,
            keep_solution=settings.output.with_name(f"{settings.output.stem}_ppk.pos"),
            reporter=reporter,
        )
        write_stations(settings.output, stations)
    tagged = 0
    if settings.tagged_photos is not None:
        with reporter.stage("tag photos"):
            tagged = write_tagged_copies(stations, settings.tagged_photos, reporter)
    counts = stations.counts()
    return {
        "output": str(settings.output),
        "n_photos": len(stations),
        "n_fix": counts.get("fix", 0),
        "n_float": counts.get("float", 0),
        "n_other": counts.get("exif", 0) + counts.get("single", 0),
        "n_none": counts.get("none", 0),
        "n_flights": len(set(stations.flight.tolist())),
        "n_tagged": tagged,
    }


COMMAND = Command(
    name="geotag",
    title="Geotag drone photos",
    group="5 Steps and research",
    summary="MRK and RTKLIB .pos (or EXIF/XMP) to camera positions at the exposure, as a point layer.",
    help=(
        "Inputs: the photos, and a folder with the drone's Timestamp.MRK and the PPK solution (.pos), or a CSV by "
        "photo name. RINEX of rover and base is solved by RTKLIB (rnx2rtkp). The antenna's path is interpolated at "
        "each exposure and the lever arm applied once; heights stay ellipsoidal unless the project CRS has a height "
        "datum, which needs its geoid grid. Output: layer 'stations' (PointZ, project CRS) with quality (fix, float, "
        "single, exif, none), standard deviations (m), time, flight and gimbal angles (degrees). Photos that are "
        "blurred or show nothing are left out with a warning; geotags of other photos are refused."
    ),
    settings=GeotagSettings,
    run=run,
    main=("photos", "geotags", "crs", "output", "base", "base_position", "tagged_photos"),
    example="treedgs geotag --photos flight/images --geotags flight --crs EPSG:6344 --output stations.gpkg",
    outputs={
        "output": "camera stations layer (file)",
        "n_photos": "photos",
        "n_fix": "photos with a fixed PPK/RTK position",
        "n_float": "photos with a float position",
        "n_other": "photos with a navigation-grade position",
        "n_none": "photos without a position",
        "n_flights": "flights",
        "n_tagged": "tagged copies written",
    },
)
