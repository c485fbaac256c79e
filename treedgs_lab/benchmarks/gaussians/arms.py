"""Three ways from the same photos to diameters, side by side: the published method over the whole plot, stem primitives
among Gaussians, and stems fitted straight to the photos.

    python -m treedgs_lab.benchmarks.gaussians.arms --plot DIR --time-limit 20 --output docs/results/gaussian_arms.json

One run: cameras are those of our own reconstruction (its CPU seconds are every arm's), the ground is that of its
points, nothing true is given. Seconds are of one core. The reference are the plot's stems with three clear photos of
breast height and more; what is measured where nothing stands is counted. ``--size`` makes the photos smaller for all
arms.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from treedgs_geo.core.progress import Reporter, make_reporter
from treedgs_geo.inventory.accuracy.scores import score
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.reconstruction.model import load_points
from treedgs_geo.run.context import Site
from treedgs_geo.run.published_plot import MAX_GAUSSIANS, TRIED_EVERY, Published, published_trees
from treedgs_geo.run.routes import CHAIN_PRESETS, photo_route
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.stems.splats.options import GaussianOptions, SceneOptions
from treedgs_geo.stems.splats.ply import write_field
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_geo.stems.splats.trees import trees_of_primitives
from treedgs_lab.benchmarking.enlarge import reduced
from treedgs_lab.benchmarking.jobs import _scene, run_sfm
from treedgs_lab.benchmarking.plot import TruePlot, score_trees
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import CLEAR_VIEWS

ARMS = ("photo fit", "stem primitive", "paper")


class Arms:
    """The arms on one site. Each returns its trees and what it modelled; the stems of the photo search are found once,
    and their seconds count for each arm that needs them."""

    def __init__(
        self, site: Site, sparse: np.ndarray, scene: SceneOptions, reporter: Reporter, keep: Path | None = None
    ) -> None:
        self.site, self.sparse, self.scene, self.reporter, self.keep = site, sparse, scene, reporter, keep
        self.found: list[Tree] = []
        self.search_s = 0.0

    def photo_fit(self) -> tuple[list[Tree], dict]:
        """Stems found in the photos and fitted there."""
        began = time.process_time()
        self.found = photo_route(self.site, CHAIN_PRESETS["balanced"], 1.37, self.reporter).trees
        self.search_s = time.process_time() - began
        return self.found, {"gaussians": 0, "photos": len(self.site.views)}

    def stem_primitive(self) -> tuple[list[Tree], dict]:
        """A tapered stem in one loop with the Gaussians about it, at the places that the photo search found."""
        places = np.array([[tree.x, tree.y, tree.z_ground or 0.0] for tree in self.found])
        xy = self.site.frame.to_local(places)[:, :2]
        options = GaussianOptions(threads=1, seed=self.scene.seed)
        site = self.site
        field, report = fit_with_report(site.views, site.frame, site.ground, xy, options, self.reporter)
        second = {number: tree.dbh_cm for number, tree in enumerate(self.found)}
        trees = trees_of_primitives(report.primitives, self.site.frame, 1.37, second)
        return trees, {"gaussians": len(field), "photos": report.photos}

    def paper(self) -> tuple[list[Tree], dict]:
        """The published method over the whole plot; no photo search."""
        made = published_trees(self.site, self.sparse, Published(scene=self.scene), self.reporter)
        fit = made.facts["published_fit"]
        if self.keep is not None:
            self.keep.mkdir(parents=True, exist_ok=True)
            write_field(self.keep / "field.ply", made.field, self.site.frame)
            write_cloud(self.keep / "surface.laz", made.cloud.with_attribute("tree_id", made.tree_id))
        return made.trees, {
            "gaussians": len(made.field),
            "photos": fit["photos"],
            **made.facts,
        }


def judged(plot: TruePlot, trees: list[Tree]) -> tuple[dict, dict[str, float]]:
    """Accuracy of an arm on the reference, and its diameters' errors by stem."""
    rows = score_trees(plot, trees, plot.clear_views({view.name for view in plot.views()}))
    inside = set(plot.trees.loc[plot.trees["in_plot"].astype(str).str.lower() == "true", "tree_id"].astype(str))
    counted = [row for row in rows if row["tree_id"] in inside and (row["clear"] or 0) >= CLEAR_VIEWS]
    read = [row for row in counted if row["read_cm"] is not None]
    errors = np.array([row["read_cm"] - row["true_cm"] for row in read])
    accuracy = score(errors, np.array([row["true_cm"] for row in read]), len(counted)).as_dict()
    accuracy["n_false"] = sum(bool(row.get("false")) for row in rows)
    return accuracy, {row["tree_id"]: row["read_cm"] - row["true_cm"] for row in read}


