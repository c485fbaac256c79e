"""The field tally: bearing and distance (or coordinates) of every tree, turned into project coordinates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ..core.column_names import QUANTITIES, plain_name
from ..core.columns import (
    FoundColumn,
    columns,
    epsg_crs,
    line_of,
    measured,
    numbers,
    plot_ids,
    refuse_bounds,
    refuse_contradiction,
    require,
)
from ..core.crs import grid_convergence_deg
from ..core.errors import InputError
from ..core.frames import moved, own_degrees
from ..core.plausible import refuse_odd_diameters, refuse_odd_heights
from ..core.plots import Plot, as_in_plots
from ..core.shown import some
from ..core.tables import read_table
from .declination import declination_deg, parse_date
from .options import Bearings, FieldProtocol
from .statuses import said_elsewhere, statuses

#: Names of the table's columns -> where the tally's places come from.
_POLAR, _ON_MAP = ("azimuth", "distance"), ("easting", "northing")
#: Units of bearings: how many make a full circle.
_CIRCLE = {"deg": 360.0, "gon": 400.0, "mil": 6400.0}
#: Two readings of one diameter differ by no more than this factor.
_CROSSWISE = 1.5
#: Trees of a plot are not this many radii from its centre; in feet read as metres nine tenths of them reach 3.
_FAR = 2.2
#: Names of columns that number trees, or count them.
_COUNT_OR_NUMBER = {"n", "no", "num", "numero"}
#: Of the steps between numbers of trees this share is 1; a range is no chance from so many on.
_RISING, _MANY = 0.7, 6
#: So many DBHs are not the same again by chance.
_LIST = 8


def read_field_trees(path: Path, protocol: FieldProtocol, heights: bool = False, placed: bool = True) -> pd.DataFrame:
    """Read the tally.

    heights: they are read. placed: the trees have to have places; else a table of plots, trees and DBHs is read too.

    Returns:
        one row a tree: ``plot_id`` (or None), ``field_id`` (text), ``azimuth_deg`` and ``distance_m`` (horizontal, to
        the pith) or ``x`` and ``y`` (m, with their ``epsg``), all NaN where the row does not say them
        (:func:`drop_unplaced`), ``dbh_cm`` and ``height_m`` (NaN where not measured), ``status``,
        ``species``, ``date``, ``line`` (in the file), ``lacks`` (what keeps the tree off the map, empty for most); in
        ``attrs``: ``said``, sentences on what was made of the table, and ``unread``, its other columns. A row of a
        class counts as its trees.

    Raises:
        InputError: missing columns, values that are no numbers or impossible, a unit that is nowhere stated or
            contradicts the values, doubled ids, more trees without a place than with one, counts that are none.
    """
    path = Path(path)
    table = read_table(path)
    has = columns(table, *_TALLY)
    table = _without_bare_rows(table, has)
    times, said = tree_counts(path, table, has)
    where = next((pair for pair in (_POLAR, _ON_MAP) if set(pair) <= set(has)), None)
    place = ("field_id", ("azimuth", "easting"), ("distance", "northing")) if placed else ()
    if not heights:
        has.pop("height", None)
    units = dict.fromkeys(("dbh", "dbh1", "dbh2", "girth"), (protocol.dbh_unit, "--dbh-unit"))
    units["height"] = ("auto", "")
    if where == _POLAR:
        units["distance"] = (protocol.distance_unit, "--distance-unit")
    unsaid = {key: option for key, (unit, option) in units.items() if unit == "auto"}
    require(path, table, has, (*place, ("dbh", "dbh1", "girth")), unsaid)
    found = pd.DataFrame({"dbh_cm": dbh_in_cm(path, table, protocol.dbh_unit)})
    found["plot_id"] = _filled_down(path, plot_ids(table, has["plot_id"]), said) if "plot_id" in has else None
    height_m = measured(path, table, "height", has.get("height"))
    # Nobody measures a height of 0: tables write it for "not measured".
    found["height_m"] = height_m.where(height_m > 0)
    refuse_odd_heights(
        found["height_m"],
        found["dbh_cm"],
        lambda bad: f"{path}, {line_of(bad, table)}",
        "name its unit in the column's name (height_ft)",
        found["plot_id"],
    )
    for name in ("field_id", "species", "date"):
        found[name] = table[has[name].name] if name in has else None
    found["status"] = statuses(path, table)
    said += said_elsewhere(path, table, found["status"])
    found["line"], found["lacks"] = table.index, ""
    if "field_id" not in has and not placed:
        found["field_id"] = [str(k + 1) for k in range(len(found))]
    bare, twice = found["field_id"].isna(), found.duplicated(["plot_id", "field_id"])
    if bare.any():
        raise InputError(f"{path}, {line_of(bare)}: has no tree_id; number every tree.")
    if twice.any():
        raise InputError(
            f"{path}, {line_of(twice)}: tree {found['field_id'][twice.idxmax()]} appears twice in its plot; "
            "give every tree of a plot its own tree_id."
        )
    if where == _POLAR:
        found["azimuth_deg"] = _degrees(path, table, has["azimuth"], found)
        found["distance_m"] = _horizontal_m(path, table, has, found, protocol)
        clear_unplaced(path, found, ["azimuth_deg", "distance_m"])
    elif where is not None:
        for name, key in zip("xy", where, strict=True):
            found[name] = where_said(table, has[key].name, found)
        found["epsg"] = table[has["epsg"].name] if "epsg" in has else None
        clear_unplaced(path, found, ["x", "y"])
    if times is None:
        _refuse_repeated(path, found)
    else:
        found = found.loc[found.index.repeat(times)]
        again = found.groupby(level=0).cumcount()
        found["field_id"] = found["field_id"].where(again == 0, found["field_id"] + "-" + (again + 1).astype(str))
    found = found.reset_index(drop=True)
    used = columns(table, *_TALLY, "count", "expansion", "status", "condition", "dead", "alive").values()
    found.attrs |= {"said": said, "unread": [name for name in table if name not in {column.name for column in used}]}
    return found


def _without_bare_rows(table: pd.DataFrame, has: dict[str, FoundColumn]) -> pd.DataFrame:
    """The table without rows of plots where no tree stands: a plot's name alone, and another plot's row below it."""
    of_trees = [has[key].name for key in has if key not in ("plot_id", "epsg", "slope", "date")]
    own = table[has["plot_id"].name].notna() if "plot_id" in has and of_trees else pd.Series(False, table.index)
    bare = own & own.shift(-1, fill_value=True) & table[of_trees].isna().all(axis=1)
    return table if bare.all() else table[~bare]


def tree_counts(path: Path, table: pd.DataFrame, has: dict[str, FoundColumn]) -> tuple[np.ndarray | None, list[str]]:
    """How many trees each row of a tally by DBH class stands for, (N,), with the sentence that says so; ``None`` where
    a row is a tree. A number ``n`` that does not number trees is such a count, and goes out of ``has``.

    Raises:
        InputError: no whole number, or several trees with the place of one.
    """
    where = next((pair for pair in (_POLAR, _ON_MAP) if set(pair) <= set(has)), ())
    place = [has[key].name for key in where]
    plots = plot_ids(table, has["plot_id"]).ffill() if "plot_id" in has else pd.Series("", table.index)
    apart = bool(place) and not table[place].assign(plot=plots).duplicated().any()
    column = columns(table, "count").get("count")
    number = has.get("field_id")
    if number is not None and plain_name(number.name) in _COUNT_OR_NUMBER:
        # Rows of several places are trees; classes are listed from thin to thick.
        thick = next((has[key].name for key in ("dbh", "dbh1", "girth") if key in has), None)
        kind = [plots, *(table[has[key].name] for key in ("species",) if key in has)]
        step = pd.to_numeric(table[thick], errors="coerce").groupby(kind, dropna=False).diff() if thick else None
        listed = step is not None and not (step < 0).any()
        if listed and not apart and not _numbers_trees(pd.to_numeric(table[number.name], errors="coerce"), plots):
            del has["field_id"]
            column = column or number
    if column is None:
        return None, []
    counts = pd.to_numeric(table[column.name], errors="coerce")
    if column is not number and counts.notna().sum() >= max(_MANY, len(counts)) and _numbers_trees(counts, plots):
        has.setdefault("field_id", column)
        return None, [
            f"{path}: column {column.name!r} was taken for the trees' numbers: it rises by one from row to row, as "
            "counts of trees do not; leave it out, or merge rows, if it counts them."
        ]
    times = numbers(path, table, column.name, required=True)
    for bad, what in (
        ((times < 0) | (times % 1 != 0), "a whole number of trees"),
        ((times > 1) & bool(place) & (not apart), "one row a tree, as it says one place"),
    ):
        if bad.any():
            raise InputError(
                f"{path}, {line_of(bad)}: {column.name} is {times[bad.idxmax()]:g}, expected {what}; correct it, or "
                "name the column for what it is (tree_id where it numbers trees)."
            )
    if (times == 1).all():
        return None, []
    if apart:
        return None, [f"{path}: column {column.name!r} was not used: a row with a place of its own is one tree."]
    said = f"{path}: column {column.name!r} counts trees: its {len(times)} rows stand for {times.sum():.0f} trees."
    return times.to_numpy(int), [said]


def _numbers_trees(values: pd.Series, plots: pd.Series) -> bool:
    """Whether they number the trees of each plot: rising by one but for gaps, or in another order all of a range."""
    if values.isna().any():
        return True
    each = values.groupby(plots).agg(["min", "max", "size", "nunique"])
    whole = (each["nunique"] == each["size"]) & (each["max"] - each["min"] < each["size"])
    steps = values.groupby(plots).diff().dropna()
    return bool((steps == 1).mean() >= _RISING or whole.all() and each["size"].mean() >= _MANY)


def _filled_down(path: Path, ids: pd.Series, said: list[str]) -> pd.Series:
    """Ids of plots, those of merged cells filled down: each stands in the first row of its plot alone, others below are
    empty; adds the sentence that says so."""
    known = ids.dropna()
    if not len(known) or pd.isna(ids.iloc[0]) or known.duplicated().any() or 2 * len(known) > len(ids):
        return ids
    said.append(
        f"{path}: {ids.name or 'the plot'} stands in the first row of each plot alone ({some(known, 5)}) and was taken "
        f"for the {len(ids) - len(known)} rows below without one; write it into every row if they are others'."
    )
    return ids.ffill()


def _refuse_repeated(path: Path, trees: pd.DataFrame) -> None:
    """Refuse one tree under two numbers, and a list that stands there twice."""
    place = next((list(pair) for pair in (("azimuth_deg", "distance_m"), ("x", "y")) if set(pair) <= set(trees)), [])
    if place:
        known = trees[trees[[*place, "dbh_cm"]].notna().all(axis=1) & (trees[place] != 0).any(axis=1)]
        for _, same in known[known.duplicated(["plot_id", *place, "dbh_cm"], keep=False)].groupby([*place, "dbh_cm"]):
            raise InputError(
                f"{path}, line {same['line'].iloc[1]}: is line {same['line'].iloc[0]} again (place and DBH): the tree "
                "would count twice; delete one of them."
            )
        return
    half = len(trees) // 2
    cells = trees[["dbh_cm", "height_m"]].to_numpy(float)
    if half >= _LIST and len(trees) == 2 * half and np.array_equal(cells[:half], cells[half:], equal_nan=True):
        raise InputError(
            f"{path}: from line {trees['line'].iloc[half]} on the list of DBHs stands there a second time: its trees "
            "would count twice; delete one of both."
        )


#: What a tally may hold.
_TALLY = (
    *("plot_id", "field_id", *_POLAR, *_ON_MAP, "epsg", "slope", "dbh", "dbh1", "dbh2", "girth", "height"),
    *("species", "date"),
)


def _degrees(path: Path, table: pd.DataFrame, column: FoundColumn, found: pd.DataFrame) -> pd.Series:
    """Bearings in degrees, by the unit that the column's name says (none: degrees)."""
    unit = column.unit or "deg"
    circle, values = _CIRCLE[unit], where_said(table, column.name, found)
    bad = (values < 0) | (values > circle)
    if bad.any():
        word = {"deg": "degrees"}.get(unit, unit)
        most = float(values.max())
        other = next((u for u in ("gon", "mil") if circle < most <= _CIRCLE[u]), None)
        hint = (
            f"{int((values > circle).sum())} of {int(values.notna().sum())} bearings are above {circle:g}: if they are "
            f"{other}, name the column azimuth_{other}; else correct them."
            if other and values.min() >= 0
            else "correct it."
        )
        raise InputError(
            f"{path}, {line_of(bad)}: bearing {values[bad.idxmax()]:g}, expected 0 to {circle:g} {word}; {hint}"
        )
    return values * (360.0 / circle)


