"""A flight as its files: small photos with EXIF and XMP, the drone's MRK, RTKLIB's solution. Nothing is rendered."""

from __future__ import annotations

import calendar
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyproj
from PIL import Image

from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags.gpstime import WEEK_S, utc_to_gps
from treedgs_lab.simulate.photographs import write_jpeg

START_UTC = float(calendar.timegm((2026, 3, 12, 15, 15, 0)))
CRS = "EPSG:6344"
_TO_DEGREES = pyproj.Transformer.from_crs("EPSG:6344", "EPSG:6318", always_xy=True)


class Listening(Reporter):
    """Keeps the warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


@dataclass
class Flight:
    """camera: (N, 3) true places, EPSG:6344. pitch_deg: one for all or (N,). every_s: between photos. exif, xmp: extra
    tags; ``None`` among the XMP values leaves that tag out. exif_error: (N, 3) metres of the photos' own GPS."""

    camera: np.ndarray
    pitch_deg: float | np.ndarray = -60.0
    every_s: float = 2.0
    size: tuple[int, int] = (400, 300)
    model: str = "M3E"
    exif: dict[int, object] = field(default_factory=dict)
    details: dict[int, object] = field(default_factory=lambda: {41989: 24})
    xmp: dict[str, str | None] = field(default_factory=dict)
    exif_error: np.ndarray | None = None
    gps: bool = True

    @property
    def utc(self) -> np.ndarray:
        """(N,) exposures."""
        return START_UTC + 10.03 + self.every_s * np.arange(len(self.camera))


def lines(count: int, speed_m_s: float = 4.0, every_s: float = 2.0, height: float = 120.0) -> np.ndarray:
    """(count, 3) a lawn-mower flight of short lines, EPSG:6344."""
    step = speed_m_s * every_s
    row, place = np.divmod(np.arange(count), 10)
    along = np.where(row % 2 == 0, place, 9 - place) * step
    return np.column_stack([425000.0 + along, 3718000.0 + row * step, np.full(count, height)])


def write_photos(flight: Flight, folder: Path) -> Path:
    """The photos, one JPEG each."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(3)
    error = np.zeros_like(flight.camera) if flight.exif_error is None else flight.exif_error
    lon, lat = _TO_DEGREES.transform(*(flight.camera + error)[:, :2].T)
    pitch = np.broadcast_to(flight.pitch_deg, len(lon))
    for i, utc in enumerate(flight.utc):
        stamp = time.strftime("%Y:%m:%d %H:%M:%S", time.gmtime(utc))
        exif = Image.Exif()
        exif[271], exif[272], exif[306] = "Maker", flight.model, stamp
        for key, value in flight.exif.items():
            exif[key] = value
        exif[0x8769] = {36867: stamp, 36881: "+00:00", 37521: f"{int(utc % 1 * 1000):03d}", **flight.details}
        if flight.gps:
            exif[0x8825] = {
                1: "N",
                2: _dms(lat[i]),
                3: "W",
                4: _dms(lon[i]),
                5: b"\0",
                6: float(flight.camera[i, 2] + error[i, 2]),
            }
        fields = {
            "GimbalYawDegree": f"{45.0 * (i % 8):.1f}",
            "GimbalPitchDegree": f"{pitch[i]:.1f}",
            "GimbalRollDegree": "0.0",
            "RelativeAltitude": f"{flight.camera[i, 2] - 60.0:+.2f}",
            **flight.xmp,
        }
        body = "\n".join(f'drone-dji:{key}="{value}"' for key, value in fields.items() if value is not None)
        xmp = f'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:Description {body}></rdf:Description></x:xmpmeta>'
        pixels = rng.integers(0, 255, (flight.size[1], flight.size[0], 3), dtype=np.uint8)
        write_jpeg(folder / f"DJI_{i + 1:04d}.JPG", pixels, exif.tobytes(), xmp.encode())
    return folder


def write_solution(flight: Flight, folder: Path, hz: float = 5.0, mark_error: float = 1.0) -> Path:
    """MRK (single-point places, no lever arm) and a fixed ``.pos`` of the whole path; returns the ``.pos``."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(4)
    marks = []
    lon, lat = _TO_DEGREES.transform(*(flight.camera + mark_error)[:, :2].T)
    for i, gps in enumerate(utc_to_gps(flight.utc)):
        marks.append(
            f"{i + 1}\t{gps % WEEK_S:.6f}\t[{int(gps // WEEK_S)}]\t0,N\t0,E\t0,V\t{lat[i]:.8f},Lat\t"
            f"{lon[i]:.8f},Lon\t{flight.camera[i, 2] + mark_error:.3f},Ellh\t1.0, 1.0, 2.0\t16,Q\n"
        )
    (folder / "flight_Timestamp.MRK").write_text("".join(marks))
    times = np.arange(START_UTC, flight.utc[-1] + 10, 1 / hz)
    path = np.column_stack([np.interp(times, flight.utc, axis) for axis in flight.camera.T])
    write_pos(folder / "flight.pos", times, path + rng.normal(0, 0.01, path.shape))
    return folder / "flight.pos"


def write_pos(target: Path, utc: np.ndarray, xyz: np.ndarray) -> None:
    """A fixed solution: (T,) UTC, (T, 3) EPSG:6344."""
    lon, lat = _TO_DEGREES.transform(*xyz[:, :2].T)
    rows = [
        f"{int(g // WEEK_S)} {g % WEEK_S:.3f} {a:.9f} {o:.9f} {h:.4f} 1 16 0.0110 0.0105 0.0270\n"
        for g, a, o, h in zip(utc_to_gps(utc), lat, lon, xyz[:, 2], strict=True)
    ]
    target.write_text(
        "% ref frame : NAD83(2011)\n%  GPST latitude(deg) longitude(deg) height(m)  Q  ns sdn(m) sde(m) "
        "sdu(m)\n" + "".join(rows)
    )


def move_epochs(pos: Path, first_utc: float, last_utc: float, shift: tuple[float, float, float]) -> None:
    """Shift the epochs of a ``.pos`` from :func:`write_pos` within a time span by E, N, U metres."""
    first, last = utc_to_gps(np.array([first_utc, last_utc]))
    back = pyproj.Transformer.from_crs("EPSG:6318", "EPSG:6344", always_xy=True)
    out = []
    for line in pos.read_text().splitlines():
        parts = line.split()
        if not line.startswith("%") and first <= float(parts[0]) * WEEK_S + float(parts[1]) <= last:
            east, north = back.transform(float(parts[3]), float(parts[2]))
            lon, lat = _TO_DEGREES.transform(east + shift[0], north + shift[1])
            parts[2:5] = f"{lat:.9f}", f"{lon:.9f}", f"{float(parts[4]) + shift[2]:.4f}"
            line = " ".join(parts)
        out.append(line)
    pos.write_text("\n".join(out) + "\n")


def _dms(angle_deg: float) -> tuple[float, float, float]:
    minutes = abs(angle_deg) % 1 * 60
    return float(int(abs(angle_deg))), float(int(minutes)), round(minutes % 1 * 60, 5)
