"""``terrain``: ground points and a terrain model from a cloud."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import CLOUD_OUTPUTS, param
from ..terrain.options import ClothSimulation


@dataclass(frozen=True, kw_only=True)
class TerrainSettings(ClothSimulation):
    """Options of ``terrain``."""

    input: Path = param(
        help="point cloud: LAS, LAZ, COPC, E57, or text with x y z per line",
        suffixes=("laz", "las", "e57", "txt", "xyz", "csv"),
    )
    output: Path = param(kind="output_file", help="terrain raster to write", suffixes=("tif", "tiff"))
    crs: str | None = param(None, kind="crs", help="CRS of a cloud that holds none: EPSG:CODE, or 'local'")
    resolution_m: float = param(0.25, help="cell size", unit="m", minimum=0.05, maximum=50)
    ground_points: Path | None = param(
        None,
        kind="output_file",
        suffixes=CLOUD_OUTPUTS,
        help="also write the cloud, ground points as class 2 and heights above ground",
    )
    use_classes: bool = param(False, help="trust the file's class 2 instead of finding the ground")


COMMAND = Command(
    name="terrain",
    title="Terrain model from a point cloud",
    group="5 Steps and research",
    summary="Find the ground in a point cloud and write a terrain model (DTM).",
    help=(
        "A cloth is draped over the lowest points (cloth simulation filter), low plants are removed by a robust "
        "surface, and the ground is gridded by local planes. The GeoTIFF holds the ground height (band 1, metres, in "
        "the cloud's vertical datum) and the distance to the nearest ground point (band 2): read band 2 before you "
        "trust band 1. Cells farther than 10 m from ground are nodata."
    ),
    settings=TerrainSettings,
    run=run_by("run.cloud_steps", "run_terrain"),
    main=("input", "output", "crs", "resolution_m", "ground_points", "use_classes"),
    example="treedgs terrain --input flight/lidar/flight_uls.laz --output dtm.tif --resolution-m 0.25",
    outputs={
        "output": "terrain raster",
        "n_points": "points used",
        "n_ground": "ground points among them",
        "covered_pct": "share of the extent with a ground height, %",
        "support_p95_m": "distance to the nearest ground point that 95 % of the cells stay under, m",
        "ground_points": "classified cloud",
    },
)
