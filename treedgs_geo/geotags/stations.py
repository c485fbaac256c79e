"""Camera stations: where each photo was taken, how well that is known, and where the camera looked."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyproj

from ..core.errors import InputError
from ..core.layer_files import read_layer, write_layer
from .gpstime import describe_utc

if TYPE_CHECKING:
    import geopandas as gpd

#: How a position was found, best first.
QUALITIES = ("fix", "float", "single", "exif", "none")
#: How a velocity was found, best first: along the antenna's path, by the drone itself (XMP), from the photos beside it.
VELOCITY_SOURCES = ("track", "xmp", "photos", "unknown")
#: Geotags with a standard error (three axes) below this level a block, and may start one, metres.
PRECISE_GEOTAG_M = 0.5
LAYER = "stations"
_SD, _VELOCITY = ("sd_e_m", "sd_n_m", "sd_u_m"), ("v_e_m_s", "v_n_m_s", "v_u_m_s")
#: Columns of other numbers, and what they are of :class:`Stations`.
_NUMBERS = {
    "utc_unix": "utc", "flight": "flight", "yaw_deg": "yaw_deg", "pitch_deg": "pitch_deg", "roll_deg": "roll_deg",
    "rel_alt_m": "relative_altitude_m",
}  # fmt: skip
#: The columns by which a layer of that name is known as ours.
OWN_LAYERS = {LAYER: frozenset({"name", "path", "quality", "sd_e_m", "utc_unix"})}


def digest_of(texts: list[Any], *numbers: np.ndarray) -> str:
    """Short hash of texts and arrays."""
    digest = hashlib.sha256(json.dumps(texts).encode())
    for values in numbers:
        digest.update(np.ascontiguousarray(values, float).tobytes())
    return digest.hexdigest()[:16]


def are_precise(xyz: np.ndarray, sd: np.ndarray) -> bool:
    """Whether (N, 3) geotags (NaN unknown) with standard errors (N, 3), metres, can level a block, or start one."""
    placed = np.isfinite(xyz).all(axis=1)
    return bool(placed.any() and np.median(np.linalg.norm(sd[placed], axis=1)) < PRECISE_GEOTAG_M)


@dataclass(frozen=True)
class Stations:
    """N photos, sorted by name.

    names: photo paths relative to the photo folder, with ``/``. xyz: (N, 3) camera in the project CRS, metres, NaN = no
    position. sd: (N, 3) E, N, U metres. quality: one of :data:`QUALITIES` each. utc: (N,) Unix seconds, NaN unknown.
    flight: (N,) int, 0-based. yaw_deg (from TRUE north, clockwise), pitch_deg (-90 = straight down), roll_deg: (N,)
    gimbal, NaN unknown. relative_altitude_m: (N,) above take-off, NaN unknown. notes: why a photo's position is not
    what its geotag said, empty text for the others; an empty list where nothing was checked. velocity_m_s: (N, 3) of
    the camera at the exposure along E, N, U of the project CRS, NaN unknown (also when not given). velocity_source:
    where each comes from, one of :data:`VELOCITY_SOURCES`; an empty list where nobody looked.

    Examples:
        >>> import treedgs_geo as tg
        >>> stations = tg.read_stations(plot / "images", plot, "EPSG:6344")
        >>> stations.names == sorted(stations.names), len(stations.quality) == len(stations)
        (True, True)
    """

    names: list[str]
    paths: list[Path]
    xyz: np.ndarray
    sd: np.ndarray
    quality: list[str]
    utc: np.ndarray
    flight: np.ndarray
    yaw_deg: np.ndarray
    pitch_deg: np.ndarray
    roll_deg: np.ndarray
    relative_altitude_m: np.ndarray
    crs: pyproj.CRS
    notes: list[str] = field(default_factory=list)
    velocity_m_s: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    velocity_source: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not len(self.velocity_m_s):
            object.__setattr__(self, "velocity_m_s", np.full((len(self.names), 3), np.nan))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def is_placed(self) -> np.ndarray:
        """(N,) bool: has a position."""
        return np.isfinite(self.xyz).all(axis=1)

    def digest(self) -> str:
        """Short hash over all that is known of the photos' places and directions."""
        turned = (self.yaw_deg, self.pitch_deg, self.roll_deg)
        known = (self.xyz, self.sd, self.utc, self.flight, *turned, self.relative_altitude_m, self.velocity_m_s)
        return digest_of([self.names, self.quality, self.crs.to_wkt()], *known)

    def counts(self) -> dict[str, int]:
        """Number of photos per quality."""
        return {quality: self.quality.count(quality) for quality in QUALITIES if quality in self.quality}


def write_stations(path: Path, stations: Stations) -> None:
    """Write the layer ``stations`` (PointZ in the project CRS; a photo without a position has no geometry), styled.

    Other layers of an existing file stay.
    """
    import geopandas
    import shapely

    geometry = [shapely.Point(*position) if np.isfinite(position).all() else None for position in stations.xyz]
    frame = geopandas.GeoDataFrame(
        {
            "name": stations.names,
            "path": [str(p.resolve()) for p in stations.paths],
            "quality": stations.quality,
            **dict(zip(_SD, stations.sd.T, strict=True)),
            "utc": [describe_utc(t)[:-4] if np.isfinite(t) else None for t in stations.utc],
            **{column: getattr(stations, name) for column, name in _NUMBERS.items()},
            "note": [note or None for note in stations.notes or [""] * len(stations)],
            **dict(zip(_VELOCITY, stations.velocity_m_s.T, strict=True)),
            "v_source": stations.velocity_source or ["unknown"] * len(stations),
        },
        geometry=geometry,
        crs=stations.crs,
    )
    write_layer(path, OWN_LAYERS, LAYER, frame)


def read_stations_table(path: Path) -> gpd.GeoDataFrame:
    """The layer that :func:`write_stations` wrote, edited or not.

    Raises:
        InputError: missing file, layer or columns.
    """
    frame = read_layer(path, LAYER, ["name", "path", "quality", *_SD, *_NUMBERS], "'treedgs geotag'")
    if frame.crs is None:
        raise InputError(f"{path}: layer 'stations' lacks its CRS; run 'treedgs geotag' again.")
    return frame


def read_stations_layer(path: Path) -> Stations:
    """Read what :func:`write_stations` wrote (edited positions are taken as they are).

    Raises:
        InputError: missing file, layer or columns.
    """
    frame = read_stations_table(path)
    xyz = np.array([[g.x, g.y, g.z] if g is not None and not g.is_empty else [np.nan] * 3 for g in frame.geometry])

    def column(name: str) -> np.ndarray:
        return frame[name].to_numpy(dtype=float, na_value=np.nan)

    known = [column(name) if name in frame.columns else np.full(len(frame), np.nan) for name in _VELOCITY]
    numbers = {name: column(of) for of, name in _NUMBERS.items()}
    return Stations(
        names=frame["name"].tolist(),
        paths=[Path(p) for p in frame["path"]],
        xyz=xyz.reshape(-1, 3),
        sd=np.column_stack([column(name) for name in _SD]),
        quality=frame["quality"].tolist(),
        crs=pyproj.CRS(frame.crs),
        notes=_texts(frame, "note", ""),
        velocity_m_s=np.column_stack(known),
        velocity_source=_texts(frame, "v_source", "unknown"),
        **{**numbers, "flight": numbers["flight"].astype(int)},
    )


def _texts(frame: gpd.GeoDataFrame, name: str, empty: str) -> list[str]:
    """A column of texts; an empty list where the layer has none."""
    return [text if isinstance(text, str) else empty for text in frame[name]] if name in frame.columns else []