def _horizontal_m(
    path: Path, table: pd.DataFrame, has: dict[str, FoundColumn], found: pd.DataFrame, protocol: FieldProtocol
) -> pd.Series:
    """Level distance to the pith, m."""
    column = has["distance"]
    unit = column.unit or protocol.distance_unit
    distance = where_said(table, column.name, found) * QUANTITIES["distance"].units[unit]
    bad = (distance < 0) | (distance > 200)
    if bad.any():
        raise InputError(
            f"{path}, {line_of(bad)}: distance {distance[bad.idxmax()]:g} m, expected 0 to 200 m from the plot centre."
        )
    if protocol.distance == "slope":
        if "slope" not in has or not has["slope"].unit:
            raise InputError(
                f"{path}: has no slope_deg or slope_pct column, which slope distances need; add it, or use "
                "--distance horizontal."
            )
        slope = where_said(table, has["slope"].name, found)
        angle = np.radians(slope) if has["slope"].unit == "deg" else np.arctan(slope / 100)
        if (np.abs(angle) > np.radians(60)).any():
            raise InputError(
                f"{path}, {line_of(np.abs(angle) > np.radians(60))}: a slope above 60 degrees; check "
                "whether the column is in degrees or per cent."
            )
        distance = distance * np.cos(angle)
    if protocol.to == "face":
        bare = found["dbh_cm"].isna()
        found.loc[bare & (found["lacks"] == ""), "lacks"] = "no DBH, which a distance to the face needs (or --to pith)"
        distance = distance + found["dbh_cm"] / 200
    return distance


