"""The field tally: bearing and distance (or coordinates) of every tree, turned into project coordinates."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ..core.crs import grid_convergence_deg
from ..core.errors import InputError
from ..core.plots import Plot
from ..core.settings import param
from ..core.tables import csv_text, plain_cell, refuse_other_formats
from .declination import declination_deg, parse_date
from .unplaced import clear_unplaced, where_said

#: What a column may be called (lower case, without blanks); the first is the name in our own files.
NAMES = {
    "plot_id": ("plot_id", "plot", "plotid", "plot_no"),
    "field_id": ("field_id", "tree_id", "tree", "treeid", "tree_no", "stem_id", "tag", "n"),
    "azimuth": (
        *(f"{name}_{unit}" for unit in ("deg", "gon", "mil") for name in ("azimuth", "bearing", "az")),
        *("azimuth", "azim", "bearing", "az"),
    ),
    "distance": ("distance_m", "distance_ft", "dist_m", "dist_ft", "distance", "dist"),
    "x": ("easting", "x", "x_m"),
    "y": ("northing", "y", "y_m"),
    "dbh": ("dbh_cm", "dbh_mm", "dbh_m", "dbh_in", "dbh", "d"),
    "slope": ("slope_deg", "slope_pct"),
    "status": ("status",),
    "species": ("species", "spp", "sp"),
    "date": ("date", "field_date", "survey_date", "date_measured"),
}
_TO_CM = {"cm": 1.0, "mm": 0.1, "m": 100.0, "in": 2.54}
_TO_M = {"m": 1.0, "ft": 0.3048}
#: Units of bearings: how many make a full circle.
_CIRCLE = {"deg": 360.0, "gon": 400.0, "mil": 6400.0}


@dataclass(frozen=True, kw_only=True)
class FieldProtocol:
    """How the field crew measured."""

    north: str = param(
        "true",
        kind="choice",
        choices=("true", "grid", "magnetic"),
        help="north that the bearings refer to (magnetic needs the date of the field work, or the declination)",
    )
    declination_deg: float | None = param(
        None,
        kind="number",
        unit="degrees, east positive",
        minimum=-180,
        maximum=180,
        help="magnetic declination at the plot on the day of the field work; default: from the World Magnetic Model by "
        "--field-date or the table's date column",
    )
    field_date: str | None = param(
        None,
        kind="text",
        help="day of the field work, year-month-day, for the declination",
    )
    distance: str = param(
        "horizontal",
        kind="choice",
        choices=("horizontal", "slope"),
        help="distance along the level or along the ground (then the table needs slope_deg or slope_pct)",
    )
    to: str = param(
        "pith",
        kind="choice",
        choices=("pith", "face"),
        help="distance to the middle of the stem, or to its near face (half the DBH is added)",
    )
    azimuth_unit: str = param(
        "auto",
        kind="choice",
        choices=("auto", "deg", "gon", "mil"),
        help="unit of the bearings: degrees, gon (400 a circle) or mil (6400); auto: from a name like azimuth_gon, "
        "else degrees",
    )
    dbh_unit: str = param(
        "auto",
        kind="choice",
        choices=("auto", "cm", "mm", "m", "in"),
        advanced=True,
        help="unit of the DBH column (auto: from a name like dbh_cm)",
    )
    distance_unit: str = param(
        "auto",
        kind="choice",
        choices=("auto", "m", "ft"),
        advanced=True,
        help="unit of a distance column that does not say it (auto: from a name like distance_m)",
    )


def read_table(path: Path) -> pd.DataFrame:
    """A CSV as text cells, column names in lower case.

    Raises:
        InputError: not readable, empty, or a column twice.
    """
    path = Path(path)
    refuse_other_formats(path)
    try:
        table = pd.read_csv(io.StringIO(csv_text(path)), dtype=str, skipinitialspace=True).map(plain_cell)
    except (OSError, ValueError, pd.errors.ParserError, pd.errors.EmptyDataError) as problem:
        raise InputError(f"{path}: cannot be read as a CSV table ({str(problem).strip()}).") from None
    table.columns = [str(name).strip().lower().replace(" ", "_") for name in table.columns]
    if table.columns.duplicated().any():
        raise InputError(f"{path}: a column appears twice ({', '.join(table.columns[table.columns.duplicated()])}).")
    table = table.dropna(how="all").reset_index(drop=True)
    if not len(table):
        raise InputError(f"{path}: holds no row, expected one row a tree.")
    return table


def read_field_trees(path: Path, protocol: FieldProtocol) -> pd.DataFrame:
    """Read the tally.

    Returns:
        one row a tree: ``plot_id`` (or None), ``field_id`` (text), ``azimuth_deg`` and ``distance_m`` (horizontal, to
        the pith) or ``x`` and ``y`` (m), all NaN where the row does not say them (:func:`.unplaced.drop_unplaced`),
        ``dbh_cm`` (NaN where not measured), ``status``, ``species``, ``line`` (in the file), ``lacks`` (what keeps the
        tree off the map, empty for most).

    Raises:
        InputError: missing columns, values that are no numbers or impossible, a unit that is nowhere stated or
            contradicts the values, doubled ids, more trees without a place than with one.
    """
    path = Path(path)
    table = read_table(path)
    column = {key: next((n for n in names if n in table.columns), "") for key, names in NAMES.items()}
    polar = column["azimuth"] and column["distance"]
    if not column["field_id"] or not (polar or (column["x"] and column["y"])):
        raise InputError(
            f"{path}: found columns {', '.join(table.columns)}; expected tree_id, dbh_cm and azimuth_deg, "
            "distance_m (or easting, northing)."
        )
    found = pd.DataFrame({"field_id": table[column["field_id"]].astype(object)})
    if found["field_id"].isna().any():
        raise InputError(f"{path}, line {_line(found['field_id'].isna())}: has no tree_id; number every tree.")
    for name in ("plot_id", "status", "species", "date"):
        values = table[column[name]].astype(object) if column[name] else pd.Series([None] * len(table), dtype=object)
        found[name] = values.where(values.notna(), None)
    twice = found.duplicated(["plot_id", "field_id"])
    if twice.any():
        raise InputError(
            f"{path}, line {_line(twice)}: tree {found['field_id'][twice.idxmax()]} appears twice in its plot; "
            "give every tree of a plot its own tree_id."
        )
    found["dbh_cm"] = dbh_in_cm(path, table, protocol.dbh_unit)
    found["line"], found["lacks"] = np.arange(len(table)) + 2, ""
    if not polar:
        for axis in "xy":
            found[axis] = where_said(table, column[axis], found)
        clear_unplaced(path, found, ["x", "y"])
        return found
    found["azimuth_deg"] = _degrees(path, table, column["azimuth"], found, protocol)
    found["distance_m"] = _horizontal_m(path, table, column, found, protocol)
    clear_unplaced(path, found, ["azimuth_deg", "distance_m"])
    return found


def _degrees(path: Path, table: pd.DataFrame, name: str, found: pd.DataFrame, protocol: FieldProtocol) -> pd.Series:
    """Bearings in degrees, by the unit that the option or the column's name says."""
    tail = name.rpartition("_")[2]
    named = tail if "_" in name and tail in _CIRCLE else "deg"
    unit = named if protocol.azimuth_unit == "auto" else protocol.azimuth_unit
    circle, values = _CIRCLE[unit], where_said(table, name, found)
    bad = (values < 0) | (values > circle)
    if bad.any():
        word = {"deg": "degrees"}.get(unit, unit)
        most = float(values.max())
        other = next((u for u in ("gon", "mil") if circle < most <= _CIRCLE[u]), None)
        hint = (
            f"{int((values > circle).sum())} of {int(values.notna().sum())} bearings are above {circle:g}: if they are "
            f"{other}, give --azimuth-unit {other} or name the column azimuth_{other}; else correct them."
            if other and values.min() >= 0
            else "correct it."
        )
        raise InputError(
            f"{path}, line {_line(bad)}: bearing {values[bad.idxmax()]:g}, expected 0 to {circle:g} {word}; {hint}"
        )
    return values * (360.0 / circle)


