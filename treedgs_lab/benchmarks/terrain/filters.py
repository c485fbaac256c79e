"""Ground filters side by side: ours, the packages that have the same cloth, and morphology (SMRF).

    python -m treedgs_lab.benchmarks.terrain.filters --data ../shared/data --output docs/results/ground_filters.json

Everything around the filter is the same: the lowest points before it, the robust surface after it, the grid. Rendered
plots are scored against their true terrain and stems; airborne clouds against a grid of the points that their makers
classified as ground; terrestrial clouds, which have no truth, by their stems alone. ``kept_differ``: points that the
filter judges otherwise than the first of the list. ``repeat_differ``: and otherwise than itself, when run again.
The packages are measured where they are installed (``cloth-simulation-filter``, ``csf-3dfin``), else left out.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import numpy as np
from scipy import ndimage

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.terrain import cloth, ground
from treedgs_geo.terrain.cloud_ground import CloudGround
from treedgs_geo.terrain.dtm import read_dtm
from treedgs_geo.terrain.options import ClothSimulation
from treedgs_lab.benchmarks.clouds.accuracy import score as score_stems
from treedgs_lab.benchmarks.clouds.accuracy import truth_of
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.terrain.accuracy import cover_kinds, score

Filter = Callable[[np.ndarray, ClothSimulation], np.ndarray]
PLOTS = ("plot_a", "plot_e", "plot_h")
AIRBORNE = (
    "als_chablais3/las_chablais3.laz",
    "als_lasr_bcts/bcts_1.laz",
    "als_lidr/Topography.laz",
    "lidar_spanner/ALS_Clip.laz",
    "lidar_spanner/UAS_Clip.laz",
)
TERRESTRIAL = ("lidar_treels/pine_plot.laz", "lidar_treeiso/LPine1_demo.laz", "lidar_treels/pine.laz")
#: Airborne clouds are cut to this much, metres.
SIDE_M = 80.0


def csf(points: np.ndarray, method: ClothSimulation) -> np.ndarray:
    """``cloth-simulation-filter``, by the authors of the method."""
    import CSF

    run = CSF.CSF()
    run.params.bSloopSmooth = True
    run.params.cloth_resolution, run.params.rigidness = method.cloth_m, method.rigidness
    run.params.class_threshold, run.params.interations = method.threshold_m, method.rounds
    run.params.time_step = 0.65
    run.setPointCloud(np.ascontiguousarray(points))
    found, other = CSF.VecInt(), CSF.VecInt()
    with _quiet_stdout():
        run.do_filtering(found, other, False)
    return _marked(points, np.asarray(found, dtype=int))


def csf_3dfin(points: np.ndarray, method: ClothSimulation) -> np.ndarray:
    """``csf-3dfin``, the same revised."""
    import CSF_3DFin

    run = CSF_3DFin.CSF()
    run.params.smooth_slope, run.params.verbose = True, False
    run.params.cloth_resolution, run.params.rigidness = method.cloth_m, method.rigidness
    run.params.class_threshold, run.params.iterations = method.threshold_m, method.rounds
    run.params.time_step = 0.65
    run.set_point_cloud(np.ascontiguousarray(points))
    return _marked(points, np.asarray(run.classify_ground()[0], dtype=int))


def smrf(
    points: np.ndarray, method: ClothSimulation, slope: float = 0.2, window_m: float = 18.0, scale: float = 0.5
) -> np.ndarray:
    """Morphology on a grid of lowest points with windows that grow (Pingel et al. 2013), by scipy."""
    cell = max(method.cloth_m, 1.0)
    place = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / cell).astype(int)
    shape = tuple(place.max(axis=0) + 1)
    lowest = np.full(shape, np.inf)
    np.minimum.at(lowest, tuple(place.T), points[:, 2])
    empty = np.isinf(lowest)
    filled = lowest[tuple(ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True))]
    last, objects = filled, np.zeros(shape, bool)
    for radius in range(1, int(np.ceil(window_m / cell)) + 1):
        y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
        opened = ndimage.grey_opening(last, footprint=x**2 + y**2 <= radius**2, mode="nearest")
        objects |= last - opened > slope * radius * cell
        last = opened
    bare = ~objects & ~empty
    if not bare.any():
        return np.zeros(len(points), bool)
    nearest = ndimage.distance_transform_edt(~bare, return_distances=False, return_indices=True)
    surface = ndimage.gaussian_filter(lowest[tuple(nearest)], 1.0, mode="nearest")
    steep = np.hypot(*np.gradient(surface, cell)) if min(shape) > 1 else np.zeros(shape)
    at = (points[:, :2] - points[:, :2].min(axis=0)).T / cell - 0.5
    base = ndimage.map_coordinates(surface, at, order=1, mode="nearest")
    return np.abs(points[:, 2] - base) < method.threshold_m + scale * steep[tuple(place.T)]


FILTERS: dict[str, Filter] = {
    "treedgs": cloth.near_cloth,
    "cloth-simulation-filter": csf,
    "csf-3dfin": csf_3dfin,
    "smrf": smrf,
}
_IMPORTS = {"cloth-simulation-filter": "CSF", "csf-3dfin": "CSF_3DFin"}


def of_filter(cloud: PointCloud, chosen: Filter) -> tuple[CloudGround | None, dict]:
    """The ground of one cloud with one filter; how long the filter took, and whether it says the same twice."""
    method = ClothSimulation()
    took: list[float] = []
    kept: list[np.ndarray] = []

    def timed(points: np.ndarray, options: ClothSimulation) -> np.ndarray:
        began = time.perf_counter()
        kept.append(chosen(points, options))
        took.append(time.perf_counter() - began)
        return kept[-1]

    with mock.patch.object(ground, "near_cloth", timed):
        try:
            dtm = ground.dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs, method=method)
        except InputError as refusal:
            return None, {"refused": str(refusal)}
        ground.dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs, method=method)
    row = {"filter_s": round(min(took), 3), "repeat_differ": int((kept[0] != kept[1]).sum()), "kept": kept[0]}
    return CloudGround(dtm, None, dtm), row


def stems_of(cloud: PointCloud, found: CloudGround) -> list:
    """Its trees, with the default settings."""
    return measure_cloud(cloud, found.dtm)[0]


def judged(data: Path, name: str, chosen: Filter) -> dict:
    """One cloud's figures with one filter."""
    if name in PLOTS:
        plot = data / name
        cloud = read_cloud(next((plot / "lidar").glob("*.laz")), attributes=())
        truth = read_dtm(plot / "dtm.tif", cloud.crs)
        found, row = of_filter(cloud, chosen)
        if found is None:
            return row
        cells, _, under = cover_kinds(plot, truth, cloud.xyz)
        row |= {"all": score(found.dtm, truth, cells), "understory": score(found.dtm, truth, cells[under])}
        stems = score_stems(stems_of(cloud, found), *truth_of(plot))
        return row | {"stems": {key: stems[key] for key in ("n", "success_pct", "rmse_cm", "false_trees")}}
    cloud = read_cloud(data / name, crs="local", need_crs=False, attributes=("classification",))
    low = cloud.xyz[:, :2].min(axis=0)
    cloud = cloud.select((cloud.xyz[:, :2] < low + SIDE_M).all(axis=1))
    found, row = of_filter(cloud, chosen)
    if found is None:
        return row
    if name in AIRBORNE:
        marked = cloud.attributes["classification"] == 2
        model = ground.dtm_from_cloud(cloud.xyz, ground=marked)
        x, y = model.centres()
        assert model.support is not None
        near = model.support <= 1.0
        return row | {"all": score(found.dtm, model, np.column_stack([x[near], y[near]]))}
    trees = stems_of(cloud, found)
    flags = {flag: sum(tree.qc_flag == flag for tree in trees) for flag in ("ok", "check", "reject")}
    return row | {"stems": {**flags, "dbh_cm": sorted(round(tree.dbh_cm, 1) for tree in trees if tree.dbh_cm)}}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    usable = {}
    for name, chosen in FILTERS.items():
        try:
            __import__(_IMPORTS.get(name, "numpy"))
            usable[name] = chosen
        except ImportError:
            print(f"{name}: not installed, left out", file=sys.stderr)
    flat = np.column_stack([np.random.default_rng(0).uniform(0, 20, (500, 2)), np.zeros(500)])
    cloth.near_cloth(flat, ClothSimulation())  # compiled before it is timed
    clouds: dict[str, dict] = {}
    for name in (*PLOTS, *AIRBORNE, *TERRESTRIAL):
        first = None
        for key, chosen in usable.items():
            row = judged(args.data, name, chosen)
            kept = row.pop("kept", None)
            first = kept if first is None else first
            if kept is not None and first is not None:
                row |= {"low_points": len(kept), "kept": int(kept.sum()), "kept_differ": int((kept != first).sum())}
            clouds.setdefault(name, {})[key] = row
            print(name, key, row, flush=True)
    write_record(args.output, {"clouds": clouds})


def _marked(points: np.ndarray, index: np.ndarray) -> np.ndarray:
    mask = np.zeros(len(points), bool)
    mask[index] = True
    return mask


@contextmanager
def _quiet_stdout() -> Iterator[None]:
    """The package prints."""
    saved, quiet = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(quiet, 1)
        yield
    finally:
        os.dup2(saved, 1)
        os.close(saved)
        os.close(quiet)


if __name__ == "__main__":
    main()
