"""GeoPackages that other programs show and that hold other layers: only our own layers are replaced, all at once."""

from __future__ import annotations

import itertools
import os
import re
import sqlite3
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from importlib.resources import files
from pathlib import Path
from xml.sax.saxutils import escape, unescape

from .errors import OutputError
from .files import ensure_writable, keep_beside, put_in_place, temporary_beside
from .geopackage_merge import ForeignLayer, check_layers, merge
from .resource_errors import is_full, reporting_full_disk

#: Seconds to wait for another program that reads or edits a GeoPackage.
WAIT_S = 12.0
#: SQLite opens no file with a longer path (bytes, less what it appends).
_LONGEST_PATH = 490

#: Layers of one kind of file: name -> columns by which a layer of that name is known as ours.
OwnLayers = Mapping[str, frozenset[str]]


@contextmanager
def atomic_geopackage(target: Path, own: OwnLayers) -> Iterator[Path]:
    """Yield a temporary GeoPackage whose layers come into ``target`` only if the block succeeds.

    In a new file, by renaming. An existing GeoPackage keeps its place (while QGIS shows it, its write-ahead log lies
    beside it, and SQLite would replay that log into a new file of the same name) and everything that is not ours: in
    one transaction the layers named in ``own`` are taken out and the new ones put in.

    Raises:
        OutputError: the folder cannot be written, the disk is full. With the result kept beside, and named: another
            program holds the file for longer than :data:`WAIT_S`; it is no GeoPackage or has a foreign layer of our
            name.
    """
    target = Path(target)
    ensure_writable(target)
    _check_path(target)
    with temporary_beside(target) as temporary, reporting_full_disk(target):
        yield temporary
        if temporary.exists():
            with closing(sqlite3.connect(temporary)) as written:
                answer = written.execute("PRAGMA quick_check").fetchone()
            if answer != ("ok",):  # GDAL does not always say that the disk was full
                raise OSError(f"the file was not written whole: {answer}")
        if not _is_database(target):
            put_in_place(temporary, target)
            return
        try:
            merge(target, temporary, own, WAIT_S)
        except (sqlite3.Error, ForeignLayer) as problem:
            kept = keep_beside(temporary, target)
            raise OutputError(
                f"{_sentence(target, problem)} This run's result is kept as {kept}: use that file, or run again."
            ) from None


