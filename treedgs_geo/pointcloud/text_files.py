"""Clouds in text lines, read chunk by chunk, their columns checked: what is no coordinate is never read as one."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
import pyproj

from ..core.errors import InputError
from .cloud import PointCloud
from .file_crs import short

#: What a header line may call the coordinates, besides x, y and z.
_AXES = (
    {"x", "east", "easting", "e"},
    {"y", "north", "northing", "n"},
    {"z", "height", "elevation", "elev", "altitude", "alt", "h"},
)
#: Whole numbers in so many rows of a column without a name are ids, colours or counts, not coordinates.
_ROWS = 50
_DECIMAL_COMMA = re.compile(r"\d,\d+(\s*[;\t]|[ ]+-?\d)")
_HELP = "put a first line that names the columns, for example 'id x y z'"


def iter_text(path: Path, crs: pyproj.CRS | None, chunk_points: int) -> Iterator[PointCloud]:
    """x y z per line (blank, comma, semicolon or tab between); a header line may name the columns in another order.

    Raises:
        InputError: no table of numbers, or columns that do not say which of them are coordinates.
    """
    try:
        with open(path, encoding="utf-8-sig") as stream:
            names, where, first = _columns(path, stream)
            lines, checked = itertools.chain([first], stream), bool(names)  # what a header names is believed
            while block := list(itertools.islice(lines, min(chunk_points, 500_000))):
                table = np.loadtxt(block, delimiter=_delimiter(first), ndmin=2)
                if table.size == 0:
                    continue
                if not checked:
                    _check_columns(path, table)
                    checked = True
                there = enumerate(names[: table.shape[1]])
                extra = {name: table[:, column] for column, name in there if column not in where}
                yield PointCloud(np.ascontiguousarray(table[:, where]), crs, extra)
    except (OSError, UnicodeDecodeError) as problem:
        raise InputError(f"{path}: is not a text file ({short(problem)}); give x y z per line.") from None
    except (ValueError, IndexError) as problem:
        raise InputError(f"{path}: is not a table of numbers ({short(problem)}); give x y z per line.") from None


def _columns(path: Path, stream: TextIO) -> tuple[list[str], list[int], str]:
    """Names of the columns, empty where no line names x, y and z; where these three are; the first line of numbers.

    Raises:
        InputError: no line of three numbers, a decimal comma, or a header that does not name x, y and z.
    """
    remarks, header = [], ""
    line = stream.readline()
    while line:
        bare = line.strip()
        words = _words(bare)
        if bare.startswith(("#", "//")):
            remarks.append(bare.lstrip("#/ "))
        elif words and not all(_is_number(word) for word in words):
            _refuse_decimal_comma(path, bare)
            if header:
                raise ValueError(f"line {bare[:40]!r}")
            header = bare
        elif len(words) > 1:  # a lone number is a count of the points
            break
        line = stream.readline()
    n_columns = len(_words(line))
    if not n_columns and len(_words(header)) >= 3:
        raise InputError(f"{path}: holds no line of numbers, expected x y z; check the export.")
    if n_columns < 3:
        raise InputError(
            f"{path}: its first line has {n_columns or len(_words(header or ''.join(remarks[:1])))} "
            "columns, expected x y z; give x y z per line."
        )
    _refuse_decimal_comma(path, line)
    names = next((words for words in map(_words, [header, *remarks]) if _axes(words)), _words(header))
    where = _axes(names)
    listed = ", ".join(names[:8])
    if names and where is None:
        degrees = any(name.startswith(("lon", "lat")) for name in names)
        metric = "; project longitude and latitude to the UTM zone of the plot" if degrees else ""
        raise InputError(
            f"{path}: its columns are called {listed}, expected x, y and z among them; name the "
            f"coordinates x, y and z in the first line{metric}."
        )
    if where is not None and n_columns > len(names):
        raise InputError(
            f"{path}: its header names {len(names)} columns ({listed}), its lines have {n_columns}, "
            "expected as many; name every column, and write decimals with a point."
        )
    return names if where else [], where or [0, 1, 2], line


def _refuse_decimal_comma(path: Path, line: str) -> None:
    if _DECIMAL_COMMA.search(line):
        raise InputError(
            f"{path}: writes a decimal comma ({line.strip()[:40]!r}), expected a point; export it with decimal points."
        )


def _axes(names: list[str]) -> list[int] | None:
    """Where x, y and z are among the names, ``None`` where one is missing."""
    found = [
        [k for k, name in enumerate(names) if name == axis] or [k for k, name in enumerate(names) if name in synonyms]
        for axis, synonyms in zip("xyz", _AXES, strict=True)
    ]
    return [places[0] for places in found] if all(found) else None


def _check_columns(path: Path, table: np.ndarray) -> None:
    """Refuse counts, ids, colours and normals in the place of coordinates."""
    if len(table) < _ROWS:
        return
    whole = [bool((column == np.floor(column)).all()) for column in table.T]
    if all(whole[:3]):
        raise InputError(
            f"{path}: columns 1 to 3 hold whole numbers ({_some(table[:, 0])}), expected x y z in metres "
            f"with decimals; export more decimals, or, if they are ids or colours, {_HELP}."
        )
    if (np.diff(table[:, 0]) == 1).all():
        raise InputError(f"{path}: column 1 counts the lines ({_some(table[:, 0])}), expected x; {_HELP}.")
    odd = [k for k in range(3) if whole[k] and np.ptp(table[:, k]) > 0]
    later = [k for k in range(3, table.shape[1]) if not whole[k]]
    if odd and later:
        raise InputError(
            f"{path}: column {odd[0] + 1} holds whole numbers ({_some(table[:, odd[0]])}) as ids and colours do, and "
            f"column {later[0] + 1} decimals as coordinates do, expected x y z first; {_HELP}."
        )
    if table.shape[1] >= 6 and np.abs(table[:, :3]).max() <= 1 and np.ptp(table[:, 3:6], axis=0).min() > 2:
        raise InputError(
            f"{path}: columns 1 to 3 lie between -1 and 1 as colours and normals do, and columns 4 to 6 "
            f"spread as coordinates do, expected x y z first; {_HELP}."
        )


def _some(values: np.ndarray) -> str:
    return ", ".join(f"{value:g}" for value in values[:3]) + " ..."


def _delimiter(line: str) -> str | None:
    return next((mark for mark in (";", "\t", ",") if mark in line), None)


def _words(line: str) -> list[str]:
    """The words of a line: small letters, without quotes and units in brackets."""
    delimiter = _delimiter(line)
    words = [word.strip().strip("\"'").lower() for word in line.strip().split(delimiter)]
    words = [re.sub(r"\s*[\[(].*?[\])]$|_m$", "", word).strip() for word in words]
    return [word for word in words if word] if delimiter is None else words


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
