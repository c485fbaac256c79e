"""One measured piece of work in a process of its own: its seconds and its peak memory are nobody else's.

Called as ``python -m treedgs_lab.benchmarks.speed.jobs JOB.json RESULT.json`` (:func:`.processes.run_job`). What a
piece of work costs: seconds of its stages, what they grow with (:data:`.cost.GROWTH`), and facts of the piece.
"""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.machine import available_threads
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.workspace import SURFACE, peak_memory_mb
from treedgs_geo.geotags.reading import read_stations
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.images import shrink_factor
from treedgs_geo.reconstruction.matching_strategy import GUIDED_FEATURES, reconstruct_photos
from treedgs_geo.reconstruction.model import load_points
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.sift import extract
from treedgs_geo.run.context import Site
from treedgs_geo.run.heights import canopy_over, highest, pieces_of
from treedgs_geo.run.published_plot import Published, published_route
from treedgs_geo.run.settings import CHAIN_PRESETS, Preset
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.trees import trees_of_photo_fits
from treedgs_geo.stems.splats.options import SceneOptions
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_geo.terrain.sparse_ground import dtm_from_sparse

from ..plot import TruePlot, in_plot_rows, site_of
from .photo_sizes import enlarge


def _spread(things: list, count: int) -> list:
    """``count`` of them, evenly spread."""
    return [things[k] for k in np.unique(np.linspace(0, len(things) - 1, count).round().astype(int))]


def run_subset_sfm(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of a reconstruction from a ``share`` of the photos, at a ``scale`` of their size."""
    plot, scratch = TruePlot.load(Path(job["plot"])), Path(job["scratch"])
    there = sorted((plot.folder / "images").iterdir())
    chosen = _spread(there, round(job["share"] * len(there)))
    (scratch / "images").mkdir(parents=True)
    for photo in chosen:
        (scratch / "images" / photo.name).symlink_to(photo.resolve())
    stations = read_stations(scratch / "images", plot.folder, plot.frame.crs.to_string())
    camera = plot.views()[0].camera
    options = ReconstructOptions(max_image_size=max(round(job["scale"] * camera.width), 500))
    report = reconstruct_photos(stations, options, scratch / "sfm")
    megapixels, photos = camera.width * camera.height / 1e6 * job["scale"] ** 2, len(chosen)
    return {
        "stages": report["stage_seconds"],
        "facts": {"photos": photos, "megapixels": megapixels, "level": report["level"]},
        "sizes": {
            "features": photos * megapixels,
            "matching": report["pairs"],
            "mapping": photos,
            "adjustment": photos,
        },
    }


def run_features_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of the guided level's features in a few ``photos`` enlarged to many ``megapixels``."""
    plot, scratch = TruePlot.load(Path(job["plot"])), Path(job["scratch"])
    chosen = _spread(sorted((plot.folder / "images").iterdir()), job["photos"])
    (scratch / "images").mkdir(parents=True)
    camera = plot.views()[0].camera
    width = round(np.sqrt(job["megapixels"] * 1e6 * camera.width / camera.height))
    paths = [scratch / "images" / photo.name for photo in chosen]
    megapixels = sum(enlarge(photo, path, width) for photo, path in zip(chosen, paths, strict=True))
    largest_px = ReconstructOptions().max_image_size
    began = time.perf_counter()
    extract(paths, GUIDED_FEATURES, largest_px, available_threads(), scratch / "own", Reporter())
    return {
        "stages": {"features": time.perf_counter() - began},
        "facts": {"photos": len(chosen), "megapixels": megapixels / len(chosen)},
        "sizes": {"features": megapixels},
    }


def run_stems_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of stems in the photos for a share of the plot's ``radius`` and a number of ``views`` (true cameras)."""
    plot = TruePlot.load(Path(job["plot"]))
    radius, views, ground = job["radius"] * plot.radius_m, plot.views(), plot.dtm.local(plot.frame).height
    used = min(job["views"], len(views))
    began = time.perf_counter()
    count = len(search_photos(views, ground, Area.circle(0.0, 0.0, radius), PhotoStemOptions(max_views=used)).fits)
    seconds, camera = time.perf_counter() - began, views[0].camera
    crop = min(camera.width * camera.height, ((2 * radius + 6) / 0.0184) ** 2) / 1e6
    return {
        "stages": {"stems": seconds},
        "sizes": {"stems": np.pi * radius**2 * used},
        "facts": {"photos": used, "stems": count, "crop_megapixels": crop * used},
    }


def run_heights_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of the canopy for a share of the plot's ``radius`` and a number of ``views`` (true cameras; the LiDAR's
    points say how high the search for crowns begins)."""
    plot = TruePlot.load(Path(job["plot"]))
    radius, views = job["radius"] * plot.radius_m, plot.views()
    site = Site(plot.frame, _spread(views, min(job["views"], len(views))), plot.dtm, Area.circle(0.0, 0.0, radius))
    points = plot.frame.to_local(plot.cloud().xyz)
    began = time.perf_counter()
    seen = 0
    for piece, box in pieces_of(site):
        seen += len(piece)
        canopy_over(site, piece, box, highest(points, site), Reporter())
    return {
        "stages": {"heights": time.perf_counter() - began},
        "sizes": {"heights": np.pi * radius**2 * seen},
        "facts": {"photos": seen},
    }


def run_lidar_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of the LiDAR route for a ``share`` of the area (so that the density stays)."""
    cloud = TruePlot.load(Path(job["plot"])).cloud()
    low, high = np.percentile(cloud.xyz[:, 0], [0, 100 * job["share"]])
    cloud = cloud.select((cloud.xyz[:, 0] >= low) & (cloud.xyz[:, 0] <= high))
    began = time.perf_counter()
    trees, _ = measure_cloud(cloud, dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs))
    return {
        "stages": {"lidar": time.perf_counter() - began},
        "sizes": {"lidar": len(cloud)},
        "facts": {"stems": len(trees)},
    }


