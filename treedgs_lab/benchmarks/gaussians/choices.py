"""What each choice of the free Gaussians gains: controller, density control, colour degree, filters, fog.

    python -m treedgs_lab.benchmarks.gaussians.choices --plot DIR [--workspace WS] [--only fixed rlgs ...]
        [--output FILE.json]

The same stems, positions and seed for every row: diameters (points spread over the volume, cone of opacities), held-out
photos and CPU seconds of the fits. Positions are true ones + 10 cm; poses are the true ones without ``--workspace``.
Spherical harmonics of degree 1 live in this file: they would move to the library if they paid.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from unittest import mock

import numpy as np

from treedgs_geo.inventory.accuracy.scores import score
from treedgs_geo.stems.splats.field import COLOUR
from treedgs_geo.stems.splats.opacity_samples import sample_volume
from treedgs_geo.stems.splats.options import GaussianOptions, SampleOptions
from treedgs_geo.stems.splats.splat_fit import band_fit
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_lab.benchmarks.gaussians.route import read_out
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import CLEAR_VIEWS, noisy_places, scene_of, truth_rows

CHOICES: dict[str, dict] = {
    "fixed": {},
    "rlgs": {"controller": "rlgs"},
    "split": {"density": "split"},
    "rlgs, split": {"controller": "rlgs", "density": "split"},
    "degree 1": {},
    "3D filter": {"smoothing_px": 0.447},
    "no fog price": {"fog": 0.0},
    "half the price": {"fog": 0.035},
    "no SSIM": {"ssim": 0.0},
    "no mask": {"mask_foliage": False},
    "half the Gaussians": {"gaussians": 500},
    "twice the Gaussians": {"gaussians": 2000},
    "twice the passes": {"coarse_epochs": 16, "fine_epochs": 12},
}


class ViewColours(band_fit.BandModel):
    """Colours of spherical-harmonic degree 1: three more numbers a channel, linear in the viewing direction."""

    def __init__(self, *arguments) -> None:
        super().__init__(*arguments)
        shape = len(self.parameters), 3, 3
        self.bands, self._first, self._second, self._steps = np.zeros(shape), np.zeros(shape), np.zeros(shape), 0

    def _directions(self) -> np.ndarray:
        ray = self.parameters[:, :3] - self._camera.centre
        return ray / np.linalg.norm(ray, axis=1, keepdims=True)

    def _drawn(self) -> np.ndarray:
        drawn = super()._drawn().copy()
        drawn[:, COLOUR] += np.einsum("nck,nk->nc", self.bands, self._directions())
        return drawn

    def shown(self, crop, full=False):
        """As without bands, seen from this crop."""
        self._camera = crop.camera
        return super().shown(crop, full)

    def view_gradient(self, crop, out, done):
        """As without bands; takes a step of the bands, at a twentieth of the base colour's rate, as published."""
        own = np.zeros_like(out)
        loss = super().view_gradient(crop, own, done)
        out += own
        g = own[:, COLOUR, None] * self._directions()[:, None, :]
        self._steps += 1
        self._first = 0.9 * self._first + 0.1 * g
        self._second = 0.99 * self._second + 0.01 * g * g
        size = np.sqrt(self._second / (1 - 0.99**self._steps)) + 1e-15
        self.bands -= 0.015 / 20 * 0.25**done * self._first / (1 - 0.9**self._steps) / size
        return loss


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, help="a rendered plot with truth/")
    parser.add_argument("--workspace", type=Path, help="poses (sfm/) of this workspace instead of the true ones")
    parser.add_argument("--only", nargs="+", choices=list(CHOICES), default=list(CHOICES))
    parser.add_argument("--every", type=int, default=1, help="every so-manyth stem of the reference")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    plot = arguments.plot
    frame, views, dtm = scene_of(plot, arguments.workspace)
    rows = truth_rows(plot, CLEAR_VIEWS)[:: arguments.every]
    dbh = np.array([float(row["dbh_cm"]) for row in rows])
    xy, ground = noisy_places(rows, frame, arguments.seed), dtm.local(frame).height
    record: dict = {
        "plot": plot.name,
        "poses": "workspace" if arguments.workspace else "true",
        "stems": len(rows),
        "threads": 1,
        "rows": {},
    }
    fit_with_report(views, frame, ground, xy[:1], None, GaussianOptions(threads=1, stems="free"))  # compiles
    for name in arguments.only:
        options = GaussianOptions(threads=1, stems="free", seed=arguments.seed, **CHOICES[name])
        began = time.process_time()
        with mock.patch.object(band_fit, "BandModel", ViewColours if name == "degree 1" else band_fit.BandModel):
            field, report = fit_with_report(views, frame, ground, xy, None, options)
        seconds = time.process_time() - began
        found = read_out(
            sample_volume(field, views, SampleOptions(seed=arguments.seed, threads=1)), frame, dtm, "volume"
        )
        got = np.array([k in found for k in range(len(rows))])
        errors = np.array([found[int(k)] for k in np.flatnonzero(got)]) - dbh[got]
        held = [stem["held_out"] for stem in report.stems if stem["held_out"]]
        accuracy = score(errors, dbh[got], len(rows))
        row = record["rows"][name] = {
            "options": CHOICES[name],
            "cpu_s": round(seconds, 1),
            "gaussians": len(field),
            "passes": round(float(np.mean([stem["epochs"] for stem in report.stems])), 1),
            "stopped": sorted({stem["stopped"] for stem in report.stems}),
            "held_out": {key: round(float(np.mean([one[key] for one in held])), 4) for key in held[0]},
            **accuracy.as_dict(),
        }
        print(
            f"{name:20} {accuracy.n_measured} of {len(rows)}, RMSE {accuracy.rmse_cm:.2f}, bias "
            f"{accuracy.me_cm:+.2f}, worst {accuracy.max_abs_cm:.1f} cm, PSNR {row['held_out']['psnr_db']:.2f} dB, "
            f"SSIM {row['held_out']['ssim']:.3f}, {row['passes']} passes, {len(field)} Gaussians, {seconds:.0f} s",
            flush=True,
        )
        write_record(arguments.output, record, seeds=[arguments.seed])


if __name__ == "__main__":
    main()
