"""``pointcloud-to-dbh``: ground, stems and DBH of a LAS/LAZ cloud in one go."""

from __future__ import annotations

from typing import Any

from ..core.calibration import CALIBRATION, TAPE
from ..core.command import Command
from ..core.progress import Reporter
from ..run.settings import PointcloudToDbhSettings


def run(settings: PointcloudToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Run the chain, or only check its inputs."""
    from ..run.cloud import check_cloud, run_cloud_chain

    return (check_cloud if settings.dry_run else run_cloud_chain)(settings, reporter)


COMMAND = Command(
    name="pointcloud-to-dbh",
    title="Measure DBH from a point cloud",
    group="2 Measure",
    summary="From a LiDAR cloud (drone or terrestrial) or surface points to tree points with DBH.",
    help=(
        "Finds the ground (or takes your DTM), finds the stems in the band from 0.5 to 5 m, measures each at breast "
        "height and writes the tree layer: DBH, standard error and 90 % interval in cm, lean, height where the cloud "
        "reaches the crowns, and for every stem that cannot be measured the reason. Needs about 100 points on the "
        "lower 3 m of a stem (drone LiDAR above 1,000 points/m2, or a terrestrial scan). The CRS comes from the file; "
        f"give --crs where it has none ('local' for a scan without a place on the map). {CALIBRATION} {TAPE}"
    ),
    settings=PointcloudToDbhSettings,
    run=run,
    main=("input", "plots", "dtm", "crs", "dry_run", "output", "report"),
    example="treedgs pointcloud-to-dbh --input flight/lidar/flight_uls.laz --output lidar_trees.gpkg",
    outputs={
        "output": "tree layer",
        "report": "the page to open",
        "n_trees": "stems in the layer",
        "n_measured": "stems with a DBH",
        "n_ok": "without remark",
        "n_check": "to check",
        "n_reject": "refused",
        "mean_dbh_cm": "mean DBH, cm",
        "n_points": "points (dry run)",
        "density_pts_m2": "points a square metre (dry run)",
        "predicted_s": "estimated time, s (dry run)",
        "needed_memory_gb": "estimated memory, GB (dry run)",
        "needed_disk_gb": "estimated disk, GB (dry run)",
        "status": "verdict (dry run)",
    },
)
