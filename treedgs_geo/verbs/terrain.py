"""``terrain``: ground points and a terrain model from a cloud."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.files import ensure_writable
from ..core.progress import Reporter
from ..core.settings import param
from ..core.shown import count_of
from ..run.cloud_input import read_checked
from ..terrain.options import ClothSimulation

#: Points a square metre from which ground has to stand out somewhere; most airborne clouds have fewer.
DENSE_M2 = 20.0


@dataclass(frozen=True, kw_only=True)
class TerrainSettings(ClothSimulation):
    """Options of ``terrain``."""

    input: Path = param(
        kind="file",
        help="point cloud: LAS, LAZ, COPC, E57, or text with x y z per line",
        suffixes=("laz", "las", "e57", "txt", "xyz", "csv"),
    )
    output: Path = param(kind="output_file", help="terrain raster to write", suffixes=("tif", "tiff"))
    crs: str | None = param(None, kind="crs", help="CRS of a cloud that holds none: EPSG:CODE, or 'local'")
    resolution_m: float = param(0.25, help="cell size", unit="m", minimum=0.05, maximum=50)
    ground_points: Path | None = param(
        None,
        kind="output_file",
        suffixes=("laz", "las"),
        help="also write the cloud, ground points as class 2 and heights above ground",
    )
    use_classes: bool = param(False, help="trust the file's class 2 instead of finding the ground")


def run(settings: TerrainSettings, reporter: Reporter) -> dict[str, Any]:
    """Classify, grid, write: a cloud that fits in memory as a whole, a larger one tile by tile."""
    import tempfile

    import numpy as np

    from ..core.errors import InputError
    from ..pointcloud.files import check_cloud_output
    from ..pointcloud.stream import copy_cloud
    from ..pointcloud.tiles import is_large, sort_into_tiles
    from ..terrain.dtm import write_dtm
    from ..terrain.streamed import dtm_from_tiles

    ensure_writable(settings.output)
    if settings.ground_points is not None:
        check_cloud_output(settings.ground_points)
    if not is_large(settings.input):
        return _run_whole(settings, reporter)
    with tempfile.TemporaryDirectory(dir=settings.output.parent, prefix=".tiles.") as name:
        folder = Path(name)
        with reporter.stage("read cloud", 0.0, 0.3):
            store = sort_into_tiles(
                settings.input, folder, settings.crs, ("classification",), reporter, find_stems=False
            )
            if settings.use_classes and "classification" not in store.extras:
                raise InputError(f"{settings.input}: has no ground class (2), expected by --use-classes; leave it out.")
        n_tiles = count_of(len(store.tiles), "tile")
        reporter.info(f"{store.n_points:,} usable points in {n_tiles} of {store.side_m:g} m.")
        with reporter.stage("terrain", 0.3, 0.75):
            dtm = dtm_from_tiles(
                store,
                folder,
                settings.resolution_m,
                settings,
                store.crs,
                use_classes=settings.use_classes,
                reporter=reporter,
            )
        tally = np.zeros(2, int)
        with reporter.stage("write", 0.75, 1.0):
            if settings.ground_points is not None:

                def classify(xyz: np.ndarray, read: Any) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
                    near = store.near(xyz)
                    height = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
                    ground = np.abs(height) <= settings.ground_m
                    tally[:] += len(xyz) if near is None else int(near.sum()), int(ground.sum())
                    reporter.progress(min(tally[0] / max(store.n_points, 1), 1.0))
                    return near, {
                        "classification": _classes(read("classification"), ground),
                        "height_m": height.astype(np.float32),
                    }

                copy_cloud(settings.input, settings.ground_points, classify, {"height_m": "float32"}, store.crs)
            else:
                for tile in store.tiles:
                    xyz, _ = store.read(tile)
                    height = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
                    tally += len(xyz), int((np.abs(height) <= settings.ground_m).sum())
            write_dtm(settings.output, dtm)
        return _summary(settings, reporter, dtm, int(tally[0]), int(tally[1]))


def _run_whole(settings: TerrainSettings, reporter: Reporter) -> dict[str, Any]:
    import numpy as np

    from ..core.errors import InputError
    from ..pointcloud.cloud import usable
    from ..pointcloud.files import write_cloud
    from ..terrain.dtm import write_dtm
    from ..terrain.ground import dtm_from_cloud, height_above_ground

    with reporter.stage("read cloud", 0.0, 0.3):
        cloud = read_checked(settings.input, settings.crs, reporter, find_stems=False, all_points=True)
        good = usable(cloud)
    known = None
    if settings.use_classes:
        if "classification" not in cloud.attributes or not (cloud.attributes["classification"] == 2).any():
            raise InputError(f"{settings.input}: has no ground class (2), expected by --use-classes; leave it out.")
        known = cloud.attributes["classification"][good] == 2
    with reporter.stage("terrain", 0.3, 0.8):
        dtm = dtm_from_cloud(cloud.xyz[good], settings.resolution_m, settings, cloud.crs, ground=known)
    height = height_above_ground(cloud.xyz, dtm)
    ground = np.abs(height) <= settings.ground_m
    if known is None:
        _warn_of_no_ground(settings, cloud.xyz[good], dtm, reporter)
    with reporter.stage("write", 0.8, 1.0):
        if settings.ground_points is not None:
            classes = _classes(cloud.attributes.get("classification", np.zeros(len(cloud), np.uint8)), ground)
            write_cloud(
                settings.ground_points,
                cloud.with_attribute("classification", classes).with_attribute("height_m", height.astype(np.float32)),
            )
        write_dtm(settings.output, dtm)
    return _summary(settings, reporter, dtm, len(cloud), int(ground.sum()))


def _warn_of_no_ground(settings: TerrainSettings, xyz: Any, dtm: Any, reporter: Reporter) -> None:
    """A dense cloud in which no ground stands out has lost it: the model runs through the feet of what is left."""
    from ..terrain.credibility import GroundLayer

    layer = GroundLayer.of(xyz, dtm)
    if len(xyz) > DENSE_M2 * layer.area_m2 and not layer.seen(layer.places()).any():
        reporter.warn(
            f"{settings.input}: shows no ground surface (its lowest metres may have been clipped or filtered out): the "
            "terrain model runs through the lowest points that are left, do not measure heights or diameters above it."
        )


def _classes(before: Any, ground: Any) -> Any:
    """The file's classes with our ground as class 2; noise stays noise, former ground becomes unclassified."""
    import numpy as np

    classes = np.array(before, np.uint8)
    noise = np.isin(classes, (7, 18))
    classes[classes == 2] = 1
    classes[ground & ~noise] = 2
    return classes


