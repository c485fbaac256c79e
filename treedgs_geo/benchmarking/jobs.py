"""One measured piece of work in a process of its own: its seconds and its peak memory are nobody else's.

Called as ``python -m treedgs_geo.benchmarking.jobs JOB.json RESULT.json``.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.children import python_command
from ..core.crs import LocalFrame
from ..core.errors import ReconstructionError
from ..core.files import read_json, write_json
from ..core.progress import Reporter
from ..core.workspace import peak_memory_mb
from ..reconstruction.area import Area
from ..reconstruction.cameras import View
from ..terrain.dtm import Dtm
from ..trees.tree import Tree
from .plot import TruePlot, score_trees


def run_job(job: dict[str, Any], result: Path) -> dict[str, Any]:
    """Run a job in a child process; returns and keeps its record (``error`` instead of results if it failed)."""
    job_file = result.with_suffix(".job.json")
    write_json(job_file, job)
    began = time.perf_counter()
    child = subprocess.Popen(
        python_command("treedgs_geo.benchmarking.jobs", job_file, result),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        errors = child.communicate()[1]
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()
    job_file.unlink(missing_ok=True)
    if child.returncode or not result.exists():
        last = (errors or b"").decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
        write_json(
            result,
            {
                "error": f"exit code {child.returncode}: {last[0][:300]}",
                "wall_s": round(time.perf_counter() - began, 2),
            },
        )
    return read_json(result)


def run_sfm(job: dict[str, Any]) -> dict[str, Any]:
    """Geotags and structure from motion of a plot into ``job["sfm"]``."""
    from ..geotags.reading import read_stations
    from ..reconstruction.options import ReconstructOptions
    from ..reconstruction.pipeline import reconstruct_photos

    plot = Path(job["plot"])
    stations = read_stations(plot / "images", plot, TruePlot.load(plot).frame.crs.to_string())
    # Features of an earlier run must not make this one look quick.
    report = reconstruct_photos(stations, ReconstructOptions(**job["params"]), Path(job["sfm"]))
    return {"stages": report["stage_seconds"], "photos": report["photos"], "registered": report["registered"]}


def _scene(job: dict[str, Any]) -> tuple[TruePlot, LocalFrame, list[View], Dtm, Area]:
    """Cameras, ground and area as the chain would have them; nothing true but the scoring."""
    from ..core.plots import read_plots
    from ..reconstruction.model import load_points, load_views
    from ..terrain.sparse_ground import dtm_from_sparse

    plot = TruePlot.load(Path(job["plot"]))
    frame, views = load_views(Path(job["sfm"]), plot.folder / "images")
    points = load_points(Path(job["sfm"])).xyz
    circles = read_plots(plot.folder / "plots.csv", frame.crs)
    centres = frame.to_local(np.array([[p.x, p.y, frame.origin[2]] for p in circles]))[:, :2]
    area = Area.circles(centres, np.array([p.radius_m for p in circles]))
    low_x, low_y, high_x, high_y = area.bounds(8.0)
    corners = frame.to_project(np.array([[low_x, low_y, 0.0], [high_x, high_y, 0.0]]))
    dtm = dtm_from_sparse(frame.to_project(points), crs=frame.crs, bounds=(corners[0, :2], corners[1, :2]))
    return plot, frame, views, dtm, area


def run_photos(job: dict[str, Any]) -> dict[str, Any]:
    """Stems found and fitted in the photos (``scale`` < 1: in reduced ones); a preset's job has all of its settings."""
    from ..chain.routes import CHAIN_PRESETS, Preset, auto_route
    from ..chain.run import Site
    from ..from_photos.options import PhotoStemOptions
    from ..reconstruction.options import ReconstructOptions

    plot, frame, views, dtm, area = _scene(job)
    if job["scale"] != 1:
        views = reduced(views, job["scale"], Path(job["scratch"]))
    named = job.get("preset")
    preset = CHAIN_PRESETS[named] if named else Preset(ReconstructOptions(), PhotoStemOptions(**job["params"]), "none")
    began = time.perf_counter()
    trees = auto_route(Site(frame, views, dtm, area), preset, preset.stems.bh_m, 0, Reporter()).trees
    seconds = time.perf_counter() - began
    used = min(len(views), preset.stems.max_views)
    return {
        "stages": {"stems": seconds},
        **_scored(plot, trees),
        "modelled": {"photos": used, "megapixels": used * views[0].camera.width * views[0].camera.height / 1e6},
    }


