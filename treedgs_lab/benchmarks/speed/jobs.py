"""One measured piece of work in a process of its own: its seconds and its peak memory are nobody else's.

Called as ``python -m treedgs_lab.benchmarks.speed.jobs JOB.json RESULT.json`` (:func:`.processes.run_job`).
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.workspace import SURFACE, peak_memory_mb
from treedgs_geo.geotags.reading import read_stations
from treedgs_geo.reconstruction.model import load_points
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.pipeline import reconstruct_photos
from treedgs_geo.run.context import Site
from treedgs_geo.run.presets import CHAIN_PRESETS, Preset
from treedgs_geo.run.published_plot import Published, published_route
from treedgs_geo.run.routes import photo_route
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.splats.options import SceneOptions
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_geo.terrain.sparse_ground import dtm_from_sparse

from ..plot import TruePlot, in_plot_rows, site_of
from .cost_jobs import COSTS, in_scratch
from .photo_sizes import scaled


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
    """Stems found and fitted in the photos (``scale`` < 1: in reduced ones); a preset's job has all of its settings."""
    plot, site, _ = chain_scene(job)
    site = replace(site, views=scaled(site.views, job["scale"], Path(job["scratch"])))
    named = job.get("preset")
    preset = CHAIN_PRESETS[named] if named else Preset(ReconstructOptions(), PhotoStemOptions(**job["params"]))
    began = time.perf_counter()
    trees = photo_route(site, preset, preset.stems.bh_m, Reporter()).trees
    seconds = time.perf_counter() - began
    used, camera = min(len(site.views), preset.stems.max_views), site.views[0].camera
    return {
        "stages": {"stems": seconds},
        "rows": in_plot_rows(plot, trees),
        "modelled": {"photos": used, "megapixels": used * camera.width * camera.height / 1e6},
    }


def run_published(job: dict[str, Any]) -> dict[str, Any]:
    """The published method over the whole plot; ``params``: ``time_limit_min``. Its stages are CPU seconds; its points
    stay at ``points``."""
    plot, site, sparse = chain_scene(job)
    points = Path(job["points"])
    asked = Published(scene=SceneOptions(**job["params"]))
    made = published_route(site, sparse, asked, lambda name: points.with_name(f"{points.stem}_{name}"), Reporter())
    points.with_name(f"{points.stem}_{SURFACE}").replace(points)
    fit = made.facts["published_fit"]
    return {
        "stages": made.facts["stages_cpu_s"],
        "rows": in_plot_rows(plot, made.trees),
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
