"""Photos, one by one: rendered, developed, disturbed and written with their metadata as a DJI drone writes
them; and the files of their tags."""

from __future__ import annotations

import datetime as dt
import io
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from treedgs_geo.core.progress import Reporter
from treedgs_geo.planning.sun import sun_direction
from treedgs_geo.reconstruction.cameras import Camera, View

from . import files, flight
from .camera import Motion
from .cycles import EXPOSURE, cycles_images
from .flight import Station
from .labels import Labels, write_labels
from .layout import Layout
from .light import Light, SkyField, bake, held_at, weather_of
from .render import radiance
from .scene import PlantedStem
from .sensor import develop, sensor_of
from .settings import SimulateSettings, Sizes
from .trouble import disturb, photo_troubles
from .wind import Wind
from .world import World

#: Cells of the light map on the ground along a side, at most: bounds memory on wide surveys.
MAX_LIGHT_CELLS = 2500
#: Largest error of a barometric height, m.
BAROMETER_M = 1.0


def geotag_files(
    folder: Path,
    rng: np.random.Generator,
    name: str,
    geo: files.Georeference,
    stations: list[flight.Station],
    track: flight.Track | None,
    start_utc: dt.datetime,
) -> np.ndarray:
    """MRK and .pos (``None``: neither); returns the single-point tags (P, 3) lon, lat, h that EXIF repeats: metres off,
    drifting slowly."""
    count = len(stations)
    std = np.column_stack([rng.normal(1.5, 0.1, (count, 2)), rng.normal(2.9, 0.25, count)])
    drift = rng.normal(0, 1, 3) * [1.3, 1.3, 2.5]
    wander = np.cumsum(rng.normal(0, 0.12, (count, 3)), axis=0)
    single = geo.lonlat(np.array([s.centre for s in stations]) + drift + wander)
    if track is None:
        return single
    local = start_utc - dt.timedelta(hours=5)
    files.write_mrk(folder / f"DJI_{local:%Y%m%d%H%M}_001_{name}_Timestamp.MRK", stations, single, std)
    files.write_pos(folder / f"{name}_ppk.pos", track, start_utc, geo, rng)
    return single


class Exposure(NamedTuple):
    """One photo to be taken, and the (3,) lon, lat, h that its tag says."""

    station: flight.Station
    view: View
    motion: Motion
    tag: np.ndarray


def photograph(
    folder: Path,
    rng: dict[str, np.random.Generator],
    settings: SimulateSettings,
    sizes: Sizes,
    geo: files.Georeference,
    layout: Layout,
    world: World,
    stems: list[PlantedStem],
    exposures: list[Exposure],
    reporter: Reporter,
) -> None:
    """Render, develop and write every photo."""
    lon, lat, _ = geo.lonlat(np.zeros(3))[0]
    weather = weather_of(settings)
    suns = [
        held_at(sun_direction(taken.station.utc, lon, lat, geo.convergence_deg), weather.elevation_deg)
        for taken in exposures
    ]
    wind = Wind(world, stems, settings, rng["wind"])
    troubles = photo_troubles(settings, len(exposures), rng["trouble"])
    troubled = any(
        (settings.shaken_pct, settings.misexposed_pct, settings.exposure_drift_stops, settings.white_drift_pct)
    )
    exposure, white = 1.0, np.ones(3)
    sensor = sensor_of(settings)
    # The metadata know the first flight's lens only.
    writer = _Writer(folder / "images", settings, sizes.name, geo, exposures[0].view.camera, sensor.jpeg_quality)
    if world.crowns is None:
        images = _own_images(folder, rng, settings, sizes, layout, wind, world, exposures, suns)
    else:
        images = cycles_images(world, wind, settings, sizes, exposures, suns)
    before = -1
    for number, (taken, image) in enumerate(zip(exposures, images, strict=True)):
        if taken.station.flight != before:
            exposure, white = (
                EXPOSURE * float(np.exp(rng["sensor"].normal(0, 0.06))),
                1 + rng["sensor"].normal(0, 0.02, 3),
            )
        before = taken.station.flight
        pixels = develop(image, exposure * weather.exposure, white, rng["sensor"], sensor, rng["image"])
        if troubled:
            pixels = disturb(pixels, troubles[number])
        writer.write(taken, pixels, rng["sensor"])
        reporter.progress((number + 1) / len(exposures), f"photo {number + 1} of {len(exposures)}")


