"""Copies of the photos with the corrected positions in EXIF and XMP, by ExifTool. Originals are only ever read."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pyproj

from ..core.children import find_program
from ..core.crs import horizontal
from ..core.errors import GeotagError, InputError, MissingComponentError, OutputError
from ..core.files import atomic_folder
from ..core.frames import moved, satellite_frame, transform
from ..core.progress import Reporter
from .stations import Stations

#: Quality -> what DJI's RtkFlag says (0 none, 16 single, 34 float, 50 fixed).
_FLAG = {"fix": 50, "float": 34, "single": 16, "exif": 0}
_BATCH = 50
#: Without a configuration: ExifTool would execute a ``.ExifTool_config`` of the current folder where HOME is not set.
_QUIETLY = ("-config", "", "-@", "-", "-common_args", "-q", "-m")


def check_target(photos: Path, target: Path) -> None:
    """Refuse a folder for the copies that could touch an original or another file.

    Raises:
        InputError: the photo folder itself, or a folder around or inside it.
    """
    source, there = Path(photos).resolve(), Path(target).resolve()
    if there == source or source in there.parents or there in source.parents:
        raise InputError(
            f"{target}: is the photo folder or lies around or inside it; choose a folder of its own, the "
            "originals are never changed."
        )


def write_tagged_copies(stations: Stations, target: Path, reporter: Reporter) -> int:
    """Copy every placed photo into ``target`` (same relative names) with corrected tags; returns their number.

    Longitude, latitude and ellipsoidal height are written on the datum of the project CRS, or in WGS 84
    (:func:`treedgs_geo.core.frames.satellite_frame`): EXIF GPS (with the datum's
    name and the horizontal error) and XMP ``drone-dji`` (position, AbsoluteAltitude, RtkFlag, RtkStd*).

    Raises:
        MissingComponentError: ExifTool is not installed. GeotagError: it refused. OutputError: not enough room.
    """
    program = find_program("exiftool")
    if program is None:
        raise MissingComponentError(
            f"{target}: writing tags needs ExifTool, which was not found; install the Debian "
            "package libimage-exiftool-perl."
        )
    geographic = satellite_frame(stations.crs) or horizontal(stations.crs).geodetic_crs
    if geographic is None:
        raise GeotagError(
            f"{target}: {stations.crs.name} is not tied to a datum, expected one with longitude and latitude."
        )
    wanted = np.flatnonzero(stations.is_placed)
    size = sum(stations.paths[i].stat().st_size for i in wanted)
    target.parent.mkdir(parents=True, exist_ok=True)
    if 1.1 * size > shutil.disk_usage(target.parent).free:
        raise OutputError(
            f"{target}: the copies need {size / 1e9:.1f} GB, more than is free there; choose another disk."
        )
    # Longitude, latitude, ellipsoidal height; NaN where unplaced.
    if stations.crs.is_compound:
        places = transform(stations.crs, geographic.to_3d(), stations.xyz, str(target))
    else:
        flat = moved(stations.xyz[:, :2], stations.crs, geographic.to_2d())
        places = np.column_stack([flat, stations.xyz[:, 2]])
    with atomic_folder(target) as folder:
        for first in range(0, len(wanted), _BATCH):
            batch = wanted[first : first + _BATCH]
            lines: list[str] = []
            for i in batch:
                source, copy = stations.paths[i].resolve(), folder / stations.names[i]
                copy.parent.mkdir(parents=True, exist_ok=True)
                lines += [*_tags(stations, i, places[i], geographic), "-o", str(copy), str(source), "-execute"]
            command, asked = [program, *_QUIETLY, "-charset", "filename=utf8"], "\n".join(lines) + "\n"
            done = subprocess.run(command, input=asked, capture_output=True, text=True, check=False)
            lost = [stations.names[i] for i in batch if not (folder / stations.names[i]).exists()]
            if lost:
                said = (done.stderr.strip().splitlines() or ["no message"])[0][:160]
                raise GeotagError(
                    f"{lost[0]}: ExifTool wrote no tagged copy ({said}); leave the photo out or copy it "
                    "again from the drone."
                )
            reporter.progress((first + len(batch)) / len(wanted))
    left = len(stations) - len(wanted)
    if left:
        reporter.warn(f"{left} photos have no position and were not copied to {target.name}.")
    return len(wanted)


def _tags(stations: Stations, i: int, place: np.ndarray, geographic: pyproj.CRS) -> list[str]:
    lon, lat, height = (float(v) for v in place)
    east, north, up = (float(v) for v in stations.sd[i])
    tags = [
        f"-EXIF:GPSLatitude={abs(lat):.10f}",
        f"-EXIF:GPSLatitudeRef={'N' if lat >= 0 else 'S'}",
        f"-EXIF:GPSLongitude={abs(lon):.10f}",
        f"-EXIF:GPSLongitudeRef={'E' if lon >= 0 else 'W'}",
        f"-EXIF:GPSAltitude={abs(height):.4f}",
        f"-EXIF:GPSAltitudeRef#={0 if height >= 0 else 1}",
        f"-EXIF:GPSMapDatum={geographic.name}",
        f"-XMP-drone-dji:GpsLatitude={lat:.10f}",
        f"-XMP-drone-dji:GpsLongitude={lon:.10f}",
        f"-XMP-drone-dji:AbsoluteAltitude={height:+.4f}",
        f"-XMP-drone-dji:RtkFlag={_FLAG.get(stations.quality[i], 0)}",
    ]
    if np.isfinite([east, north, up]).all():
        tags += [
            f"-EXIF:GPSHPositioningError={np.hypot(east, north):.4f}",
            f"-XMP-drone-dji:RtkStdLon={east:.5f}",
            f"-XMP-drone-dji:RtkStdLat={north:.5f}",
            f"-XMP-drone-dji:RtkStdHgt={up:.5f}",
        ]
    return tags