def dbh_in_cm(path: Path, table: pd.DataFrame, unit: str, option: str = "--dbh-unit") -> pd.Series:
    """The DBHs of a table in cm, NaN where empty; all NaN without such a column. Two readings (``dbh1_cm, dbh2_cm``)
    are averaged, girths divided by pi. unit: of the option, which counts before the column's name (``auto``).

    Raises:
        InputError: the unit is nowhere stated, or the values contradict it; a diameter that no tree has.
    """
    has = columns(table, "dbh", "dbh1", "dbh2", "girth")
    keys = next((keys for keys in (("dbh",), ("dbh1", "dbh2"), ("dbh1",), ("girth",)) if set(keys) <= set(has)), ())
    if unit == "auto":
        require(path, table, {key: has[key] for key in keys}, (), dict.fromkeys(keys, option))
    read = [_diameters(path, table, key, has[key], unit, option) for key in keys]
    if len(read) < 2:
        return read[0] if read else pd.Series(np.full(len(table), np.nan), table.index)
    both = np.sort(np.column_stack(read), axis=1)
    apart = both[:, 1] > np.maximum(_CROSSWISE * both[:, 0], both[:, 0] + 5)
    if apart.any():
        raise InputError(
            f"{path}, {line_of(apart, table)}: {has['dbh1'].name} and {has['dbh2'].name} are {both[apart][0][0]:g} and "
            f"{both[apart][0][1]:g} cm, expected two readings of one stem; correct them."
        )
    return read[0].fillna(read[1]).add(read[1].fillna(read[0])) / 2


