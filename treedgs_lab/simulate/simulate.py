"""One call from settings to a folder that looks like a campaign: photos, PPK, LiDAR, field table, truth."""

from __future__ import annotations

import datetime as dt
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.errors import OutputError
from treedgs_geo.core.files import atomic_folder
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.settings import to_json
from treedgs_geo.reconstruction.cameras import Camera, View

from . import files, flight, tables
from .barks import make_barks
from .camera import Motion, camera_of_flight, make_camera, motions
from .control import Plates, cleared, lay_out, painted, write_control
from .crowns import Crowns
from .cycles import check_cycles, grown_crowns
from .dress import dressed
from .foliage import Faces, in_colours, photographed_leaves
from .grid import follow_terrain, grid_shots, survey_area
from .layout import Layout, grid_layout, plot_centres, ring_layout
from .lidar import scan
from .light import SkyField
from .photographs import Exposure, geotag_files, photograph
from .planned_flight import read_flight
from .scanned import ScannedForest, read_scan, scanned_faces, scanned_settings
from .scanned_truth import scanned_stems
from .scene import PlantedStem, grow_stand
from .settings import LEVEL_FLIGHTS, SimulateSettings, Sizes, resolve
from .stem_mesh import StemMesh, mesh_stems, no_stems
from .terrain import Ground, make_ground
from .textures import litter
from .vegetation import all_foliage, overgrown
from .world import World, build_world

#: Where the synthetic stands grow (Arkansas), degrees; each seed shifts it by some hundred metres.
LON_LAT = (-91.8, 33.6)
#: Half side of the ground up to which it has 25 cm cells, m; wider grounds have 50 cm cells.
FINE_GROUND_M = 120.0
#: Texels of the litter along a side, at most: bounds memory on wide surveys.
MAX_TEXELS = 9000
#: Parts of a plot that draw from streams of their own: changing the photos does not change the trees.
PARTS = (
    "site", "stand", "leaves", "textures", "flight", "sensor", "lidar", "field", "light", "trouble", "camera",
    "image", "plots", "wind", "control", "spacing", "snags", "hardwoods", "barks", "ivy", "wrap", "sections",
    "shrubs", "crowns",
)  # fmt: skip


def streams(seed: int) -> dict[str, np.random.Generator]:
    """One independent stream of random numbers a part."""
    made = np.random.SeedSequence(seed).spawn(len(PARTS))
    return {name: np.random.default_rng(stream) for name, stream in zip(PARTS, made, strict=True)}


