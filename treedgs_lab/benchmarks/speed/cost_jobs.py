"""What a piece of work costs, as :mod:`.jobs` runs it in a process of its own: seconds of its stages, what they grow
with (:data:`.cost.GROWTH`), and facts of the piece."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.machine import available_threads
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags.reading import read_stations
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.matching_strategy import GUIDED_FEATURES
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.pipeline import reconstruct_photos
from treedgs_geo.reconstruction.sift import extract
from treedgs_geo.run.context import Site
from treedgs_geo.run.heights import canopy_over, highest, pieces_of
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.terrain.ground import dtm_from_cloud

from ..plot import TruePlot
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
    """Cost of stems in the photos for a share of the plot's ``radius`` and a number of ``views`` (true cameras): by
    their edges, and what it takes longer where the network is asked for stems, too."""
    plot = TruePlot.load(Path(job["plot"]))
    radius, views, ground = job["radius"] * plot.radius_m, plot.views(), plot.dtm.local(plot.frame).height
    area, seconds, count = Area.circle(0.0, 0.0, radius), list[float](), 0
    used = min(job["views"], len(views))
    for network in ("low-confidence", "full"):
        options = PhotoStemOptions(max_views=used, most_asked=0, stem_network=network)
        began = time.perf_counter()
        count = len(search_photos(views, ground, area, options).fits)
        seconds.append(time.perf_counter() - began)
    camera = views[0].camera
    crop = min(camera.width * camera.height, ((2 * radius + 6) / 0.0184) ** 2) / 1e6
    size = np.pi * radius**2 * used
    return {
        "stages": {"stems": seconds[0], "stem network": max(seconds[1] - seconds[0], 0.0)},
        "sizes": {"stems": size, "stem network": size},
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
