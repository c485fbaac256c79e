"""Photos, one by one: rendered, developed, disturbed and written with their metadata; and the files of their tags."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import numpy as np

from ..core.progress import Reporter
from ..reconstruction.cameras import View
from . import files, flight, photo_files
from .camera import Motion
from .layout import Layout
from .light import Light, SkyField, bake, sun_direction
from .render import World, radiance
from .sensor import develop, sensor_of
from .settings import SimulateSettings, Sizes
from .trouble import disturb, photo_troubles
from .wind import windy_worlds

#: Cells of the light map on the ground along a side, at most: bounds memory on wide surveys.
MOST_LIGHT_CELLS = 3500


def geotag_files(
    folder: Path,
    rng: np.random.Generator,
    name: str,
    geo: files.Georeference,
    stations: list[flight.Station],
    track: flight.Track,
    start_utc: dt.datetime,
) -> np.ndarray:
    """MRK and .pos; returns the single-point tags (P, 3) lon, lat, h that EXIF repeats: metres off, drifting slowly."""
    count = len(stations)
    std = np.column_stack([rng.normal(1.5, 0.1, (count, 2)), rng.normal(2.9, 0.25, count)])
    drift = rng.normal(0, 1, 3) * [1.3, 1.3, 2.5]
    wander = np.cumsum(rng.normal(0, 0.12, (count, 3)), axis=0)
    single = geo.lonlat(np.array([s.centre for s in stations]) + drift + wander)
    local = start_utc - dt.timedelta(hours=5)
    files.write_mrk(folder / f"DJI_{local:%Y%m%d%H%M}_001_{name}_Timestamp.MRK", stations, single, std)
    files.write_pos(folder / f"{name}_ppk.pos", track, start_utc, geo, rng)
    return single


def photograph(
    folder: Path,
    rng: dict[str, np.random.Generator],
    settings: SimulateSettings,
    sizes: Sizes,
    geo: files.Georeference,
    world: World,
    stations: list[flight.Station],
    views: list[View],
    moves: list[Motion],
    tags: np.ndarray,
    layout: Layout,
    reporter: Reporter,
) -> None:
    """Render, develop and write every photo; light is baked once a flight, or once in all under a still sun."""
    lon, lat, _ = geo.lonlat(np.zeros(3))[0]
    sky = SkyField(world.faces, -world.ground.low)
    worlds = windy_worlds(world, settings.wind_sway_cm, rng["trouble"])
    troubles = photo_troubles(settings, len(views), rng["trouble"])
    troubled = any(
        (settings.shaken_pct, settings.misexposed_pct, settings.exposure_drift_stops, settings.white_drift_pct)
    )
    lights: dict[tuple[int, int], Light] = {}
    exposure, white = 1.0, np.ones(3)
    map_step_m = max(0.035, 2 * layout.reach_m / MOST_LIGHT_CELLS)
    nominal, sensor = views[0].camera, sensor_of(settings)
    for number, (station, view) in enumerate(zip(stations, views, strict=True)):
        block = station.flight if settings.sun_shift_min > 0 else 0
        phase = number % len(worlds)
        here = worlds[phase]
        if (block, phase) not in lights:
            sun = sun_direction(station.utc, lon, lat, geo.convergence_deg)
            baked = bake(
                here.scene, here.ground, here.mesh, here.faces, sky, sun, layout.reach_m, rng["light"], map_step_m
            )
            lights = {key: light for key, light in lights.items() if key[0] == block} | {(block, phase): baked}
        if number == 0 or station.flight != stations[number - 1].flight:
            exposure, white = 3.9 * float(np.exp(rng["sensor"].normal(0, 0.06))), 1 + rng["sensor"].normal(0, 0.02, 3)
        image = radiance(
            here, lights[block, phase], view, sizes.samples, settings.seed * 7919 + number, motion=moves[number]
        )
        pixels = develop(image, exposure, white, rng["sensor"], sensor, rng["image"])
        if troubled:
            pixels = disturb(pixels, troubles[number])
        tag_lon, tag_lat, tag_h = tags[number]
        local = station.utc - dt.timedelta(hours=5)
        exif = photo_files.exif_bytes(
            nominal,
            sizes.name,
            tag_lon,
            tag_lat,
            tag_h,
            f"{local:%Y:%m:%d %H:%M:%S}",
            f"{local.microsecond // 1000:03d}",
            settings.exposure_ms / 1000 or 0.00125,
        )
        xmp = photo_files.xmp_packet(
            station,
            nominal,
            tag_lon,
            tag_lat,
            tag_h,
            float(station.centre[2]),
            station.yaw_deg + geo.convergence_deg,
            rng["sensor"],
        )
        photo_files.write_jpeg(folder / "images" / station.name, pixels, exif, xmp, sensor.jpeg_quality)
        reporter.progress((number + 1) / len(views), f"photo {number + 1} of {len(views)}")
