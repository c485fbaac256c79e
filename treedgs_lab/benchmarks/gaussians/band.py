"""The stem band against the full scene: the same photos, poses, positions and read-outs, in one run on one thread.

    python -m treedgs_lab.benchmarks.gaussians.band --output docs/results/gaussian_band.json
        (simulates its own plot; true poses)
    python -m treedgs_lab.benchmarks.gaussians.band --plot DIR [--workspace WS]
        (another plot; poses and sparse points of WS)

Arms of the band: ``primitive`` is ``fit-gaussians``, ``search`` the same without its last loop (the stem is fitted
against the ground texture alone), ``free`` is ``--stems free``. The full scene (``stems/splats/scene.py``) models all
that the photos show, as published, until the held-out photos settle. Each read-out is made of both: the stem primitive
(``search``; in the full scene with the other Gaussians before and behind the stem, those in its cylinder left out),
and points spread evenly, the cone at whose bark opacity ends (``free``). Photos held out of a band are held out of the
scene. ``--steps 30000`` gives the full scene the published length instead. ``--fewer`` fits scenes with other numbers
of Gaussians for some passes at half resolution: is the number right?
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.core.files import read_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.inventory.accuracy.scores import score
from treedgs_geo.stems.splats.bands import Band, cut_bands
from treedgs_geo.stems.splats.opacity_samples import sample_volume
from treedgs_geo.stems.splats.options import GaussianOptions, SampleOptions
from treedgs_geo.stems.splats.primitive.fit import PrimitiveFit
from treedgs_geo.stems.splats.splat_fit.held_out import hold_out
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_lab.benchmarking.factor_type import BASE
from treedgs_lab.benchmarks.gaussians.route import read_out
from treedgs_lab.benchmarks.gaussians.scene import (
    Fit,
    Photos,
    band_db,
    near_stems,
    points_on_rays,
    primitive_in_scene,
    start,
)
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import CLEAR_VIEWS, noisy_places, scene_of, truth_rows

ARMS: dict[str, dict] = {"primitive": {}, "search": {"stem_epochs": 0}, "free": {"stems": "free"}}


def simulated(folder: Path, seed: int) -> Path:
    """The small plot of the stability suite, without LiDAR."""
    from treedgs_lab.simulate.settings import SimulateSettings
    from treedgs_lab.simulate.simulate import simulate_plot

    if not (folder / "truth" / "trees.csv").exists():
        simulate_plot(SimulateSettings(output=folder, seed=seed, name="small", lidar_density_m2=0.0, **BASE))
    return folder


def diameters(primitives: dict[int, PrimitiveFit]) -> dict[int, float]:
    """DBH in cm of the stems that are not refused."""
    return {k: found.dbh_cm for k, found in primitives.items() if not found.findings.refused}


def some(curve: list[dict], most: int = 60) -> list[dict]:
    """Rows of a long curve, evenly; the last one always."""
    stride = -(-len(curve) // most) or 1
    return curve[::-1][::stride][::-1]


class Comparison:
    """What both arms share, and what was found so far."""

    def __init__(self, arguments: argparse.Namespace, plot: Path) -> None:
        self.arguments = arguments
        self.frame, self.views, self.dtm = scene_of(plot, arguments.workspace)
        self.ground = self.dtm.local(self.frame).height
        self.rows = truth_rows(plot, CLEAR_VIEWS)
        self.true_cm = np.array([float(row["dbh_cm"]) for row in self.rows])
        self.xy = noisy_places(self.rows, self.frame, arguments.seed)
        self.options = GaussianOptions(threads=1, seed=arguments.seed)
        self.sampling = SampleOptions(seed=arguments.seed, threads=1, samples=arguments.samples)
        self.record: dict = {
            "plot": plot.name,
            "poses": "workspace" if arguments.workspace else "true",
            "stems": len(self.rows),
            "photos": len(self.views),
            "threads": 1,
            "arms": {},
        }
        if arguments.state and arguments.state.exists() and arguments.output and arguments.output.exists():
            self.record = read_json(arguments.output)
            del self.record["made_by"]

    def write(self) -> None:
        seeds = [self.arguments.seed] + ([] if self.arguments.plot else [self.arguments.plot_seed])
        write_record(self.arguments.output, self.record, seeds=seeds)

    def read(self, found: dict[int, float]) -> dict:
        """Scores of a read-out."""
        got = np.array([k in found for k in range(len(self.rows))])
        errors = np.array([found[int(k)] for k in np.flatnonzero(got)]) - self.true_cm[got]
        names = [row["tree_id"] for row, ok in zip(self.rows, got, strict=True) if ok]
        return {
            **score(errors, self.true_cm[got], len(self.rows)).as_dict(),
            "errors_cm": dict(zip(names, errors.round(2).tolist(), strict=True)),
        }

    def finish(self, name: str, entry: dict) -> None:
        self.record["arms"][name] = entry | {"peak_memory_mb": peak_memory_mb()}
        print(name, json.dumps(self.record["arms"][name]), flush=True)
        self.write()

    def bands(self) -> tuple[dict[int, np.ndarray], dict[int, Band]]:
        """Origins and crops of the stems, as the band arms cut them."""
        cut = cut_bands(self.views, self.ground, self.xy, self.options, Reporter(), [])
        found = {stem: cut.band(stem) for stem in cut.origins}
        return cut.origins, {stem: band for stem, band in found.items() if band is not None}

    def band_arm(self, name: str) -> None:
        options = GaussianOptions(threads=1, seed=self.arguments.seed, **ARMS[name])
        fit_with_report(self.views, self.frame, self.ground, self.xy[:1], None, options)  # compiles
        began = time.process_time()
        field, report = fit_with_report(self.views, self.frame, self.ground, self.xy, None, options)
        if options.free:
            found = read_out(sample_volume(field, self.views, self.sampling), self.frame, self.dtm, "volume")
        else:
            found = diameters({k: stem.primitive for k, stem in report.primitives.items()})
        held = [stem["held_out"]["psnr_db"] for stem in report.stems if stem["held_out"]]
        self.finish(
            name,
            {
                "cpu_s": round(time.process_time() - began, 1),
                "gaussians": len(field),
                "megapixels": report.megapixels,
                "million_pairs": round(report.pairs / 1e6),
                "passes": max(stem["epochs"] for stem in report.stems),
                "band_held_out_db": round(float(np.mean(held)), 2) if held else None,
                **self.read(found),
            },
        )

    def begin(self, count: int, held: list[int]) -> Fit:
        """A scene of ``count`` Gaussians before its first pass."""
        seed, rng = self.arguments.seed, np.random.default_rng(self.arguments.seed)
        began = time.process_time()
        photos = Photos.of(self.views, held)
        if self.arguments.workspace:
            from treedgs_geo.reconstruction.model import load_points

            sparse = load_points(self.arguments.workspace / "sfm")
            xyz, colours = np.asarray(sparse.xyz, float), np.asarray(sparse.rgb, float) / 255
            away = np.linalg.norm((xyz - np.median(xyz, axis=0))[:, :2], axis=1)
            near = away < 3 * np.median(away) + 10
            xyz, colours = xyz[near], colours[near]
        else:
            xyz, colours = points_on_rays(photos, self.ground, count, rng)
        middle = np.median(self.xy, axis=0)
        foot = np.array([*middle, float(self.ground(middle[:1], middle[1:])[0])])
        pixel_m = float(np.median([np.linalg.norm(v.centre - foot) / v.camera.fx for v in self.views]))
        fit = Fit(photos, start(xyz, colours, count, rng), pixel_m, seed)
        fit.cpu_s = time.process_time() - began
        return fit

    def full_arm(self) -> None:
        """The whole scene: fitted, and read out as a band is."""
        arguments, began = self.arguments, time.process_time()
        origins, bands = self.bands()
        cutting_s = time.process_time() - began
        held = sorted({crop.view for band in bands.values() for crop in hold_out(band.crops)[1]})
        fit = self.begin(arguments.gaussians, held)
        if arguments.state and arguments.state.exists():
            fit.restore(arguments.state)
        looks: list[dict] = self.record.setdefault("looks", [])

        def primitives() -> dict[int, float]:
            found = {k: primitive_in_scene(fit.p, origins[k], band, self.options) for k, band in bands.items()}
            return diameters({k: one for k, one in found.items() if one is not None})

        def after(fit: Fit) -> None:
            self.record["curve"] = some(fit.curve)
            if len(fit.curve) in arguments.look:
                looks.append({"pass": len(fit.curve), **self.read(primitives())})
            self.write()
            if arguments.state:
                fit.save(arguments.state)

        primitive_in_scene(fit.p, next(iter(origins.values())), next(iter(bands.values())), self.options)  # compiles
        if arguments.steps:
            fit.run_length(arguments.steps, after)
        else:
            fit.run(tuple(arguments.most), arguments.last, after)
        self.record["curve"] = some(fit.curve)
        seeds = np.column_stack([self.xy, self.ground(*self.xy.T)])
        scene = {
            "gaussians": len(fit.p),
            "held_out_photos": len(held),
            "passes": len(fit.curve),
            "steps": fit.steps,
            "megapixels": round(fit.pixels / 1e6, 1),
            "million_pairs": round(fit.pairs / 1e6),
            "fit_cpu_s": round(fit.cpu_s, 1),
            "settled": {stage: fit.settled(stage) for stage in ("half", "full")},
            "cpu_h_for_30000_steps_extrapolated": round(30000 * fit.cpu_s / max(fit.steps, 1) / 3600, 2),
            "held_out_db": round(fit.held_out_db(1.0), 2),
            "band_held_out_db": round(float(np.mean([band_db(fit.p, origins[k], bands[k]) for k in bands])), 2),
        }
        primitive_s = time.process_time()
        found = primitives()
        primitive_s = time.process_time() - primitive_s
        self.finish("full", scene | {"cpu_s": round(fit.cpu_s + cutting_s + primitive_s, 1), **self.read(found)})
        self.free_read_out(fit, scene, seeds)
        self.with_fewer(fit, held)

    def free_read_out(self, fit: Fit, scene: dict, seeds: np.ndarray) -> None:
        """The scene's Gaussians about the stems, read as the band's free ones are. seeds: (K, 3) feet."""
        began = time.process_time()
        found: dict[int, float] = {}
        try:
            own = near_stems(fit.p, seeds, self.options.radius_m, self.options.band_m)
            points = sample_volume(own, self.views, self.sampling)
            found = read_out(points, self.frame, self.dtm, "volume")
        except ValueError as problem:
            scene = scene | {"problem": str(problem)}
        self.finish(
            "full_free", scene | {"cpu_s": round(fit.cpu_s + time.process_time() - began, 1), **self.read(found)}
        )

    def with_fewer(self, fit: Fit, held: list[int]) -> None:
        """Scenes with other numbers of Gaussians, some passes at half resolution, beside the same passes of ``fit``."""
        arguments = self.arguments
        for count in arguments.fewer:
            other = self.begin(count, held)
            other.run((arguments.fewer_passes, 0), 0, lambda fit: None)
            same = [row["held_out_db"] for row in fit.curve if row["stage"] == "half"][: len(other.curve)][-1:]
            self.record.setdefault("fewer", []).append(
                {
                    "gaussians": count,
                    "passes": len(other.curve),
                    "cpu_s": round(other.cpu_s, 1),
                    "held_out_db": other.curve[-1]["held_out_db"],
                    f"held_out_db_with_{arguments.gaussians}": same[0] if same else None,
                }
            )
            self.write()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, help="a rendered plot with truth/; default: a small one is simulated")
    parser.add_argument("--plot-seed", type=int, default=101, help="of the simulated plot")
    parser.add_argument("--scratch", type=Path, help="folder for the simulated plot, kept")
    parser.add_argument("--workspace", type=Path, help="its reconstruction (sfm/); default: true poses")
    parser.add_argument("--gaussians", type=int, default=70_000, help="of the full scene")
    parser.add_argument("--most", type=int, nargs=2, default=[40, 40], help="most passes at half and full resolution")
    parser.add_argument("--last", type=int, default=2, help="passes with falling steps")
    parser.add_argument(
        "--steps", type=int, help="fit the full scene for so many steps, settled or not (published: 30,000)"
    )
    parser.add_argument("--look", type=int, nargs="*", default=[2, 8], help="read the stems out after these passes too")
    parser.add_argument("--fewer", type=int, nargs="*", default=[17_500], help="other numbers of Gaussians to try")
    parser.add_argument("--fewer-passes", type=int, default=6)
    parser.add_argument("--arms", nargs="*", default=list(ARMS), choices=list(ARMS), help="of the band")
    parser.add_argument("--samples", type=int, default=40)
    parser.add_argument(
        "--state",
        type=Path,
        help="file to keep the scene in after each pass; a run that finds it, and its own --output, goes on from there",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    plot = arguments.plot
    if plot is None:
        plot = simulated(arguments.scratch or Path(tempfile.mkdtemp()) / "small", arguments.plot_seed)
    comparison = Comparison(arguments, plot)
    for name in arguments.arms:
        if name not in comparison.record["arms"]:
            comparison.band_arm(name)
    comparison.full_arm()
    arms = comparison.record["arms"]
    for name in arguments.arms:
        full = arms["full_free" if name == "free" else "full"]
        comparison.record[f"full_over_{name}"] = {
            what: round(full[what] / max(arms[name][what], 1e-9), 1) for what in ("cpu_s", "gaussians")
        } | {
            "rmse_difference_cm": None
            if full["rmse_cm"] is None or arms[name]["rmse_cm"] is None
            else round(full["rmse_cm"] - arms[name]["rmse_cm"], 2)
        }
        print(name, comparison.record[f"full_over_{name}"])
    comparison.write()


if __name__ == "__main__":
    main()
