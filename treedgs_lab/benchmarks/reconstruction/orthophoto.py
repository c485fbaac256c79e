"""Does the orthophoto of the ground lie where the ground is? Against the one that the true cameras and ground give.

    python -m treedgs_lab.benchmarks.reconstruction.orthophoto PLOT=WORKSPACE … [--output FILE]

PLOT: a rendered plot with ``truth/``. WORKSPACE: of ``photos-to-dbh`` on its photos. Both pictures are made here; at
places 1.5 m apart a patch of 1.2 m of the run's picture is looked for in the true one.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
import rasterio

from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.orthophoto import write_orthophoto
from treedgs_geo.run.context import Site
from treedgs_lab.benchmarks.plot import site_of
from treedgs_lab.benchmarks.records import write_record

#: Places, half the patch and how far it is looked for, metres; correlation from which on it is found.
_STEP_M, _HALF_M, _REACH_M, _FOUND = 1.5, 0.6, 0.25, 0.6
_BESIDE_M = 2.0


def picture(site: Site, path: Path) -> tuple[np.ndarray, np.ndarray, float, dict]:
    """Grey values, (2,) north-western corner, pixel in metres, and what the orthophoto of a site says and costs."""
    began = time.process_time()
    said = write_orthophoto(path, site.views, site.ground, site.frame, site.area.bounds(_BESIDE_M), Reporter())
    said["cpu_s"] = round(time.process_time() - began, 1)
    said["megabytes"] = round(path.stat().st_size / 1e6, 2)
    with rasterio.open(path) as source:
        grey = cv2.cvtColor(np.moveaxis(source.read(), 0, 2), cv2.COLOR_RGB2GRAY)
        return grey, np.array([source.transform.c, source.transform.f]), source.transform.a, said


def offsets(run: Site, truth: Site) -> tuple[np.ndarray, dict]:
    """(K, 2) metres east and north from where places are to where the run's picture has them, and its cost."""
    with tempfile.TemporaryDirectory() as folder:
        own, corner, gsd, said = picture(run, Path(folder) / "own.tif")
        true, true_corner, true_gsd, _ = picture(truth, Path(folder) / "true.tif")
    assert gsd == true_gsd
    half, reach, step = (int(length / gsd) for length in (_HALF_M, _REACH_M, _STEP_M))
    shift = np.round((corner - true_corner) / gsd).astype(int) * [1, -1]
    found, rim = [], half + reach + int(np.abs(shift).max())
    for row in range(rim, own.shape[0] - rim, step):
        for column in range(rim, own.shape[1] - rim, step):
            patch = own[row - half : row + half + 1, column - half : column + half + 1]
            x, y = column + shift[0] - half - reach, row + shift[1] - half - reach
            around = true[y : y + 2 * (half + reach) + 1, x : x + 2 * (half + reach) + 1]
            score = cv2.matchTemplate(around, patch, cv2.TM_CCOEFF_NORMED)
            i, j = np.unravel_index(int(score.argmax()), score.shape)
            if score[i, j] < _FOUND or not (0 < i < 2 * reach and 0 < j < 2 * reach):
                continue
            down, right = i + _peak(score[i - 1 : i + 2, j]), j + _peak(score[i, j - 1 : j + 2])
            place = true_corner + gsd * np.array([x + half + right, -(y + half + down)])
            found.append(corner + gsd * np.array([column, -row]) - place)
    return np.array(found), said


def _peak(three: np.ndarray) -> float:
    """Where between its neighbours the parabola through three values is highest."""
    return float((three[0] - three[2]) / (2 * (three[0] - 2 * three[1] + three[2])))


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", help="PLOT=WORKSPACE")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    results = {}
    for pair in args.runs:
        plot, _, workspace = (Path(part) for part in pair.partition("="))
        away, said = offsets(site_of(plot, workspace), site_of(plot))
        distance = 100 * np.hypot(*away.T)
        results[plot.name] = said | {
            "points": len(away),
            "rms_cm": round(float(np.sqrt((distance**2).mean())), 1),
            "max_cm": round(float(distance.max()), 1),
            "mean_e_n_cm": np.round(100 * away.mean(axis=0), 1).tolist(),
        }
        print(plot.name, json.dumps(results[plot.name]), flush=True)
    write_record(args.output, results, seeds=[0])


if __name__ == "__main__":
    main()
