"""What densifying by sums of absolute gradients, too, gives the published fit of a whole plot: the same steps with and
without, photos that took no part.

    python -m treedgs_lab.benchmarks.gaussians.absolute --plot DIR --sfm DIR/arms/sfm --steps 600 \
        --output docs/results/gaussian_absolute.json

Cameras, points and ground are those of a reconstruction (``benchmarks.gaussians.arms`` leaves it in ``DIR/arms/sfm``);
the start is our stereo. Every fit has the fixed schedule, full-size photos and one seed. ``--held`` photos are left out
and predicted; only pixels whose rays meet the plot's box count.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo.core.progress import make_reporter
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.on_torch.scene_fit import fit_scene
from treedgs_geo.stems.splats.options import SceneOptions
from treedgs_geo.stems.splats.raster import Rasteriser
from treedgs_geo.stems.splats.scene_start import Box, dense_prior
from treedgs_geo.stems.splats.whole_photos import WholePhotos
from treedgs_lab.benchmarking.jobs import _scene
from treedgs_lab.benchmarks.records import write_record


def psnr_db(field: GaussianField, photos: WholePhotos, box: Box) -> float:
    """Of all photos' pixels that see the box; colours of the field as seen from all sides."""
    rasteriser, total, count = Rasteriser(), 0.0, 0
    for camera, image, inside in zip(photos.cameras, photos.images, photos.inside, strict=True):
        shown = np.moveaxis(rasteriser.forward(field.packed, camera).planes[:3], 0, 2)
        here = (inside > 0.5) & box.seen(camera)
        off = np.clip(shown, 0, 1)[here] - image[here] / 255
        total, count = total + float((off**2).sum()), count + off.size
    return float(-10 * np.log10(total / count))


def main() -> None:
    """Fit, compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--sfm", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=600)
    parser.add_argument("--held", type=int, default=3, help="photos left out, evenly over the flight")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    reporter = make_reporter("plain")
    plot, frame, views, dtm, area = _scene({"plot": str(arguments.plot), "sfm": str(arguments.sfm)})
    ground = dtm.local(frame).height
    options = SceneOptions(
        steps=arguments.steps, controller="fixed", factor=1.0, max_gaussians=200_000, seed=arguments.seed
    )
    box = Box.of(area, ground, options)
    points, colours = dense_prior(views, ground, area, box, reporter)
    left_out = {int(k) for k in np.linspace(0, len(views) - 1, arguments.held + 2)[1:-1]}
    taught = WholePhotos.load([view for k, view in enumerate(views) if k not in left_out])
    held = WholePhotos.load([views[k] for k in sorted(left_out)])
    record: dict = {
        "plot": plot.folder.name,
        "steps": arguments.steps,
        "photos": len(taught),
        "held_out": len(held),
        "prior_points": int(box.contains(points).sum()),
        "fits": {},
    }
    for name, absolute in (("plain", False), ("absolute", True)):
        began = time.process_time()
        field, report = fit_scene(taught, box, points, colours, replace(options, absolute=absolute), reporter)
        record["fits"][name] = {
            "cpu_s": round(time.process_time() - began, 1),
            "gaussians_first": report.gaussians_first,
            "gaussians": len(field),
            "counts": report.counts,
            "loss": [round(value, 4) for value in report.loss],
            "held_out_psnr_db": round(psnr_db(field, held, box), 2),
            "taught_psnr_db": round(psnr_db(field, taught, box), 2),
        }
        print(name, record["fits"][name], flush=True)
        write_record(arguments.output, record, seeds=[arguments.seed])


if __name__ == "__main__":
    main()