def _diameters(path: Path, table: pd.DataFrame, key: str, column: FoundColumn, unit: str, option: str) -> pd.Series:
    """One column of diameters, or girths, as diameters in cm."""
    asked = unit != "auto"
    unit = unit if asked else column.unit
    values = numbers(path, table, column.name)
    dbh = values * QUANTITIES[key].units[unit] / (np.pi if key == "girth" else 1.0)
    known = dbh.dropna()
    if not len(known):
        return dbh
    spread = f"{column.name} read as {unit} gives DBHs of {known.min():.3g} to {known.max():.3g} cm"
    if known.max() < 2.5 or known.median() > 250:
        raise InputError(
            f"{path}: {spread}, expected trees of about 5 to 100 cm; name the right unit in the column name or with "
            f"{option}."
        )
    refuse_bounds(path, dbh, column.name, "dbh")
    for other, times in (("dbh", 1.0), ("girth", np.pi)):
        refuse_contradiction(path, table, other, column, dbh, times)
    # Millimetres are whole numbers, and those of thin trees would still pass for centimetres.
    whole = len(known) >= 3 and bool((values.dropna() % 1 == 0).all())
    if not asked and unit == "cm" and whole and (known.median() > 100 or known.median() > 60 and known.min() >= 50):
        raise InputError(
            f"{path}: {spread}, median {known.median():.3g}, all whole numbers; if these are millimetres, give "
            f"{option} mm or rename the column dbh_mm, if they are centimetres, give {option} cm."
        )
    if not asked:
        refuse_odd_diameters(dbh, lambda bad: f"{path}, {line_of(bad, table)}", f"give {option} if it is right")
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
        line = placed.loc[placed["plot_id"].isna(), "line"].iloc[0]
        raise InputError(f"{path}, line {line}: has no plot_id; name the plot of every tree.")
    placed["plot_id"] = placed["plot_id"].replace(as_in_plots(placed["plot_id"].tolist(), list(known)))
    lost = sorted(set(placed["plot_id"]) - set(known))
    if lost:
        raise InputError(
            f"{path}: plot {', '.join(lost[:5])} is not in the plots table (it has {', '.join(known)}); add "
            "its centre or correct the plot_id."
        )
    if "x" in placed:
        for code in placed["epsg"].dropna().unique() if "epsg" in placed else ():
            rows, source = (placed["epsg"] == code).to_numpy(), epsg_crs(str(code), str(path))
            placed.loc[rows, ["x", "y"]] = moved(placed.loc[rows, ["x", "y"]].to_numpy(float), source, crs)
        return placed
    if protocol.distance_unit == "auto":
        _refuse_far(path, placed, known)
    days = [_day(cell, protocol, path) for cell in placed.get("date", [None] * len(placed))]
    keys = list(zip(placed["plot_id"], days, strict=True))
    turn = {key: bearing_to_grid_deg(known[key[0]], crs, protocol, key[1], path) for key in set(keys)}
    bearing = np.radians(placed["azimuth_deg"].to_numpy(float) - [turn[key] for key in keys])
    distance = placed["distance_m"].to_numpy(float)
    placed["x"] = [known[p].x for p in placed["plot_id"]] + distance * np.sin(bearing)
    placed["y"] = [known[p].y for p in placed["plot_id"]] + distance * np.cos(bearing)
    return placed


