"""Pairs of photos on both sides of a moved sun: which SIFT registers, and which a matcher plug-in beside it.

    python -m benchmarks.reconstruction.moved_sun --plot ../shared/data/plot_e --matcher examples/sun_matcher.py \
        --matcher-weights WEIGHTS --work WORK --pairs 60 --output moved_sun.json

The pairs are those that ``reconstruct`` would match at its full level and whose photos are of different flights; of
them the ones that look along the most similar axes. A pair is registered when its matches are verified as
``reconstruct`` does, and right when nine in ten of them lie within 4 px of the true epipolar lines (``truth/``, for
scoring alone).
"""

from __future__ import annotations

import argparse
import shutil
import time
from functools import lru_cache
from pathlib import Path

import numpy as np

from benchmarks.records import write_record
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags.reading import read_stations
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.features import FeatureStore
from treedgs_geo.reconstruction.images import load_image
from treedgs_geo.reconstruction.matchers import import_matches, load_matcher, plugin_of
from treedgs_geo.reconstruction.matching import match_pairs
from treedgs_geo.reconstruction.matching_strategy import extract_features
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.pairs import select_pairs
from treedgs_geo.reconstruction.prior_knowledge import survey_of
from treedgs_lab.benchmarking.plot import TruePlot

NEAR_PX, RIGHT_SHARE, SEED = 4.0, 0.9, 1


def off_lines_px(one: View, two: View, here: np.ndarray, there: np.ndarray) -> np.ndarray:
    """(K,) Sampson distance, pixels, of matches (K, 2) and (K, 2) from the true epipolar lines."""
    rotation = two.rotation @ one.rotation.T
    along = two.rotation @ (one.centre - two.centre)
    cross = np.array([[0, -along[2], along[1]], [along[2], 0, -along[0]], [-along[1], along[0], 0]])
    essential = cross @ rotation
    rays = [
        np.column_stack([*view.camera.undistort(*pixels.T), np.ones(len(pixels))])
        for view, pixels in ((one, here), (two, there))
    ]
    forward, backward = rays[0] @ essential.T, rays[1] @ essential
    scale = np.sqrt((forward[:, :2] ** 2).sum(axis=1) + (backward[:, :2] ** 2).sum(axis=1))
    return np.abs(np.einsum("ij,ij->i", rays[1], forward)) / scale * one.camera.fx


def judged(store: FeatureStore, views: list[View], pairs: np.ndarray) -> dict:
    """Registered and right pairs, and their matches."""
    counts, right = [], 0
    for i, j in pairs.tolist():
        rows = store.matches.get((i, j))
        if rows is None or not len(rows):
            continue
        off = off_lines_px(views[i], views[j], store.keypoints[i][rows[:, 0]], store.keypoints[j][rows[:, 1]])
        right += bool((off < NEAR_PX).mean() >= RIGHT_SHARE)
        counts.append(len(rows))
    return {
        "pairs": len(pairs),
        "registered": len(counts),
        "right": right,
        "matches_median": float(np.median(counts)) if counts else 0.0,
    }


def main() -> int:
    """Match with and without, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--matcher", type=Path, required=True)
    parser.add_argument("--matcher-weights", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    plugin = plugin_of(args.matcher, args.matcher_weights)
    assert plugin is not None
    truth = TruePlot.load(args.plot)
    stations = read_stations(args.plot / "images", args.plot, truth.frame.crs.to_string())
    options, survey = ReconstructOptions(threads=1), survey_of(stations, None, None)
    by_name = {Path(view.name).name: view for view in truth.views()}
    views = [by_name[Path(name).name] for name in stations.names]
    camera = survey.calibration.camera
    half_field = 0.5 * max(camera.width, camera.height) / survey.calibration.focal_px
    pairs = select_pairs(survey.known.xyz, survey.rotations, survey.ground, half_field, options.neighbours)
    flight = np.asarray(stations.flight)
    pairs = pairs[flight[pairs[:, 0]] != flight[pairs[:, 1]]]
    alike = [-(views[i].rotation[2] @ views[j].rotation[2]) for i, j in pairs.tolist()]
    pairs = pairs[np.argsort(alike, kind="stable")[: args.pairs]]
    args.work.mkdir(parents=True, exist_ok=True)
    database, learned = args.work / "features.db", args.work / "learned.db"
    extract_features(database, args.work, stations, survey.calibration, options, 1, Reporter())
    match_pairs(database, args.work, stations.names, pairs, 1, SEED, Reporter())
    found = {"sift": judged(FeatureStore.read(database, stations.names), views, pairs)}
    print("sift", found["sift"], flush=True)
    paths = dict(zip(stations.names, stations.paths, strict=True))
    photo = lru_cache(maxsize=24)(lambda name: load_image(paths[name]))
    names = [(stations.names[i], stations.names[j]) for i, j in sorted(pairs.tolist())]
    began = time.process_time()
    shutil.copyfile(database, learned)
    report = import_matches(learned, names, photo, load_matcher(plugin), keep=True)
    seconds = time.process_time() - began
    found["with the plug-in"] = judged(FeatureStore.read(learned, stations.names), views, pairs)
    found["with the plug-in"]["added"] = report.added
    found["with the plug-in"]["cpu_s_a_pair"] = round(seconds / len(pairs), 2)
    print("with the plug-in", found["with the plug-in"], flush=True)
    write_record(args.output, {"plot": args.plot.name, **found}, seeds=[SEED])
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
