"""What a verb may write over: never an input, never another output, nothing of somebody else's. Checked before work,
from the declared settings."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import InputError, OutputError
from .files import check_name, identity, protected
from .settings import Param, params_of

#: What files of ours hold near their beginning or end, in small letters, by ending.
_MARKS: dict[str, tuple[bytes, ...]] = {
    **dict.fromkeys((".html", ".htm", ".tif", ".tiff"), (b"treedgs",)),
    **dict.fromkeys((".laz", ".las", ".ply"), (b"treedgs", b"tree_id", b"height_m")),
    ".gpkg": (b"sqlite format 3\0",),
}
_LAYER = (b"qc_flag",)
_LOOKED_AT = 1 << 16
_TELL = "give another name, or --overwrite to replace it"


@contextmanager
def checked_paths(settings: Any, overwrite: bool | Collection[str] = False) -> Iterator[None]:
    """Refuse paths that cannot be used together, and keep the inputs from being written while the block runs.

    overwrite: replace files that TreeDGS did not write; or the names of the outputs for which the user said so.

    Raises:
        InputError: an output is an input or another output. OutputError: a name that no output can have, a pipe, a
            wrong ending, a file or folder of somebody else.
    """
    given = [(name, spec, value) for name, spec, _ in params_of(type(settings)) if (value := getattr(settings, name))]
    inputs = {_option(name): Path(value) for name, spec, value in given if spec.kind in ("file", "folder", "files")}
    outputs = [(name, spec, Path(value)) for name, spec, value in given if spec.kind.startswith("output_")]
    for path in (*inputs.values(), *(path for _, _, path in outputs)):
        if os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path):
            raise InputError(f"{path}: is a pipe or a device, expected a file; give a file.")
    taken = {identity(path): option for option, path in inputs.items()}
    for name, spec, path in outputs:
        option, may = _option(name), overwrite is True or (overwrite is not False and name in overwrite)
        check_name(path)
        _check_ending(path, spec)
        for target in (path, *(path / held for held in spec.holds)):
            if (other := taken.get(identity(target))) is not None:
                raise InputError(
                    f"{option}: {target} is what {other} names, and would be written over; give another "
                    f"{'folder' if spec.kind == 'output_folder' else 'name'}."
                )
        taken[identity(path)] = option
        if spec.kind == "output_folder":
            _check_folder(option, path, spec, may)
        elif not may and is_foreign(path):
            raise OutputError(f"{path}: is there already and was not written by TreeDGS; {_TELL}.")
    for name, spec, folder in outputs:
        for other, _, path in outputs if spec.kind == "output_folder" and not spec.holds else ():
            if other != name and identity(folder) in map(identity, path.absolute().parents):
                raise InputError(
                    f"{_option(other)}: {path} lies in the folder of {_option(name)}, which is made anew; give another "
                    "place."
                )
    # A verb without an output changes its input: that is what it is for.
    with protected([path for path in inputs.values() if path.is_file()] if outputs else []):
        yield


def is_foreign(path: Path) -> bool:
    """Whether a file is there that does not look like one of ours. In GeoPackages only our own layers are replaced."""
    # The columns of a shapefile stand in its table.
    table = path.with_suffix(".dbf") if path.suffix.lower() == ".shp" else path
    if not path.is_file() or not path.stat().st_size or not table.is_file():
        return path.is_file() and path.stat().st_size > 0
    with open(table, "rb") as stream:
        text = stream.read(_LOOKED_AT)
        stream.seek(max(table.stat().st_size - _LOOKED_AT, 0))
        text += stream.read(_LOOKED_AT)
    return not any(mark in text.lower() for mark in _MARKS.get(path.suffix.lower(), _LAYER))


def _check_folder(option: str, folder: Path, spec: Param, may: bool) -> None:
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, expected a folder; choose another output.")
    if not folder.is_dir() or may or (spec.known_by and (folder / spec.known_by).exists()):
        return
    if not spec.holds and any(folder.iterdir()):
        raise OutputError(f"{folder}: is there already, not empty, and not of {option}; give an empty or new folder.")
    for name in spec.holds:
        if (folder / name).is_file() and (folder / name).stat().st_size:
            raise OutputError(
                f"{option}: {folder / name} is there already and was not written by TreeDGS; give another folder, or "
                "--overwrite to replace it."
            )


def _check_ending(path: Path, spec: Param) -> None:
    endings = ["." + suffix.lstrip(".").lower() for suffix in spec.suffixes]
    if spec.kind == "output_file" and endings and path.suffix.lower() not in endings:
        raise OutputError(f"{path}: ends in {path.suffix!r}, expected {' or '.join(endings)}; rename the output.")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