def _horizontal_m(
    path: Path, table: pd.DataFrame, column: dict, found: pd.DataFrame, protocol: FieldProtocol
) -> pd.Series:
    """Level distance to the pith, m."""
    name = column["distance"]
    unit = name.rpartition("_")[2] if "_" in name else protocol.distance_unit
    if unit == "auto":
        raise InputError(
            f"{path}: column {name!r} does not say its unit; rename it distance_m or distance_ft, or give "
            "--distance-unit."
        )
    distance = where_said(table, name, found) * _TO_M[unit]
    bad = (distance < 0) | (distance > 200)
    if bad.any():
        raise InputError(
            f"{path}, line {_line(bad)}: distance {distance[bad.idxmax()]:g} m, expected 0 to 200 m from the "
            "plot centre."
        )
    if protocol.distance == "slope":
        if not column["slope"]:
            raise InputError(
                f"{path}: has no slope_deg or slope_pct column, which slope distances need; add it, or use "
                "--distance horizontal."
            )
        slope = where_said(table, column["slope"], found)
        angle = np.radians(slope) if column["slope"] == "slope_deg" else np.arctan(slope / 100)
        if (np.abs(angle) > np.radians(60)).any():
            raise InputError(
                f"{path}, line {_line(np.abs(angle) > np.radians(60))}: a slope above 60 degrees; check "
                "whether the column is in degrees or per cent."
            )
        distance = distance * np.cos(angle)
    if protocol.to == "face":
        bare = found["dbh_cm"].isna()
        found.loc[bare & (found["lacks"] == ""), "lacks"] = "no DBH, which a distance to the face needs (or --to pith)"
        distance = distance + found["dbh_cm"] / 200
    return distance


