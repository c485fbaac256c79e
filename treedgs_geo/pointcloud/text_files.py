"""Clouds in text lines, read chunk by chunk."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyproj

from ..core.errors import InputError
from .cloud import PointCloud
from .file_crs import short


def iter_text(path: Path, crs: pyproj.CRS | None, chunk_points: int) -> Iterator[PointCloud]:
    """x y z per line (blank, comma, semicolon or tab between), one optional header line that names the columns."""
    try:
        with open(path, encoding="utf-8-sig") as stream:
            first = stream.readline()
            delimiter = next((mark for mark in (",", ";", "\t") if mark in first), None)
            words = [word.strip().lower() for word in first.strip().lstrip("#/").split(delimiter)]
            has_header = not all(_is_number(word) for word in words)
            if len(words) < 3:
                raise InputError(f"{path}: its first line has {len(words)} columns, expected x y z; give x y z per "
                                 "line.")
            names = words if has_header else []
            where = [names.index(axis) for axis in "xyz"] if all(axis in names for axis in "xyz") else [0, 1, 2]
            if not has_header:
                stream.seek(0)
                first_line = stream.readline()
                assert first_line
                lines = itertools.chain([first_line.lstrip("\ufeff")], stream)
            else:
                lines = itertools.chain(stream)
            while True:
                block = list(itertools.islice(lines, min(chunk_points, 500_000)))
                if not block:
                    return
                table = np.loadtxt(block, delimiter=delimiter, ndmin=2)
                if table.size == 0:
                    continue
                extra = {name: table[:, column] for column, name in enumerate(names[:table.shape[1]])
                         if column not in where}
                yield PointCloud(np.ascontiguousarray(table[:, where]), crs, extra)
    except (OSError, UnicodeDecodeError) as problem:
        raise InputError(f"{path}: is not a text file ({short(problem)}); give x y z per line.") from None
    except (ValueError, IndexError) as problem:
        raise InputError(f"{path}: is not a table of numbers ({short(problem)}); give x y z per line.") from None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
