"""Layers of one GeoPackage into another, in one transaction, with plain SQL: nothing else in the file is touched.

Tables and their roles: OGC GeoPackage 1.2 (12-128r14), clauses 1.1.2 to 2.1; ``gpkg_ogr_contents`` is GDAL's,
``layer_styles`` QGIS's.
"""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

#: Tables with one row or more a layer; a layer that is put in anew keeps what people wrote into the last two.
_BOOKS = ("gpkg_geometry_columns", "gpkg_ogr_contents", "gpkg_extensions", "gpkg_contents")
_NOTES = ("gpkg_data_columns", "gpkg_metadata_reference")
#: The description of a style that TreeDGS put in begins so; others are the user's.
_OUR_STYLE = "TreeDGS "


class ForeignLayer(Exception):
    """The file is no GeoPackage, or a layer with one of our names is not ours."""


def check_layers(there: sqlite3.Connection, own: Mapping[str, frozenset[str]]) -> None:
    """Raises:
    ForeignLayer: no GeoPackage, or a layer of our name without our columns.
    """
    if not _exists(there, "main", "gpkg_contents"):
        raise ForeignLayer("is a database but no GeoPackage")
    for name, columns in own.items():
        table = _exists(there, "main", name)
        if table is None:
            continue
        have = {column.lower() for column in _columns(there, "main", table)}
        (kind,) = there.execute("SELECT type FROM main.sqlite_master WHERE name = ?", (table,)).fetchone()
        if columns - have or kind != "table":
            lacking = ", ".join(sorted(columns - have)) or "a table of its own"
            raise ForeignLayer(f"has a layer {table!r} that TreeDGS did not make (it lacks {lacking})")


def merge(target: Path, source: Path, own: Mapping[str, frozenset[str]], wait_s: float) -> None:
    """Take the layers ``own`` out of ``target`` and put those of ``source`` in.

    own: name -> columns by which such a layer is known as ours. wait_s: how long to wait for other programs, twice.

    Raises:
        ForeignLayer: see :func:`check_layers`. sqlite3.Error: locked, full, damaged; ``target`` is as it was.
    """
    with closing(sqlite3.connect(target, timeout=wait_s, isolation_level=None)) as there:
        there.execute("ATTACH DATABASE ? AS fresh", (str(source),))
        there.create_function("treedgs_with_srs", 2, _with_srs, deterministic=True)
        there.execute("BEGIN IMMEDIATE")
        try:
            check_layers(there, own)
            layers = [
                row[0]
                for row in there.execute(
                    "SELECT table_name FROM fresh.gpkg_contents WHERE data_type IN ('features', 'attributes') "
                    "AND table_name <> 'layer_styles'"
                )
            ]
            for name in own:
                _take_out(there, name, stays=name in layers)
            for name in layers:
                _put_in(there, name)
            _put_styles(there, layers)
            there.execute("COMMIT")
        except BaseException:
            if there.in_transaction:
                there.execute("ROLLBACK")
            raise


def _take_out(there: sqlite3.Connection, layer: str, stays: bool) -> None:
    table = _exists(there, "main", layer)
    if table is None:
        return
    if _exists(there, "main", "gpkg_geometry_columns"):
        for (column,) in there.execute(
            "SELECT column_name FROM main.gpkg_geometry_columns WHERE table_name = ? COLLATE NOCASE", (table,)
        ).fetchall():
            there.execute(f"DROP TABLE IF EXISTS main.{_quoted(f'rtree_{table}_{column}')}")
    there.execute(f"DROP TABLE main.{_quoted(table)}")
    for book in (*_BOOKS, *(() if stays else _NOTES)):
        if _exists(there, "main", book):
            there.execute(f"DELETE FROM main.{book} WHERE table_name = ? COLLATE NOCASE", (table,))
    if _exists(there, "main", "layer_styles"):
        there.execute(
            "DELETE FROM main.layer_styles WHERE f_table_name = ? COLLATE NOCASE AND description LIKE ?",
            (table, _OUR_STYLE + "%"),
        )


def _put_in(there: sqlite3.Connection, layer: str) -> None:
    """Table, rows, spatial index, triggers (last: they call functions that only GDAL and QGIS have), entries."""
    made = there.execute(
        "SELECT type, name, sql FROM fresh.sqlite_master WHERE tbl_name = ? AND sql IS NOT NULL", (layer,)
    ).fetchall()
    geometry = (
        there.execute(
            "SELECT column_name, srs_id FROM fresh.gpkg_geometry_columns WHERE table_name = ?", (layer,)
        ).fetchone()
        if _exists(there, "fresh", "gpkg_geometry_columns")
        else None
    )
    (srs,) = there.execute("SELECT srs_id FROM fresh.gpkg_contents WHERE table_name = ?", (layer,)).fetchone()
    moved = {number: _srs(there, number) for number in {srs, geometry[1] if geometry else srs} if number is not None}
    for kind, _, sql in made:
        if kind == "table":
            there.execute(sql)
    names = _columns(there, "fresh", layer)
    values = [
        f"treedgs_with_srs({_quoted(name)}, {moved[geometry[1]]:d})"
        if geometry and name == geometry[0] and moved[geometry[1]] != geometry[1]
        else _quoted(name)
        for name in names
    ]
    there.execute(
        f"INSERT INTO main.{_quoted(layer)} ({', '.join(map(_quoted, names))}) "
        f"SELECT {', '.join(values)} FROM fresh.{_quoted(layer)}"
    )
    if geometry:
        index = f"rtree_{layer}_{geometry[0]}"
        virtual = there.execute("SELECT sql FROM fresh.sqlite_master WHERE name = ?", (index,)).fetchone()
        if virtual:
            there.execute(virtual[0])
            there.execute(f"INSERT INTO main.{_quoted(index)} SELECT * FROM fresh.{_quoted(index)}")
    for kind, _, sql in made:
        if kind in ("index", "trigger"):
            there.execute(sql)
    for book in reversed(_BOOKS):
        _copy_rows(there, book, layer, moved)


