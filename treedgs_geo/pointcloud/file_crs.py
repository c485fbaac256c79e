"""The CRS of a cloud: what its file says, what the user says, and whether the two agree."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyproj

from ..core.crs import check_projected, project_crs
from ..core.errors import CRSError
from .cloud import horizontal

#: What ``--crs`` takes for a cloud in local metres without a place on the map (a terrestrial scan).
LOCAL = "local"
#: What layers made from such a cloud are written in.
LOCAL_CRS = pyproj.CRS.from_wkt('LOCAL_CS["local metres",UNIT["metre",1]]')


def file_crs(header: Any, path: Path) -> pyproj.CRS | None:
    """The CRS that a LAS header names, ``None`` without one.

    Raises:
        CRSError: there is a record, but it cannot be read.
    """
    try:
        return header.parse_crs()
    except Exception as problem:
        raise CRSError(f"{path}: its CRS record is unreadable ({short(problem)}); export the cloud again.") from None


def agreed_crs(own: pyproj.CRS | None, given: str | None, path: Path, need_crs: bool) -> pyproj.CRS | None:
    """The CRS to work in, from the file's and the user's word."""
    if own is not None and not own.is_geographic and not own.is_projected and given and given.lower() != LOCAL:
        own = None  # an engineering CRS says nothing about the place: the user's word fills it in
    if own is not None:
        base = horizontal(own)
        assert base is not None
        check_projected(base, str(path))
        for part in own.sub_crs_list if own.is_compound else []:
            unit = part.axis_info[0].unit_name if part.is_vertical and part.axis_info else "metre"
            if unit not in ("metre", "meter"):
                raise CRSError(f"{path}: heights are in {unit}, expected metres; convert the cloud to metres.")
        if given and given.lower() == LOCAL:
            return own
        if given and not same_place(base, project_crs(given)):
            raise CRSError(f"{path}: is in {base.name}, but --crs says {given}; leave --crs out or reproject it.")
        return own
    if given and given.lower() == LOCAL:
        return None
    if given:
        return project_crs(given)
    if need_crs:
        raise CRSError(f"{path}: holds no CRS, expected a projected one in metres; give it with --crs EPSG:CODE "
                       f"(or --crs {LOCAL} for a scan in local metres).")
    return None


def same_place(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """True when two horizontal CRS are the same, apart from metadata and axis order."""
    first, second = horizontal(one), horizontal(other)
    assert first is not None and second is not None
    if first.equals(second, ignore_axis_order=True):
        return True
    codes = first.to_epsg(min_confidence=70), second.to_epsg(min_confidence=70)
    return codes[0] is not None and codes[0] == codes[1]


def short(problem: BaseException) -> str:
    """What another library's exception says, on one line."""
    text = " ".join(str(problem).split()) or type(problem).__name__
    return text[:120]
