"""Ground control and check points: surveyed places on the ground, and where photos show them."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np
import pyproj
from PIL import Image

from ..core.crs import lonlat_to_project
from ..core.errors import InputError
from ..core.frames import same_datum, transform
from ..core.map_scale import zone_that_fits
from ..core.progress import Reporter
from .control_files import ControlRow, read_control_rows
from .photos import shorten
from .stations import Stations

#: Standard deviation of a point for which the file gives none, E, N, U metres: RTK GNSS on a pole, and pricking.
CONTROL_SD_M = np.array([0.02, 0.02, 0.03])
#: A point farther from the nearest photo lies elsewhere, metres.
MAX_AWAY_M = 5000.0
#: Ground that lies further from what precise geotags and the drone's barometer say has another height datum, metres.
_ODD_HEIGHT_M = 20.0
#: Positions that are good enough to compare heights with.
_PRECISE = ("fix", "float")


@dataclass(frozen=True)
class ControlPoints:
    """K points on the ground and M marks of them in photos.

    labels: K, each once. xyz: (K, 3) project CRS, metres, in the heights of the geotags. sd_m: (K, 3) E, N, U.
    is_check: (K,) bool, only compared with, never adjusted to. point: (M,) number of the point. photo: (M,) number of
    the photo among the stations. pixels: (M, 2) u, v; the upper-left corner of the photo is (0, 0), the centre of its
    first pixel (0.5, 0.5). Every point has two marks or more, each in another photo.
    """

    labels: list[str]
    xyz: np.ndarray
    sd_m: np.ndarray
    is_check: np.ndarray
    point: np.ndarray
    photo: np.ndarray
    pixels: np.ndarray

    def __len__(self) -> int:
        return len(self.labels)

    def digest(self) -> str:
        """Short hash over places, accuracies, use and marks."""
        digest = hashlib.sha256(json.dumps([self.labels, self.is_check.tolist()]).encode())
        for values in (self.xyz, self.sd_m, self.point, self.photo, self.pixels):
            digest.update(np.ascontiguousarray(values, float).tobytes())
        return digest.hexdigest()[:16]


def read_control(path: Path, stations: Stations, reporter: Reporter | None = None) -> ControlPoints:
    """Control and check points for the photos of ``stations``, in their CRS.

    Formats: ODM's ``gcp_list.txt`` (line 1 the CRS, then ``x y z px py photo [label] [check]``) and CSV with a header
    (label, easting, northing, height or lon, lat, height; photo, u, v; optional sd_h_m, sd_v_m, kind, epsg). Pixels
    count from the upper-left corner of the photo as it lies in the file. Longitude and latitude in WGS 84, and
    coordinates without a CRS, are taken on the project's datum, as geotags are. All points are control points but those
    whose ``kind`` is check or whose label ends in ``_check``.

    Args:
        path: the file. stations: photos with their places. reporter: warned of marks and points that are left out, and
            of heights that look like another datum.

    Raises:
        InputError: what is wrong in which line. CRSError: an unknown CRS, one that cannot be turned into the project's.
    """
    path, reporter = Path(path), reporter or Reporter()
    crs, rows = read_control_rows(path)
    rows = _with_labels(path, rows)
    groups: dict[str, list[ControlRow]] = {}
    for row in rows:
        groups.setdefault(row.label, []).append(row)
    labels = list(groups)
    _check_places(path, groups)
    xyz = _in_project(path, crs, np.array([group[0].place for group in groups.values()]), stations.crs)
    _check_distance(path, [group[0] for group in groups.values()], xyz, stations)
    _check_heights(path, xyz, stations, reporter)
    sd = np.array([_deviations(group) for group in groups.values()])
    check = np.array([_use(path, group) for group in groups.values()], bool)

    marks = _marks(path, rows, stations, reporter)
    seen = Counter(row.label for row, _ in marks)
    lost = [label for label in labels if seen[label] < 2]
    if len(lost) == len(labels):
        raise InputError(
            f"{path}: none of its {len(labels)} points is marked in two photos of this flight, expected two marks or "
            "more a point; mark them in more photos."
        )
    if lost:
        reporter.warn(
            f"{path.name}: {len(lost)} of {len(labels)} points are marked in fewer than two photos and left out: "
            f"{shorten(lost)}."
        )
    kept = [label for label in labels if seen[label] >= 2]
    chosen = np.array([seen[label] >= 2 for label in labels])
    number = {label: i for i, label in enumerate(kept)}
    used = [(row, photo) for row, photo in marks if seen[row.label] >= 2]
    reporter.info(
        f"{path.name}: {int((~check[chosen]).sum())} control and {int(check[chosen].sum())} check points, {len(used)} "
        "marks."
    )
    return ControlPoints(
        kept,
        xyz[chosen],
        sd[chosen],
        check[chosen],
        np.array([number[row.label] for row, _ in used]),
        np.array([photo for _, photo in used]),
        np.array([row.pixel for row, _ in used], float),
    )


def _with_labels(path: Path, rows: list[ControlRow]) -> list[ControlRow]:
    """The rows with a label each: points without one are known by their coordinates.

    Raises:
        InputError: two labels for the same coordinates.
    """
    named: dict[tuple[float, float, float], ControlRow] = {}
    for row in rows:
        before = named.setdefault(row.place, row) if row.label else None
        if before is not None and before.label != row.label:
            raise InputError(
                f"{path}, lines {before.line} and {row.line}: points {before.label!r} and {row.label!r} have the same "
                "coordinates; correct one of them, or give them one label."
            )
    found, taken = [], {row.label for row in rows}
    for row in rows:
        if not row.label and row.place not in named:
            label = next(f"point {n}" for n in range(1, len(rows) + 2) if f"point {n}" not in taken)
            taken.add(label)
            named[row.place] = replace(row, label=label)
        found.append(row if row.label else replace(row, label=named[row.place].label))
    return found


def _check_places(path: Path, groups: dict[str, list[ControlRow]]) -> None:
    for label, (first, *others) in groups.items():
        other = next((row for row in others if row.place != first.place), None)
        if other is not None:
            raise InputError(
                f"{path}, lines {first.line} and {other.line}: point {label!r} has two different coordinates; correct "
                "one, or give it another label."
            )


def _in_project(path: Path, crs: pyproj.CRS | None, places: np.ndarray, project: pyproj.CRS) -> np.ndarray:
    """(K, 3) coordinates of the file in the project CRS."""
    if crs is None:
        return places
    if not crs.is_geographic or crs.is_compound:
        return transform(crs, project, places, str(path))
    if (np.abs(places[:, 0]) > 180).any() or (np.abs(places[:, 1]) > 90).any():
        raise InputError(f"{path}: holds no degrees, expected longitude, latitude, height; check its CRS, {crs.name}.")
    frame = None if same_datum(crs, pyproj.CRS("EPSG:4326")) else crs.to_3d()
    return lonlat_to_project(project, places[:, 0], places[:, 1], places[:, 2], frame)


def _check_distance(path: Path, rows: list[ControlRow], xyz: np.ndarray, stations: Stations) -> None:
    placed = stations.xyz[stations.is_placed][:, :2]
    away = np.array([np.linalg.norm(placed - place, axis=1).min(initial=np.inf) for place in xyz[:, :2]])
    worst = int(np.argmax(away))
    if not len(placed) or away[worst] <= MAX_AWAY_M:
        return
    hint = ""
    if np.isfinite(xyz).all():
        zone = zone_that_fits(
            stations.crs,
            xyz[:, :2],
            lambda xy: bool(max(np.linalg.norm(placed - place, axis=1).min() for place in xy) <= MAX_AWAY_M),
        )
        hint = f" (in EPSG:{zone.to_epsg()}, {zone.name}, all would lie there)" if zone is not None else ""
    raise InputError(
        f"{path}, line {rows[worst].line}: point {rows[worst].label!r} lies {away[worst] / 1000:.0f} km from the "
        f"nearest photo, expected it under the flight{hint}; check the coordinates, their order and their CRS."
    )


def _check_heights(path: Path, xyz: np.ndarray, stations: Stations, reporter: Reporter) -> None:
    """Heights above sea level among ellipsoidal ones bend or lift the whole block."""
    precise = np.array([quality in _PRECISE for quality in stations.quality], bool)
    ground = (stations.xyz[:, 2] - stations.relative_altitude_m)[precise]
    ground = ground[np.isfinite(ground)]
    if not len(ground):
        return
    apart = float(np.median(xyz[:, 2]) - np.median(ground))
    if abs(apart) > _ODD_HEIGHT_M:
        reporter.warn(
            f"{path.name}: the points lie {apart:+.0f} m from the place where the drone took off (median), by the "
            "photos' positions; if that is not the terrain, their heights have another zero (above sea level, where "
            "those of the geotags are ellipsoidal): name it in the CRS, for example EPSG:6344+5703."
        )


def _deviations(rows: list[ControlRow]) -> np.ndarray:
    """(3,) E, N, U metres of one point: the largest that its rows give, else :data:`CONTROL_SD_M`."""
    given = np.fmax.reduce([np.array(row.sd_m) for row in rows])
    return np.where(np.isfinite(given), given, CONTROL_SD_M)


def _use(path: Path, rows: list[ControlRow]) -> bool:
    """True for a check point."""
    says = [row for row in rows if row.is_check is not None]
    other = next((row for row in says if row.is_check != says[0].is_check), None)
    if other is not None:
        raise InputError(
            f"{path}, lines {says[0].line} and {other.line}: point {other.label!r} is control in one and check in the "
            "other; decide for one."
        )
    return bool(says and says[0].is_check)


def _marks(path: Path, rows: list[ControlRow], stations: Stations, reporter: Reporter) -> list[tuple[ControlRow, int]]:
    """The rows whose photo is there, with its number."""
    found, missing = [], []
    sizes: dict[int, tuple[int, int]] = {}
    before: dict[tuple[str, int], int] = {}
    named = _photos_by_name(stations)
    for row in rows:
        photo = _photo_number(path, row, stations, named)
        if photo is None:
            missing.append(row.photo)
            continue
        if photo not in sizes:
            with Image.open(stations.paths[photo]) as image:
                sizes[photo] = image.size
        width, height = sizes[photo]
        if not (0 <= row.pixel[0] <= width and 0 <= row.pixel[1] <= height):
            raise InputError(
                f"{path}, line {row.line}: pixel {row.pixel[0]:g}, {row.pixel[1]:g} lies outside of {row.photo} "
                f"({width} x {height} px); mark the point in the photo as it is in the folder, neither reduced nor "
                "turned."
            )
        line = before.setdefault((row.label, photo), row.line)
        if line != row.line:
            raise InputError(
                f"{path}, lines {line} and {row.line}: point {row.label!r} is marked twice in {row.photo}; keep one."
            )
        found.append((row, photo))
    if not found:
        raise InputError(
            f"{path}: names none of the {len(stations)} photos (it has {rows[0].photo!r}, the folder "
            f"{stations.names[0]!r}); give the file of these photos."
        )
    if missing:
        reporter.warn(
            f"{path.name}: {len(missing)} of {len(rows)} marks are in photos that are not there or not used, and are "
            f"left out: {shorten(list(dict.fromkeys(missing)))}."
        )
    return found


def _photos_by_name(stations: Stations) -> list[dict[str, list[int]]]:
    """Numbers of the photos by relative name, by file name and by file name without ending, lower case."""
    found: list[dict[str, list[int]]] = [{}, {}, {}]
    for i, name in enumerate(stations.names):
        whole = PurePosixPath(name.lower())
        for names, key in zip(found, (str(whole), whole.name, whole.stem), strict=True):
            names.setdefault(key, []).append(i)
    return found


def _photo_number(path: Path, row: ControlRow, stations: Stations, named: list[dict[str, list[int]]]) -> int | None:
    """Number of the row's photo, ``None`` when it is not there."""
    asked = PurePosixPath(row.photo.replace("\\", "/").lower())
    for names, key in zip(named, (str(asked), asked.name, asked.name), strict=True):
        hits = names.get(key, [])
        if len(hits) > 1:
            raise InputError(
                f"{path}, line {row.line}: photo {row.photo!r} is both {stations.names[hits[0]]} and "
                f"{stations.names[hits[1]]}; write its folder before it."
            )
        if hits:
            return hits[0]
    return None