def main() -> None:
    """Run the arms, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--work", type=Path, help="folder for the reconstruction (default: beside the plot)")
    parser.add_argument("--time-limit", type=float, default=20.0, help="CPU minutes of the published fit")
    parser.add_argument("--factor", type=float, default=0.0, help="size of its photos; 0 = as the time limit asks for")
    parser.add_argument("--size", type=float, default=1.0, help="size of the photos, all arms")
    parser.add_argument("--controller", choices=("rlgs", "fixed"), default="rlgs")
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, help="JSON file")
    parser.add_argument("--keep", type=Path, help="folder for the published method's Gaussians and points")
    arguments = parser.parse_args()
    reporter, work = make_reporter("plain"), arguments.work or arguments.plot / "arms"
    began = time.process_time()
    job = {"plot": str(arguments.plot), "sfm": str(work / "sfm"), "params": {}}
    registered = run_sfm(job)
    plot, frame, views, dtm, area = _scene(job)
    sfm_s = time.process_time() - began
    if arguments.size != 1:
        views = reduced(views, arguments.size, work / "photos")
    scene = SceneOptions(
        time_limit_min=arguments.time_limit,
        factor=arguments.factor,
        controller=arguments.controller,
        tried_every=TRIED_EVERY,
        max_gaussians=MAX_GAUSSIANS,
        seed=arguments.seed,
    )
    arms = Arms(Site(frame, views, dtm, area), load_points(work / "sfm").xyz, scene, reporter, arguments.keep)
    works: dict[str, Callable[[], tuple[list[Tree], dict]]] = {
        "photo fit": arms.photo_fit,
        "stem primitive": arms.stem_primitive,
        "paper": arms.paper,
    }
    record: dict = {
        "plot": arguments.plot.name,
        "photos": registered["registered"],
        "photo_px": [views[0].camera.width, views[0].camera.height],
        "size": arguments.size,
        "reconstruction_cpu_s": round(sfm_s, 1),
        "arms": {},
    }
    errors: dict[str, dict[str, float]] = {}
    if "stem primitive" in arguments.arms and "photo fit" not in arguments.arms:
        parser.error("stem primitive stands where the photo fit found stems: ask for it too")
    for name in (arm for arm in ARMS if arm in arguments.arms):
        began = time.process_time()
        trees, modelled = works[name]()
        seconds = time.process_time() - began + (arms.search_s if name == "stem primitive" else 0.0)
        accuracy, errors[name] = judged(plot, trees)
        record["arms"][name] = {"cpu_s": round(seconds, 1), **modelled, **accuracy, "errors_cm": errors[name]}
        print(name, record["arms"][name], flush=True)
        write_record(arguments.output, record, seeds=[arguments.seed])
    common = set.intersection(*(set(own) for own in errors.values()))
    record["on_common_stems"] = {
        name: {"stems": len(common), "rmse_cm": round(float(np.sqrt(np.mean([own[k] ** 2 for k in common]))), 2)}
        for name, own in errors.items()
        if common
    }
    write_record(arguments.output, record, seeds=[arguments.seed])


if __name__ == "__main__":
    main()
