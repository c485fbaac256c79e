"""Which geotag files there are: MRK, ``.pos``, RINEX and tables in a folder, sorted by what they are."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import GeotagError
from .ppk import read_rinex_header
from .tables import is_position_table


@dataclass
class GeotagFiles:
    """Files found: MRK, ``.pos`` trajectories, ``_events.pos`` (one row a photo), RINEX, tables by photo name."""

    mrk: list[Path] = field(default_factory=list)
    pos: list[Path] = field(default_factory=list)
    events: list[Path] = field(default_factory=list)
    tables: list[Path] = field(default_factory=list)
    rinex: list[Path] = field(default_factory=list)

    def all(self) -> list[Path]:
        """Every file that the positions come from; RINEX lies idle where its solution is there."""
        rinex = [] if self.pos or self.events else self.rinex
        return list(dict.fromkeys([*self.mrk, *self.pos, *self.events, *self.tables, *rinex]))


def find_geotags(geotags: Path, photos: Path) -> GeotagFiles:
    """Look at a file, or into a folder (and, for MRK and ``.pos``, one level below it and beside the photos).

    A single ``.pos`` brings the MRK files beside it or beside the photos with it: the exposure times are there.

    Raises:
        GeotagError: nothing usable there.
    """
    geotags, photos = Path(geotags), Path(photos)
    found = GeotagFiles()
    if geotags.is_file():
        _sort_in(geotags, found, always=True)
        if found.rinex:
            found.rinex = [path for path in _files(geotags.parent) if _is_rinex(path)]
        beside: tuple[Path, ...] = (geotags.parent, photos, photos.parent)
    elif geotags.is_dir():
        for path in _files(geotags):
            _sort_in(path, found)
        for below in sorted(p for p in geotags.iterdir() if p.is_dir() and not p.name.startswith(".")):
            for path in _files(below):
                if path.suffix.lower() in (".mrk", ".pos") or _is_rinex(path):
                    _sort_in(path, found)
        beside = (photos,)
    else:
        raise GeotagError(f"{geotags}: not found; give the folder or file with the MRK, .pos or CSV geotags.")
    if not found.mrk and (found.pos or found.events or found.rinex):
        marks = ([path for path in _files(folder) if path.suffix.lower() == ".mrk"] for folder in beside)
        found.mrk = next(filter(None, marks), [])
    if not (found.mrk or found.pos or found.events or found.tables or found.rinex):
        raise GeotagError(
            f"{geotags}: holds no geotags, expected MRK, RTKLIB .pos, RINEX, or a table with the columns name, lat, "
            "lon, h; leave --geotags out to use the photos' EXIF."
        )
    if found.tables and (found.mrk or found.pos or found.events):
        raise GeotagError(
            f"{geotags}: holds both {found.tables[0].name} and {(found.mrk + found.pos + found.events)[0].name}; "
            "give the one to use as --geotags."
        )
    if len(found.tables) > 1:
        raise GeotagError(
            f"{geotags}: holds {len(found.tables)} tables of positions ({found.tables[0].name}, "
            f"{found.tables[1].name}); give the one to use as --geotags."
        )
    return found


def _files(folder: Path) -> list[Path]:
    try:
        return sorted(p for p in Path(folder).iterdir() if p.is_file() and not p.name.startswith("."))
    except OSError:
        return []


def _sort_in(path: Path, found: GeotagFiles, always: bool = False) -> None:
    suffix = path.suffix.lower()
    if suffix == ".mrk":
        found.mrk.append(path)
    elif suffix == ".pos":
        (found.events if path.stem.lower().endswith("_events") else found.pos).append(path)
    elif suffix in (".csv", ".txt", ".tsv") and (always or is_position_table(path)):
        found.tables.append(path)
    elif _is_rinex(path):
        found.rinex.append(path)
    elif always:
        raise GeotagError(
            f"{path}: is not a kind of geotags that is known; give MRK, RTKLIB .pos, RINEX, CSV or geo.txt."
        )


_RINEX = re.compile(r"\.(obs|nav|rnx|crx|\d\d[oOnNgGpPlLcCqQfFdD])$", re.IGNORECASE)


def _is_rinex(path: Path) -> bool:
    return bool(_RINEX.search(path.name)) and read_rinex_header(path) is not None
