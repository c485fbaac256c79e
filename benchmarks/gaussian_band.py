"""The stem band against the full scene: the same photos, poses, positions and read-out, in one run on one thread.

    python benchmarks/gaussian_band.py --plot DIR --workspace WS [--gaussians 400000] [--output gaussian_band.json]

Arms: ``primitive`` and ``free`` are ``fit-gaussians --stems ...`` on crops of the stem band with the ground as a
texture. ``full`` models everything that the photos show with Gaussians (crowns, ground, stems): started from the sparse
points of the reconstruction, 0.8 L1 + 0.2 D-SSIM over whole photos, a fixed number of Gaussians with dead ones moved
(3DGS-MCMC), the same optimiser, rasteriser and number of passes as ``free``. Diameters of the free arms come from the
same sampling and the same estimator. 30,000 steps, as published, are an extrapolation from the seconds a step.
"""

from __future__ import annotations

import argparse
import csv
import json
import platform
import time
from pathlib import Path

import numpy as np
from gaussian_route import read_out, true_positions
from scipy.spatial import cKDTree

from treedgs_geo import __version__
from treedgs_geo.core.files import write_json
from treedgs_geo.core.progress import make_reporter
from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.evaluation.accuracy import score
from treedgs_geo.gaussians.controllers import FixedSchedule
from treedgs_geo.gaussians.crops import cut_out
from treedgs_geo.gaussians.field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION, GaussianField
from treedgs_geo.gaussians.loss import d_ssim, l1
from treedgs_geo.gaussians.optimise import Adam, Volume, constrain, learning_rates, relocate
from treedgs_geo.gaussians.options import GaussianOptions, SampleOptions
from treedgs_geo.gaussians.project import CropCamera
from treedgs_geo.gaussians.raster import Rasteriser
from treedgs_geo.gaussians.train import fit_with_report, read_photo
from treedgs_geo.gaussians.volume import sample_volume
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.model import load_points, load_views
from treedgs_geo.terrain.dtm import read_dtm

#: Passes over the photos at half and at full resolution: those of the preset ``balanced``.
COARSE, FINE = 8, 6