def dbh_in_cm(path: Path, table: pd.DataFrame, unit: str, option: str = "--dbh-unit") -> pd.Series:
    """The DBH column of a text table in cm, NaN where empty; all NaN without such a column. unit: of the option, which
    counts before the column's name; ``auto``: the name's.

    Raises:
        InputError: the unit is nowhere stated, or the values contradict it (metres or millimetres taken for
            centimetres).
    """
    name = next((n for n in NAMES["dbh"] if n in table.columns), None)
    if name is None:
        return pd.Series(np.full(len(table), np.nan))
    values = numbers(path, table, name, required=False)
    asked = unit != "auto"
    if not asked and "_" in name:
        unit = name.rpartition("_")[2]
    if unit == "auto":
        raise InputError(
            f"{path}: column {name!r} does not say its unit (values {values.min():g} to {values.max():g}); "
            f"rename it dbh_cm, dbh_mm, dbh_m or dbh_in, or give {option}."
        )
    dbh = values * _TO_CM[unit]
    known = dbh.dropna()
    if not len(known):
        return dbh
    spread = f"{name} read as {unit} gives DBHs of {known.min():.3g} to {known.max():.3g} cm"
    if known.max() < 2.5 or known.median() > 250 or known.min() <= 0:
        raise InputError(
            f"{path}: {spread}, expected trees of about 5 to 100 cm; name the right unit in the column name or with "
            f"{option}."
        )
    # Millimetres are whole numbers, and those of thin trees would still pass for centimetres.
    whole = len(known) >= 3 and bool((values.dropna() % 1 == 0).all())
    if not asked and unit == "cm" and whole and (known.median() > 100 or known.median() > 60 and known.min() >= 50):
        raise InputError(
            f"{path}: {spread}, median {known.median():.3g}, all whole numbers; if these are millimetres, give "
            f"{option} mm or rename the column dbh_mm, if they are centimetres, give {option} cm."
        )
    return dbh


