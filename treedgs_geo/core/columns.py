"""What the columns of a table hold: numbers in one unit, within bounds, and places in one CRS."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .column_names import FIA, FIA_MARKS, QUANTITIES, plain_name, spellings
from .errors import CRSError, InputError
from .tables import read_table

if TYPE_CHECKING:
    import pandas as pd
    import pyproj


#: Two columns of one quantity agree within this share: whole inches do.
_CONTRADICTS = 0.15


@dataclass(frozen=True)
class FoundColumn:
    """A column of the table: its name there, the unit that the name says (empty: none)."""

    name: str
    unit: str


def columns(table: Iterable[str], *keys: str) -> dict[str, FoundColumn]:
    """Which of the wanted :data:`.column_names.QUANTITIES` a table has, by names of columns
    (:func:`.number_cells.column_name`); of several that would do the best name counts."""
    names = list(table)
    plain = {plain_name(name): name for name in reversed(names)}
    fia = FIA if FIA_MARKS & set(names) else {}
    found = {}
    for key in keys:
        for spelt, unit in ([fia[key]] if key in fia else []) + spellings(key):
            # Beside "e" an "n" is a northing.
            if spelt in plain and not (spelt == "n" and key == "field_id" and "e" in plain):
                found[key] = FoundColumn(plain[spelt], unit)
                break
    return found


def plot_ids(table: pd.DataFrame, column: FoundColumn) -> pd.Series:
    """The plot of each row, ``None`` where it is empty. FIA numbers its subplots anew in each plot: in a table of
    several plots both make the id (``7-1``)."""
    if "subp" not in table:
        return table[column.name]
    inner = table["subp"]
    plots = [table[name] for name in ("plot", "plt_cn") if name in table]
    outer = max(plots, key=lambda cells: cells.nunique(), default=None)
    if outer is None or outer.nunique() < 2:
        return inner
    return (outer + "-" + inner).where(outer.notna() & inner.notna(), None)


def require(
    path: Path,
    table: pd.DataFrame,
    found: Mapping[str, FoundColumn],
    needed: Iterable[str | tuple[str, ...]],
    units: Mapping[str, str] | None = None,
) -> None:
    """Raise ``InputError`` with everything that a table lacks in one sentence. needed: quantities, or several of which
    one will do. units: quantity -> option that says its unit (empty: there is none); those in ``found`` without a unit
    are refused."""
    wanted = [(need,) if isinstance(need, str) else need for need in needed]
    lacks = [
        f"{QUANTITIES[keys[0]].what} ({' or '.join(QUANTITIES[key].examples for key in keys)})"
        for keys in wanted
        if not set(keys) & set(found)
    ]
    problems = [f"it lacks {'; '.join(lacks)}"] if lacks else []
    for key, option in (units or {}).items():
        if key in found and not found[key].unit:
            way = f", or give {option}" if option else ""
            problems.append(
                f"column {found[key].name!r} does not say its unit: rename it {QUANTITIES[key].examples}{way}"
            )
    if problems:
        used = {column.name for column in found.values()}
        other = [name for name in table.columns if name not in used]
        unknown = f" (not known here: {', '.join(other)})" if lacks and other else ""
        raise InputError(f"{path}: found columns {', '.join(table.columns)}{unknown}; {'; '.join(problems)}.")


def numbers(path: Path, table: pd.DataFrame, name: str, required: bool = False) -> pd.Series:
    """A column as float64 (NaN where empty).

    Raises:
        InputError: the first cell that is no finite number, or (``required``) empty.
    """
    import pandas as pd

    cells = table[name]
    values = pd.to_numeric(cells, errors="coerce").astype(float)
    bad = (cells.notna() | required) & ~np.isfinite(values)
    if bad.any():
        found = cells[bad.idxmax()]
        what = "empty" if found is None or found != found else repr(found)
        raise InputError(f"{path}, {line_of(bad)}: {name} is {what}, expected a number; correct it.")
    return values


def measured(path: Path, table: pd.DataFrame, key: str, column: FoundColumn | None) -> pd.Series:
    """A quantity in its first unit (:data:`.column_names.QUANTITIES`), NaN where empty; all NaN without a column.

    Raises:
        InputError: no number, outside of the quantity's bounds, or no unit.
    """
    import pandas as pd

    if column is None:
        return pd.Series(np.full(len(table), np.nan), index=table.index)
    require(path, table, {key: column}, (), {key: ""})
    values = numbers(path, table, column.name) * QUANTITIES[key].units[column.unit]
    refuse_bounds(path, values, column.name, key)
    refuse_contradiction(path, table, key, column, values)
    return values


def refuse_contradiction(
    path: Path, table: pd.DataFrame, key: str, column: FoundColumn, values: pd.Series, times: float = 1.0
) -> None:
    """Refuse a table that says a quantity twice, in two units, and not the same. values: of ``column``, in the
    quantity's first unit. times: what the others' numbers are times the quantity (girths: pi).

    Raises:
        InputError: the first row.
    """
    import pandas as pd

    for spelt, unit in dict(spellings(key)).items():
        if not unit or spelt not in table or spelt == column.name:
            continue
        other = pd.to_numeric(table[spelt], errors="coerce").astype(float) * QUANTITIES[key].units[unit] / times
        bad = np.abs(other - values) > _CONTRADICTS * np.abs(values)
        if bad.any():
            first = bad.idxmax()
            raise InputError(
                f"{path}, {line_of(bad)}: {column.name} is {table[column.name][first]} and {spelt} "
                f"{table[spelt][first]}, expected one size; correct the row, or leave out one of the columns."
            )


def refuse_bounds(path: Path, values: pd.Series, name: str, key: str) -> None:
    """Refuse a value that the quantity cannot have; what stands for "not measured" is one.

    Raises:
        InputError: the row, the value and the bounds.
    """
    quantity = QUANTITIES[key]
    bad = values.notna() & ~values.between(quantity.low, quantity.high)
    if bad.any():
        raise InputError(
            f"{path}, {line_of(bad)}: {name} is {values[bad.idxmax()]:g} {quantity.unit}, expected {quantity.low:g} to "
            f"{quantity.high:g}; correct it (a cell of what was not measured stays empty), or its unit in the column's "
            "name."
        )


def line_of(bad: pd.Series | np.ndarray, table: pd.DataFrame | None = None) -> str:
    """``line 3``: of the first True, in a table that :func:`.tables.read_table` read (``bad``'s own, or ``table``);
    ``row 3`` of another."""
    index = bad.index if table is None else table.index  # type: ignore[union-attr]
    return f"{index.name or 'row'} {index[int(np.flatnonzero(np.asarray(bad))[0])]}"


def places(path: Path, table: pd.DataFrame, crs: pyproj.CRS | None, required: bool = True) -> np.ndarray:
    """(N, 2) places of the rows in ``crs``: easting and northing (or x and y) in it or in that of the row's ``epsg``,
    else longitude and latitude on its datum; NaN where a row has none and none is ``required``.

    Raises:
        InputError: no number, no or half a place, one that ``crs`` does not have. CRSError: an unknown ``epsg``.
    """
    from .frames import moved

    found = columns(table, "easting", "northing", "lon", "lat", "epsg")
    out, datum = np.full((len(table), 2), np.nan), None if crs is None else crs.geodetic_crs
    for pair in (("easting", "northing"), ("lon", "lat")):
        if not set(pair) <= set(found):
            continue
        names = [found[key].name for key in pair]
        xy = np.column_stack([numbers(path, table, name) for name in names])
        said = np.isfinite(xy)
        half = said.any(axis=1) & ~said.all(axis=1)
        if half.any():
            raise InputError(
                f"{path}, {line_of(half, table)}: has only one of {' and '.join(names)}; complete the row."
            )
        codes = table[found["epsg"].name].fillna("").to_numpy() if "epsg" in found else np.full(len(table), "")
        mine = said.all(axis=1) & ~np.isfinite(out).all(axis=1)
        for code in dict.fromkeys(codes[mine]):
            rows = mine & (codes == code)
            where = f"{path}, {line_of(rows, table)}"
            source = datum and datum.to_2d() if pair[0] == "lon" else epsg_crs(str(code), where)
            out[rows] = moved(xy[rows], source, crs)
        lost = said.all(axis=1) & ~np.isfinite(out).all(axis=1)
        if lost.any() and crs is not None:
            first, second = xy[lost][0]
            raise InputError(
                f"{path}, {line_of(lost, table)}: {names[0]} {first:g}, {names[1]} {second:g} has no place in "
                f"{crs.name}; correct the row, or its epsg."
            )
    lost = ~np.isfinite(out).all(axis=1)
    if required and lost.any():
        raise InputError(
            f"{path}, {line_of(lost, table)}: has no place, expected numbers in easting, northing (or x, y, or lon, "
            "lat); correct the row."
        )
    return out


def epsg_crs(code: str, where: str) -> pyproj.CRS | None:
    """The CRS that a cell names (``32616``, ``EPSG:32616``), ``None`` where it is empty.

    Raises:
        CRSError: unknown code.
    """
    import pyproj

    text = code.strip().upper().removeprefix("EPSG:")
    if not text:
        return None
    try:
        return pyproj.CRS.from_epsg(int(float(text)))
    except (ValueError, OverflowError, pyproj.exceptions.CRSError):
        raise CRSError(f"{where}: epsg {code!r} is unknown; give the EPSG code of its coordinates.") from None


def table_crs(path: Path) -> pyproj.CRS | None:
    """The CRS of a table of places by its first ``epsg``, else the UTM zone of its first longitude and latitude;
    ``None`` where it says neither.

    Raises:
        InputError, CRSError: cannot be read, an unknown ``epsg``.
    """
    from .frames import suggest_utm

    table = read_table(path)
    found = columns(table, "easting", "lon", "lat", "epsg")
    if "easting" in found and "epsg" in found and len(codes := table[found["epsg"].name].dropna()):
        return epsg_crs(str(codes.iloc[0]), str(path))
    if "lon" in found and "lat" in found:
        degrees = [numbers(path, table, found[key].name).dropna() for key in ("lon", "lat")]
        if all(map(len, degrees)):
            return suggest_utm(*(float(values.iloc[0]) for values in degrees))
    return None