def ensure_unlocked(target: Path, own: OwnLayers | None = None) -> None:
    """Prove that a GeoPackage may be written, before hours of work. Makes nothing.

    Raises:
        OutputError: QGIS or another program is editing it, it is no GeoPackage, it has a foreign layer of our name.
    """
    _check_path(target)
    if not _is_database(target):
        return
    try:
        with closing(sqlite3.connect(target, timeout=WAIT_S, isolation_level=None)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            check_layers(connection, own or {})
            connection.rollback()
    except (sqlite3.Error, ForeignLayer) as problem:
        raise OutputError(_sentence(target, problem)) from None


def is_whole(path: Path, layer: str) -> bool:
    """Whether a GeoPackage can be read to its end and has the layer."""
    try:
        if not _is_database(path):
            return False
        with closing(sqlite3.connect(path, timeout=WAIT_S)) as connection:
            connection.execute(f'SELECT count(*) FROM "{layer}"').fetchone()
            return connection.execute("PRAGMA quick_check").fetchone() == ("ok",)
    except sqlite3.Error as problem:
        return "locked" in str(problem)  # somebody works on it, so it can be read


def move_aside(path: Path) -> Path:
    """Rename a damaged file, for whoever wants to rescue something from it; returns the new name.

    Raises:
        OutputError: another program holds it.
    """
    try:
        with closing(sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.rollback()
    except sqlite3.Error as problem:
        if "locked" in str(problem) or "busy" in str(problem):
            raise OutputError(_sentence(path, problem)) from None
    names = (path.with_name(f"{path.stem}.damaged{number}{path.suffix}") for number in itertools.count(1))
    kept = next(name for name in names if not name.exists())
    put_in_place(path, kept)
    for ending in ("-wal", "-shm", "-journal"):
        Path(f"{path}{ending}").unlink(missing_ok=True)
    return kept


def style_text(name: str) -> str:
    """The QML of one of our layers (``core/styles``, written by ``make styles``)."""
    return (files(__package__) / "styles" / f"{name}.qml").read_text(encoding="utf-8")


def save_style(geopackage: Path, layer: str, texts: Mapping[str, str] | None = None) -> None:
    """Store our style of this layer inside the GeoPackage; a layer that has none keeps QGIS's own. texts: what stands
    in the style's expressions as a text -> what shall stand there."""
    if (files(__package__) / "styles" / f"{layer}.qml").is_file():
        qml = style_text(layer)
        for there, wanted in (texts or {}).items():
            qml = qml.replace(f"'{there}'", escape(f"'{wanted.replace(chr(39), 2 * chr(39))}'"))
        put_style(geopackage, layer, qml)


def style_text_after(geopackage: Path, layer: str, before: str) -> str | None:
    """The text that follows ``before`` in the expressions of a layer's default style; ``None`` where there is none."""
    if not _is_database(geopackage):
        return None
    with suppress(sqlite3.Error), closing(sqlite3.connect(geopackage, timeout=WAIT_S)) as connection:
        order = "SELECT styleQML FROM layer_styles WHERE f_table_name = ? ORDER BY useAsDefault DESC"
        for (qml,) in connection.execute(order, (layer,)):
            found = re.search(re.escape(before) + "'((?:[^']|'')*)'", unescape(qml or ""))
            if found:
                return found[1].replace("''", "'")
    return None


def put_style(geopackage: Path, layer: str, qml: str) -> None:
    """Store ``qml`` as the layer's default style inside the GeoPackage, where QGIS looks for it."""
    with closing(sqlite3.connect(geopackage, timeout=WAIT_S)) as connection, connection:
        connection.execute(
            "CREATE TABLE IF NOT EXISTS layer_styles (id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, "
            "f_table_catalog TEXT(256), f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256), "
            "styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT, owner TEXT(30), "
            "ui TEXT(30), update_time DATETIME DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')))"
        )
        connection.execute("DELETE FROM layer_styles WHERE f_table_name = ?", (layer,))
        connection.execute(
            "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName, "
            "styleQML, styleSLD, useAsDefault, description, owner) VALUES ('', '', ?, 'geom', ?, ?, '', 1, ?, '')",
            (layer, layer, qml, f"TreeDGS {layer}"),
        )
        connection.execute(
            "INSERT OR IGNORE INTO gpkg_contents (table_name, data_type, identifier) "
            "VALUES ('layer_styles', 'attributes', 'layer_styles')"
        )


def _check_path(target: Path) -> None:
    length = len(os.fsencode(os.path.abspath(target)))
    if length > _LONGEST_PATH:
        raise OutputError(
            f"{target}: the path has {length} bytes, expected at most {_LONGEST_PATH} for a GeoPackage; choose a "
            "shorter one."
        )


def _is_database(path: Path) -> bool:
    try:
        with open(path, "rb") as stream:
            return stream.read(16) == b"SQLite format 3\0"
    except (OSError, ValueError):
        return False


def _sentence(path: Path, problem: Exception) -> str:
    """What stands in the way, and what to do."""
    text = str(problem)
    if isinstance(problem, ForeignLayer):
        return f"{path}: {text}; rename that layer, or choose another output."
    if "locked" in text or "busy" in text:
        names = ", ".join(_holders(path)) or "perhaps QGIS with an open edit session or attribute table"
        return (
            f"{path}: cannot be written ({text}), another program reads or edits it ({names}); save or drop the edits "
            "in QGIS, or close that program, and run again."
        )
    if "readonly" in text:
        return f"{path}: cannot be written (it is write-protected); choose another output."
    if is_full(text):
        return f"{path}: cannot be written, the disk is full ({text}); make room and run again."
    return f"{path}: cannot be written ({text}); move or delete it, or choose another output."


def _holders(path: Path) -> list[str]:
    """Other programs that have the file open, ``name, process N``; Linux only, empty elsewhere."""
    import psutil

    wanted, found = {os.path.realpath(path) + ending for ending in ("", "-wal", "-shm", "-journal")}, []
    for process in psutil.process_iter() if sys.platform == "linux" else ():
        with suppress(psutil.Error, OSError):
            if process.pid != os.getpid() and not wanted.isdisjoint(each.path for each in process.open_files()):
                found.append(f"{process.name()}, process {process.pid}")
    return found
