"""How long a metre of the ground is on the map, and whether coordinates can lie in the CRS that is stated.

Lengths measured in map coordinates are too long or too short by the projection's scale and by the height above the
ellipsoid; what is left of them after :func:`ground_scale` is ground (``docs/technician/frames.md``). The scale is taken
from geodesics on the CRS's own ellipsoid (Karney 2013, doi:10.1007/s00190-012-0578-z) between points a few hundred
metres apart on the map: the axes of Tissot's indicatrix (Snyder 1987, USGS PP 1395, ch. 4) of any projection, known to
PROJ by name or not. The height adds R / (R + h), the surveyors' elevation factor.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pyproj

from .errors import CRSError
from .frames import horizontal, zone_named
from .progress import Reporter

#: Lengths that the map changes by more than this share are refused; smaller changes are corrected.
LARGEST_STRETCH = 0.005
#: Above this share it is said: radii and areas of plots are not corrected, only the trees' diameters are.
NOTED_STRETCH = 0.002
#: A place this far outside the area that a CRS is made for, degrees of arc, is refused.
MARGIN_DEG = 5.0
#: Eastings of UTM zones; beyond them only in the far north, where degrees are short.
_UTM_EASTINGS_M, _FAR_NORTH_DEG = (0.0, 1e6), 56.0
#: Coordinates of local scans are smaller than this.
LOCAL_REACH_M = 20_000.0
#: Half the base on the map over which the scale is taken, and the mean radius of the earth.
_STEP_M, _EARTH_M = 200.0, 6_371_000.0
#: Heights outside of this are no heights of the ground.
_HEIGHTS_M = -500.0, 9_000.0


@dataclass(frozen=True)
class GridScale:
    """Map metres for one metre on the ground, over all directions, and the place it holds for (WGS 84 degrees)."""

    smallest: float
    largest: float
    lon_deg: float
    lat_deg: float

    @property
    def mean(self) -> float:
        """What the mean diameter of a circle is multiplied by."""
        return float(np.sqrt(self.smallest * self.largest))

    @property
    def stretch(self) -> float:
        """Largest relative change of a length, whatever its direction."""
        return max(abs(self.smallest - 1), abs(self.largest - 1))

    def text(self) -> str:
        """In words."""
        low, high = f"{self.smallest:.4f}", f"{self.largest:.4f}"
        return f"1 m on the ground is {low if low == high else f'{low} to {high}'} m on the map"


class Area(NamedTuple):
    """Where a CRS is meant to be used, WGS 84 degrees; ``west`` > ``east`` across the date line."""

    west: float
    south: float
    east: float
    north: float

    def outside_deg(self, lon_deg: float, lat_deg: float) -> float:
        """Degrees of arc to a place outside, 0 inside."""
        width = self.east - self.west if self.east >= self.west else self.east - self.west + 360
        along = (lon_deg - self.west) % 360
        across = 0.0 if along <= width else min(along - width, 360 - along)
        beyond = max(self.south - lat_deg, lat_deg - self.north, 0.0)
        return float(np.hypot(across * np.cos(np.radians(lat_deg)), beyond))

    def text(self) -> str:
        """In words."""
        return f"longitudes {self.west:g} to {self.east:g}, latitudes {self.south:g} to {self.north:g}"


def local_scale(crs: pyproj.CRS | None, x: float, y: float, height_m: float = 0.0) -> GridScale | None:
    """The scale of the map at project coordinates ``x, y`` (metres) and ``height_m`` above the ellipsoid (a height
    above the geoid is as good: 100 m are 0.0016 %).

    ``None`` without a CRS, for one without a place on the earth, and where the projection has no such point.
    """
    if crs is None or not _is_on_earth(crs):
        return None
    try:
        lon, lat = _to_own_degrees(
            crs, x + _STEP_M * np.array([0, 1, -1, 0, 0]), y + _STEP_M * np.array([0, 0, 0, 1, -1])
        )
    except pyproj.exceptions.ProjError:  # some projections of whole continents cannot be turned back
        return None
    if not (np.isfinite(lon).all() and np.isfinite(lat).all()):
        return None
    earth = horizontal(crs).get_geod()
    if earth is None:
        return None
    azimuth, _, distance = earth.inv(np.full(4, lon[0]), np.full(4, lat[0]), lon[1:], lat[1:])
    ground = distance * np.array([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))])
    across, along = (ground[:, 0] - ground[:, 1]), (ground[:, 2] - ground[:, 3])
    lengths = np.linalg.svd(np.column_stack([across, along]) / (2 * _STEP_M), compute_uv=False)
    if not lengths[1] > 1e-6:
        return None
    height = float(np.clip(height_m, *_HEIGHTS_M)) if np.isfinite(height_m) else 0.0
    factor = _EARTH_M / (_EARTH_M + height)
    where = _to_wgs84(crs, x, y)
    return GridScale(factor / lengths[0], factor / lengths[1], *where)


def ground_scale(crs: pyproj.CRS | None, x: float, y: float, height_m: float = 0.0) -> float:
    """What lengths measured on the map have to be divided by to be lengths on the ground; 1 where nothing is known.

    Raises:
        CRSError: the map stretches by more than :data:`LARGEST_STRETCH`.
    """
    scale = local_scale(crs, x, y, height_m)
    if scale is None or crs is None:
        return 1.0
    _refuse_stretch("coordinates", crs, scale, "reproject them to")
    return scale.mean


def area_of(crs: pyproj.CRS) -> Area | None:
    """Where a CRS is meant to be used; of one written without it, by its UTM zone or EPSG code; else ``None``."""
    return _area(horizontal(crs).to_wkt())


@lru_cache(maxsize=64)
def _area(wkt: str) -> Area | None:
    crs = pyproj.CRS.from_wkt(wkt)
    found = crs.area_of_use
    if found is None and (known := _in_database(crs)) is not None:
        found = known.area_of_use
    if found is not None:
        return Area(found.west, found.south, found.east, found.north)
    if (zone := crs.utm_zone) is None:
        return None
    west = -186.0 + 6 * int(zone[:-1])
    return Area(west, -80.0, west + 6, 0.0) if zone.endswith("S") else Area(west, 0.0, west + 6, 84.0)


def _in_database(crs: pyproj.CRS) -> pyproj.CRS | None:
    """The EPSG's own entry of a CRS that came from a file, as old WKT, without its area."""
    named = crs.to_json_dict().get("id") or {}
    if named.get("authority") == "EPSG":
        with suppress(pyproj.exceptions.CRSError):  # a code that somebody made up
            known = pyproj.CRS.from_epsg(named["code"])
            if known.name == crs.name:
                return known
    # A match that is less certain has the parameters, but another country's datum and area.
    code = crs.to_epsg(min_confidence=90)
    return pyproj.CRS.from_epsg(code) if code is not None else None