def _own_images(
    folder: Path,
    rng: dict[str, np.random.Generator],
    settings: SimulateSettings,
    sizes: Sizes,
    layout: Layout,
    wind: Wind,
    world: World,
    exposures: list[Exposure],
    suns: list[np.ndarray],
) -> Iterator[np.ndarray]:
    """(H, W, 3) float32 linear radiance, photo by photo; light is baked once a flight, or once in all under a still
    sun."""
    sky = SkyField(world.faces, -world.ground.low)
    map_step_m = max(0.035, 2 * layout.reach_m / MAX_LIGHT_CELLS)
    weather = weather_of(settings)
    lights: dict[tuple[int, int], Light] = {}
    for number, taken in enumerate(exposures):
        station = taken.station
        block = station.flight if settings.sun_shift_min > 0 else 0
        phase = number % wind.phases
        here = wind.at(number, station.seconds)
        if (block, phase) not in lights:
            baked = bake(here, sky, suns[number], layout.reach_m, rng["light"], map_step_m, weather)
            lights = {key: light for key, light in lights.items() if key[0] == block} | {(block, phase): baked}
        seed = settings.seed * 7919 + number
        labels = Labels(here, taken.view, sizes.samples) if settings.labels else None
        image = radiance(
            here, lights[block, phase], taken.view, sizes.samples, seed, motion=taken.motion, looked=labels
        )
        if labels is not None:
            write_labels(folder / "truth" / "labels" / Path(station.name).with_suffix(".png").name, labels.shares)
        yield image


class _Writer(NamedTuple):
    """Writes photos with what a drone says about them."""

    folder: Path
    settings: SimulateSettings
    name: str
    geo: files.Georeference
    nominal: Camera
    quality: int

    def write(self, taken: Exposure, pixels: np.ndarray, rng: np.random.Generator) -> None:
        """One JPEG; rng: of the errors of the angles."""
        station, (lon, lat, h) = taken.station, taken.tag
        local = station.utc - dt.timedelta(hours=5)
        when, part = f"{local:%Y:%m:%d %H:%M:%S}", f"{local.microsecond // 1000:03d}"
        exposure_s = self.settings.exposure_ms / 1000 or 0.00125
        exif = exif_bytes(self.nominal, self.name, lon, lat, h, when, part, exposure_s)
        relative_h, rtk_flag = float(station.centre[2]), "16"
        if self.settings.gnss == "consumer":
            # By air pressure, which drifts; and no word of the receiver's solution.
            relative_h, rtk_flag = relative_h + BAROMETER_M * np.sin(station.seconds / 240 + self.settings.seed), ""
        yaw_true = station.yaw_deg + self.geo.convergence_deg
        xmp = xmp_packet(station, self.nominal, lon, lat, h, relative_h, yaw_true, rng, rtk_flag)
        write_jpeg(self.folder / station.name, pixels, exif, xmp, self.quality)


def _dms(angle_deg: float) -> tuple[float, float, float]:
    minutes, degrees = (abs(angle_deg) % 1) * 60, float(int(abs(angle_deg)))
    return degrees, float(int(minutes)), round(minutes % 1 * 60, 5)


def exif_bytes(
    camera: Camera,
    plot: str,
    lon: float,
    lat: float,
    h: float,
    local_time: str,
    subsecond: str,
    exposure_s: float = 0.00125,
) -> bytes:
    """EXIF block with exposure, 35 mm focal length, local time and the single-point GPS position."""
    exif = Image.Exif()
    exif[270], exif[271], exif[272] = f"SYNTHETIC render {plot}", "DJI", "M3E"
    exif[274], exif[305], exif[306] = 1, "TreeDGS sim", local_time
    diagonal = np.hypot(camera.width, camera.height)
    exif[0x8769] = {
        33434: exposure_s,
        33437: 2.8,
        34855: 110,
        36867: local_time,
        36868: local_time,
        36881: "-05:00",
        37386: 12.29,
        37521: subsecond,
        40962: camera.width,
        40963: camera.height,
        41989: int(round(camera.fx * 43.2666 / diagonal)),
    }
    exif[0x8825] = {
        0: b"\x02\x03\x00\x00",
        1: "N" if lat >= 0 else "S",
        2: _dms(lat),
        3: "E" if lon >= 0 else "W",
        4: _dms(lon),
        5: b"\x00" if h >= 0 else b"\x01",
        6: round(abs(h), 3),
        18: "WGS-84",
    }
    return exif.tobytes()