def in_scratch(work: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Run a job; its folder ``scratch`` is fresh, and goes afterwards."""
    if "scratch" in job:
        shutil.rmtree(job["scratch"], ignore_errors=True)
    try:
        return work(job)
    finally:
        if "scratch" in job:
            shutil.rmtree(job["scratch"], ignore_errors=True)


COSTS = {
    "subset_sfm": run_subset_sfm,
    "features_cost": run_features_cost,
    "stems_cost": run_stems_cost,
    "heights_cost": run_heights_cost,
    "lidar_cost": run_lidar_cost,
}


def run_sfm(job: dict[str, Any]) -> dict[str, Any]:
    """Geotags and structure from motion of a plot into ``job["sfm"]``."""
    plot = Path(job["plot"])
    stations = read_stations(plot / "images", plot, TruePlot.load(plot).frame.crs.to_string())
    report = reconstruct_photos(stations, ReconstructOptions(**job["params"]), Path(job["sfm"]))
    return {"stages": report["stage_seconds"], "photos": report["photos"], "registered": report["registered"]}


def chain_scene(job: dict[str, Any]) -> tuple[TruePlot, Site, np.ndarray]:
    """A plot; cameras, ground and area as the chain would have them (nothing true but the scoring); and the sparse
    points (N, 3), local."""
    plot, sfm = Path(job["plot"]), Path(job["sfm"])
    site, points = site_of(plot, sfm.parent), load_points(sfm)
    frame = site.frame
    low_x, low_y, high_x, high_y = site.area.bounds(8.0)
    corners = frame.to_project(np.array([[low_x, low_y, 0.0], [high_x, high_y, 0.0]]))
    dtm = dtm_from_sparse(frame.to_project(points), crs=frame.crs, bounds=(corners[0, :2], corners[1, :2]))
    return TruePlot.load(plot), replace(site, dtm=dtm), points


def run_photos(job: dict[str, Any]) -> dict[str, Any]:
    """Stems found and fitted in the photos; a preset's job has all of its settings."""
    plot, site, _ = chain_scene(job)
    named = job.get("preset")
    preset = CHAIN_PRESETS[named] if named else Preset(ReconstructOptions(), PhotoStemOptions(**job["params"]))
    began = time.perf_counter()
    fits = search_photos(site.views, site.ground, site.area, preset.stems, Reporter()).fits
    trees = trees_of_photo_fits(fits, site.frame)
    seconds = time.perf_counter() - began
    used, camera = min(len(site.views), preset.stems.max_views), site.views[0].camera
    middle = np.append(site.area.centres.mean(axis=0), site.ground(*site.area.centres.T).mean())
    away = np.linalg.norm([view.centre - middle for view in site.views], axis=1)
    reduced = [shrink_factor(camera, depth_m, preset.stems.finest_gsd_m) for depth_m in away.tolist()]
    megapixels = used * camera.width * camera.height / 1e6 * float(np.mean(1 / np.square(reduced)))
    return {
        "stages": {"stems": seconds},
        "rows": in_plot_rows(plot, trees),
        "modelled": {"photos": used, "megapixels": megapixels},
    }


def run_published(job: dict[str, Any]) -> dict[str, Any]:
    """The published method over the whole plot; ``params``: ``time_limit_min``. Its stages are CPU seconds; its points
    stay at ``points``."""
    plot, site, sparse = chain_scene(job)
    points = Path(job["points"])
    asked = Published(scene=SceneOptions(**job["params"]))
    trees, facts = published_route(
        site, sparse, asked, lambda name: points.with_name(f"{points.stem}_{name}"), Reporter()
    )
    points.with_name(f"{points.stem}_{SURFACE}").replace(points)
    fit = facts["published_fit"]
    return {
        "stages": facts["stages_cpu_s"],
        "rows": in_plot_rows(plot, trees),
        "modelled": {name: fit[name] for name in ("photos", "megapixels", "gaussians", "steps", "factor")},
    }


def run_cloud(job: dict[str, Any]) -> dict[str, Any]:
    """The plot's LiDAR: ground, stems, diameters."""
    plot = TruePlot.load(Path(job["plot"]))
    clock = [time.perf_counter()]
    cloud = plot.cloud()
    dtm = dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    clock.append(time.perf_counter())
    trees, _ = measure_cloud(cloud, dtm, MeasureOptions(**job["params"]))
    clock.append(time.perf_counter())
    stages = dict(zip(("read and ground", "stems"), np.diff(clock).tolist(), strict=True))
    return {"stages": stages, "rows": in_plot_rows(plot, trees), "modelled": {"points": len(cloud)}}


JOBS = {"sfm": run_sfm, "photos": run_photos, "published": run_published, "cloud": run_cloud, **COSTS}


def main() -> None:
    """Run one job; ``wall_s`` counts from the start of Python."""
    job = read_json(Path(sys.argv[1]))
    record = in_scratch(JOBS[job["kind"]], job)
    record["stages"] = {name: round(value, 2) for name, value in record["stages"].items()}
    record["wall_s"] = round(time.time() - psutil.Process().create_time(), 2)
    write_json(Path(sys.argv[2]), {**record, "peak_memory_mb": peak_memory_mb()})


if __name__ == "__main__":
    main()