def _summary(settings: TerrainSettings, reporter: Reporter, dtm: Any, n_points: int, n_ground: int) -> dict[str, Any]:
    import numpy as np

    from ..inventory.tree_layer import style_raster

    style_raster(settings.output)
    covered = float(np.isfinite(dtm.heights).mean())
    support = float(np.nanpercentile(dtm.support, 95)) if dtm.support is not None else None
    reporter.info(
        f"{100 * n_ground / max(n_points, 1):.0f} % of the points are ground; the model covers "
        f"{100 * covered:.0f} % of the extent; 95 % of it lies within {support:.1f} m of a ground point."
    )
    return {
        "output": str(settings.output),
        "n_points": n_points,
        "n_ground": n_ground,
        "covered_pct": round(100 * covered, 1),
        "support_p95_m": round(support, 2) if support is not None else None,
        "ground_points": str(settings.ground_points) if settings.ground_points else None,
    }


COMMAND = Command(
    name="terrain",
    qgis_id="terrain",
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
    run=run,
    main=("input", "output", "crs", "resolution_m", "ground_points", "use_classes"),
    example="treedgs terrain --input plot.laz --output dtm.tif --resolution-m 0.25",
    outputs={
        "output": "terrain raster",
        "n_points": "points read",
        "n_ground": "ground points",
        "covered_pct": "share of the extent with a ground height, %",
        "support_p95_m": "distance to the nearest ground point that 95 % of the cells stay under, m",
        "ground_points": "classified cloud",
    },
)
