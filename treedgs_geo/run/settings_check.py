"""Are these the settings of the run that a workspace holds?"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.errors import InputError
from ..core.workspace import read_record

if TYPE_CHECKING:
    from .settings import PhotosToDbhSettings

#: Settings that may differ: they change no diameter.
_FREE = frozenset({"output", "workspace", "sheets", "dry_run", "at"})
#: Files that stages know by their content, wherever they are.
_BY_CONTENT = frozenset({"photos", "geotags", "dtm", "gcp", "calibration"})


def same_run(settings: PhotosToDbhSettings) -> PhotosToDbhSettings:
    """The settings, with the CRS written as the run in the workspace had it, so that its stages are known again.

    Raises:
        InputError: there is no finished run, or a setting differs from the run's, with both values.
    """
    folder = settings.workspace
    record = read_record(folder)
    had = record.get("parameters") if record is not None else None
    stages = record["stages"] if record is not None else {}
    if not isinstance(had, dict) or stages.get("measure", {}).get("status") != "done":
        raise InputError(
            f"{folder}: holds no finished run of photos-to-dbh, which --at measures from; run it once without --at, "
            "or give the workspace of that run."
        )
    start = str((record or {}).get("folder") or os.getcwd())
    crs = settings.crs
    for item in fields(settings):
        if item.name in _FREE or item.name not in had:
            continue
        value, before = getattr(settings, item.name), had[item.name]
        if item.name in _BY_CONTENT:
            same = (value is None) == (before is None)
        elif isinstance(value, Path) and isinstance(before, str):
            same = _where(Path(start) / before) == _where(value)
        elif item.name == "crs":
            # The run's own, as it found it where none was given.
            before = before or (record or {}).get("crs")
            same = value is None or _same_crs(value, before)
            crs = str(before) if same else crs
        else:
            # How far points may be off is asked anew where the run had no field stems.
            same = value == before or (item.name == "field_error_m" and had.get("field_stems") is None)
        if not same:
            option = "--" + item.name.replace("_", "-")
            raise InputError(
                f"{folder}: its run had {option} {_text(before)}, now it is {_text(value)}; give the settings of the "
                "run, or run photos-to-dbh once with the new ones and without --at."
            )
    return replace(settings, crs=crs)


def _where(path: Path) -> str:
    return os.path.realpath(os.path.expanduser(path))


def _same_crs(one: str, other: object) -> bool:
    import pyproj

    if one == other:
        return True
    with suppress(pyproj.exceptions.CRSError):
        return bool(pyproj.CRS.from_user_input(one) == pyproj.CRS.from_user_input(other))
    return False


def _text(value: object) -> str:
    return "not given" if value is None else str(value)
