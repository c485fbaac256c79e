"""Does fitting Gaussians and a stem primitive in one loop beat the primitive alone?

    python -m treedgs_lab.benchmarks.gaussians.joint_loop PLOT ... --output docs/results/gaussian_joint_loop.json

Cameras and ground are the renderer's; stems stand where the photo search finds them. Each found stem of the plots is
measured three ways in the photos of the second measurement: primitive and Gaussians in one loop, the primitive alone in
the same photos (two held out), and the primitive alone in all of them. Then the stems of low confidence get the second
measurement of a run, from each. Seconds are of one core.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from treedgs_geo.core.files import read_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.seeding import own_seed
from treedgs_geo.run.context import Site
from treedgs_geo.run.routes import CHAIN_PRESETS, photo_route
from treedgs_geo.run.second_measurement import stems_to_measure_again, with_second_measurements
from treedgs_geo.stems.splats.bands import Band, cut_bands
from treedgs_geo.stems.splats.held_out import hold_out
from treedgs_geo.stems.splats.joint_fit import fit_with_primitive
from treedgs_geo.stems.splats.layered_model import FitSettings, ground_textures
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.primitive.fit import PrimitiveFit, fit_primitive
from treedgs_geo.stems.splats.primitive.views import JointSettings
from treedgs_geo.stems.splats.train import FoundStem
from treedgs_geo.stems.splats.trees import trees_of_primitives
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import area_of, judged, scene_of


def _alone(band: Band, everything: bool) -> PrimitiveFit | None:
    crops = band.crops if everything else hold_out(band.crops)[0]
    ground = ground_textures(band.plane, band.around, {crop.flight for crop in band.crops})
    return fit_primitive(crops, band.plane, ground, JointSettings())


def _joint(band: Band, seed: int) -> PrimitiveFit | None:
    options = GaussianOptions()
    settings = FitSettings(options.stem_gaussians, options.stem_epochs, "cpu", seed)
    made = fit_with_primitive(
        band.crops, band.plane, band.volume, settings, band.pixel_m, band.around, JointSettings(), 0
    )
    return None if made is None else made.primitive


def measured(plot: Path) -> dict:
    """Accuracy, diameters' errors and seconds of each way on one plot."""
    frame, views, dtm = scene_of(plot)
    truth, site = TruePlot.load(plot), Site(frame, views, dtm, area_of(plot, frame))
    preset = CHAIN_PRESETS["balanced"]
    began = time.process_time()
    found = photo_route(site, preset, 1.37, Reporter())
    searched_s = time.process_time() - began
    fits = found.kept.fits
    places = np.array([fit.axis.p for fit in fits])
    inside = site.area.contains(places, 0.0)
    low = stems_to_measure_again(fits, inside)
    options = GaussianOptions(threads=1, max_views=preset.second_views)
    bands = cut_bands(views, site.ground, places, options, Reporter(), [])
    ways: dict[str, Callable[[Band, int], PrimitiveFit | None]] = {
        "in one loop": _joint,
        "alone": lambda band, _: _alone(band, False),
        "alone, all photos": lambda band, _: _alone(band, True),
    }
    accuracy, errors = judged(truth, found.trees)
    record: dict = {
        "plot": plot.name,
        "stems_found": len(fits),
        "low_confidence": len(low),
        "photo fit": {"cpu_s": round(searched_s, 1), **accuracy, "errors_cm": errors},
        "ways": {},
    }
    stems = [k for k in bands.origins if inside[k]]
    made: dict[str, dict[int, FoundStem]] = {name: {} for name in ways}
    seconds = dict.fromkeys(ways, 0.0)
    for k in stems:
        band, seed = bands.band(k), own_seed(0, bands.origins[k]) % 2**31
        if band is None:
            continue
        for name, way in ways.items():
            began = time.process_time()
            primitive = way(band, seed)
            seconds[name] += time.process_time() - began
            if primitive is not None:
                made[name][k] = FoundStem(bands.origins[k], primitive)
    for name, primitives in made.items():
        accuracy, errors = judged(truth, trees_of_primitives(primitives, frame, 1.37))
        again = {k: stem for k, stem in primitives.items() if k in low}
        trees, counts = with_second_measurements(found.trees, fits, again, 1.37)
        second, second_errors = judged(truth, trees)
        record["ways"][name] = {
            "cpu_s": round(seconds[name], 1),
            **accuracy,
            "dbh_cm": {k: round(stem.primitive.dbh_cm, 3) for k, stem in primitives.items()},
            "errors_cm": errors,
            "second measurement": {**asdict(counts), **second, "errors_cm": second_errors},
        }
    common = set.intersection(*(set(way["errors_cm"]) for way in record["ways"].values()))
    record["on_common_stems"] = {
        name: {
            "stems": len(common),
            "rmse_cm": round(float(np.sqrt(np.mean([way["errors_cm"][k] ** 2 for k in common]))), 3),
            "me_cm": round(float(np.mean([way["errors_cm"][k] for k in common])), 3),
        }
        for name, way in record["ways"].items()
        if common
    }
    return record


def pooled(plots: list[dict]) -> dict:
    """Over the plots together: seconds, stems measured, within 2 cm and off by 5 cm or more, RMSE on the stems that all
    ways have within 3 cm, and the run's trees after the second measurement."""
    out: dict = {}
    for name in plots[0]["ways"]:
        ways = [plot["ways"][name] for plot in plots]
        own = np.array([e for way in ways for e in way["errors_cm"].values()])
        second = [way["second measurement"] for way in ways]
        after = np.array([e for way in second for e in way["errors_cm"].values()])
        right = np.array(
            [
                error
                for plot in plots
                for k, error in plot["ways"][name]["errors_cm"].items()
                if all(abs(way["errors_cm"].get(k, np.inf)) < 3 for way in plot["ways"].values())
            ]
        )
        out[name] = {
            "cpu_s": round(sum(way["cpu_s"] for way in ways), 1),
            "n_reference": sum(way["n_reference"] for way in ways),
            "n_measured": len(own),
            "within_2_cm": int((np.abs(own) < 2).sum()),
            "off_5_cm": int((np.abs(own) >= 5).sum()),
            "right_stems": len(right),
            "right_rmse_cm": round(float(np.sqrt(np.mean(right**2))), 3),
            "right_me_cm": round(float(np.mean(right)), 3),
            "second_measured": len(after),
            "second_rmse_cm": round(float(np.sqrt(np.mean(after**2))), 3),
            "second_gained": sum(way["gained"] for way in second),
            "second_flagged": sum(way["flagged"] for way in second),
        }
    return out


def main() -> None:
    """Measure, print and write; plots that the output file holds already are not measured again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--output", type=Path, required=True, help="JSON file")
    arguments = parser.parse_args()
    plots: list[dict] = read_json(arguments.output)["plots"] if arguments.output.exists() else []
    for plot in arguments.plots:
        if plot.name not in {known["plot"] for known in plots}:
            plots.append(measured(plot))
        write_record(arguments.output, {"pooled": pooled(plots), "plots": plots}, seeds=[0])
    print(pooled(plots))


if __name__ == "__main__":
    main()