def simulate_plot(settings: SimulateSettings, reporter: Reporter | None = None) -> dict[str, Any]:
    """Grow, light, photograph, scan and measure one synthetic plot into ``settings.output``.

    Returns:
        output, name, n_photos, n_stems (in the plot), n_lidar_points, median_unoccluded_views, seconds.

    Raises:
        InputError: sizes that do not fit together. OutputError: the output holds something else or cannot be written.
    """
    reporter = reporter or Reporter()
    output = Path(settings.output)
    if output.is_file():
        raise OutputError(f"{output}: is a file, expected a folder; choose another output.")
    if output.exists() and any(output.iterdir()) and not (output / "truth" / "config.json").exists():
        raise OutputError(f"{output}: is not empty and not a simulated plot; choose an empty or new folder.")
    if settings.world == "cycles":
        check_cycles(settings)
    began = time.monotonic()
    cloud = None if settings.from_cloud is None else read_scan(settings.from_cloud, reporter)
    settings, sizes = resolve(settings if cloud is None else scanned_settings(settings, cloud))
    rng = streams(settings.seed)
    with reporter.stage("stand", 0.0, 0.12):
        camera = make_camera(settings, sizes)
        shots, layout = plan_shots(rng, settings, sizes, camera)
        world, stems, plates = grow_world(rng, settings, sizes, layout, reporter, cloud)
    geo, start_utc = site_of(rng["site"])
    if settings.terrain_following or settings.flight not in ("rings", "grid"):
        shots = follow_terrain(shots, world.ground)
    stations = flight.fly(rng["flight"], shots, start_utc, settings.sun_shift_min, settings.flight_speed_m_s)
    moves = motions(settings, np.array([s.velocity for s in stations]), rng["camera"])
    views = true_views(settings, camera, stations, moves)
    track = flight.ppk_track(rng["flight"], stations, start_utc, settings.float_epochs)
    if settings.gnss == "consumer":
        track = replace(track, floating=np.zeros(len(stations), bool))
    if settings.ppk_bias_m:
        track = replace(track, position=track.position + settings.ppk_bias_m)
    seconds: dict[str, float] = {"stand_s": time.monotonic() - began}
    with atomic_folder(output) as folder:
        for name in ("images", "truth"):
            (folder / name).mkdir()
        solved = track if settings.gnss == "ppk" else None
        tag = geotag_files(folder, rng["field"], sizes.name, geo, stations, solved, start_utc)
        with reporter.stage("photos", 0.12, 0.9):
            clock = time.monotonic()
            exposures = [Exposure(*parts) for parts in zip(stations, views, moves, tag, strict=True)]
            photograph(folder, rng, settings, sizes, geo, layout, world, stems, exposures, reporter)
            seconds["render_s_per_photo"] = (time.monotonic() - clock) / len(views)
        points = 0
        if sizes.lidar_density_m2 > 0:
            with reporter.stage("lidar", 0.9, 0.96):
                (folder / "lidar").mkdir()
                returns = scan(world, rng["lidar"], layout.lidar_half_m, sizes.lidar_density_m2)
                files.write_laz(folder / "lidar" / f"{sizes.name}_uls.laz", returns, geo, start_utc)
                points = len(returns.points)
        with reporter.stage("truth", 0.96, 1.0):
            files.write_dtm(folder / "dtm.tif", world.ground, geo, min(layout.survey_half_m, -world.ground.low - 1))
            summary = tables.write_truth(folder / "truth", world, stems, sizes, layout, geo, views, cloud)
            tables.write_looks(folder / "truth" / "looks.csv", stems)
            if plates is not None:
                write_control(folder, rng["control"], plates, world, geo, views)
            tables.write_cameras(folder / "truth" / "cameras.csv", geo, stations, views, track)
            centre_errors = tables.write_field_tables(folder, rng["field"], sizes, layout, geo, summary)
            seconds["total_s"] = time.monotonic() - began
            files.write_json_plain(folder / "truth" / "timing.json", {**seconds, "spp": sizes.samples})
            files.write_json_plain(
                folder / "truth" / "config.json",
                {
                    "config": {**to_json(settings), "output": sizes.name, **_scan_name(settings)},
                    "origin_E_N_h": geo.origin.tolist(),
                    "epsg": files.EPSG,
                    "height": "ellipsoidal NAD83(2011)",
                    "meridian_convergence_deg": geo.convergence_deg,
                    "true_plot_centre": (geo.origin[:2] + layout.centres[0]).tolist(),
                    "plot_centre_error_m": centre_errors[0],
                    "plot_centres_local_m": layout.centres.tolist(),
                    "ppk_float_photos": [s.name for s, bad in zip(stations, track.floating, strict=True) if bad],
                    "n_photos": len(views),
                    "n_trees_in_plot": summary["in_plot"],
                    "median_unoccluded_views": summary["median_views"],
                    "synthetic": True,
                    **({} if cloud is None else {"scan_origin": cloud.origin.tolist()}),
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


def plan_shots(
    rng: dict[str, np.random.Generator], settings: SimulateSettings, sizes: Sizes, camera: Camera
) -> tuple[list[flight.Shot], Layout]:
    """The photos to take, heights above the origin, and what world they need."""
    if settings.flight == "rings":
        return flight.ring_shots(rng["flight"], sizes), ring_layout(settings, sizes)
    if settings.flight in LEVEL_FLIGHTS:
        shots = flight.level_shots(rng["flight"], settings.flight, sizes.radius_m)
        return shots, grid_layout(np.zeros((1, 2)), shots, camera, sizes)
    if settings.flight != "grid":
        planned = read_flight(Path(settings.flight))
        shots = flight.planned_shots(planned.photos)
        return shots, grid_layout(planned.centres, shots, camera, sizes)
    centres = plot_centres(rng["plots"], settings.plots, sizes.radius_m)
    area = survey_area(rng["plots"], centres, sizes.radius_m)
    shots = grid_shots(rng["flight"], settings, camera, area)
    return shots, grid_layout(centres, shots, camera, sizes)


def grow_world(
    rng: dict[str, np.random.Generator],
    settings: SimulateSettings,
    sizes: Sizes,
    layout: Layout,
    reporter: Reporter,
    cloud: ScannedForest | None = None,
) -> tuple[World, list[PlantedStem], Plates | None]:
    """The world, its stems, and the control points laid out in it."""
    reach = layout.reach_m
    step = 0.25 if layout.ground_half_m <= FINE_GROUND_M else 0.5
    crowns = None
    if cloud is None:
        ground, mesh, faces, stems, crowns = _grown(rng, settings, sizes, layout, step, reporter)
        barked = stems
    else:
        ground, mesh, barked = cloud.ground_mesh(layout.ground_half_m, step), no_stems(), []
        faces, stems = scanned_faces(rng["stand"], cloud, sizes.radius_m, layout), scanned_stems(cloud, sizes.radius_m)
    reporter.progress(0.5)
    texel = max(0.6 * settings.gsd_cm / 100, 2 * reach / MAX_TEXELS)
    texture = litter(rng["textures"], reach, texel)
    reporter.progress(0.8)
    plates = None
    if settings.control_points:
        sky = SkyField(faces, -ground.low)
        plates = lay_out(rng["control"], settings.control_points, layout, sizes.radius_m, ground, stems, sky)
        faces, texture = cleared(faces, plates), painted(texture, plates)
    barks = make_barks(rng["textures"], rng["barks"], barked, settings.bark_photos)
    world = build_world(ground, mesh, faces, texture, barks, rng["textures"])
    return replace(world, crowns=crowns), stems, plates


def _grown(
    rng: dict[str, np.random.Generator],
    settings: SimulateSettings,
    sizes: Sizes,
    layout: Layout,
    step_m: float,
    reporter: Reporter,
) -> tuple[Ground, StemMesh, Faces, list[PlantedStem], Crowns | None]:
    """Ground, stems and everything that grows about them."""
    reach = layout.reach_m
    ground = make_ground(rng["site"], layout.ground_half_m, settings.slope_pct, step_m=step_m)
    around = layout.stand_radius_m, layout.centres
    stems = dressed(
        rng, settings, grow_stand(rng["stand"], settings, sizes, ground, reach + 6, *around, rng["spacing"])
    )
    mesh = mesh_stems(rng["stand"], stems, settings.ellipticity_pct)
    reporter.progress(0.2)
    crowns = grown_crowns(settings, rng["crowns"]) if settings.world == "cycles" else None
    faces = all_foliage(rng["leaves"], settings, ground, stems, reach, rng, crowns)
    faces = overgrown(faces, rng, settings, ground, stems, mesh, reach)
    if settings.leaf_photos is not None:
        photos = photographed_leaves(settings.leaf_photos)
        faces = in_colours(rng["leaves"], faces, photos)
        if crowns is not None:
            crowns.colour([colours.mean(axis=0) for colours in photos])
    return ground, mesh, faces if crowns is None else crowns.with_plants(faces), stems, crowns


def _scan_name(settings: SimulateSettings) -> dict[str, str]:
    """The scan's name, without its folder, where there is one."""
    return {} if settings.from_cloud is None else {"from_cloud": settings.from_cloud.name}


def true_views(
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


def site_of(rng: np.random.Generator) -> tuple[files.Georeference, dt.datetime]:
    """Origin of the local frame and start of the first flight, 14:40-15:25 UTC on 12 March 2026."""
    import pyproj

    lon, lat = np.array(LON_LAT) + rng.uniform(-0.012, 0.012, 2)
    transformer = pyproj.Transformer.from_crs(files.GEODETIC_EPSG, files.EPSG, always_xy=True)
    east, north = transformer.transform(lon, lat)
    origin = np.round([east, north, rng.uniform(30, 50)], 3)
    start = dt.datetime(2026, 3, 12, 14, 40) + dt.timedelta(seconds=round(float(rng.uniform(0, 2700)), 6))
    return files.Georeference(origin), start