def place(
    trees: pd.DataFrame, plots: list[Plot], crs: pyproj.CRS, protocol: FieldProtocol, path: Path = Path("field table")
) -> pd.DataFrame:
    """Add ``x, y`` (project CRS, m) from the surveyed plot centres; coordinates that are there already are kept.

    Grid bearing = true bearing - meridian convergence; true = magnetic + declination. The grid's scale (4 mm in 10 m at
    most in UTM) is far below what a tape or a hypsometer reads and is left out.

    Raises:
        InputError: magnetic bearings without a declination, a plot id without a centre.
    """
    placed = trees.copy()
    known = {plot.plot_id: plot for plot in plots}
    if len(plots) == 1:
        placed["plot_id"] = placed["plot_id"].where(placed["plot_id"].notna(), plots[0].plot_id)
    if placed["plot_id"].isna().any():
        raise InputError(
            f"{path}, line {_line(placed['plot_id'].isna())}: has no plot_id; name the plot of every tree."
        )
    lost = sorted(set(placed["plot_id"]) - set(known))
    if lost:
        raise InputError(
            f"{path}: plot {', '.join(lost[:5])} is not in the plots table (it has {', '.join(known)}); add "
            "its centre or correct the plot_id."
        )
    if "x" in placed:
        return placed
    turn = {
        key: bearing_to_grid_deg(known[key[0]], crs, protocol, key[1], path)
        for key in {(p, _day(row, protocol, path)) for p, row in zip(placed["plot_id"], _dates(placed), strict=True)}
    }
    bearing = np.radians(
        placed["azimuth_deg"].to_numpy(float)
        - [turn[(p, _day(row, protocol, path))] for p, row in zip(placed["plot_id"], _dates(placed), strict=True)]
    )
    distance = placed["distance_m"].to_numpy(float)
    placed["x"] = [known[p].x for p in placed["plot_id"]] + distance * np.sin(bearing)
    placed["y"] = [known[p].y for p in placed["plot_id"]] + distance * np.cos(bearing)
    return placed


def bearing_to_grid_deg(
    plot: Plot, crs: pyproj.CRS, protocol: FieldProtocol, day: str = "", path: Path = Path("field table")
) -> float:
    """Degrees to take off a field bearing to make it a grid bearing at this plot. day: ISO date of the field work.

    Raises:
        InputError: no datum; magnetic bearings with neither a declination nor a date, or a date outside the model.
    """
    if protocol.north == "grid":
        return 0.0
    if crs is None or crs.geodetic_crs is None:
        raise InputError(
            "--north: true or magnetic bearings need a CRS that is tied to the earth; use --north grid for "
            "local coordinates."
        )
    to_degrees = pyproj.Transformer.from_crs(crs, crs.geodetic_crs.to_2d(), always_xy=True)
    lon, lat = to_degrees.transform(plot.x, plot.y)
    declination = 0.0
    if protocol.north == "magnetic":
        if protocol.declination_deg is not None:
            declination = protocol.declination_deg
        elif day:
            declination = declination_deg(lon, lat, 0.0, parse_date(day, str(path)), f"{path}, plot {plot.plot_id}")
        else:
            raise InputError(
                f"{path}: magnetic bearings need the day of the field work, expected --field-date 2025-06-30 (or a "
                "date "
                "column), or --declination-deg: degrees, east positive."
            )
    return grid_convergence_deg(crs, lon, lat) - declination


def _dates(trees: pd.DataFrame) -> list:
    return trees["date"].tolist() if "date" in trees else [None] * len(trees)


def _day(cell, protocol: FieldProtocol, path: Path) -> str:
    """The row's date, else the protocol's, as ISO text; empty where bearings do not need one."""
    if protocol.north != "magnetic" or protocol.declination_deg is not None:
        return ""
    text = str(cell).strip() if cell is not None and not pd.isna(cell) else (protocol.field_date or "")
    return parse_date(text, str(path)).isoformat() if text else ""


def numbers(path: Path, table: pd.DataFrame, name: str, required: bool) -> pd.Series:
    """A column as float64 (NaN where empty); the first cell that is no finite number is named."""
    cells = table[name]
    values = pd.to_numeric(cells, errors="coerce").astype(float)
    bad = (cells.notna() | required) & ~np.isfinite(values)
    if bad.any():
        raise InputError(
            f"{path}, line {_line(bad)}: {name} is {cells[bad.idxmax()]!r}, expected a number; correct it."
        )
    return values


def _line(bad: pd.Series) -> int:
    """Line in the file of the first True."""
    return int(np.flatnonzero(np.asarray(bad))[0]) + 2
