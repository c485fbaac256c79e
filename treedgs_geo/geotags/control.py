"""Ground control and check points: surveyed places on the ground, and where photos show them; known lengths between
marked points; their files: ODM's ``gcp_list.txt`` and CSV, one row for each point marked in a photo."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
import pandas as pd
import pyproj
from PIL import Image

from ..core.columns import FoundColumn, columns, epsg_crs, line_of, measured, numbers, refuse_bounds, require
from ..core.crs import lonlat_to_project
from ..core.errors import CRSError, InputError
from ..core.frames import same_datum, transform, usual_crs
from ..core.map_scale import zone_hint
from ..core.number_cells import as_number
from ..core.progress import Reporter
from ..core.shown import shorten
from ..core.tables import numbered_lines, read_heading, read_table, refuse_other_formats
from .stations import Stations, digest_of
from .tables import crs_of_line

#: Standard deviation of a point for which the file gives none, E, N, U metres: RTK GNSS on a pole, and pricking.
CONTROL_SD_M = np.array([0.02, 0.02, 0.03])
#: Standard deviation of a known length, metres: a tape between two marks.
BAR_SD_M = 0.002
#: A point farther from the nearest photo lies elsewhere, metres.
MAX_AWAY_M = 5000.0
#: Points that lie less than this (root of the sum of squares) beside a line do not turn a block about it, metres.
_MIN_BREADTH_M = 2.0
#: Ground that lies further from what precise geotags and the drone's barometer say has another height datum, metres.
_ODD_HEIGHT_M = 20.0
#: So many marks that none of them lies in the right or lower part of its photo, from this share of its width and height
#: on, were made in reduced photos, or by a rare chance.
_REDUCED_MARKS, _REDUCED_SHARE = 8, 0.6
#: Positions that are good enough to compare heights with.
_PRECISE = ("fix", "float")


@dataclass(frozen=True)
class ScaleBars:
    """B known lengths, each between two ends that photos show, and M marks of the ends.

    labels: B. length_m: (B,). point: (M,) number of the end, those of a bar one after the other. photo: (M,) number of
    the photo among the stations. pixels: (M, 2) u, v as in :class:`ControlPoints`. Every end has two marks or more,
    each in another photo.
    """

    labels: list[str]
    length_m: np.ndarray
    point: np.ndarray
    photo: np.ndarray
    pixels: np.ndarray

    def __len__(self) -> int:
        return len(self.labels)


@dataclass(frozen=True)
class ControlPoints:
    """K points on the ground (none, where a file holds known lengths alone) and M marks of them in photos.

    labels: K, each once. xyz: (K, 3) project CRS, metres, in the heights of the geotags. sd_m: (K, 3) E, N, U.
    is_check: (K,) bool, only compared with, never adjusted to. point: (M,) number of the point. photo: (M,) number of
    the photo among the stations. pixels: (M, 2) u, v; the upper-left corner of the photo is (0, 0), the centre of its
    first pixel (0.5, 0.5). Every point has two marks or more, each in another photo. bars: known lengths.
    """

    labels: list[str]
    xyz: np.ndarray
    sd_m: np.ndarray
    is_check: np.ndarray
    point: np.ndarray
    photo: np.ndarray
    pixels: np.ndarray
    bars: ScaleBars | None = None

    def __len__(self) -> int:
        return len(self.labels)

    def digest(self) -> str:
        """Short hash over places, accuracies, use, lengths and marks."""
        lengths = () if self.bars is None else (self.bars.length_m, self.bars.point, self.bars.photo, self.bars.pixels)
        known = (self.xyz, self.sd_m, self.point, self.photo, self.pixels, *lengths)
        return digest_of([self.labels, self.is_check.tolist()], *known)


def are_spread(xyz: np.ndarray) -> bool:
    """Whether (K, 3) points, metres, place a block: three or more, not in a line."""
    beside = np.linalg.svd(xyz - xyz.mean(axis=0), compute_uv=False)[1:2] if len(xyz) >= 3 else np.zeros(1)
    return bool(beside[0] >= _MIN_BREADTH_M)


def project_of(path: Path) -> pyproj.CRS | None:
    """The CRS of a file of control points, or the usual one at its degrees; ``None`` where the file names none.

    Raises:
        InputError, CRSError: as :func:`read_control_rows`; no CRS is known at that place.
    """
    crs, rows = read_control_rows(path)
    if crs is None or not crs.is_geographic:
        return crs
    lon, lat = (float(rows[axis].median()) for axis in PLACE[:2])
    return usual_crs(lon, lat)[0]


def read_control(path: Path, stations: Stations, reporter: Reporter | None = None) -> ControlPoints:
    """Control and check points for the photos of ``stations``, in their CRS.

    Formats: ODM's ``gcp_list.txt`` (line 1 the CRS, then ``x y z px py photo [label] [check]``) and CSV with a header
    (label, easting, northing, height or lon, lat, height; photo, u, v; optional sd_h_m, sd_v_m, kind, epsg). Pixels
    count from the upper-left corner of the photo as it lies in the file. Longitude and latitude in WGS 84, and
    coordinates without a CRS, are taken on the project's datum, as geotags are. All points are control points but those
    whose ``kind`` is check or whose label ends in ``_check``. In a CSV two labels with one ``bar`` are the ends of a
    known ``length_m``; they need no place.

    Args:
        path: the file. stations: photos with their places. reporter: warned of marks and points that are left out, and
            of heights that look like another datum.

    Raises:
        InputError: what is wrong in which line; no photo has a position, and the points do not place a block.
        CRSError: an unknown CRS, one that cannot be turned into the project's.
    """
    path, reporter = Path(path), reporter or Reporter()
    crs, rows = read_control_rows(path)
    rows["line"] = rows.index
    bars = _bars(path, rows[rows["bar"] != ""], stations, reporter)
    rows = rows[rows[PLACE].notna().all(axis=1)]
    if rows.empty and bars is None:
        raise InputError(
            f"{path}: none of its known lengths has two ends that two photos of this flight show, expected one or "
            "more; mark them in more photos."
        )
    if rows.empty and stations.is_placed.any():
        none = np.zeros(0, int)
        return ControlPoints([], np.zeros((0, 3)), np.zeros((0, 3)), none > 0, none, none, np.zeros((0, 2)), bars)
    rows = rows.assign(label=_labels(path, rows))
    points = rows.drop_duplicates("label").set_index("label")
    _refuse_contradictions(path, rows)
    xyz = _in_project(path, crs, points[PLACE].to_numpy(), stations.crs)
    _check_distance(path, points, xyz, stations)
    _check_heights(path, xyz, stations, reporter)
    of_point = rows.groupby("label", sort=False)
    sd = np.where(of_point[DEVIATIONS].max().isna(), CONTROL_SD_M, of_point[DEVIATIONS].max())
    check = of_point["is_check"].first().eq(True).to_numpy(bool)

    marks = _marks(path, rows, stations, reporter)
    seen = marks["label"].value_counts().reindex(points.index, fill_value=0)
    lost = seen.index[seen < 2].tolist()
    if len(lost) == len(points):
        raise InputError(
            f"{path}: none of its {len(points)} points is marked in two photos of this flight, expected two marks or "
            "more a point; mark them in more photos."
        )
    if lost:
        reporter.warn(
            f"{path.name}: {len(lost)} of {len(points)} points are marked in fewer than two photos and left out: "
            f"{shorten(lost)}."
        )
    chosen = (seen >= 2).to_numpy()
    kept = points.index[chosen]
    marks = marks[marks["label"].isin(kept)]
    control = xyz[chosen & ~check]
    if not stations.is_placed.any() and not are_spread(control):
        raise InputError(
            f"{path}: has {len(control)} control points that two photos or more show"
            f"{', all in a line' * (len(control) > 2)}; where no photo has a position, three or more are expected, not "
            "in a line: mark more points, or give --geotags."
        )
    reporter.info(
        f"{path.name}: {int((~check[chosen]).sum())} control and {int(check[chosen].sum())} check points, {len(marks)} "
        "marks."
    )
    point, photo, pixels = kept.get_indexer(marks["label"]), marks["number"].to_numpy(int), marks[PIXEL].to_numpy(float)
    return ControlPoints(kept.tolist(), xyz[chosen], sd[chosen], check[chosen], point, photo, pixels, bars)


def _bars(path: Path, rows: pd.DataFrame, stations: Stations, reporter: Reporter) -> ScaleBars | None:
    """Known lengths of the rows that name one; ``None`` where none has two ends that two photos show.

    Raises:
        InputError: a bar that has not two ends and one length.
    """
    for bar, own in rows.groupby("bar", sort=False):
        labels, lengths = own["label"].unique().tolist(), own["length"].unique().tolist()
        if len(labels) != 2 or not all(labels) or len(lengths) != 1 or not np.isfinite(lengths[0]):
            raise InputError(
                f"{path}, line {own.index[0]}: bar {bar!r} has the ends {shorten(labels)} and the lengths "
                f"{shorten([f'{length:g}' for length in lengths])} m, expected two labels and one length_m: complete "
                "or correct its rows."
            )
    if rows.empty:
        return None
    marks = _marks(path, rows, stations, reporter)
    seen = marks.groupby(["bar", "label"]).size() >= 2
    whole = [bar for bar in rows["bar"].unique() if bar in seen and seen[bar].sum() == 2]
    if lost := [bar for bar in rows["bar"].unique() if bar not in whole]:
        reporter.warn(f"{path.name}: bars with an end that fewer than two photos show are left out: {shorten(lost)}.")
    marks = marks[marks["bar"].isin(whole)]
    if not whole:
        return None
    ends = rows.drop_duplicates(["bar", "label"]).set_index(["bar", "label"])
    order = [(bar, label) for bar in whole for label in ends.loc[bar].index]
    point = pd.Index(order).get_indexer(pd.MultiIndex.from_frame(marks[["bar", "label"]]))
    reporter.info(f"{path.name}: {len(whole)} known lengths, {len(marks)} marks of their ends.")
    length_m = ends.loc[order[::2], "length"].to_numpy(float)
    return ScaleBars(whole, length_m, point, marks["number"].to_numpy(int), marks[PIXEL].to_numpy(float))


def _labels(path: Path, rows: pd.DataFrame) -> list[str]:
    """A label of each row: points without one are known by their coordinates.

    Raises:
        InputError: two labels for the same coordinates.
    """
    places = list(zip(*(rows[axis] for axis in PLACE), strict=True))
    named: dict[tuple[float, float, float], tuple[int, str]] = {}
    for line, place, label in zip(rows.index, places, rows["label"], strict=True):
        before, other = named.setdefault(place, (line, label)) if label else (line, label)
        if other != label:
            raise InputError(
                f"{path}, lines {before} and {line}: points {other!r} and {label!r} have the same coordinates; correct "
                "one of them, or give them one label."
            )
    free = (f"point {n}" for n in range(1, 2 * len(rows) + 2) if f"point {n}" not in set(rows["label"]))
    return [
        label or named.setdefault(place, (0, next(free) if place not in named else ""))[1]
        for place, label in zip(places, rows["label"], strict=True)
    ]


def _refuse_contradictions(path: Path, rows: pd.DataFrame) -> None:
    """Rows of one point with other coordinates, or another use, than the first that says them."""
    for label, group in rows.groupby("label", sort=False):
        moved = (group[PLACE] != group[PLACE].iloc[0]).any(axis=1)
        if moved.any():
            raise InputError(
                f"{path}, lines {group.index[0]} and {moved.idxmax()}: point {label!r} has two different coordinates; "
                "correct one, or give it another label."
            )
        says = group["is_check"].dropna()
        if says.nunique() > 1:
            raise InputError(
                f"{path}, lines {says.index[0]} and {(says != says.iloc[0]).idxmax()}: point {label!r} is control in "
                "one and check in the other; decide for one."
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


def _check_distance(path: Path, points: pd.DataFrame, xyz: np.ndarray, stations: Stations) -> None:
    placed = stations.xyz[stations.is_placed][:, :2]
    away = np.array([np.linalg.norm(placed - place, axis=1).min(initial=np.inf) for place in xyz[:, :2]])
    worst = int(np.argmax(away))
    if not len(placed) or away[worst] <= MAX_AWAY_M:
        return

    def is_near(xy: np.ndarray) -> bool:
        return bool(max(np.linalg.norm(placed - place, axis=1).min() for place in xy) <= MAX_AWAY_M)

    said = " (in {zone}, all would lie there)"
    hint = zone_hint(said, stations.crs, xyz[:, :2], is_near) if np.isfinite(xyz).all() else ""
    raise InputError(
        f"{path}, line {points['line'].iloc[worst]}: point {points.index[worst]!r} lies {away[worst] / 1000:.0f} km "
        f"from the nearest photo, expected it under the flight{hint}; check the coordinates, their order and their CRS."
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


def _marks(path: Path, rows: pd.DataFrame, stations: Stations, reporter: Reporter) -> pd.DataFrame:
    """The rows whose photo is there, with its ``number``."""
    names = [PurePosixPath(name.lower()) for name in stations.names]
    known = pd.DataFrame([(str(name), name.name, name.stem) for name in names], columns=["path", "file", "stem"])
    numbers = [_photo_number(path, line, photo, stations, known) for line, photo in rows["photo"].items()]
    rows = rows.assign(number=numbers)
    missing, found = rows[rows["number"] < 0], rows[rows["number"] >= 0]
    sizes = {}
    for photo in found["number"].unique():
        with Image.open(stations.paths[photo]) as image:
            sizes[photo] = image.size
    for line, row in found.iterrows():
        width, height = sizes[row["number"]]
        if not (0 <= row["u"] <= width and 0 <= row["v"] <= height):
            raise InputError(
                f"{path}, line {line}: pixel {row['u']:g}, {row['v']:g} lies outside of {row['photo']} "
                f"({width} x {height} px); mark the point in the photo as it is in the folder, neither reduced nor "
                "turned."
            )
    size = np.array([sizes[number] for number in found["number"]]).reshape(-1, 2)
    if len(found) >= _REDUCED_MARKS and (found[PIXEL] <= _REDUCED_SHARE * size).all(axis=None):
        width, height = found[PIXEL].max()
        reporter.warn(
            f"{path.name}: all {len(found)} marks lie in the upper left {width:.0f} x {height:.0f} px of photos of "
            f"{size[0, 0]} x {size[0, 1]} px, as if they were made in reduced photos; if so, multiply their pixels by "
            "the factor, or mark the points in the photos of the folder."
        )
    again = found.duplicated(["label", "number"])
    if again.any():
        row = found.loc[again.idxmax()]
        first = found.index[(found["label"] == row["label"]) & (found["number"] == row["number"])][0]
        raise InputError(
            f"{path}, lines {first} and {row['line']}: point {row['label']!r} is marked twice in {row['photo']}; keep "
            "one."
        )
    if found.empty:
        raise InputError(
            f"{path}: names none of the {len(stations)} photos (it has {rows['photo'].iloc[0]!r}, the folder "
            f"{stations.names[0]!r}); give the file of these photos."
        )
    if len(missing):
        reporter.warn(
            f"{path.name}: {len(missing)} of {len(rows)} marks are in photos that are not there or not used, and are "
            f"left out: {shorten(missing['photo'].unique().tolist())}."
        )
    return found


def _photo_number(path: Path, line: int, photo: str, stations: Stations, known: pd.DataFrame) -> int:
    """Number of a row's photo, -1 when it is not there. known: its names as a path, a file, and without ending."""
    asked = PurePosixPath(photo.replace("\\", "/").lower())
    for name, key in (("path", str(asked)), ("file", asked.name), ("stem", asked.name)):
        hits = np.flatnonzero(known[name] == key)
        if len(hits) > 1:
            raise InputError(
                f"{path}, line {line}: photo {photo!r} is both {stations.names[hits[0]]} and "
                f"{stations.names[hits[1]]}; write its folder before it."
            )
        if len(hits):
            return int(hits[0])
    return -1


