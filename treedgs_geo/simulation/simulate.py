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
from ..reconstruction.cameras import View
from . import files, flight, photo_files, truth
from .foliage import all_foliage
from .lidar import scan
from .light import Light, SkyField, bake, sun_direction
from .render import World, build_world, develop, radiance
from .scene import PlantedStem, grow_stand, mesh_stems
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
    parts = ("site", "stand", "leaves", "textures", "flight", "sensor", "lidar", "field", "light", "trouble")
    streams = dict(zip(parts, np.random.SeedSequence(settings.seed).spawn(len(parts)), strict=True))
    rng = {name: np.random.default_rng(stream) for name, stream in streams.items()}
    with reporter.stage("stand", 0.0, 0.12):
        world, stems, reach = _grow(rng, settings, sizes, reporter)
    geo, start_utc = _site(rng["site"])
    camera = flight.make_camera(settings.gsd_cm, sizes)
    stations = flight.plan(rng["flight"], settings.sun_shift_min, sizes, start_utc)
    views = [
        View(s.name, output / "images" / s.name, camera, s.rotation, -s.rotation @ s.centre, s.flight) for s in stations
    ]
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
            _photograph(folder, rng, settings, sizes, geo, world, stations, views, tag, reach, reporter)
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
            summary = _write_truth(folder / "truth", world, stems, sizes, geo, stations, views, track)
            centre_error = _field_tables(folder, rng["field"], sizes, geo, summary)
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
        image = radiance(here, lights[block, phase], view, sizes.samples, settings.seed * 7919 + number)
        pixels = develop(image, exposure, white, rng["sensor"])
        if troubled:
            pixels = disturb(pixels, troubles[number])
        tag_lon, tag_lat, tag_h = tags[number]
        local = station.utc - dt.timedelta(hours=5)
        exif = photo_files.exif_bytes(
            view.camera,
            sizes.name,
            tag_lon,
            tag_lat,
            tag_h,
            f"{local:%Y:%m:%d %H:%M:%S}",
            f"{local.microsecond // 1000:03d}",
        )
        xmp = photo_files.xmp_packet(
            station,
            view.camera,
            tag_lon,
            tag_lat,
            tag_h,
            float(station.centre[2]),
            station.yaw_deg + geo.convergence_deg,
            rng["sensor"],
        )
        photo_files.write_jpeg(folder / "images" / station.name, pixels, exif, xmp)
        reporter.progress((number + 1) / len(views), f"photo {number + 1} of {len(views)}")


TREE_COLUMNS = [
    "tree_id",
    "kind",
    "status",
    "in_plot",
    "E_bh",
    "N_bh",
    "h_bh",
    "x_bh",
    "y_bh",
    "z_bh",
    "E_base",
    "N_base",
    "h_base",
    "dbh_cm",
    "w_min_cm",
    "w_max_cm",
    "height_m",
    "lean_deg",
    "lean_bh_deg",
    "lean_az_grid_deg",
    "crown_base_m",
    "taper_cm_m",
    "n_in_frame",
    "n_unoccluded_bh_views",
    "n_half_visible_bh_views",
    "mean_width_px",
    "mean_width_px_unoccluded",
]


