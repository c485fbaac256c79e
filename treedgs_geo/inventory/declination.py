"""Magnetic declination by place and date, from the World Magnetic Model (``pygeomag``, data inside the package)."""

from __future__ import annotations

import re
from datetime import date
from functools import lru_cache
from typing import Any

from ..core.errors import InputError

#: First years of the models that pygeomag brings; each holds for five years.
_MODELS = (2010, 2015, 2020, 2025)
_SPAN = 5


def parse_date(text: str, where: str) -> date:
    """``2025-06-30`` (ISO, also with a time), or ``30.6.2025`` as with points only days come first.

    Raises:
        InputError: another form, or no date: 03/04/2025 means two different days.
    """
    iso = re.fullmatch(r"(\d{4})[-/](\d{2})[-/](\d{2})([ T]\d{1,2}:\d{2}.*)?", text.strip())
    german = re.fullmatch(r"(\d{1,2})\.(\d{1,2})\.(\d{4})", text.strip())
    if iso or german:
        try:
            return date(*map(int, iso.groups()[:3] if iso else german.groups()[::-1]))  # type: ignore[union-attr]
        except ValueError:
            pass
    raise InputError(f"{where}: found the date {text!r}, expected year-month-day such as 2025-06-30.")


def declination_deg(lon_deg: float, lat_deg: float, height_m: float, day: date, where: str) -> float:
    """Degrees, east positive. lon_deg, lat_deg: WGS84; height_m: above the ellipsoid (a kilometre changes nothing).

    Raises:
        InputError: a day outside the models, or a place near a magnetic pole, where a compass is of no use.
    """
    year = day.year + (day.timetuple().tm_yday - 1) / (366 if day.year % 4 == 0 else 365)
    base = max((b for b in _MODELS if b <= year), default=None)
    if base is None or year >= base + _SPAN:
        raise InputError(
            f"{where}: the field work of {day} is outside the World Magnetic Model ({_MODELS[0]} to "
            f"{_MODELS[-1] + _SPAN - 1}); give --declination-deg."
        )
    try:
        found = _model(base).calculate(glat=lat_deg, glon=lon_deg, alt=height_m / 1000, time=year)
    except Exception as problem:
        raise InputError(
            f"{where}: no declination at {lat_deg:.2f}, {lon_deg:.2f} ({problem}); give --declination-deg."
        ) from None
    if found.h < 2000:
        raise InputError(
            f"{where}: {lat_deg:.2f}, {lon_deg:.2f} is too near a magnetic pole for a compass; use --north true or "
            "grid."
        )
    return float(found.d)


@lru_cache(maxsize=4)
def _model(base: int) -> Any:
    from pygeomag import GeoMag

    # The model of 2015 was replaced by a second version in 2018.
    return GeoMag(coefficients_file=f"wmm/WMM_{base}{'v2' if base == 2015 else ''}.COF")
