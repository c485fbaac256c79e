"""One measured piece of work in a process of its own: its seconds and its peak memory are nobody else's.

Called as ``python -m treedgs_lab.benchmarking.jobs JOB.json RESULT.json``.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.children import python_command
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.dtm import Dtm

from .cost_jobs import COSTS
from .enlarge import reduced
from .plot import TruePlot, score_trees


def run_job(job: dict[str, Any], result: Path) -> dict[str, Any]:
    """Run a job in a child process; returns and keeps its record (``error`` instead of results if it failed)."""
    job_file = result.with_suffix(".job.json")
    write_json(job_file, job)
    began = time.perf_counter()
    child = subprocess.Popen(
        python_command("treedgs_lab.benchmarking.jobs", job_file, result),
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
    from treedgs_geo.geotags.reading import read_stations
    from treedgs_geo.reconstruction.options import ReconstructOptions
    from treedgs_geo.reconstruction.pipeline import reconstruct_photos

    plot = Path(job["plot"])
    stations = read_stations(plot / "images", plot, TruePlot.load(plot).frame.crs.to_string())
    # Features of an earlier run must not make this one look quick.
    report = reconstruct_photos(stations, ReconstructOptions(**job["params"]), Path(job["sfm"]))
    return {"stages": report["stage_seconds"], "photos": report["photos"], "registered": report["registered"]}


def _scene(job: dict[str, Any]) -> tuple[TruePlot, LocalFrame, list[View], Dtm, Area]:
    """Cameras, ground and area as the chain would have them; nothing true but the scoring."""
    from treedgs_geo.core.plots import read_plots
    from treedgs_geo.reconstruction.model import load_points, load_views
    from treedgs_geo.terrain.sparse_ground import dtm_from_sparse

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
    from treedgs_geo.reconstruction.options import ReconstructOptions
    from treedgs_geo.run.context import Site
    from treedgs_geo.run.routes import CHAIN_PRESETS, Preset, auto_route
    from treedgs_geo.stems.photos.options import PhotoStemOptions

    plot, frame, views, dtm, area = _scene(job)
    if job["scale"] != 1:
        views = reduced(views, job["scale"], Path(job["scratch"]))
    named = job.get("preset")
    preset = CHAIN_PRESETS[named] if named else Preset(ReconstructOptions(), PhotoStemOptions(**job["params"]), "none")
    began = time.perf_counter()
    trees = auto_route(Site(frame, views, dtm, area), preset, preset.stems.bh_m, Reporter()).trees
    seconds = time.perf_counter() - began
    used = min(len(views), preset.stems.max_views)
    return {
        "stages": {"stems": seconds},
        **_scored(plot, trees),
        "modelled": {"photos": used, "megapixels": used * views[0].camera.width * views[0].camera.height / 1e6},
    }


def run_published(job: dict[str, Any]) -> dict[str, Any]:
    """The published method over the whole plot; ``params``: ``time_limit_min``. Its stages are CPU seconds."""
    from treedgs_geo.pointcloud.files import write_cloud
    from treedgs_geo.reconstruction.model import load_points
    from treedgs_geo.run.context import Site
    from treedgs_geo.run.published_plot import Published, published_trees
    from treedgs_geo.stems.splats.options import SceneOptions

    plot, frame, views, dtm, area = _scene(job)
    scene = SceneOptions(**job["params"])
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
    from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
    from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
    from treedgs_geo.terrain.ground import dtm_from_cloud

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


JOBS = {
    "sfm": run_sfm,
    "photos": run_photos,
    "published": run_published,
    "cloud": run_cloud,
    **COSTS,
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
