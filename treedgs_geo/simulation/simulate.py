"""One call from settings to a folder that looks like a campaign: photos, PPK, LiDAR, field table, truth."""

from __future__ import annotations

import datetime as dt
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import OutputError
from ..core.files import atomic_folder
from ..core.progress import Reporter
from ..core.settings import to_json
from ..reconstruction.cameras import Camera, View
from . import files, flight, photo_files, tables
from .camera import Motion, camera_of_flight, make_camera, motions
from .foliage import all_foliage
from .lidar import scan
from .light import Light, SkyField, bake, sun_direction
from .render import World, build_world, radiance
from .scene import PlantedStem, grow_stand, mesh_stems
from .sensor import develop, sensor_of
from .settings import SimulateSettings, Sizes, resolve
from .terrain import make_ground
from .textures import bark, litter
from .trouble import disturb, photo_troubles
from .wind import windy_worlds

#: Where the synthetic stands grow (Arkansas), degrees; each seed shifts it by some hundred metres.
LON_LAT = (-91.8, 33.6)


def simulate_plot(settings: SimulateSettings, reporter: Reporter | None = None) -> dict[str, Any]:
    """Grow, light, photograph, scan and measure one synthetic plot into ``settings.output``.

    Returns:
        output, name, n_photos, n_stems (in the plot), n_lidar_points, median_unoccluded_views, seconds.

    Raises:
        InputError: sizes that do not fit together. OutputError: the output holds something else or cannot be written.
    """
    reporter = reporter or Reporter()
    settings, sizes = resolve(settings)
    output = Path(settings.output)
    if output.is_file():
        raise OutputError(f"{output}: is a file, expected a folder; choose another output.")
    if output.exists() and any(output.iterdir()) and not (output / "truth" / "config.json").exists():
        raise OutputError(f"{output}: is not empty and not a simulated plot; choose an empty or new folder.")
    began = time.monotonic()
    # One independent stream a part: changing the photos does not change the trees.
    parts = (
        "site",
        "stand",
        "leaves",
        "textures",
        "flight",
        "sensor",
        "lidar",
        "field",
        "light",
        "trouble",
        "camera",
        "image",
    )
    streams = dict(zip(parts, np.random.SeedSequence(settings.seed).spawn(len(parts)), strict=True))
    rng = {name: np.random.default_rng(stream) for name, stream in streams.items()}
    with reporter.stage("stand", 0.0, 0.12):
        world, stems, reach = _grow(rng, settings, sizes, reporter)
    geo, start_utc = _site(rng["site"])
    shots = flight.ring_shots(rng["flight"], sizes)
    stations = flight.fly(rng["flight"], shots, start_utc, settings.sun_shift_min, settings.flight_speed_m_s)
    moves = motions(settings, np.array([s.velocity for s in stations]), rng["camera"])
    views = _views(settings, make_camera(settings, sizes), stations, moves)
    track = flight.ppk_track(rng["flight"], stations, start_utc, settings.float_epochs)
    if settings.ppk_bias_m:
        track = replace(track, position=track.position + settings.ppk_bias_m)
    seconds: dict[str, float] = {"stand_s": time.monotonic() - began}
    with atomic_folder(output) as folder:
        for name in ("images", "truth"):
            (folder / name).mkdir()
        tag = _geotag_files(folder, rng["field"], sizes.name, geo, stations, track, start_utc)
        with reporter.stage("photos", 0.12, 0.9):
            clock = time.monotonic()
            _photograph(folder, rng, settings, sizes, geo, world, stations, views, moves, tag, reach, reporter)
            seconds["render_s_per_photo"] = (time.monotonic() - clock) / len(views)
        points = 0
        if sizes.lidar_density_m2 > 0:
            with reporter.stage("lidar", 0.9, 0.96):
                (folder / "lidar").mkdir()
                returns = scan(world, rng["lidar"], sizes.lidar_half_m, sizes.lidar_density_m2)
                files.write_laz(folder / "lidar" / f"{sizes.name}_uls.laz", returns, geo, start_utc)
                points = len(returns.points)
        with reporter.stage("truth", 0.96, 1.0):
            files.write_dtm(folder / "dtm.tif", world.ground, geo, min(20.0, -world.ground.low - 1))
            summary = tables.write_truth(folder / "truth", world, stems, sizes, geo, views)
            tables.write_cameras(folder / "truth" / "cameras.csv", geo, stations, views, track)
            centre_error = tables.write_field_tables(folder, rng["field"], sizes, geo, summary)
            seconds["total_s"] = time.monotonic() - began
            files.write_json_plain(folder / "truth" / "timing.json", {**seconds, "spp": sizes.samples})
            files.write_json_plain(
                folder / "truth" / "config.json",
                {
                    "config": {**to_json(settings), "output": sizes.name},
                    "origin_E_N_h": geo.origin.tolist(),
                    "epsg": files.EPSG,
                    "height": "ellipsoidal NAD83(2011)",
                    "meridian_convergence_deg": geo.convergence_deg,
                    "true_plot_centre": geo.origin[:2].tolist(),
                    "plot_centre_error_m": centre_error,
                    "ppk_float_photos": [s.name for s, bad in zip(stations, track.floating, strict=True) if bad],
                    "n_photos": len(views),
                    "n_trees_in_plot": summary["in_plot"],
                    "median_unoccluded_views": summary["median_views"],
                    "synthetic": True,
                },
            )
    reporter.info(
        f"{sizes.name}: {len(views)} photos, {summary['in_plot']} stems in the plot, each seen free at "
        f"breast height in {summary['median_views']:g} photos (median), {points} LiDAR points."
    )
    return {
        "output": str(output),
        "name": sizes.name,
        "n_photos": len(views),
        "n_stems": summary["in_plot"],
        "n_lidar_points": points,
        "median_unoccluded_views": summary["median_views"],
        "seconds": round(time.monotonic() - began, 1),
    }