def _refuse_far(path: Path, trees: pd.DataFrame, plots: dict[str, Plot]) -> None:
    """Refuse distances that reach far beyond the plots: feet read as metres."""
    share = trees["distance_m"] / [plots[name].radius_m for name in trees["plot_id"]]
    reach = float(share.quantile(0.9))
    if len(share.dropna()) >= 3 and reach > _FAR:
        raise InputError(
            f"{path}: its distances reach {reach:.1f} times as far as the plots' radius (up to "
            f"{trees['distance_m'].max():.1f} m), as feet read as metres do; name the column distance_ft, "
            "correct the plots' radius, or give --distance-unit m if both are right."
        )


def bearing_to_grid_deg(
    plot: Plot, crs: pyproj.CRS, protocol: Bearings, day: str = "", path: Path = Path("field table")
) -> float:
    """Degrees to take off a field bearing to make it a grid bearing at this plot. day: ISO date of the field work.

    Raises:
        InputError: no datum; magnetic bearings with neither a declination nor a date, or a date outside the model.
    """
    if protocol.north == "grid":
        return 0.0
    if (degrees := own_degrees(crs, plot.x, plot.y)) is None:
        raise InputError(
            "--north: true or magnetic bearings need a CRS that is tied to the earth; use --north grid for "
            "local coordinates."
        )
    lon, lat = degrees
    declination = 0.0
    if protocol.north == "magnetic":
        if protocol.declination_deg is not None:
            declination = protocol.declination_deg
        elif day:
            declination = declination_deg(lon, lat, 0.0, parse_date(day, str(path)), f"{path}, plot {plot.plot_id}")
        else:
            raise InputError(
                f"{path}: magnetic bearings need the day of the field work, expected --field-date 2025-06-30 (or a "
                "date column), or --declination-deg: degrees, east positive."
            )
    return grid_convergence_deg(crs, lon, lat) - declination


