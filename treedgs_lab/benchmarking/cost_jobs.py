"""What a piece of work costs, as :mod:`.jobs` runs it in a process of its own: seconds of its stages, what they grow
with (:data:`.cost.GROWTH`), and facts of the piece."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.area import Area

from .enlarge import reduced
from .plot import TruePlot


def run_subset_sfm(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of a reconstruction from every so-manyth photo, at a share of their size."""
    import shutil

    from treedgs_geo.core.files import ensure_writable
    from treedgs_geo.geotags.reading import read_stations
    from treedgs_geo.reconstruction.options import ReconstructOptions
    from treedgs_geo.reconstruction.pipeline import reconstruct_photos

    plot, scratch = Path(job["plot"]), Path(job["scratch"])
    photos_there = sorted((plot / "images").iterdir())
    count = round(job["share"] * len(photos_there))
    chosen = np.unique(np.linspace(0, len(photos_there) - 1, count).round().astype(int))
    ensure_writable(scratch / "images" / "x")
    for k in chosen:
        (scratch / "images" / photos_there[k].name).symlink_to(photos_there[k].resolve())
    stations = read_stations(scratch / "images", plot, TruePlot.load(plot).frame.crs.to_string())
    camera = TruePlot.load(plot).views()[0].camera
    options = ReconstructOptions(max_image_size=max(round(job["scale"] * camera.width), 500))
    try:
        report = reconstruct_photos(stations, options, scratch / "sfm")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    megapixels = camera.width * camera.height / 1e6 * job["scale"] ** 2
    photos = len(chosen)
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
    """Cost of the guided level's features in a few photos enlarged to many megapixels."""
    import shutil

    from treedgs_geo.core.machine import available_threads
    from treedgs_geo.reconstruction.matching_strategy import GUIDED_FEATURES
    from treedgs_geo.reconstruction.options import ReconstructOptions
    from treedgs_geo.reconstruction.sift import extract

    from .enlarge import enlarge

    plot, scratch = Path(job["plot"]), Path(job["scratch"])
    photos_there = sorted((plot / "images").iterdir())
    chosen = np.unique(np.linspace(0, len(photos_there) - 1, job["photos"]).round().astype(int))
    (scratch / "images").mkdir(parents=True, exist_ok=True)
    camera = TruePlot.load(plot).views()[0].camera
    width = round(np.sqrt(job["megapixels"] * 1e6 * camera.width / camera.height))
    try:
        paths = [scratch / "images" / photos_there[k].name for k in chosen]
        megapixels = sum(enlarge(plot / "images" / path.name, path, width) for path in paths)
        largest_px = ReconstructOptions().max_image_size
        began = time.perf_counter()
        extract(paths, GUIDED_FEATURES, largest_px, available_threads(), scratch / "own", Reporter())
        seconds = time.perf_counter() - began
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return {
        "stages": {"features": seconds},
        "facts": {"photos": len(chosen), "megapixels": megapixels / len(chosen)},
        "sizes": {"features": megapixels},
    }


def run_second_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of asking some stems again (true cameras and places), in photos at a multiple of their size."""
    from treedgs_geo.core.machine import available_threads
    from treedgs_geo.run.routes import CHAIN_PRESETS
    from treedgs_geo.stems.splats.options import GaussianOptions
    from treedgs_geo.stems.splats.train import fit_with_report

    plot = TruePlot.load(Path(job["plot"]))
    inside = plot.trees[plot.trees["in_plot"].astype(str).str.lower() == "true"].head(job["stems"])
    places = plot.frame.to_local(inside[["E_bh", "N_bh", "h_base"]].to_numpy(float))[:, :2]
    views, most = plot.views(), CHAIN_PRESETS["balanced"].second_views
    if job["scale"] != 1:
        views = reduced(views, job["scale"], Path(job["scratch"]))
    began = time.perf_counter()
    fit_with_report(
        views,
        plot.frame,
        plot.dtm.local(plot.frame).height,
        places,
        GaussianOptions(threads=available_threads(), max_views=most),
        Reporter(),
    )
    seconds = time.perf_counter() - began
    size = len(places) * min(len(views), most) * job["scale"] ** 2
    return {
        "stages": {"second measurement": seconds},
        "sizes": {"second measurement": size},
        "facts": {"photos": len(views), "stems": len(places), "scale": job["scale"]},
    }


def run_stems_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of stems in the photos for a share of the plot's radius and a number of photos (true cameras): by their
    edges, and what it takes longer where the network is asked for stems, too."""
    from treedgs_geo.stems.photos.options import PhotoStemOptions
    from treedgs_geo.stems.photos.route import stems_from_photos

    plot = TruePlot.load(Path(job["plot"]))
    radius, views, ground = job["radius"] * plot.radius_m, plot.views(), plot.dtm.local(plot.frame).height
    area, seconds, count = Area.circle(0.0, 0.0, radius), list[float](), 0
    used = min(job["views"], len(views))
    for enough in (0.0, np.inf):
        options = PhotoStemOptions(max_views=used, most_asked=0, enough_certain=enough)
        began = time.perf_counter()
        count = len(stems_from_photos(views, ground, area, options))
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
    """Cost of the canopy for a share of the plot's radius and a number of photos (true cameras; the LiDAR's points say
    how high the search for crowns begins)."""
    from treedgs_geo.run.context import Site
    from treedgs_geo.run.heights import canopy_over, highest, pieces_of

    plot = TruePlot.load(Path(job["plot"]))
    radius, views = job["radius"] * plot.radius_m, plot.views()
    chosen = np.unique(np.linspace(0, len(views) - 1, min(job["views"], len(views))).round().astype(int))
    area = Area.circle(0.0, 0.0, radius)
    site = Site(plot.frame, [views[k] for k in chosen], plot.dtm, area)
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
    """Cost of the LiDAR route for a share of the area (so that the density stays)."""
    from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
    from treedgs_geo.terrain.ground import dtm_from_cloud

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


COSTS = {
    "subset_sfm": run_subset_sfm,
    "features_cost": run_features_cost,
    "stems_cost": run_stems_cost,
    "heights_cost": run_heights_cost,
    "second_cost": run_second_cost,
    "lidar_cost": run_lidar_cost,
}