def _write_truth(
    folder: Path,
    world: World,
    stems: list[PlantedStem],
    sizes: Sizes,
    geo: files.Georeference,
    stations: list[flight.Station],
    views: list[View],
    track: flight.Track,
) -> dict[str, Any]:
    """trees.csv, visibility.csv, cameras.csv and stems.json; returns what the field tables need."""
    rows, profiles, saplings = truth.stem_table(world.mesh, stems, sizes.radius_m + 5)
    table, seen = [], []
    for row in rows:
        stem = stems[row["index"]]
        records = [truth.visibility(world, stem, row["index"], row["dbh_cm"] / 100, view) for view in views]
        seen += [
            [
                row["tree_id"],
                view.name,
                f"{r['visible_fraction']:.3f}",
                f"{r['width_px']:.2f}",
                r["in_frame"],
                f"{r['foreshortening']:.3f}",
            ]
            for view, r in zip(views, records, strict=True)
        ]
        row.update(truth.count_views(records))
        (x, y, z), (e, n, h) = row["bh"], geo.project(row["bh"])[0]
        eb, nb, hb = geo.project(row["base"])[0]
        values = {
            **row,
            "E_bh": e,
            "N_bh": n,
            "h_bh": h,
            "x_bh": x,
            "y_bh": y,
            "z_bh": z,
            "E_base": eb,
            "N_base": nb,
            "h_base": hb,
        }
        table.append([f"{values[c]:.4f}" if isinstance(values[c], float) else values[c] for c in TREE_COLUMNS])
    files.write_csv(folder / "trees.csv", TREE_COLUMNS, table)
    files.write_csv(
        folder / "visibility.csv",
        ["tree_id", "image", "visible_fraction", "width_px", "in_frame", "foreshortening"],
        seen,
    )
    cameras = []
    for station, view, floating in zip(stations, views, track.floating, strict=True):
        e, n, h = geo.project(station.centre)[0]
        camera = view.camera
        cameras.append(
            [
                station.name,
                station.flight,
                station.kind,
                f"{e:.4f}",
                f"{n:.4f}",
                f"{h:.4f}",
                *(f"{value:.9f}" for value in view.rotation.ravel()),
                *(f"{value:.5f}" for value in view.translation),
                camera.fx,
                camera.fy,
                camera.cx,
                camera.cy,
                camera.k1,
                camera.k2,
                camera.width,
                camera.height,
                f"{station.yaw_deg:.4f}",
                f"{station.pitch_deg:.4f}",
                f"{station.roll_deg:.4f}",
                f"{station.utc:%Y-%m-%dT%H:%M:%S.%f}",
                int(floating),
            ]
        )
    files.write_csv(
        folder / "cameras.csv",
        [
            "image",
            "flight",
            "kind",
            "E",
            "N",
            "h",
            *(f"r{i}{j}" for i in range(3) for j in range(3)),
            "tx",
            "ty",
            "tz",
            "fx",
            "fy",
            "cx",
            "cy",
            "k1",
            "k2",
            "width",
            "height",
            "yaw_grid_deg",
            "pitch_deg",
            "roll_deg",
            "utc",
            "ppk_float",
        ],
        cameras,
    )
    files.write_json_plain(
        folder / "stems.json",
        {
            "columns": ["s_m", "mean_diameter_cm", "x", "y", "z"],
            "origin": geo.origin.tolist(),
            "stems": profiles,
            "saplings_xy_dbhcm": saplings,
        },
    )
    inside = [row for row in rows if row["in_plot"]]
    views_free = [row["n_unoccluded_bh_views"] for row in inside]
    return {"rows": inside, "in_plot": len(inside), "median_views": float(np.median(views_free)) if views_free else 0.0}


def _field_tables(
    folder: Path, rng: np.random.Generator, sizes: Sizes, geo: files.Georeference, summary: dict[str, Any]
) -> list[float]:
    """plots.csv and field_trees.csv as a crew would bring them, and the key; returns the centre's error (2,), m."""
    error = rng.normal(0, 0.3 / np.sqrt(2), 2)
    surveyed = np.array([*error, 0.0])
    lon, lat, _ = geo.lonlat(surveyed)[0]
    e, n, _ = geo.project(surveyed)[0]
    files.write_csv(
        folder / "plots.csv",
        ["plot_id", "lon", "lat", "easting", "northing", "epsg", "radius_m"],
        [[sizes.name, f"{lon:.8f}", f"{lat:.8f}", f"{e:.3f}", f"{n:.3f}", files.EPSG, f"{sizes.radius_m:.1f}"]],
    )
    tally = []
    for row in summary["rows"]:
        x, y = row["bh"][:2]
        azimuth = (np.degrees(np.arctan2(x, y)) + geo.convergence_deg + rng.normal(0, 1)) % 360
        tally.append(
            [
                azimuth,
                np.hypot(x, y) + rng.normal(0, 0.05),
                row["dbh_cm"] + rng.normal(0, 0.3),
                row["height_m"] + rng.normal(0, 0.4),
                row["status"],
                row["tree_id"],
            ]
        )
    tally.sort()
    files.write_csv(
        folder / "field_trees.csv",
        ["plot_id", "tree_id", "azimuth_deg", "distance_m", "dbh_cm", "height_m", "status", "species"],
        [
            [sizes.name, k, round(a) % 360, f"{max(d, 0):.2f}", f"{dbh:.1f}", f"{tall:.1f}", status, "PITA"]
            for k, (a, d, dbh, tall, status, _) in enumerate(tally, start=1)
        ],
    )
    files.write_json_plain(
        folder / "truth" / "field_key.json",
        {"field_tree_id_to_truth": {str(k): item[5] for k, item in enumerate(tally, start=1)}},
    )
    return error.tolist()