def _day(cell, protocol: FieldProtocol, path: Path) -> str:
    """The row's date, else the protocol's, as ISO text; empty where bearings do not need one."""
    if protocol.north != "magnetic" or protocol.declination_deg is not None:
        return ""
    text = str(cell).strip() if cell is not None and not pd.isna(cell) else (protocol.field_date or "")
    return parse_date(text, str(path)).isoformat() if text else ""


#: Of a table's trees this share may lack a bearing or a distance; with more it is the table that is wrong.
_MAX_UNPLACED = 0.5


def drop_unplaced(trees: pd.DataFrame, path: Path) -> tuple[pd.DataFrame, list[str]]:
    """The trees that have a place, and a sentence about those that have none."""
    lacking = trees[trees["lacks"] != ""]
    if not len(lacking):
        return trees, []
    named = some((f"line {row.line} (tree {row.field_id}: {row.lacks})" for row in lacking.itertuples()), 10)
    text = (
        f"{path}: {len(lacking)} of {len(trees)} field trees left out of the pairing, as nothing says where they "
        f"stand: {named}; correct the table and run again."
    )
    return trees[trees["lacks"] == ""].reset_index(drop=True), [text]


def where_said(table: pd.DataFrame, name: str, found: pd.DataFrame) -> pd.Series:
    """A column as float64; rows where it is empty or no number are noted in ``lacks``."""
    cells = table[name]
    values = pd.to_numeric(cells, errors="coerce").astype(float)
    values = values.where(np.isfinite(values))
    for row in np.flatnonzero(values.isna() & (found["lacks"] == "")):
        text = cells.iloc[row]
        found.loc[found.index[row], "lacks"] = f"{name} is empty" if pd.isna(text) else f"{name} is {text!r}"
    return values


def clear_unplaced(path: Path, found: pd.DataFrame, columns: list[str]) -> None:
    """Half a place is none; a table in which most trees lack theirs is refused."""
    lacking = (found["lacks"] != "").to_numpy()
    if lacking.mean() > _MAX_UNPLACED or lacking.all():
        first = found[lacking].iloc[0]
        raise InputError(
            f"{path}, line {first['line']}: {first['lacks']}, expected a number; {int(lacking.sum())} of {len(found)} "
            "rows are like this: correct them."
        )
    found.loc[lacking, columns] = np.nan
