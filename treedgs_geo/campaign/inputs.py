"""What a plot's inputs are: how much there is of them, their CRS, and whether they have changed."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyproj

from ..core.crs import project_crs
from ..core.errors import InputError
from ..core.files import PHOTO_SUFFIXES
from ..core.frames import horizontal

_CLOUDS = (".las", ".laz")
#: Bytes of a line of a text cloud, for counting without reading.
_LINE_BYTES = 30
FEWEST_PHOTOS = 3


@dataclass(frozen=True)
class PlotInputs:
    """photos, megapixels (all photos together), points (millions). crs: as text. use_crs: what has
    to be handed to the verb, or "". stamp: changes when a name, size or time of a file changes."""

    photos: int
    megapixels: float
    points_m: float
    crs: str
    use_crs: str
    stamp: str


def look_at(route: str, values: dict[str, Any], plots: str, field: str, crs: str | None) -> PlotInputs:
    """Names, sizes and headers only: milliseconds a plot.

    Raises:
        InputError: too few photos, a cloud whose header cannot be read. CRSError: no usable CRS.
    """
    files = input_files(route, values, plots, field)
    stamp = hashlib.sha256()
    for path in files:
        size = path.stat()
        stamp.update(f"{path}:{size.st_size}:{size.st_mtime_ns};".encode("utf-8", "surrogateescape"))
    if route == "photos":
        from PIL import Image

        folder = Path(values["photos"])
        photos = [path for path in files if path.suffix.lower() in PHOTO_SUFFIXES and folder in path.parents]
        if len(photos) < FEWEST_PHOTOS:
            raise InputError(f"photos {folder} holds {len(photos)} photos, expected at least {FEWEST_PHOTOS}.")
        middle = photos[len(photos) // 2]
        try:
            with Image.open(middle) as image:
                megapixels = len(photos) * (image.width * image.height / 1e6)
        except (OSError, Image.DecompressionBombError) as problem:
            raise InputError(f"photos: {middle} is no image that can be read ({problem}); remove it.") from None
        return PlotInputs(len(photos), megapixels, 0.0, crs_name(values["crs"]), "", stamp.hexdigest()[:16])
    cloud = Path(values["input"])
    points, own = _cloud_header(cloud)
    given_crs = values.get("crs") or ("" if own else crs or "")
    if not own and not given_crs:
        raise InputError(f"cloud {cloud} holds no CRS; give it in a column crs, or one for all rows with --crs.")
    name = "local" if given_crs == "local" else own or crs_name(given_crs)
    return PlotInputs(0, 0.0, points / 1e6, name, given_crs, stamp.hexdigest()[:16])


def input_files(route: str, values: dict[str, Any], plots: str, field: str) -> list[Path]:
    """Every file that decides the result, in a fixed order."""
    found: list[Path] = []
    of_photos = ("photos", "geotags", "gcp", "calibration", "dtm")
    places = of_photos if route == "photos" else ("input", "dtm")
    for name in places:
        if values.get(name):
            found += _geotag_files(values) if name == "geotags" else _below(Path(values[name]), deep=name == "photos")
    found += [Path(name) for name in (plots, field) if name]
    return list(dict.fromkeys(found))


def _geotag_files(values: dict[str, Any]) -> list[Path]:
    """The files that the positions come from; whatever lies there when they are of no use (the run says why)."""
    from ..geotags.sources import find_geotags

    try:
        return find_geotags(Path(values["geotags"]), Path(values["photos"])).all()
    except InputError:
        return _below(Path(values["geotags"]), deep=False)


def _below(path: Path, deep: bool) -> list[Path]:
    if path.is_file():
        return [path]
    found = []
    for folder, inner, names in os.walk(path):
        inner[:] = sorted(name for name in inner if not name.startswith(".")) if deep else []
        found += [Path(folder) / name for name in sorted(names) if not name.startswith(".")]
    if deep:
        return [item for item in found if item.suffix.lower() in PHOTO_SUFFIXES]
    return [item for item in found if item.suffix.lower() not in PHOTO_SUFFIXES | {".gpkg", ".laz", ".las"}]


def _cloud_header(path: Path) -> tuple[int, str]:
    """Points and CRS ("" if none) of a cloud, from its header."""
    if path.suffix.lower() not in _CLOUDS:
        return path.stat().st_size // _LINE_BYTES, ""
    from ..pointcloud.las_reader import open_reader

    try:
        with open_reader(path) as reader:
            crs = reader.header.parse_crs()
            return int(reader.header.point_count), _text(horizontal(crs).to_wkt()) if crs is not None else ""
    except Exception as problem:
        raise InputError(f"cloud {path} is not a LAS/LAZ file that can be read ({problem}); export it again.") from None


@lru_cache(maxsize=64)
def crs_name(text: str) -> str:
    """One name for a CRS, however it is given; ``local`` stays."""
    if text == "local":
        return text
    return _text(project_crs(text).to_wkt())


@lru_cache(maxsize=64)
def _text(wkt: str) -> str:
    crs = pyproj.CRS.from_wkt(wkt)
    code = crs.to_epsg(min_confidence=60)
    return f"EPSG:{code}" if code else wkt