def check_place(
    crs: pyproj.CRS | None,
    xyz: np.ndarray,
    where: str,
    reporter: Reporter | None = None,
    photos: bool = False,
    measured: bool = True,
) -> None:
    """Refuse coordinates that cannot lie in their CRS, and a CRS in which lengths are not to be measured there.

    Args:
        crs: of the coordinates; ``None`` (local metres) is not looked at. xyz: (N, 2 or 3) project metres; their median
            counts, so that a stray point does not. where: file or option that the sentence starts with.
        reporter: warned where the place is outside of the CRS's area, or the scale is large. photos: the CRS is the
            user's choice, not that of data made before. measured: lengths are taken in this CRS.

    Raises:
        CRSError: degrees, local metres or exchanged axes in a metric CRS; a place :data:`MARGIN_DEG` outside of the
            CRS's area; a scale more than :data:`LARGEST_STRETCH` from 1.
    """
    if (spot := _middle(crs, xyz)) is None or crs is None:
        return
    _require_map_coordinates(crs, spot, where, photos)
    _, _, scale, area, outside = spot
    if scale is None or not measured:
        return
    _refuse_stretch(where, crs, scale, _remedy(photos))
    if reporter is None:
        return
    name = _name(crs)
    if outside > 0 and area is not None:
        corrected = f"; {_corrected(scale)}" if scale.stretch > NOTED_STRETCH else ""
        reporter.warn(
            f"{where}: lies at {_place(scale)}, {outside:.2g} degrees outside of the area of {name} "
            f"({area.text()}){corrected}; check that the CRS is right; if it is, {_zone(scale)} suits the place better."
        )
    elif scale.stretch > NOTED_STRETCH:
        reporter.warn(f"{where}: {name} changes lengths here; {_corrected(scale)}.")


def is_local(crs: pyproj.CRS | None, xyz: np.ndarray) -> bool:
    """Whether (N, 2 or 3) coordinates are plainly no place in the CRS that is stated for them, but local metres: small
    numbers, far outside of where the CRS is meant to be used."""
    spot = _middle(crs, xyz)
    return spot is not None and spot.is_no_place and max(abs(spot.x), abs(spot.y)) < LOCAL_REACH_M


