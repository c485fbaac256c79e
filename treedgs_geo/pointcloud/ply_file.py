"""Binary little-endian PLY out: clouds for programs that read no LAS, Gaussian fields, input of other segmenters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..core.files import atomic_path

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


@contextmanager
def ply_writer(path: Path) -> Iterator[Callable[[np.ndarray, dict[str, np.ndarray]], None]]:
    """What takes the pieces of a cloud for a PLY file, which is there when the block ends well: (N, 3) metres, and
    name -> (N,) or (N, K) values, of the same names and types in each piece.

    x, y, z as float64, colours in 8 bits, every other attribute as the property ``scalar_NAME``: CloudCompare's own
    form, and the only names that it takes for scalar fields unasked. The number of points is known at the end: the
    header is then written again, padded to the same length.
    """
    count, columns = 0, np.dtype([])
    # Colours have 16 bits, which their values alone tell: a cloud's first piece decides, or a later, brighter one.
    wide = False

    def header() -> bytes:
        return ply_header(count, columns, [f"TreeDGS, metres, no CRS{'.' * (20 - len(str(count)))}"])

    def write(xyz: np.ndarray, attributes: dict[str, np.ndarray]) -> None:
        nonlocal count, columns, wide
        named = dict(zip("xyz", xyz.T.astype(float), strict=True))
        for name, values in attributes.items():
            several = np.ndim(values) > 1
            for number, column in enumerate(np.atleast_2d(np.asarray(values).T)):
                if name in _COLOURS:
                    wide = wide or column.max(initial=0) > 255
                    named[name] = (column >> 8 if wide else column).astype(np.uint8)
                else:
                    named["_".join(f"scalar {name}".split()) + (f"_{number}" if several else "")] = _column(column)
        columns = np.dtype([(name, column.dtype.newbyteorder("<")) for name, column in named.items()])
        if not stream.tell():
            stream.write(header())
        rows = np.empty(len(xyz), columns)
        for name, column in named.items():
            rows[name] = column
        stream.write(rows.tobytes())
        count += len(xyz)

    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        yield write
        stream.seek(0)
        stream.write(header())


def _column(values: np.ndarray) -> np.ndarray:
    """As one of PLY's types: 0 and 1 for booleans, float64 for 64-bit integers (exact to 2**53)."""
    if values.dtype == bool:
        return values.astype(np.uint8)
    return values if values.dtype.name in _OLD_NAMES else values.astype(float)