_PLACE = ("easting", "northing", "lon", "lat")
_KINDS = {"control": False, "gcp": False, "check": True, "checkpoint": True, "check point": True}
#: A label that ends so names a check point: ``P7_check``, ``P7-check``.
_CHECK_LABEL = re.compile(r"[\s_.-]check$", re.IGNORECASE)
_EXPECTED = (
    "expected ODM's gcp_list.txt (line 1 the CRS, then x y z px py photo [label]), or a CSV with the columns label, "
    "easting, northing, height (or lon, lat, height), photo, u, v"
)


#: Coordinates in the file's CRS, pixels, and standard errors E, N, U, metres.
PLACE, PIXEL, DEVIATIONS = ["x", "y", "z"], ["u", "v"], ["sd_e", "sd_n", "sd_u"]


def read_control_rows(path: Path) -> tuple[pyproj.CRS | None, pd.DataFrame]:
    """The CRS that the file names (``None``: that of the project) and its rows, one for each point marked in a photo:
    ``label`` (empty where the file gives none), :data:`PLACE`, ``photo`` (its name), :data:`PIXEL`, :data:`DEVIATIONS`
    (NaN), ``is_check`` (``None`` where the file says nothing), ``bar`` (empty) and ``length`` (NaN) by their lines.

    Raises:
        InputError: no such file, neither of the two formats, a row that cannot be read. CRSError: an unknown CRS.
    """
    refuse_other_formats(path)
    if {"photo", "u"} & set(columns(read_heading(path), "photo", "u")):
        crs, rows = _of_csv(path)
    else:
        crs, rows = _of_gcp_list(path)
    if rows.empty:
        raise InputError(f"{path}: holds no control point; {_EXPECTED}.")
    named = np.array([bool(_CHECK_LABEL.search(label)) for label in rows["label"]])
    rows.loc[named & rows["is_check"].isna(), "is_check"] = True
    return crs, rows


