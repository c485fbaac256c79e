"""Clouds with their ground, and with their lowest metres cut off: what each stem can say about its ground.

``python -m treedgs_lab.benchmarks.terrain.ground_cut --data ../shared/data --output docs/results/ground_cut.json``

Each cloud (its middle ``--side`` metres) is measured whole, and cut 0.5, 1, 2 and 4 m above the ground that the whole
cloud shows; ``error_cm`` is the difference of a stem's diameter to that in the whole cloud, without any judgement of
the ground. Share and contrast are those of :mod:`treedgs_geo.terrain.credibility`, of every stem.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.stems.cloud.estimate.foot import FOOT_M, USUAL_FOOT_M, with_ground
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.cloud_ground import CloudGround, own_ground
from treedgs_lab.benchmarks.records import write_record

CLOUDS = (
    "lidar_treels/pine_plot.laz",
    "lidar_treels/pine.laz",
    "lidar_treels/spruce.laz",
    "lidar_itsme/tree_1_pc.txt",
    "lidar_itsme/tree_2_pc.txt",
    "lidar_spanner/UAS_Clip.laz",
    "lidar_treeiso/LPine1_demo.laz",
    "plot_a/lidar/plot_a_uls.laz",
    "plot_e/lidar/plot_e_uls.laz",
    "plot_h/lidar/plot_h_uls.laz",
)
CUTS_M = (0.0, 0.5, 1.0, 2.0, 4.0)


def read(path: Path, side_m: float) -> PointCloud:
    """The middle of a cloud; one without a CRS is local."""
    try:
        cloud = read_cloud(path)
    except InputError:
        cloud = read_cloud(path, crs="local")
    low, high = cloud.xyz[:, :2].min(axis=0), cloud.xyz[:, :2].max(axis=0)
    return cloud.select((np.abs(cloud.xyz[:, :2] - (low + high) / 2) <= side_m / 2).all(axis=1))


def judged(cloud: PointCloud, whole: list[Tree] | None) -> tuple[dict, list[Tree], CloudGround | None]:
    """One cloud's figures, its stems before the ground is judged, and its ground."""
    try:
        ground = own_ground(cloud.xyz, None)
    except InputError as refusal:
        return {"refused": str(refusal)}, [], None
    trees, _ = measure_cloud(cloud, ground.dtm)
    after = with_ground(trees, ground, cloud.xyz)
    xy = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    row: dict = {
        "stems": len(trees),
        "ok_before": sum(tree.qc_flag == "ok" for tree in trees),
        **{flag: sum(tree.qc_flag == flag for tree in after) for flag in ("ok", "check", "reject")},
        "no_ground": sum("no_ground" in tree.qc_reason for tree in after),
    }
    if ground.layer is not None and len(trees):
        clear = [USUAL_FOOT_M if tree.dbh_cm is None else tree.dbh_cm / 200 + FOOT_M for tree in trees]
        share, contrast, _ = ground.layer.without(xy, np.array(clear)).evidence(xy)
        row |= {"share": np.round(share, 2).tolist(), "contrast": np.round(contrast, 1).tolist()}
    error = []
    for tree in whole or []:
        away = np.hypot(*(xy - (tree.x, tree.y)).T) if len(xy) else np.array([np.inf])
        near = trees[int(away.argmin())] if away.min() < 0.3 else None
        if near is not None and near.dbh_cm is not None and tree.dbh_cm is not None:
            error.append(near.dbh_cm - tree.dbh_cm)
    if error:
        row |= {
            "error_cm": round(float(np.mean(error)), 2),
            "worst_cm": round(float(min(error, key=lambda e: -abs(e))), 2),
        }
    return row, trees, ground


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--side", type=float, default=13.0)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    rows = []
    for name in CLOUDS:
        cloud = read(args.data / name, args.side)
        first, whole, ground = judged(cloud, None)
        rows.append({"cloud": name, "cut_m": 0.0, **first})
        print(rows[-1], flush=True)
        if ground is None or not first["ok"] + first["check"]:
            continue
        height = cloud.xyz[:, 2] - ground.dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
        for cut in CUTS_M[1:]:
            rows.append({"cloud": name, "cut_m": cut, **judged(cloud.select(height > cut), whole)[0]})
            print(rows[-1], flush=True)
    write_record(args.output, {"side_m": args.side, "rows": rows})


if __name__ == "__main__":
    main()
