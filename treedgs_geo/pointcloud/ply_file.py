"""Binary little-endian PLY out: clouds for programs that read no LAS, Gaussian fields, input of other segmenters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import BinaryIO

import numpy as np

#: PLY's old names of types -> numpy's, which are its new ones. It has no 64-bit integers and no booleans.
TYPES = {"float": "float32", "double": "float64", "char": "int8", "uchar": "uint8", "short": "int16",
         "ushort": "uint16", "int": "int32", "uint": "uint32"}  # fmt: skip
_OLD_NAMES = {new: old for old, new in TYPES.items()}
_COLOURS = ("red", "green", "blue")


def ply_header(count: int, columns: np.dtype, comments: Iterable[str] = ()) -> bytes:
    """The header of ``count`` rows of a structured type, little endian."""
    lines = ["ply", "format binary_little_endian 1.0", *(f"comment {text}" for text in comments)]
    lines += [f"element vertex {count}", *(f"property {_OLD_NAMES[columns[n].name]} {n}" for n in columns.names or ())]
    return "\n".join([*lines, "end_header", ""]).encode("ascii", "replace")


class PlyWriter:
    """A cloud piece by piece into an open file: x, y, z as float64, colours in 8 bits, every other attribute as the
    property ``scalar_NAME``: CloudCompare's own form, and the only names that it takes for scalar fields unasked.

    The number of points is known at the end: :meth:`close` writes the header again, padded to the same length.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self._count = stream, 0
        self._columns = np.dtype([])
        #: Colours have 16 bits, which their values alone tell: a cloud's first piece decides, or a later, brighter one.
        self._wide = False

    def write(self, xyz: np.ndarray, attributes: dict[str, np.ndarray]) -> None:
        """xyz: (N, 3) metres. attributes: name -> (N,) or (N, K) values, of the same names and types in each piece."""
        named = dict(zip("xyz", xyz.T.astype(float), strict=True))
        for name, values in attributes.items():
            several = np.ndim(values) > 1
            for number, column in enumerate(np.atleast_2d(np.asarray(values).T)):
                if name in _COLOURS:
                    self._wide = self._wide or column.max(initial=0) > 255
                    named[name] = (column >> 8 if self._wide else column).astype(np.uint8)
                else:
                    named["_".join(f"scalar {name}".split()) + (f"_{number}" if several else "")] = _column(column)
        self._columns = np.dtype([(name, column.dtype.newbyteorder("<")) for name, column in named.items()])
        if not self._stream.tell():
            self._stream.write(self._header())
        rows = np.empty(len(xyz), self._columns)
        for name, column in named.items():
            rows[name] = column
        self._stream.write(rows.tobytes())
        self._count += len(xyz)

    def close(self) -> None:
        """Write the number of points."""
        self._stream.seek(0)
        self._stream.write(self._header())

    def _header(self) -> bytes:
        return ply_header(self._count, self._columns, [f"TreeDGS, metres, no CRS{'.' * (20 - len(str(self._count)))}"])


def _column(values: np.ndarray) -> np.ndarray:
    """As one of PLY's types: 0 and 1 for booleans, float64 for 64-bit integers (exact to 2**53)."""
    if values.dtype == bool:
        return values.astype(np.uint8)
    return values if values.dtype.name in _OLD_NAMES else values.astype(float)
