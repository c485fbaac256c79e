"""Settings that every verb which reconstructs photos has (standard library only)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..core.settings import param


@dataclass(frozen=True, kw_only=True)
class ReconstructOptions:
    """How to reconstruct; the defaults suit drone photos of 1 to 60 MP."""

    max_features: int = param(
        8000, kind="integer", help="Most features per photo", minimum=500, maximum=60000, advanced=True
    )
    max_image_size: int = param(
        4000,
        kind="integer",
        unit="px",
        help="Photos are reduced to this longer side for the features",
        minimum=500,
        maximum=20000,
        advanced=True,
    )
    neighbours: int = param(
        20, kind="integer", help="Photos that each photo is matched with", minimum=4, maximum=200, advanced=True
    )
    threads: int = param(0, kind="integer", help="Processor threads, 0 = all", minimum=0, maximum=256, advanced=True)
    seed: int = param(1, kind="integer", help="Random seed", minimum=0, advanced=True)
    keep_cache: bool = param(False, kind="flag", help="Keep the feature database after a successful run", advanced=True)


def gcp_option() -> Any:
    """Setting ``gcp``: ground control and check points."""
    return param(
        None,
        kind="file",
        help="Ground control and check points: gcp_list.txt of OpenDroneMap, or CSV with label, easting, northing, "
        "height (or lon, lat, height), photo, u, v; for drones without PPK, and to check any block.",
        suffixes=(".txt", ".csv"),
    )


def calibration_option() -> Any:
    """Setting ``calibration``: what an earlier reconstruction found about the camera."""
    return param(
        None,
        kind="file",
        help="camera.json of an earlier reconstruction with the same camera and photo size; without it the lens is "
        "taken from the photos' metadata.",
        suffixes=(".json",),
        advanced=True,
    )


def project_crs_option() -> Any:
    """``crs`` of the verbs that read photos."""
    return param(
        None,
        kind="crs",
        help="Project CRS, projected and in metres, for example EPSG:6344, or with a height datum, EPSG:6344+5703; "
        "default: the UTM zone where the photos lie, in the datum that is usual there",
    )


def geotags_crs_option() -> Any:
    """Setting ``geotags_crs``: the frame of the geotags, where it is not the project's."""
    return param(
        None,
        kind="crs",
        help="Reference frame of the geotags (geographic), for example EPSG:7912 for ITRF2014; default: the project's.",
    )
