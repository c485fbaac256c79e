"""``photos-to-dbh``: the whole chain, from drone photos to tree points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import param


@dataclass(frozen=True, kw_only=True)
class PhotosToDbhSettings:
    """Parameters of the whole chain."""

    photos: Path = param(kind="folder", help="Folder with the original drone photos (JPEG) of one plot or block.")
    geotags: Path | None = param(
        None,
        kind="files",
        help="Folder or file with MRK and RTKLIB .pos (PPK), or a CSV; without it EXIF/XMP positions are used.",
    )
    dtm: Path | None = param(
        None,
        kind="file",
        help="Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is found in the photos.",
        suffixes=(".tif", ".tiff"),
    )
    crs: str = param(kind="crs", help="Project CRS, projected and in metres, for example EPSG:6344.")
    plots: Path | None = param(
        None,
        kind="file",
        help="CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); without it all that photos see well.",
        suffixes=(".csv",),
    )
    preset: str = param(
        "balanced",
        kind="choice",
        help="How much is modelled: fast and best differ in photos and features used; paper = the published method.",
        choices=("fast", "balanced", "best", "paper"),
    )
    fit: str = param(
        "auto",
        kind="choice",
        help="photos = stems fitted straight to the photos; gaussians = stem primitives among Gaussians; "
        "paper = splats with the published constants; auto = photos, then stems left in doubt asked again among "
        "Gaussians.",
        choices=("auto", "photos", "gaussians", "paper"),
    )
    bh_m: float = param(1.37, kind="number", help="Breast height above ground.", unit="m", minimum=0.5, maximum=2.5)
    seed: int = param(0, kind="integer", help="Seed of every random choice.", minimum=0, advanced=True)
    dry_run: bool = param(
        False,
        kind="flag",
        help="Only check inputs, overlap, fixed positions, memory and disk, and foretell the time; writes nothing.",
    )
    workspace: Path = param(kind="output_folder", help="Folder for intermediate results; a second run resumes there.")
    output: Path = param(
        kind="output_file",
        help="Tree layer to write (.gpkg, .shp, .geojson or .csv).",
        suffixes=(".gpkg", ".shp", ".geojson", ".csv"),
    )


def photos_to_dbh(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Run the chain; finished stages of the same inputs and settings are kept."""
    if settings.dry_run:
        from ..chain.preflight import check_photos

        return check_photos(settings, reporter)
    from ..chain.photos import run_chain
    from ..chain.preflight import tell_kept

    tell_kept(settings.workspace, reporter)
    return run_chain(settings, reporter)


COMMAND = Command(
    name="photos-to-dbh",
    qgis_id="photostodbh",
    title="Measure DBH from drone photos",
    group="Measure trees",
    summary="Drone photos (and PPK geotags) in, tree points with DBH, error and reasons out.",
    help=(
        "Inputs: overlapping drone photos taken above the canopy, most of them oblique (30 to 50 degrees from "
        "straight down), at about 2 cm a pixel or finer; PPK or RTK geotags. Output: one point per stem found, with "
        "DBH (cm), its standard error and 90 % interval (cm), and a reason wherever no DBH could be measured. Stems "
        "under 7.5 cm and stems that fewer than three photos see at breast height are refused. A second run in the "
        "same workspace resumes."
    ),
    settings=PhotosToDbhSettings,
    run=photos_to_dbh,
    example=(
        "treedgs photos-to-dbh --photos flight/images --geotags flight --crs EPSG:6344 --plots plots.csv "
        "--workspace work --output trees.gpkg"
    ),
    outputs={
        "output": "tree layer (file)",
        "report": "HTML report (file)",
        "run": "run.json: parameters, versions, seconds, peak memory (file)",
        "n_trees": "stems found",
        "n_measured": "stems with a DBH",
        "n_rejected": "stems without one, each with a reason",
        "mean_dbh_cm": "mean DBH of the measured stems, cm",
        "n_photos": "photos that can be used (dry run)",
        "fix_pct": "photos with a fixed position, % (dry run)",
        "overlap_pct": "ground that neighbouring photos share, % (dry run)",
        "n_tiles": "tiles that are searched for stems (dry run)",
        "predicted_s": "foretold time, s (dry run)",
        "needed_memory_gb": "foretold memory, GB (dry run)",
        "needed_disk_gb": "foretold disk, GB (dry run)",
        "status": "what came out, in one sentence",
    },
)
