"""Photos, one by one: rendered, developed, disturbed and written with their metadata; and the files of their tags."""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.planning.sun import sun_direction
from treedgs_geo.reconstruction.cameras import Camera, View

from . import files, flight, photo_files
from .camera import Motion
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
    """Render, develop and write every photo; light is baked once a flight, or once in all under a still sun."""
    lon, lat, _ = geo.lonlat(np.zeros(3))[0]
    sky = SkyField(world.faces, -world.ground.low)
    wind = Wind(world, stems, settings, rng["trouble"], rng["wind"])
    troubles = photo_troubles(settings, len(exposures), rng["trouble"])
    troubled = any(
        (settings.shaken_pct, settings.misexposed_pct, settings.exposure_drift_stops, settings.white_drift_pct)
    )
    lights: dict[tuple[int, int], Light] = {}
    exposure, white = 1.0, np.ones(3)
    map_step_m = max(0.035, 2 * layout.reach_m / MAX_LIGHT_CELLS)
    sensor, weather = sensor_of(settings), weather_of(settings)
    # The metadata know the first flight's lens only.
    writer = _Writer(folder / "images", settings, sizes.name, geo, exposures[0].view.camera, sensor.jpeg_quality)
    before = -1
    for number, taken in enumerate(exposures):
        station = taken.station
        block = station.flight if settings.sun_shift_min > 0 else 0
        phase = number % wind.phases
        here = wind.at(number, station.seconds)
        if (block, phase) not in lights:
            sun = held_at(sun_direction(station.utc, lon, lat, geo.convergence_deg), weather.elevation_deg)
            baked = bake(here, sky, sun, layout.reach_m, rng["light"], map_step_m, weather)
            lights = {key: light for key, light in lights.items() if key[0] == block} | {(block, phase): baked}
        if station.flight != before:
            exposure, white = 3.9 * float(np.exp(rng["sensor"].normal(0, 0.06))), 1 + rng["sensor"].normal(0, 0.02, 3)
        before = station.flight
        seed = settings.seed * 7919 + number
        labels = Labels(here, taken.view, sizes.samples) if settings.labels else None
        image = radiance(
            here, lights[block, phase], taken.view, sizes.samples, seed, motion=taken.motion, looked=labels
        )
        if labels is not None:
            write_labels(folder / "truth" / "labels" / Path(station.name).with_suffix(".png").name, labels.shares)
        pixels = develop(image, exposure * weather.exposure, white, rng["sensor"], sensor, rng["image"])
        if troubled:
            pixels = disturb(pixels, troubles[number])
        writer.write(taken, pixels, rng["sensor"])
        reporter.progress((number + 1) / len(exposures), f"photo {number + 1} of {len(exposures)}")


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
        exif = photo_files.exif_bytes(self.nominal, self.name, lon, lat, h, when, part, exposure_s)
        relative_h, rtk_flag = float(station.centre[2]), "16"
        if self.settings.gnss == "consumer":
            # By air pressure, which drifts; and no word of the receiver's solution.
            relative_h, rtk_flag = relative_h + BAROMETER_M * np.sin(station.seconds / 240 + self.settings.seed), ""
        yaw_true = station.yaw_deg + self.geo.convergence_deg
        xmp = photo_files.xmp_packet(station, self.nominal, lon, lat, h, relative_h, yaw_true, rng, rtk_flag)
        photo_files.write_jpeg(self.folder / station.name, pixels, exif, xmp, self.quality)