def _of_gcp_list(path: Path) -> tuple[pyproj.CRS | None, pd.DataFrame]:
    filled = [(n, line.rstrip()) for n, line in numbered_lines(path, _EXPECTED) if line.lstrip()[:1] != "#"]
    if not filled:
        return None, pd.DataFrame()
    try:
        crs = crs_of_line(filled[0][1], f"{path}, line {filled[0][0]}")
    except CRSError as problem:
        raise CRSError(f"{str(problem).rstrip('.')}; {_EXPECTED}.") from None
    rows = {}
    for number, line in filled[1:]:
        # Names of photos may hold blanks where tabs part the columns.
        cells = [cell.strip() for cell in line.split("\t")] if line.count("\t") >= 5 else line.split()
        numbers = [as_number(cell) for cell in cells[:5]]
        if len(cells) < 6 or not np.isfinite(numbers).all() or not cells[5]:
            raise InputError(
                f"{path}, line {number}: found {line.strip()[:70]!r}, expected x y z px py photo [label]; correct the "
                "row (a height that is not known makes no control point)."
            )
        said = True if {cell.lower() for cell in cells[7:]} & {"check", "checkpoint"} else None
        rows[number] = [*numbers, cells[5], cells[6] if len(cells) > 6 else "", said]
    found = pd.DataFrame.from_dict(rows, "index", columns=[*PLACE, *PIXEL, "photo", "label", "is_check"])
    none = {"bar": "", "length": np.nan, **dict.fromkeys(DEVIATIONS, np.nan)}
    return crs, found.assign(is_check=found["is_check"].astype(object), **none)