def xmp_packet(
    station: Station,
    camera: Camera,
    lon: float,
    lat: float,
    h: float,
    relative_h: float,
    yaw_true: float,
    rng: np.random.Generator,
    rtk_flag: str = "16",
) -> bytes:
    """drone-dji XMP: gimbal angles (true north, noisy), nominal focal length, UTC at exposure."""
    yaw = (yaw_true + rng.normal(0, 0.5) + 180) % 360 - 180
    pitch, roll = station.pitch_deg + rng.normal(0, 0.1), station.roll_deg + rng.normal(0, 0.1)
    body = (yaw + rng.normal(0, 2) + 180) % 360 - 180
    fields = {
        "AltitudeType": "GpsFusionAlt",
        "GpsLatitude": f"{lat:+.8f}",
        "GpsLongitude": f"{lon:+.8f}",
        "AbsoluteAltitude": f"{h:+.3f}",
        "RelativeAltitude": f"{relative_h:+.3f}",
        "GimbalRollDegree": f"{roll:+.2f}",
        "GimbalYawDegree": f"{yaw:+.2f}",
        "GimbalPitchDegree": f"{pitch:+.2f}",
        "FlightRollDegree": f"{rng.normal(0, 2):+.2f}",
        "FlightYawDegree": f"{body:+.2f}",
        "FlightPitchDegree": f"{rng.normal(-3, 2):+.2f}",
        "RtkFlag": rtk_flag,
        "CalibratedFocalLength": f"{round(camera.fx * 0.99763):.6f}",
        "CalibratedOpticalCenterX": f"{camera.width / 2:.6f}",
        "CalibratedOpticalCenterY": f"{camera.height / 2:.6f}",
        "UTCAtExposure": f"{station.utc:%Y-%m-%dT%H:%M:%S.%f}",
    }
    if not rtk_flag:
        del fields["RtkFlag"]
    if station.velocity.any():
        # North, east, down; the drone writes decimetres a second.
        east, north, up = station.velocity
        fields |= {"FlightXSpeed": f"{north:+.1f}", "FlightYSpeed": f"{east:+.1f}", "FlightZSpeed": f"{-up:+.1f}"}
    body_text = "\n".join(f'   drone-dji:{name}="{value}"' for name, value in fields.items())
    text = (
        '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>\n<x:xmpmeta xmlns:x="adobe:ns:meta/">\n'
        ' <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">\n'
        '  <rdf:Description rdf:about="DJI Meta Data" xmlns:tiff="http://ns.adobe.com/tiff/1.0/" '
        'xmlns:drone-dji="http://www.dji.com/drone-dji/1.0/"\n   tiff:Make="DJI" tiff:Model="M3E"\n'
        f'{body_text}>\n  </rdf:Description>\n </rdf:RDF>\n</x:xmpmeta>\n<?xpacket end="w"?>'
    )
    return text.encode("utf-8")


def write_jpeg(path: Path, pixels: np.ndarray, exif: bytes, xmp: bytes, quality: int = 92) -> None:
    """(H, W, 3) uint8 -> JPEG (4:2:0) with the XMP packet as a second APP1 segment, right behind EXIF."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=quality, exif=exif)
    data = stream.getvalue()
    position = 2
    # Behind JFIF and EXIF, wherever the encoder put them.
    while data[position : position + 2] in (b"\xff\xe0", b"\xff\xe1"):
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    body = b"http://ns.adobe.com/xap/1.0/\x00" + xmp
    segment = b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body
    path.write_bytes(data[:position] + segment + data[position:])
