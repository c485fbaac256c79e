"""From photos and geotag files to camera stations."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import replace
from itertools import chain
from pathlib import Path, PurePosixPath

import numpy as np
import pyproj

from ..core.crs import horizontal, lonlat_to_project, project_crs
from ..core.errors import CRSError, GeotagError, InputError
from ..core.files import atomic_path
from ..core.frames import satellite_frame, usual_crs, vertical_of
from ..core.map_scale import check_lon_lat, check_place
from ..core.progress import Reporter
from ..core.shown import shorten
from .agreement import check_agreement
from .control import project_of
from .datum import check_frame, geotags_frame, place_of
from .exposures import antenna_at, assign_marks, in_time, marks_of_events, note_pairing, on_map
from .gpstime import describe_utc, gps_to_utc
from .mrk import read_mrk
from .own_tags import without_faults
from .pairing import pair_photos
from .photos import Photo, read_photos
from .ppk import solve
from .rtklib import read_pos
from .sharpness import find_defects
from .sources import GeotagFiles, find_geotags
from .stations import Stations
from .tables import NamedPositions, read_position_table
from .trajectory import FIX_FLOOR_M, FLOAT_FLOOR_M, SINGLE_FLOOR_M, Interpolated
from .velocity import with_velocities

#: Standard deviation of a navigation-grade (EXIF) position, E, N, U metres.
EXIF_SD_M = np.array([2.0, 2.0, 4.0])
#: The same of a height that no photo says: those of a flight differ by less, metres.
UNKNOWN_HEIGHT_SD_M = 30.0
#: A flight ends where no photo is taken for this long.
FLIGHT_GAP_S = 60.0
#: A position that is not known better than this along the flight, as the path's time is not, is no fix, metres.
LATE_M = 0.05


def read_stations(
    photos: Path,
    geotags: Path | None,
    crs: str | pyproj.CRS | None,
    *,
    check_photos: bool = True,
    camera_delay_ms: float = 0.0,
    frame: str | None = None,
    base: Path | None = None,
    base_position: str | None = None,
    keep_solution: Path | None = None,
    control: Path | None = None,
    reporter: Reporter | None = None,
) -> Stations:
    """Camera stations of the photos in a folder.

    Args:
        photos: folder of photos (searched with its subfolders). geotags: folder or file with MRK (+ RTKLIB ``.pos``
            or RINEX), or a table of positions; None = EXIF/XMP. crs: project CRS, projected, metres; None =
            the usual one where the photos lie (:func:`treedgs_geo.core.frames.usual_crs`), by their own positions or
            by the geotags.
        check_photos: leave out blurred and empty photos. camera_delay_ms: exposure minus mark time.
        frame: geographic CRS of the geotags (default: the project CRS's datum, or
            :func:`treedgs_geo.core.frames.satellite_frame`; without ``crs`` what the header of a ``.pos`` names).
        base, base_position: the base station's RINEX file and place, see :func:`.ppk.solve`. keep_solution: where the
            solved ``.pos`` is kept.
        control: ground control points, which will place photos none of which has a position, and say their CRS.

    Raises:
        InputError: no photo. CRSError: geographic or foreign CRS. GeotagError: no position, or geotags of other photos.

    Examples:
        >>> import treedgs_geo as tg
        >>> stations = tg.read_stations(plot / "images", plot, "EPSG:6344")
        >>> stations.xyz.shape == (len(stations), 3), stations.counts()["fix"] > 0
        (True, True)
    """
    reporter = reporter or Reporter()
    found = without_faults(read_photos(Path(photos), reporter), reporter)
    own = _middle(found)
    source = geotags_frame(frame)
    files = None if geotags is None else find_geotags(Path(geotags), Path(photos))
    if crs is None and control is not None and own is None and files is None:
        crs = project_of(control)
    if crs is None:
        place, named = place_of(files) if files else (None, None)
        source = source or named
        project = _usual(own or place, Path(photos), source, reporter)
    else:
        project = project_crs(crs, own)
    for named, option in ((project if crs is not None else None, "--crs"), (source, "--geotags-crs")):
        if own is not None and named is not None:
            check_lon_lat(named, *own, option)
    if source is None and (source := satellite_frame(project)) is not None:
        reporter.info(
            f"Positions are taken to be in WGS 84 and turned into {project.name}; if the base station's are in a frame "
            "of the country, --geotags-crs says which (EPSG:4937 for ETRS89)."
        )
    if check_photos:
        found = _without_defects(found, Path(photos), reporter)
    stations = _from_exif(found, project)
    if geotags is None or files is None:
        if not stations.is_placed.any() and control is None:
            raise GeotagError(
                f"{photos}: none of the {len(found)} photos has a GPS position of its own in its EXIF; "
                "give --geotags (MRK, .pos or a CSV with name, lat, lon, h), or three or more control points (--gcp)."
            )
        if stations.is_placed.any() and (vertical := vertical_of(project)) is not None:
            reporter.warn(
                f"--crs: {project.name} has heights above {vertical.name}, EXIF heights do not say theirs and were "
                "left as they are: do not mix them with a DTM; give PPK geotags for true heights."
            )
        check_place(project, stations.xyz, "--crs", reporter, photos=True)
        _note_unplaced(stations, reporter)
        return with_velocities(stations, found, np.full_like(stations.xyz, np.nan))
    written, track, marked = stations, Interpolated.nothing(len(stations)), np.full_like(stations.xyz, np.nan)
    if files.tables:
        stations = _from_table(stations, read_position_table(files.tables[0], project, source), reporter)
    else:
        with tempfile.TemporaryDirectory(prefix="treedgs-ppk-") as scratch:
            if files.rinex and not (files.pos or files.events):
                solution = solve(files.rinex, base, base_position, Path(scratch), reporter)
                files.pos.append(solution)
                if keep_solution is not None:
                    with atomic_path(keep_solution) as temporary:
                        shutil.copyfile(solution, temporary)
            elif files.rinex:
                why = f", the solution {files.pos[0].name} is there" if files.pos else ""
                reporter.info(f"{files.rinex[0].name}: RINEX left alone{why}.")
            delay_s = camera_delay_ms / 1000
            stations, track, marked = _from_marks(stations, found, files, project, source, delay_s, reporter)
    check_place(project, stations.xyz, str(files.tables[0] if files.tables else geotags), reporter, photos=True)
    stations = check_agreement(stations, written, marked, track.off_m, Path(geotags), reporter)
    if not stations.is_placed.any():
        raise GeotagError(
            f"{geotags}: gives none of the {len(found)} photos a position; check that it belongs to this flight."
        )
    _note_unplaced(stations, reporter)
    return with_velocities(stations, found, track.velocity)


def _usual(
    lon_lat: tuple[float, float] | None, photos: Path, frame: pyproj.CRS | None, reporter: Reporter
) -> pyproj.CRS:
    if lon_lat is None:
        raise CRSError(
            f"{photos}: neither its photos nor the geotags say a longitude and latitude, which would tell the "
            "project's CRS; give --crs, projected and in metres."
        )
    crs, why = usual_crs(*lon_lat, frame)
    reporter.info(f"Project CRS: EPSG:{crs.to_epsg()}, {crs.name}: {why}; --crs takes another.")
    return crs


def _middle(photos: list[Photo]) -> tuple[float, float] | None:
    """Longitude and latitude of the photo in the middle: one with a wrong position does not decide on the CRS."""
    placed = sorted((photo.lon_deg, photo.lat_deg) for photo in photos if photo.has_position)
    return placed[len(placed) // 2] if placed else None


def _without_defects(photos: list[Photo], folder: Path, reporter: Reporter) -> list[Photo]:
    defects = find_defects([photo.path for photo in photos])
    for reason in sorted(set(defects.values())):
        names = [photo.name for photo in photos if defects.get(photo.path) == reason]
        reporter.warn(f"Left out {len(names)} photos: each {reason}: {shorten(names)}.")
    kept = [photo for photo in photos if photo.path not in defects]
    if not kept:
        reasons = sorted(set(defects.values()))
        advice = "look at them, copy broken ones again from the drone, and fly again if it was the camera"
        if "16 bits" in reasons[0]:
            advice = "write 8-bit JPEGs with the brightness stretched, keeping the EXIF"
        raise InputError(
            f"{folder}: none of its {len(photos)} photos is usable (each {' or '.join(reasons)}); {advice}."
        )
    return kept


def _from_exif(photos: list[Photo], crs: pyproj.CRS) -> Stations:
    """Positions as the photos say them; EXIF names no height datum, so heights stay as they are."""
    flat = horizontal(crs)
    xyz, sd = np.full((2, len(photos), 3), np.nan)
    quality = ["none"] * len(photos)
    no_height = not any(np.isfinite(photo.height_m) for photo in photos)
    for i, photo in enumerate(photos):
        if not photo.has_position or not (no_height or np.isfinite(photo.height_m)):
            continue
        height = float(np.nan_to_num(photo.relative_altitude_m)) if no_height else photo.height_m
        xyz[i] = lonlat_to_project(flat, *np.array([[photo.lon_deg], [photo.lat_deg], [height]]))[0]
        quality[i], sd[i] = _grade(photo.rtk_flag, photo.sd, "exif")
        if no_height:
            sd[i, 2] = UNKNOWN_HEIGHT_SD_M
    names, paths, utc = [p.name for p in photos], [p.path for p in photos], np.array([p.time_s for p in photos])
    said = np.array([(p.yaw_deg, p.pitch_deg, p.roll_deg, p.relative_altitude_m) for p in photos]).reshape(-1, 4)
    yaw, pitch, roll, above = said.T.copy()
    flight = split_flights(names, utc)
    return Stations(names, paths, xyz, sd, quality, utc, flight, yaw, pitch, roll, above, crs)


def _grade(flag: float, sd: np.ndarray, otherwise: str) -> tuple[str, np.ndarray]:
    """DJI's RTK flag -> quality and believed standard deviation."""
    known = np.where(np.isfinite(sd), sd, 0.0)
    if 50 <= flag <= 59:
        return "fix", np.maximum(known, FIX_FLOOR_M)
    if 32 <= flag <= 49:
        return "float", np.maximum(known, FLOAT_FLOOR_M)
    if otherwise == "single":
        return "single", np.maximum(known, SINGLE_FLOOR_M)
    return "exif", np.maximum(known, EXIF_SD_M)


