"""The published method with all of its steps: the fit on a machine with a graphics card, everything else here.

    python -m treedgs_lab.benchmarks.photos.published_fit pack PLOT WORKSPACE SCENE
    python -m treedgs_lab.benchmarks.photos.published_fit fit SCENE --device cuda --minutes 8
    python -m treedgs_lab.benchmarks.photos.published_fit measure PLOT WORKSPACE SCENE --output docs/results/FILE.json

WORKSPACE is one of ``photos-to-dbh`` on PLOT (cameras and ground of our own; nothing true is given). ``pack`` writes
the dense prior, the cameras and the photos into the folder SCENE; ``fit`` needs that folder, torch and, for a card,
warp-lang; it leaves ``field.npy`` and ``fit.json`` there, and one that was cut off goes on when it is called again;
``measure`` samples, segments and measures them and scores the trees against the truth.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.progress import make_reporter
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.on_torch.scene_fit import fit_scene
from treedgs_geo.stems.splats.options import SceneOptions
from treedgs_geo.stems.splats.scene_start import Box, WholePhotos, thinned

#: The arrays of a view.
_POSE = ("rotation", "translation", "readout_travel_m")


def pack(plot: Path, workspace: Path, scene: Path) -> None:
    """What a fit begins with, in a folder that can be carried."""
    from treedgs_geo.reconstruction.model import load_points
    from treedgs_geo.run.published_plot import dense_start
    from treedgs_lab.benchmarks.plot import site_of

    site, reporter = site_of(plot, workspace), make_reporter("plain")
    box = Box.of(site.area, site.ground)
    points, colours, _ = dense_start(site, load_points(workspace / "sfm"), None, box, reporter)
    points, colours = thinned(points, colours, SceneOptions().max_gaussians // 2)
    scene.mkdir(parents=True, exist_ok=True)
    for view in site.views:
        shutil.copy(view.path, scene / view.name)
    np.savez(scene / "start.npz", low=box.low, high=box.high, points=points, colours=colours)
    views = [
        {
            "name": view.name,
            "camera": asdict(view.camera),
            "flight": view.flight,
            **{key: getattr(view, key).tolist() for key in _POSE},
        }
        for view in site.views
    ]
    write_json(scene / "views.json", views)


def fit(scene: Path, device: str, minutes: float, tried_every: int) -> None:
    """All steps, or what the minutes leave."""
    views = [
        View(
            each["name"],
            scene / each["name"],
            Camera(**each["camera"]),
            flight=each["flight"],
            **{key: np.array(each[key]) for key in _POSE},
        )
        for each in read_json(scene / "views.json")
    ]
    start, photos = np.load(scene / "start.npz"), WholePhotos.load(views)
    box = Box(start["low"], start["high"])
    options = SceneOptions(time_limit_min=minutes, device=device, tried_every=tried_every)
    reporter, kept = make_reporter("plain"), scene / "fit.pt"
    field, report = fit_scene(photos, box, start["points"], start["colours"], options, reporter, kept)
    np.save(scene / "field.npy", field.packed.astype(np.float32))
    card = torch.cuda.get_device_name() if device == "cuda" else None
    kept.unlink(missing_ok=True)
    write_json(scene / "fit.json", {"card": card, **asdict(report)})


def measure(plot: Path, workspace: Path, scene: Path, output: Path | None) -> None:
    """Diameters from a fitted field, scored."""
    from treedgs_geo.inventory.accuracy.scores import score
    from treedgs_geo.run.published_plot import Published, trees_of_gaussians
    from treedgs_lab.benchmarks.plot import CLEAR_VIEWS, TruePlot, score_trees, site_of
    from treedgs_lab.benchmarks.records import write_record

    site, truth = site_of(plot, workspace), TruePlot.load(plot)
    field = GaussianField.from_packed(np.load(scene / "field.npy").astype(float))
    trees, _ = trees_of_gaussians(site, field, Published(scene=SceneOptions()), make_reporter("plain"))
    rows = score_trees(truth, trees, truth.clear_views({view.name for view in site.views}))
    inside = set(truth.trees.loc[truth.trees["in_plot"], "tree_id"].astype(str))
    counted = [row for row in rows if row["tree_id"] in inside and (row["clear"] or 0) >= CLEAR_VIEWS]
    read = [row for row in counted if row["read_cm"] is not None]
    errors = np.array([row["read_cm"] - row["true_cm"] for row in read])
    record = asdict(score(errors, np.array([row["true_cm"] for row in read]), len(counted)))
    record["n_false"] = sum(bool(row.get("false")) for row in rows)
    record["errors_cm"] = {row["tree_id"]: round(row["read_cm"] - row["true_cm"], 2) for row in read}
    record = {"gaussians": len(field), "published_fit": read_json(scene / "fit.json"), **record}
    print(record)
    write_record(output, {"plot": plot.name, "arms": {"paper": record}}, seeds=[0])


def main() -> None:
    """One of the three steps."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    steps = parser.add_subparsers(dest="step", required=True)
    for name in ("pack", "fit", "measure"):
        step = steps.add_parser(name)
        if name != "fit":
            step.add_argument("plot", type=Path)
            step.add_argument("workspace", type=Path)
        step.add_argument("scene", type=Path)
        if name == "fit":
            step.add_argument("--device", default="cuda")
            step.add_argument("--minutes", type=float, default=60.0)
            step.add_argument("--tried-every", type=int, default=8)
        if name == "measure":
            step.add_argument("--output", type=Path)
    given = vars(parser.parse_args())
    work: dict[str, Callable[..., None]] = {"pack": pack, "fit": fit, "measure": measure}
    work[given.pop("step")](**given)


if __name__ == "__main__":
    main()