class _Spot(NamedTuple):
    """A place on the map, the scale there, and the area of the CRS with the degrees to it."""

    x: float
    y: float
    scale: GridScale | None
    area: Area | None
    outside_deg: float

    @property
    def is_no_place(self) -> bool:
        """Off West Africa, where longitude and latitude are nearly zero, no forest grows either."""
        there = self.scale
        return self.outside_deg > 0 or there is not None and abs(there.lon_deg) < 1 and abs(there.lat_deg) < 1


def _middle(crs: pyproj.CRS | None, xyz: np.ndarray) -> _Spot | None:
    """The median of (N, 2 or 3) coordinates; ``None`` where nothing can be said."""
    if crs is None or not _is_on_earth(crs):
        return None
    xyz = np.asarray(xyz, float)
    some = xyz[:: max(len(xyz) // 100_000, 1)]
    some = some[np.isfinite(some[:, :2]).all(axis=1)]
    if not len(some):
        return None
    x, y = (float(value) for value in np.median(some[:, :2], axis=0))
    height = float(np.nanmedian(some[:, 2])) if some.shape[1] > 2 and np.isfinite(some[:, 2]).any() else 0.0
    scale, area = local_scale(crs, x, y, height), area_of(crs)
    outside = np.inf if scale is None else 0.0 if area is None else area.outside_deg(scale.lon_deg, scale.lat_deg)
    return _Spot(x, y, scale, area, outside)


def _require_map_coordinates(crs: pyproj.CRS, spot: _Spot, where: str, photos: bool) -> None:
    """Degrees, local metres, exchanged axes and places far from the CRS's area are refused."""
    (x, y, scale, area, outside_deg), name = spot, _name(crs)
    digits = ".0f" if 1e3 <= max(abs(x), abs(y)) < 1e8 else ".6g"
    found = f"{where}: its coordinates (x {x:{digits}}, y {y:{digits}})"
    remedy = _remedy(photos)
    local = "a scan without a place on the map has to hold no CRS and be given --crs local"
    local = "local metres need their place" if photos else local
    if spot.is_no_place:
        if abs(x) <= 180 and abs(y) <= 90:
            raise CRSError(
                f"{found} are degrees or local metres by their size, expected metres in {name}; longitude and latitude "
                f"have to be projected, {local}."
            )
        if max(abs(x), abs(y)) < LOCAL_REACH_M:
            raise CRSError(f"{found} are local metres by their size, expected coordinates in {name}; {local}.")
    if scale is None or outside_deg > MARGIN_DEG:
        if _is_swapped(crs, area, x, y):
            raise CRSError(f"{found} cannot lie in {name}, exchanged they can; write easting first, northing second.")
        if scale is None or area is None:
            raise CRSError(f"{found} cannot lie in {name}; give the CRS that they are in.")
        raise CRSError(
            f"{found} lie at {_place(scale)}, but {name} is made for {area.text()}; give the CRS that they "
            f"are in, or {remedy} {_zone(scale)}."
        )
    low, high = _UTM_EASTINGS_M
    if horizontal(crs).utm_zone and not low <= x <= high and abs(scale.lat_deg) < _FAR_NORTH_DEG:
        raise CRSError(
            f"{found} cannot lie in {name}, expected an easting from {low:.0f} to {high:.0f}; give the CRS "
            f"that they are in, or {remedy} {_zone(scale)}."
        )


def check_lon_lat(crs: pyproj.CRS, lon_deg: float, lat_deg: float, where: str) -> None:
    """Raise ``CRSError`` for a CRS that is not made for the place where photos were taken (WGS 84 degrees), or
    stretches lengths there; the UTM zone of the place is named."""
    area, name = area_of(crs), _name(crs)
    there = GridScale(1.0, 1.0, lon_deg, lat_deg)
    remedy = _remedy(photos=True) if crs.is_projected else "give the frame of the geotags, for example EPSG:7912"
    if area is not None and area.outside_deg(lon_deg, lat_deg) > MARGIN_DEG:
        raise CRSError(
            f"{where}: {name} is made for {area.text()}; the photos were taken at {_place(there)}: {remedy}"
            f"{' ' + _zone(there) if crs.is_projected else ''}."
        )
    if not _is_on_earth(crs):
        return
    try:
        to_map = pyproj.Transformer.from_crs("EPSG:4326", horizontal(crs), always_xy=True)
        scale = local_scale(crs, *to_map.transform(lon_deg, lat_deg))
    except pyproj.exceptions.ProjError:  # another planet
        scale = None
    if scale is None:
        raise CRSError(
            f"{where}: {name} does not reach {_place(there)}, where the photos were taken; {remedy} {_zone(there)}."
        )
    _refuse_stretch(where, crs, scale, remedy)


def zone_hint(said: str, crs: pyproj.CRS | None, xy: np.ndarray, fits: Callable[[np.ndarray], bool]) -> str:
    """What is ``said`` of the UTM zone beside that of ``crs`` in which (N, 2) coordinates would fit, by the same places
    in ``crs`` ``fits``, named in place of ``{zone}``; '' where none does, or ``crs`` is no UTM zone."""
    zone = horizontal(crs).utm_zone if crs is not None else None
    if crs is None or zone is None:
        return ""
    number, base = int(zone[:-1]), 32700 if zone.endswith("S") else 32600
    for step in (-1, 1, -2, 2):
        other = pyproj.CRS.from_epsg(base + (number - 1 + step) % 60 + 1)
        moved = pyproj.Transformer.from_crs(other, horizontal(crs), always_xy=True).transform(xy[:, 0], xy[:, 1])
        if np.isfinite(moved).all() and fits(np.column_stack(moved)):
            return said.format(zone=f"EPSG:{other.to_epsg()}, {other.name}")
    return ""


def _is_on_earth(crs: pyproj.CRS) -> bool:
    flat = horizontal(crs)
    return bool(flat.is_projected and flat.geodetic_crs is not None)


def _refuse_stretch(where: str, crs: pyproj.CRS, scale: GridScale, remedy: str) -> None:
    if scale.stretch > LARGEST_STRETCH:
        raise CRSError(
            f"{where}: {_name(crs)} is not made for measuring at {_place(scale)}: {scale.text()}, expected "
            f"within {100 * LARGEST_STRETCH:g} %; {remedy} {_zone(scale)}."
        )


def _name(crs: pyproj.CRS) -> str:
    name = str(horizontal(crs).name)
    return name if name not in ("unknown", "unnamed", "undefined", "") else "the CRS given (it has no name)"


def _remedy(photos: bool) -> str:
    return "give --crs" if photos else "reproject the data to"


def _corrected(scale: GridScale) -> str:
    return (
        f"1 m on the ground is {scale.mean:.4f} m on the map, for which diameters are corrected, radii and areas "
        "of plots are not"
    )


def _place(scale: GridScale) -> str:
    return f"longitude {scale.lon_deg:.3f}, latitude {scale.lat_deg:.3f}"


def _zone(scale: GridScale) -> str:
    """The UTM zone of a place."""
    if not -80 <= scale.lat_deg <= 84:
        return "a metric CRS of the region"
    return zone_named(scale.lon_deg, scale.lat_deg)


def _is_swapped(crs: pyproj.CRS, area: Area | None, x: float, y: float) -> bool:
    other = local_scale(crs, y, x)
    return (
        other is not None
        and area is not None
        and other.stretch <= LARGEST_STRETCH
        and area.outside_deg(other.lon_deg, other.lat_deg) == 0
    )


def _to_own_degrees(crs: pyproj.CRS, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Longitude and latitude on the CRS's own datum, degrees from its own prime meridian."""
    transformer, factor = _to_geographic(horizontal(crs).to_wkt())
    lon, lat = transformer.transform(x, y)
    return np.asarray(lon) * factor, np.asarray(lat) * factor


@lru_cache(maxsize=64)
def _to_geographic(wkt: str) -> tuple[pyproj.Transformer, float]:
    crs = pyproj.CRS.from_wkt(wkt)
    assert crs.geodetic_crs is not None
    own = crs.geodetic_crs.to_2d()
    # France has maps whose angles are grads.
    factor = np.degrees(own.axis_info[0].unit_conversion_factor) if own.axis_info else 1.0
    return pyproj.Transformer.from_crs(crs, own, always_xy=True), float(factor)


@lru_cache(maxsize=64)
def _to_degrees(wkt: str) -> pyproj.Transformer:
    return pyproj.Transformer.from_crs(pyproj.CRS.from_wkt(wkt), "EPSG:4326", always_xy=True)


def _to_wgs84(crs: pyproj.CRS, x: float, y: float) -> tuple[float, float]:
    try:
        lon, lat = _to_degrees(horizontal(crs).to_wkt()).transform(x, y)
    except pyproj.exceptions.ProjError:  # another planet
        lon, lat = np.inf, np.inf
    if not np.isfinite([lon, lat]).all():
        own = _to_own_degrees(crs, np.array([x]), np.array([y]))
        lon, lat = own[0][0], own[1][0]
    return float(lon), float(lat)