def split_flights(names: list[str], utc: np.ndarray) -> np.ndarray:
    """(N,) flight numbers, 0-based: a new one after a pause of more than :data:`FLIGHT_GAP_S` or in another folder."""
    folders = [str(PurePosixPath(name).parent) for name in names]
    order = sorted(range(len(names)), key=lambda i: (np.nan_to_num(utc[i], nan=-1.0), names[i]))
    flight = np.zeros(len(names), int)
    last: dict[str, tuple[float, int]] = {}
    count = 0
    for i in order:
        before = last.get(folders[i])
        if before is None or utc[i] - before[0] > FLIGHT_GAP_S:
            flight[i], count = count, count + 1
        else:
            flight[i] = before[1]
        last[folders[i]] = (utc[i], int(flight[i]))
    return flight


def _from_table(stations: Stations, table: NamedPositions, reporter: Reporter) -> Stations:
    unsure: list[str] = []
    rows = {name.lower(): row for row, name in enumerate(table.names)}
    rows |= {Path(name).stem.lower(): row for name, row in list(rows.items())}
    xyz, sd, quality = np.full_like(stations.xyz, np.nan), np.full_like(stations.sd, np.nan), ["none"] * len(stations)
    for i, name in enumerate(stations.names):
        row = rows.get(Path(name).name.lower(), rows.get(Path(name).stem.lower()))
        if row is None:
            continue
        xyz[i], known = table.xyz[row], table.sd[row]
        if np.isfinite(known[:2]).all():
            known = np.where(np.isfinite(known), known, 2 * known[:2].max())
            sd[i] = np.maximum(known, FIX_FLOOR_M)
            quality[i] = "single" if known.max() > 1 else "fix" if known.max() < 0.1 else "float"
        else:
            # Claiming more than navigation grade would be a guess.
            sd[i], quality[i] = EXIF_SD_M, "single"
            unsure.append(name)
    if unsure:
        reporter.warn(
            f"{table.path.name}: gives no accuracy for {len(unsure)} of {len(stations)} photos, so their positions "
            f"count as those of navigation ({EXIF_SD_M[0]:.0f} m); if they are better, add their standard deviations "
            "in metres as columns sd_e, sd_n, sd_u."
        )
    if not np.isfinite(xyz).any():
        raise GeotagError(
            f"{table.path}: names none of the {len(stations)} photos (it has {table.names[0]!r}, the folder "
            f"{Path(stations.names[0]).name!r}); give the table of these photos."
        )
    return replace(stations, xyz=xyz, sd=sd, quality=quality)


