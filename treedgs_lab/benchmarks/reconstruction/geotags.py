"""How true the camera centres are: MRK + ``.pos`` against the photos' own EXIF, on rendered plots with truth.

``python -m treedgs_lab.benchmarks.reconstruction.geotags --plots shared/data/plot_a shared/data/plot_e
--rinex shared/data/ppk_matrtklib/static --output docs/results/geotags.json``

``--rinex``: the folder of the static RINEX set, its known point through ``rnx2rtkp``. The truth is used for scoring
alone.
"""

from __future__ import annotations

import argparse
import csv
import json
import tempfile
from pathlib import Path

import numpy as np
import pyproj

from treedgs_geo.core.crs import lonlat_to_project
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.ppk import solve
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_lab.benchmarks.records import write_record


def _rms(error: np.ndarray) -> dict:
    if not len(error):
        return {"photos": 0}
    horizontal = np.hypot(error[:, 0], error[:, 1])
    return {
        "photos": len(error),
        "rms_e_n_u_cm": np.round(100 * np.sqrt(np.mean(error**2, axis=0)), 2).tolist(),
        "rms_horizontal_cm": round(float(100 * np.sqrt(np.mean(horizontal**2))), 2),
        "max_horizontal_cm": round(float(100 * horizontal.max()), 2),
        "bias_e_n_u_cm": np.round(100 * error.mean(axis=0), 2).tolist(),
    }


def score(plot: Path, crs: str) -> dict:
    """Errors of one plot's stations by quality, and of the raw EXIF positions beside them."""
    with open(plot / "truth" / "cameras.csv", newline="", encoding="utf-8") as stream:
        truth = {row["image"]: row for row in csv.DictReader(stream)}
    found = read_stations(plot / "images", plot, crs, check_photos=False)
    raw = read_stations(plot / "images", None, crs, check_photos=False)
    true = np.array([[float(truth[name][key]) for key in "ENh"] for name in found.names])
    spoilt = np.array([truth[name]["ppk_float"] == "1" for name in found.names])
    quality = np.array(found.quality)
    error = found.xyz - true
    # A standard deviation is honest when errors over it spread by about one.
    ratio = (error / found.sd)[quality == "fix"]
    return {
        "fix": _rms(error[quality == "fix"]),
        "float": _rms(error[quality == "float"]),
        "all": _rms(error),
        "raw_exif": _rms(raw.xyz - true),
        "float_epochs_in_truth": int(spoilt.sum()),
        "of_them_flagged": int((spoilt & (quality != "fix")).sum()),
        "error_over_sd_e_n_u_fix": np.round(np.sqrt(np.mean(ratio**2, axis=0)), 2).tolist(),
    }


def rinex(folder: Path) -> dict:
    """The static set's known point, solved as a moving rover."""
    crs = pyproj.CRS.from_epsg(32653)
    with tempfile.TemporaryDirectory() as scratch:
        track = read_pos(
            solve(
                [folder / name for name in ("rover.obs", "base.obs", "base.nav")],
                None,
                "35.134707705, 136.977577939, 104.85",
                Path(scratch),
                Reporter(),
            )
        )
    true = lonlat_to_project(crs, *np.array([[136.97757549], [35.13469901], [104.8626]]))
    error = lonlat_to_project(crs, track.lon_deg, track.lat_deg, track.height_m) - true
    return _rms(error) | {"fixed_pct": round(100 * float((track.quality == 1).mean()), 1)}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="+", required=True)
    parser.add_argument("--rinex", type=Path)
    parser.add_argument("--crs", default="EPSG:6344")
    parser.add_argument("--output", type=Path)
    known = parser.parse_args()
    report: dict = {plot.name: score(plot, known.crs) for plot in known.plots}
    if known.rinex:
        report["rinex_static"] = rinex(known.rinex)
    print(json.dumps(report, indent=1))
    write_record(known.output, report)


if __name__ == "__main__":
    main()