def _grow(
    rng: dict[str, np.random.Generator], settings: SimulateSettings, sizes: Sizes, reporter: Reporter
) -> tuple[World, list[PlantedStem], float]:
    """The world, its stems, and the radius (m) within which ground detail matters."""
    footprint = np.hypot(sizes.image_width, sizes.image_height) / 2 * settings.gsd_cm / 100 * 1.5
    reach = footprint + sizes.target_off_m + 2
    ground = make_ground(rng["site"], sizes.stand_radius_m + 12, settings.slope_pct, settings.roughness_m)
    stems = grow_stand(rng["stand"], settings, sizes, ground, reach + 6, max(sizes.stand_radius_m, reach + 12))
    mesh = mesh_stems(rng["stand"], stems, settings.ellipticity_pct)
    reporter.progress(0.2)
    faces = all_foliage(rng["leaves"], settings, ground, stems, reach)
    reporter.progress(0.5)
    texture = litter(rng["textures"], reach, 0.6 * settings.gsd_cm / 100)
    reporter.progress(0.8)
    world = build_world(ground, mesh, faces, texture, bark(rng["textures"]), rng["textures"])
    return world, stems, reach


def _views(
    settings: SimulateSettings, camera: Camera, stations: list[flight.Station], moves: list[Motion]
) -> list[View]:
    """The true views: pose of the middle row, travel over the readout, the flight's own focal length."""
    return [
        View(
            s.name,
            Path(settings.output) / "images" / s.name,
            camera_of_flight(camera, settings.focal_drift, s.flight),
            s.rotation,
            -s.rotation @ s.centre,
            s.flight,
            move.readout_travel_m,
        )
        for s, move in zip(stations, moves, strict=True)
    ]


def _site(rng: np.random.Generator) -> tuple[files.Georeference, dt.datetime]:
    """Origin of the local frame and start of the first flight, 14:40-15:25 UTC on 12 March 2026."""
    import pyproj

    lon, lat = np.array(LON_LAT) + rng.uniform(-0.012, 0.012, 2)
    transformer = pyproj.Transformer.from_crs(files.GEODETIC_EPSG, files.EPSG, always_xy=True)
    east, north = transformer.transform(lon, lat)
    origin = np.round([east, north, rng.uniform(30, 50)], 3)
    start = dt.datetime(2026, 3, 12, 14, 40) + dt.timedelta(seconds=round(float(rng.uniform(0, 2700)), 6))
    return files.Georeference(origin), start


def _geotag_files(
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


def _photograph(
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
    reach: float,
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
    nominal, sensor = views[0].camera, sensor_of(settings)
    for number, (station, view) in enumerate(zip(stations, views, strict=True)):
        block = station.flight if settings.sun_shift_min > 0 else 0
        phase = number % len(worlds)
        here = worlds[phase]
        if (block, phase) not in lights:
            sun = sun_direction(station.utc, lon, lat, geo.convergence_deg)
            baked = bake(here.scene, here.ground, here.mesh, here.faces, sky, sun, reach, rng["light"])
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