def reduced(views: list[View], scale: float, folder: Path) -> list[View]:
    """The photos at a share of their size, with cameras that fit (not timed: a drone would store them so)."""
    import cv2

    from ..reconstruction.images import load_image

    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for view in views:
        image = load_image(view)[..., ::-1]
        height, width = round(image.shape[0] * scale), round(image.shape[1] * scale)
        path = folder / view.path.name
        cv2.imwrite(
            str(path), cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), [cv2.IMWRITE_JPEG_QUALITY, 95]
        )
        sx, sy = width / image.shape[1], height / image.shape[0]
        c = view.camera
        camera = replace(c, width=width, height=height, fx=c.fx * sx, fy=c.fy * sy, cx=c.cx * sx, cy=c.cy * sy)
        made.append(replace(view, path=path, camera=camera))
    return made


def run_splats(job: dict[str, Any]) -> dict[str, Any]:
    """Splats fitted about stems that were found in the photos (positions only), then measured as a cloud."""
    from ..from_photos.find import stems_from_photos
    from ..from_photos.options import PhotoStemOptions
    from ..from_photos.trees import trees_of_photo_fits
    from ..from_points.measuring.cloud import measure_stems
    from ..from_points.measuring.options import MeasureOptions
    from ..gaussians.options import PAPER_SAMPLING, GaussianOptions, SampleOptions
    from ..gaussians.train import fit_with_report
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.files import write_cloud
    from .splat_points import points_of

    plot, frame, views, dtm, area = _scene(job)
    paper = job["params"].get("preset") == "paper-crops"
    clock = [time.perf_counter()]
    found = trees_of_photo_fits(
        stems_from_photos(views, dtm.local(frame).height, area, PhotoStemOptions(max_views=48)), frame
    )
    if not found:
        raise ReconstructionError("no stem was found to fit splats around; give another plot.")
    places = frame.to_local(np.array([[t.x, t.y, t.z_ground or 0.0] for t in found]))[:, :2]
    clock.append(time.perf_counter())
    options = GaussianOptions(**job["params"])
    field, report = fit_with_report(views, frame, dtm.local(frame).height, places, None, options, Reporter())
    clock.append(time.perf_counter())
    sampling = replace(SampleOptions(), **(PAPER_SAMPLING if paper else {}))
    xyz, opacity, groups = points_of(field, views, job["reads"], sampling)
    clock.append(time.perf_counter())
    cloud = PointCloud(frame.to_project(xyz), frame.crs, {"opacity": opacity, "tree_id": (groups + 1).astype(np.int32)})
    write_cloud(Path(job["points"]), cloud)
    measuring = MeasureOptions(weights="opacity", method="paper" if paper else "default", source="splat")
    trees = measure_stems(cloud, groups + 1, dtm, measuring)
    clock.append(time.perf_counter())
    stages = dict(zip(("find stems", "fit splats", "sample", "measure"), np.diff(clock).tolist(), strict=True))
    return {
        "stages": stages,
        **_scored(plot, trees),
        "modelled": {"photos": report.photos, "megapixels": report.megapixels, "gaussians": len(field)},
    }


def run_published(job: dict[str, Any]) -> dict[str, Any]:
    """The published method over the whole plot; ``params``: ``time_limit_min``. Its stages are CPU seconds."""
    from ..chain.published_plot import MAX_GAUSSIANS, TRIED_EVERY, Published, published_trees
    from ..chain.run import Site
    from ..gaussians.options import SceneOptions
    from ..pointcloud.files import write_cloud
    from ..reconstruction.model import load_points

    plot, frame, views, dtm, area = _scene(job)
    scene = SceneOptions(tried_every=TRIED_EVERY, max_gaussians=MAX_GAUSSIANS, **job["params"])
    sparse = load_points(Path(job["sfm"])).xyz
    made = published_trees(Site(frame, views, dtm, area), sparse, Published(scene=scene), Reporter())
    write_cloud(Path(job["points"]), made.cloud.with_attribute("tree_id", made.tree_id.astype(np.int32)))
    fit = made.facts["published_fit"]
    return {
        "stages": made.facts["stages_cpu_s"],
        **_scored(plot, made.trees),
        "modelled": {name: fit[name] for name in ("photos", "megapixels", "gaussians", "steps", "factor")},
    }


