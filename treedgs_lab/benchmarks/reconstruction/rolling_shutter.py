"""What does a rolling shutter cost in diameter, taken into account and not?

    python -m treedgs_lab.benchmarks.reconstruction.rolling_shutter --plots DIR [DIR ...] --work WORK [--output FILE]

Each plot (photos of a drone that flies while its sensor is read, with truth) is reconstructed twice: as it is done, and
with a calibration file that says all rows are exposed at once (its lens stays as free as metadata leave it). Then as
``accuracy.py``: cameras, focal length, and diameters minus those of the same fit in the true cameras.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path
from typing import Any

from treedgs_geo.core.files import read_json, write_json
from treedgs_lab.benchmarking.blocks import camera_errors, scale_error
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.reconstruction.accuracy import SEED, of_stems, reconstructed
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.verbs import photo_inputs

#: Standard deviation of a readout time that is to stay as it is, seconds.
_HELD_S = 1e-7
_REPORTED = ("photos", "registered", "readout_s", "readout_sd_s", "readout_source", "focal_sd_px", "scale_sd")


def figures_of(plot: Path, work: Path, inputs: list) -> dict[str, Any]:
    """Reconstruct in ``work`` and score; ``exit_code`` alone where that ended with a refusal."""
    try:
        report = reconstructed(plot, work, inputs)
    except subprocess.CalledProcessError as problem:
        return {"exit_code": problem.returncode}
    workspace, truth = work / plot.name, TruePlot.load(plot)
    found = {name: report[name] for name in (*_REPORTED, "reprojection_rms_px")}
    sfm = workspace / "sfm"
    return found | {"scale_error": scale_error(truth, sfm)} | camera_errors(truth, sfm) | of_stems(plot, workspace)


def still_camera(camera: Path, target: Path) -> Path:
    """The nominal camera of ``camera.json`` with all rows exposed at once, and everything else as unsure as it is
    without a file.
    """
    record = {name: value for name, value in read_json(camera).items() if not name.endswith("_sd")}
    target.parent.mkdir(parents=True, exist_ok=True)
    write_json(target, record | {"readout_s": 0.0, "readout_s_sd": _HELD_S})
    return target


def main() -> None:
    """Reconstruct, score, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="+", required=True)
    parser.add_argument("--work", type=Path, required=True, help="for the workspaces; what is there is scored as it is")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    figures: dict[str, Any] = {}
    for plot in args.plots:
        inputs, modelled = photo_inputs(plot), args.work / "modelled"
        figures[plot.name] = {"modelled": figures_of(plot, modelled, inputs)}
        held = still_camera(modelled / plot.name / "sfm" / "camera.json", args.work / f"{plot.name}.json")
        ignored = figures_of(plot, args.work / "ignored", [*inputs, "--calibration", held])
        figures[plot.name]["ignored"] = ignored
        print(json.dumps({plot.name: figures[plot.name]}, indent=1), flush=True)
        write_record(args.output, figures, seeds=[SEED])


if __name__ == "__main__":
    main()
