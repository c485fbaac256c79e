"""Tables, rasters and clouds of a synthetic plot, as drone, post-processing and field crew would leave them."""

from __future__ import annotations

import datetime as dt
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from treedgs_geo.core import tables

from .flight import LEAP_SECONDS, Station, Track
from .lidar import Returns
from .terrain import Ground

EPSG = 6344
#: NAD83(2011), longitude and latitude.
GEODETIC_EPSG = 6318
GPS_EPOCH = dt.datetime(1980, 1, 6)


@dataclass(frozen=True)
class Georeference:
    """Where the local frame lies: origin (3,) E, N, ellipsoidal h in EPSG:6344; scale taken as 1."""

    origin: np.ndarray

    def project(self, local: np.ndarray) -> np.ndarray:
        """(N, 3) local -> (N, 3) E, N, h."""
        return np.atleast_2d(local) + self.origin

    def lonlat(self, local: np.ndarray) -> np.ndarray:
        """(N, 3) local -> (N, 3) lon, lat (degrees, NAD83(2011)), h."""
        grid = self.project(local)
        transformer = pyproj.Transformer.from_crs(EPSG, GEODETIC_EPSG, always_xy=True)
        lon, lat = transformer.transform(grid[:, 0], grid[:, 1])
        return np.column_stack([lon, lat, grid[:, 2]])

    @property
    def convergence_deg(self) -> float:
        """Grid azimuth = true azimuth - convergence."""
        lon, lat, _ = self.lonlat(np.zeros(3))[0]
        return float(pyproj.Proj(pyproj.CRS.from_epsg(EPSG)).get_factors(lon, lat).meridian_convergence)


def gps_time(utc: dt.datetime) -> tuple[int, float]:
    """UTC -> GPS week and seconds of week (GPST)."""
    since = (utc - GPS_EPOCH).total_seconds() + LEAP_SECONDS
    week = int(since // 604800)
    return week, since - 604800 * week


def write_csv(path: Path, columns: list[str], rows: list[list]) -> None:
    """Plain CSV; None becomes an empty cell."""
    tables.write_csv(path, pd.DataFrame(rows, columns=columns, dtype=object), lineterminator="\n")


def write_mrk(path: Path, stations: list[Station], single_point: np.ndarray, std: np.ndarray) -> None:
    """DJI Timestamp.MRK. single_point: (P, 3) lon, lat, h as the receiver saw it in flight; std: (P, 3) N, E, V, m."""
    lines = []
    for number, (station, (lon, lat, h), sd) in enumerate(zip(stations, single_point, std, strict=True), start=1):
        week, seconds = gps_time(station.utc)
        east, north, down = station.lever_mm
        lines.append(
            f"{number}\t{seconds:.6f}\t[{week}]\t{north:6.0f},N\t{east:6.0f},E\t{down:6.0f},V\t{lat:.8f},Lat\t"
            f"{lon:.8f},Lon\t{h:.3f},Ellh\t{sd[0]:.6f}, {sd[1]:.6f}, {sd[2]:.6f}\t16,Q\n"
        )
    path.write_text("".join(lines), encoding="ascii")


def write_pos(path: Path, track: Track, start_utc: dt.datetime, geo: Georeference, rng: np.random.Generator) -> None:
    """RTKLIB llh solution of the antenna, GPST."""
    head = (
        "% program   : TreeDGS sim (RTKLIB layout)\n% ref frame : NAD83(2011) epoch 2010.0\n"
        "% (lat/lon/height=NAD83(2011)/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,"
        "ns=# of satellites)\n"
        "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)"
        "  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio\n"
    )
    lonlat = geo.lonlat(track.position)
    lines = [head]
    for t, (lon, lat, h), quality in zip(track.seconds, lonlat, track.quality, strict=True):
        stamp = start_utc + dt.timedelta(seconds=round(float(t), 6) + LEAP_SECONDS)
        # To the nearest millisecond: the epochs are whole fifths of a second.
        stamp = GPS_EPOCH + dt.timedelta(milliseconds=round((stamp - GPS_EPOCH) / dt.timedelta(milliseconds=1)))
        sd = "0.0110   0.0105   0.0270" if quality == 1 else "0.2900   0.2700   0.3600"
        ratio = rng.uniform(5, 95) if quality == 1 else rng.uniform(1.0, 2.5)
        lines.append(
            f"{stamp:%Y/%m/%d %H:%M:%S}.{stamp.microsecond // 1000:03d}   {lat:.9f}  {lon:.9f}   {h:.4f}"
            f"   {quality}  {rng.integers(13, 22)}   {sd}   0.0010  -0.0020   0.0010   0.00   {ratio:.1f}\n"
        )
    path.write_text("".join(lines), encoding="ascii")


def write_dtm(path: Path, ground: Ground, geo: Georeference, half_m: float, step_m: float = 0.25) -> None:
    """True terrain as a Float32 GeoTIFF, heights ellipsoidal, sampled at cell centres."""
    import rasterio

    n = int(round(2 * half_m / step_m))
    axis = -half_m + step_m * (np.arange(n) + 0.5)
    x, y = np.meshgrid(axis, axis[::-1])
    z = ground.height(np.column_stack([x.ravel(), y.ravel()])).reshape(n, n) + geo.origin[2]
    transform = rasterio.transform.from_origin(geo.origin[0] - half_m, geo.origin[1] + half_m, step_m, step_m)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=n,
        height=n,
        count=1,
        dtype="float32",
        crs=f"EPSG:{EPSG}",
        transform=transform,
        nodata=-9999,
        compress="deflate",
    ) as target:
        target.write(z.astype(np.float32), 1)


def write_laz(path: Path, returns: Returns, geo: Georeference, start_utc: dt.datetime) -> None:
    """LAS 1.4 point format 6, compressed, with the CRS as WKT; class 1 everywhere, as delivered."""
    import laspy

    header = laspy.LasHeader(version="1.4", point_format=6)
    header.add_crs(pyproj.CRS.from_epsg(EPSG))
    header.scales, header.offsets = [0.001] * 3, np.floor(geo.origin)
    header.generating_software = "TreeDGS sim"
    header.creation_date = start_utc.date()
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = geo.project(returns.points).T
    cloud.intensity, cloud.return_number, cloud.number_of_returns = returns.intensity, returns.number, returns.count
    cloud.classification = np.ones(len(returns.points), np.uint8)
    cloud.scan_angle = np.round(returns.angle_deg / 0.006).astype(np.int16)
    cloud.point_source_id = returns.line
    cloud.gps_time = gps_time(start_utc)[1] - 3600 + returns.seconds
    cloud.write(path)


def write_json_plain(path: Path, value: object) -> None:
    """JSON inside a folder that is itself written atomically."""
    path.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