def _copy_rows(there: sqlite3.Connection, book: str, layer: str, moved: Mapping[int, int]) -> None:
    for values in _rows(there, "fresh", book, "table_name = ?", layer) if _shared(there, book) else ():
        if values.get("srs_id") is not None:
            values["srs_id"] = moved.get(values["srs_id"], values["srs_id"])
        named = "SELECT 1 FROM main.gpkg_contents WHERE identifier = ?"
        if book == "gpkg_contents" and there.execute(named, (values.get("identifier"),)).fetchone():
            values["identifier"] = None  # unique, and another layer has it
        _insert(there, book, values)


def _shared(there: sqlite3.Connection, table: str) -> bool:
    """Whether ``source`` has a table; where ``target`` lacks it, it is made there."""
    made = there.execute("SELECT sql FROM fresh.sqlite_master WHERE name = ?", (table,)).fetchone()
    if made is not None and not _exists(there, "main", table):
        there.execute(made[0])
    return made is not None


def _rows(there: sqlite3.Connection, schema: str, table: str, where: str = "1", *asked: object) -> list[dict[str, Any]]:
    """Rows of a table of both files, by the columns that both have."""
    names = [name for name in _columns(there, "fresh", table) if name in _columns(there, "main", table)]
    wanted = f"SELECT {', '.join(map(_quoted, names))} FROM {schema}.{_quoted(table)} WHERE {where}"
    return [dict(zip(names, row, strict=True)) for row in there.execute(wanted, asked).fetchall()]


def _insert(there: sqlite3.Connection, table: str, values: Mapping[str, object]) -> None:
    there.execute(
        f"INSERT INTO main.{_quoted(table)} ({', '.join(map(_quoted, values))}) "
        f"VALUES ({', '.join('?' * len(values))})",
        tuple(values.values()),
    )


def _srs(there: sqlite3.Connection, number: int) -> int:
    """The number that a CRS of ``source`` has in ``target``; put in where it is missing."""
    _widen_srs(there)
    found = _rows(there, "fresh", "gpkg_spatial_ref_sys", "srs_id = ?", number)
    if not found:
        return number
    values = found[0]

    def is_same(theirs: dict[str, Any]) -> bool:
        if str(values["organization"]).upper() not in ("EPSG", "ESRI"):
            return all(theirs[name] == value for name, value in values.items() if name.startswith("definition"))
        names = ("organization", "organization_coordsys_id")
        return all(str(theirs[name]).upper() == str(values[name]).upper() for name in names)

    numbers = {theirs["srs_id"]: is_same(theirs) for theirs in _rows(there, "main", "gpkg_spatial_ref_sys")}
    if numbers.get(number) or number in (0, -1) and number in numbers:
        return number
    if any(numbers.values()):
        return next(found for found, fits in numbers.items() if fits)
    values["srs_id"] = number if number not in numbers else max(100_000, *numbers) + 1
    if str(values["organization"]).upper() == "NONE":
        values["organization_coordsys_id"] = values["srs_id"]
    _insert(there, "gpkg_spatial_ref_sys", values)
    return values["srs_id"]


def _widen_srs(there: sqlite3.Connection) -> None:
    """Columns that GDAL adds for CRSs which old WKT cannot say (compound, with epoch), with their extension's rows."""
    have = _columns(there, "main", "gpkg_spatial_ref_sys")
    lacking = [name for name in _columns(there, "fresh", "gpkg_spatial_ref_sys") if name not in have]
    for name in lacking:
        kind = "TEXT DEFAULT 'undefined'" if name.startswith("definition") else "DOUBLE"
        there.execute(f"ALTER TABLE main.gpkg_spatial_ref_sys ADD COLUMN {_quoted(name)} {kind}")
    if lacking:
        _copy_rows(there, "gpkg_extensions", "gpkg_spatial_ref_sys", {})


def _put_styles(there: sqlite3.Connection, layers: list[str]) -> None:
    """Our styles; not as default where a person has made another one the default."""
    if not _shared(there, "layer_styles"):
        return
    if not there.execute("SELECT 1 FROM main.gpkg_contents WHERE table_name = 'layer_styles'").fetchone():
        _copy_rows(there, "gpkg_contents", "layer_styles", {})
    for layer in layers:
        own = there.execute(
            "SELECT 1 FROM main.layer_styles WHERE f_table_name = ? COLLATE NOCASE AND useAsDefault", (layer,)
        ).fetchone()
        for values in _rows(there, "fresh", "layer_styles", "f_table_name = ?", layer):
            values.pop("id", None)
            _insert(there, "layer_styles", values | ({"useAsDefault": 0} if own else {}))


def _exists(there: sqlite3.Connection, schema: str, table: str) -> str | None:
    """The table's or view's name as the file spells it."""
    row = there.execute(
        f"SELECT name FROM {schema}.sqlite_master WHERE type IN ('table', 'view') AND name = ? COLLATE NOCASE", (table,)
    ).fetchone()
    return row[0] if row else None


def _columns(there: sqlite3.Connection, schema: str, table: str) -> list[str]:
    return [row[1] for row in there.execute(f"PRAGMA {schema}.table_info({_quoted(table)})")]


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _with_srs(geometry: bytes | None, number: int) -> bytes | None:
    """A GeoPackage geometry (clause 2.1.3) with another ``srs_id``."""
    if geometry is None or geometry[:2] != b"GP":
        return geometry
    return geometry[:4] + struct.pack("<i" if geometry[3] & 1 else ">i", number) + geometry[8:]