def _of_csv(path: Path) -> tuple[pyproj.CRS | None, pd.DataFrame]:
    table = read_table(path, comments=True)
    has = columns(table, "point", "photo", "u", "v", "kind", *_PLACE, "altitude", "epsg", *DEVIATIONS, "bar", "length")
    rows = pd.DataFrame({"bar": table[has["bar"].name].fillna("") if "bar" in has else ""}, index=table.index)
    is_point = rows["bar"] == ""
    places = (("easting", "lon"), ("northing", "lat"), "altitude") if is_point.any() else ("point",)
    require(path, table, has, (*places, "photo", "u", "v"))
    geographic = {"lon", "lat"} <= set(has)
    place = (*(("lon", "lat") if geographic else ("easting", "northing")), "altitude")
    for name, key in zip([*PLACE, *PIXEL], (*place, "u", "v"), strict=True):
        if key in has:
            numbers(path, table if name in PIXEL else table[is_point], has[key].name, required=True)
        rows[name] = numbers(path, table, has[key].name) if key in has else np.nan
    rows["length"] = measured(path, table, "length", has.get("length") if "bar" in has else None)
    for key in DEVIATIONS:
        rows[key] = numbers(path, table, has[key].name) if key in has else np.nan
        if key in has:
            refuse_bounds(path, rows[key], f"standard deviation {has[key].name}", key)
    rows["photo"] = table[has["photo"].name]
    bare = rows["photo"].isna()
    if bare.any():
        raise InputError(f"{path}, {line_of(bare)}: has no photo; complete or delete the row.")
    rows["label"] = table[has["point"].name].fillna("") if "point" in has else ""
    kind = table[has["kind"].name] if "kind" in has else pd.Series(None, table.index, object)
    rows["is_check"] = kind.str.lower().map(_KINDS).astype(object)
    odd = kind.notna() & rows["is_check"].isna()
    if odd.any():
        raise InputError(f"{path}, {line_of(odd)}: kind {kind[odd.idxmax()]!r}, expected control or check.")
    return _csv_crs(path, table, has.get("epsg"), geographic), rows


def _csv_crs(path: Path, table: pd.DataFrame, column: FoundColumn | None, geographic: bool) -> pyproj.CRS | None:
    """The CRS of a table: column ``epsg`` (one for all rows), WGS 84 degrees, or the project's."""
    codes = table[column.name].fillna("") if column is not None else pd.Series([""], [2])
    other = codes != codes.iloc[0]
    if other.any():
        raise InputError(
            f"{path}, lines {codes.index[0]} and {codes.index[other][0]}: have different epsg; write all points in one "
            "CRS."
        )
    found = epsg_crs(codes.iloc[0], f"{path}, line {codes.index[0]}")
    return pyproj.CRS.from_epsg(4326) if found is None and geographic else found