def _from_marks(
    stations: Stations,
    photos: list[Photo],
    files: GeotagFiles,
    crs: pyproj.CRS,
    source: pyproj.CRS | None,
    delay_s: float,
    reporter: Reporter,
) -> tuple[Stations, Interpolated, np.ndarray]:
    """The stations by their marks; the cameras by the path or by the marks alone; (N, 3) positions as the MRK has them,
    NaN where they are unknown or not asked for."""
    marks = [read_mrk(path) for path in files.mrk] or [marks_of_events(path, reporter) for path in files.events]
    if not marks:
        raise GeotagError(
            f"{(files.pos or files.rinex)[0]}: gives the antenna's path but no exposure times; put the drone's "
            "Timestamp.MRK beside it."
        )
    tracks = [read_pos(path) for path in (files.pos or files.events)]
    for note in chain(*(each.notes for each in marks), *(track.notes for track in tracks)):
        reporter.warn(note)
    if delay_s and not files.pos:
        reporter.warn(
            "--camera-delay-ms: there is no antenna path between the exposures, so the delay is not applied; "
            "give the PPK solution (.pos)."
        )
    for track in tracks:
        if track.datum:
            reporter.info(
                f"{track.path.name}: {len(track.gps_s)} epochs, {np.mean(track.quality == 1):.0%} fixed, datum "
                f"{track.datum}."
            )
        check_frame(track, crs, source, reporter)
    found, marked = Interpolated.nothing(len(stations)), np.full_like(stations.xyz, np.nan)
    utc = stations.utc.copy()
    for each, group in assign_marks(marks, photos):
        pairing = pair_photos([photos[i] for i in group], each)
        rows = pairing.rows
        paired = np.array(group)[rows >= 0]
        own = rows[rows >= 0]
        note_pairing(each, pairing, [photos[i].name for i in group], reporter)
        utc[np.array(group)[rows < 0]] = pairing.utc[rows < 0]
        utc[paired] = gps_to_utc(each.gps_s[own] + delay_s)
        if tracks:
            late_s = 0.0
            if files.pos:
                tracks, late_s = in_time(each, own, tracks, stations.xyz[paired, :2], crs, source, delay_s, reporter)
            solved = antenna_at(each, own, tracks, crs, source, delay_s)
            late_m = late_s * np.abs(np.nan_to_num(solved.velocity))
            solved.quality[(solved.quality == "fix") & (late_m.max(axis=1) > LATE_M)] = "float"
            found.put(paired, solved._replace(sd=np.hypot(solved.sd, late_m)))
            seen = each.is_placed[own]
            if files.mrk and seen.any():
                marked[paired[seen]] = on_map(each, crs, source, own[seen])
        else:
            found.xyz[paired] = on_map(each, crs, source, own)
            for i, row in zip(paired, own, strict=True):
                found.quality[i], found.sd[i] = _grade(each.flag[row], each.sd[row], "single")
    if tracks and not np.isfinite(found.xyz).any():
        track, each = tracks[0], marks[0]
        first, last = gps_to_utc(track.gps_s[[0, -1]])
        raise GeotagError(
            f"{track.path}: covers {describe_utc(first)} to {describe_utc(last)}, but the exposures of "
            f"{each.path.name} start at {describe_utc(float(gps_to_utc(each.gps_s[0])))}; give the solution of this "
            "flight."
        )
    flight, quality = split_flights(stations.names, utc), found.quality.tolist()
    stations = replace(stations, xyz=found.xyz, sd=found.sd, quality=quality, utc=utc, flight=flight)
    return stations, found, marked


def _note_unplaced(stations: Stations, reporter: Reporter) -> None:
    missing = [name for name, placed in zip(stations.names, stations.is_placed, strict=True) if not placed]
    if missing:
        reporter.warn(f"{len(missing)} of {len(stations)} photos have no position: {shorten(missing)}.")
    counts = ", ".join(f"{count} {quality}" for quality, count in stations.counts().items())
    reporter.info(
        f"Camera stations: {len(stations)} photos in {len(set(stations.flight.tolist()))} flights ({counts})."
    )