def run_cloud(job: dict[str, Any]) -> dict[str, Any]:
    """The plot's LiDAR: ground, stems, diameters."""
    from ..from_points.measuring.cloud import measure_cloud
    from ..from_points.measuring.options import MeasureOptions
    from ..terrain.ground import dtm_from_cloud

    plot = TruePlot.load(Path(job["plot"]))
    clock = [time.perf_counter()]
    cloud = plot.cloud()
    dtm = dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    clock.append(time.perf_counter())
    trees, _ = measure_cloud(cloud, dtm, MeasureOptions(**job["params"]))
    clock.append(time.perf_counter())
    stages = dict(zip(("read and ground", "stems"), np.diff(clock).tolist(), strict=True))
    return {"stages": stages, **_scored(plot, trees), "modelled": {"points": len(cloud)}}


def _scored(plot: TruePlot, trees: list[Tree]) -> dict[str, Any]:
    clear = plot.clear_views({view.name for view in plot.views()})
    rows = score_trees(plot, trees, clear)
    inside = set(plot.trees.loc[plot.trees["in_plot"].astype(str).str.lower() == "true", "tree_id"].astype(str))
    return {"rows": [row for row in rows if row["tree_id"] in inside or row.get("false")]}


def run_subset_sfm(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of a reconstruction from every so-manyth photo, at a share of their size."""
    import shutil

    from ..core.files import ensure_writable
    from ..geotags.reading import read_stations
    from ..reconstruction.options import ReconstructOptions
    from ..reconstruction.pipeline import reconstruct_photos

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

    from ..core.machine import available_threads
    from ..reconstruction.levels import GUIDED_FEATURES
    from ..reconstruction.options import ReconstructOptions
    from ..reconstruction.sift import extract
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
    from ..chain.routes import CHAIN_PRESETS
    from ..core.machine import available_threads
    from ..gaussians.options import GaussianOptions
    from ..gaussians.train import fit_with_report

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
        None,
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
    """Cost of stems in the photos for a share of the plot's radius and a number of photos (true cameras)."""
    from ..from_photos.find import stems_from_photos
    from ..from_photos.options import PhotoStemOptions

    plot = TruePlot.load(Path(job["plot"]))
    radius, views = job["radius"] * plot.radius_m, plot.views()
    began = time.perf_counter()
    fits = stems_from_photos(
        views,
        plot.dtm.local(plot.frame).height,
        Area.circle(0.0, 0.0, radius),
        PhotoStemOptions(max_views=job["views"]),
    )
    seconds = time.perf_counter() - began
    camera = views[0].camera
    crop = min(camera.width * camera.height, ((2 * radius + 6) / 0.0184) ** 2) / 1e6
    return {
        "stages": {"stems": seconds},
        "sizes": {"stems": np.pi * radius**2 * job["views"]},
        "facts": {"photos": job["views"], "stems": len(fits), "crop_megapixels": crop * job["views"]},
    }


def run_heights_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of the canopy for a share of the plot's radius and a number of photos (true cameras; the LiDAR's points say
    how high the search for crowns begins)."""
    from ..chain.heights import canopy_over, pieces_of
    from ..chain.run import Site

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
        canopy_over(site, piece, box, points, Reporter())
    return {
        "stages": {"heights": time.perf_counter() - began},
        "sizes": {"heights": np.pi * radius**2 * seen},
        "facts": {"photos": seen},
    }


def run_lidar_cost(job: dict[str, Any]) -> dict[str, Any]:
    """Cost of the LiDAR route for a share of the area (so that the density stays)."""
    from ..from_points.measuring.cloud import measure_cloud
    from ..terrain.ground import dtm_from_cloud

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


JOBS = {
    "sfm": run_sfm,
    "photos": run_photos,
    "splats": run_splats,
    "published": run_published,
    "cloud": run_cloud,
    "subset_sfm": run_subset_sfm,
    "features_cost": run_features_cost,
    "stems_cost": run_stems_cost,
    "second_cost": run_second_cost,
    "heights_cost": run_heights_cost,
    "lidar_cost": run_lidar_cost,
}


def main() -> int:
    """Run one job."""
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    began = time.perf_counter()
    record = JOBS[job["kind"]](job)
    record["stages"] = {name: round(value, 2) for name, value in record["stages"].items()}
    write_json(
        Path(sys.argv[2]),
        {**record, "wall_s": round(time.perf_counter() - began, 2), "peak_memory_mb": peak_memory_mb()},
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
