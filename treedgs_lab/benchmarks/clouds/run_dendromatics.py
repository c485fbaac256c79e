"""DBH with dendromatics (GPL-3, of 3DFin), beside which ours is put: runs in an environment of its own.

    ENV/bin/python treedgs_lab/benchmarks/clouds/run_dendromatics.py CLOUD.npy OUT.json [--stem-points 1000] ...

Its steps in its order: cloth ground, heights, stripe, verticality clustering,
individualisation, sections of 5 cm every 20 cm, circle checks, tilt, locator at 1.3 m. A DBH of 0 is its "none".
"""

import dendromatics as dm
import numpy as np
from rival import run


def measure(xyz, args):
    ground = dm.generate_dtm(dm.clean_ground(xyz))
    ground = dm.complete_dtm(dm.clean_cloth(ground))
    height = dm.normalize_heights(xyz, ground)
    cloud = np.column_stack([xyz, height])
    stripe = cloud[(height > 0.7) & (height < 3.5)]
    stems = dm.verticality_clustering(
        stripe,
        scale=args.scale,
        vert_threshold=args.verticality,
        n_points=args.stem_points,
        n_iter=args.rounds,
        resolution_xy=args.voxel,
        resolution_z=args.voxel,
    )
    # Its other voxel size, 3.5 cm, is kept in proportion to the first.
    assigned, vector, _ = dm.individualize_trees(
        cloud, stems, h_range=args.height_range, resolution_xy=1.75 * args.voxel, resolution_z=1.75 * args.voxel
    )
    heights = np.arange(0.3, 6.0, 0.2)
    lower = assigned[assigned[:, 3] < 6.5]
    x, y, r, _, _, sector, _ = dm.compute_sections(
        lower,
        heights,
        section_width=args.section_width,
        n_points_section=args.section_points,
        min_n_sectors=args.least_sectors,
    )
    tilt = dm.tilt_detection(x, y, r, heights)
    dbh, place = dm.tree_locator(heights, x, y, vector, sector, r, tilt)
    return [
        {"x": float(p[0]), "y": float(p[1]), "dbh_cm": 100 * float(d[0])}
        for d, p in zip(dbh, place, strict=True)
        if d[0] > 0
    ]


if __name__ == "__main__":
    run(
        __doc__,
        "dendromatics",
        measure,
        stem_points={"type": int, "default": 1000},
        section_points={"type": int, "default": 80},
        scale={"type": float, "default": 0.1},
        verticality={"type": float, "default": 0.7},
        rounds={"type": int, "default": 2},
        height_range={"type": float, "default": 1.0},
        voxel={"type": float, "default": 0.02, "help": "resolution_xy and resolution_z of the stripe"},
        section_width={"type": float, "default": 0.05},
        least_sectors={"type": int, "default": 9},
    )