def start(points: np.ndarray, colours: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 14) Gaussians at the sparse points and, to fill the budget, beside them."""
    gap = np.clip(cKDTree(points).query(points, k=4)[0][:, 1:].mean(axis=1), 0.01, 0.5)
    from_points = np.concatenate([rng.permutation(len(points)), rng.integers(0, len(points), max(count, 1))])[:count]
    own = gap[from_points]
    p = np.zeros((count, N_PARAMETERS))
    jitter = rng.standard_normal((count, 3)) * own[:, None]
    jitter[: len(points)] = 0
    p[:, MEAN] = points[from_points] + jitter
    p[:, QUATERNION] = rng.standard_normal((count, 4))
    p[:, QUATERNION] /= np.linalg.norm(p[:, QUATERNION], axis=1, keepdims=True)
    copies = max(count / len(points), 1)
    p[:, LOG_SCALE] = np.log(np.clip(own / copies ** (1 / 3), 0.006, 0.3))[:, None]
    p[:, LOGIT] = np.log(0.18 / 0.82)
    p[:, COLOUR] = colours[from_points]
    return p


def fit_full(
    views: list[View], p: np.ndarray, volume: Volume, pixel_m: float, passes: tuple[int, int], seed: int
) -> tuple[np.ndarray, dict]:
    """Adam over whole photos; the fitted (N, 14) and what it took."""
    rng, rasteriser, schedule = np.random.default_rng(seed), Rasteriser(1), FixedSchedule()
    whole = []
    for view in views:
        c = view.camera
        camera = CropCamera(c.width, c.height, c.fx, c.fy, c.cx, c.cy, view.rotation, view.translation)
        whole.append((camera, cut_out(read_photo(view), view, camera)))
    held = sorted({len(whole) // 4, 3 * len(whole) // 4})
    taught = [k for k in range(len(whole)) if k not in held]
    adam, pairs, steps, pixels = Adam.start(len(p), learning_rates(pixel_m)), 0, 0, 0
    began, spent = time.process_time(), {0.5: 0.0, 1.0: 0.0}
    import cv2

    for epoch in range(sum(passes)):
        factor = 0.5 if epoch < passes[0] else 1.0
        for at, k in enumerate(rng.permutation(taught)):
            camera, (photo, inside) = whole[k]
            camera, busy = camera.scaled(factor), time.process_time()
            size = camera.width, camera.height
            image = cv2.resize(photo, size, interpolation=cv2.INTER_AREA).astype(np.float32) / np.float32(255)
            weight = cv2.resize(inside, size, interpolation=cv2.INTER_AREA)
            done = rasteriser.forward(p, camera)
            shown = np.ascontiguousarray(np.moveaxis(done.planes[:3], 0, -1))
            _, g = l1(shown, image, weight)
            _, g_structure = d_ssim(shown, image, weight)
            given = np.zeros((4, camera.height, camera.width), np.float32)
            given[:3] = np.moveaxis(0.8 * g + 0.2 * g_structure, -1, 0)
            progress = (epoch + at / len(taught)) / sum(passes)
            adam.step(p, rasteriser.backward(p, done, given), schedule.factors(progress))
            constrain(p, volume)
            pairs, steps, pixels = pairs + done.pairs, steps + 1, pixels + size[0] * size[1]
            spent[factor] += time.process_time() - busy
        if epoch + 1 < 0.85 * sum(passes):
            relocate(p, adam, volume, rng)
        print(f"full: pass {epoch + 1} of {sum(passes)}, {time.process_time() - began:.0f} s", flush=True)
    seconds, square = time.process_time() - began, []
    for k in held:
        camera, (photo, inside) = whole[k]
        shown = np.clip(np.moveaxis(rasteriser.forward(p, camera).planes[:3], 0, -1), 0, 1)
        square.append(float(np.average(((shown - photo / 255) ** 2).mean(axis=-1), weights=inside)))
    each = [spent[factor] / max(count, 1) for factor, count in zip((0.5, 1.0), passes, strict=True)]
    return p, {"cpu_s": round(seconds, 1), "passes": list(passes), "cpu_s_a_pass": [round(one, 1) for one in each],
               "cpu_s_for_8_and_6_passes": round(COARSE * each[0] + FINE * each[1], 1), "steps": steps,
               "megapixels": round(pixels / 1e6, 1),
               "million_pairs": round(pairs / 1e6), "cpu_s_a_step": round(seconds / max(steps, 1), 3),
               "held_out_photo_psnr_db": round(float(-10 * np.log10(np.mean(square))), 2)}


def near_stems(p: np.ndarray, seeds: np.ndarray, radius_m: float, band_m: float) -> GaussianField:
    """The Gaussians about the stems, as the field of the stem band has them. seeds: (K, 3) local, on the ground."""
    away, nearest = cKDTree(seeds[:, :2]).query(p[:, :2])
    above = p[:, 2] - seeds[nearest, 2]
    chosen = np.flatnonzero((away <= radius_m) & (above > -0.15) & (above < band_m + 0.4))
    return GaussianField.from_packed(p[chosen], nearest[chosen].astype(np.int32))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, help="a rendered plot with truth/")
    parser.add_argument("--workspace", type=Path, required=True, help="its reconstruction (sfm/)")
    parser.add_argument("--gaussians", type=int, default=400_000, help="of the full scene")
    parser.add_argument("--passes", type=int, nargs=2, default=[COARSE, FINE], help="of the full scene, half and full")
    parser.add_argument("--arms", nargs="*", default=["primitive", "free"], help="of the band")
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    plot = arguments.plot
    frame, views = load_views(arguments.workspace / "sfm", plot / "images")
    dtm_file = arguments.workspace / "dtm.tif"
    dtm = read_dtm(dtm_file if dtm_file.exists() else plot / "dtm.tif", frame.crs)
    rows = [row for row in csv.DictReader(open(plot / "truth" / "trees.csv"))
            if row["in_plot"] == "True" and int(row["n_unoccluded_bh_views"]) >= 3]
    true_dbh = np.array([float(row["dbh_cm"]) for row in rows])
    xy = true_positions(rows, frame, arguments.seed)
    ground = dtm.local(frame).height
    sampling = SampleOptions(seed=arguments.seed, threads=1, samples=arguments.samples)
    record: dict = {"plot": plot.name, "stems": len(rows), "machine": platform.machine(), "version": __version__,
                    "seed": arguments.seed, "threads": 1, "arms": {}}

    def finish(name: str, found: dict[int, float], entry: dict) -> None:
        got = np.array([k in found for k in range(len(rows))])
        errors = np.array([found[k] for k in np.flatnonzero(got)]) - true_dbh[got]
        entry |= {"peak_memory_mb": peak_memory_mb(), **score(errors, true_dbh[got], len(rows)).as_dict()}
        record["arms"][name] = entry
        print(name, json.dumps(entry), flush=True)
        if arguments.output:
            write_json(arguments.output, record)

    sparse = load_points(arguments.workspace / "sfm")
    xyz = np.asarray(sparse.xyz, float)
    middle = np.median(xyz, axis=0)
    away = np.linalg.norm((xyz - middle)[:, :2], axis=1)
    near = away < 3 * np.median(away) + 10
    colours = np.asarray(sparse.rgb, float)[near] / 255
    volume = Volume(1e4, -1e3, 1e3, 0.005, 2.0)
    p = start(xyz[near], colours, arguments.gaussians, np.random.default_rng(arguments.seed))
    pixel_m = float(np.median([np.linalg.norm(v.centre - middle) / v.camera.fx for v in views]))
    p, entry = fit_full(views, p, volume, pixel_m, tuple(arguments.passes), arguments.seed)
    entry |= {"gaussians": len(p), "sparse_points": int(near.sum()),
              "cpu_h_for_30000_steps_extrapolated": round(30000 * entry["cpu_s_a_step"] / 3600, 2)}
    seeds = np.column_stack([xy, ground(xy[:, 0], xy[:, 1])])
    points = sample_volume(near_stems(p, seeds, 0.5, 3.0), views, sampling)
    finish("full", read_out(points, frame, dtm, "volume"), entry)
    for stems in arguments.arms:
        fit_with_report(views, frame, ground, xy[:1], None, GaussianOptions(threads=1, stems=stems))  # compiles
        began = time.process_time()
        options = GaussianOptions(threads=1, stems=stems, seed=arguments.seed)
        field, report = fit_with_report(views, frame, ground, xy, None, options, make_reporter("plain"))
        entry = {"cpu_s": round(time.process_time() - began, 1), "gaussians": len(field),
                 "megapixels": report.megapixels, "million_pairs": round(report.pairs / 1e6)}
        if stems == "primitive":
            finish(stems, {k: found.primitive.dbh_cm for k, found in report.primitives.items()}, entry)
        else:
            finish(stems, read_out(sample_volume(field, views, sampling), frame, dtm, "volume"), entry)
    full, arms = record["arms"]["full"], record["arms"]
    for name in arguments.arms:
        record[f"full_over_{name}"] = {what: round(full[what] / arms[name][what], 1)
                                       for what in ("cpu_s", "gaussians", "million_pairs")}
        print(name, record[f"full_over_{name}"])
    if arguments.output:
        write_json(arguments.output, record)


if __name__ == "__main__":
    main()
