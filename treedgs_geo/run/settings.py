"""Settings of both chains, and what the presets of the photo chain are (standard library only: commands show them
without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.settings import TABLES, TREE_LAYERS, param
from ..core.workspace import KeptWorkspace, workspace_option
from ..reconstruction.options import ReconstructOptions, geotags_crs_option, project_crs_option
from ..stems.cloud.estimate.options import MeasureOptions
from ..stems.photos.options import PhotoStemOptions
from ..stems.quality.priors import BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M
from ..stems.splats.options import dense_option, device_option, time_limit_option


def sheets_option(auto: str) -> Any:
    """The switch of the evidence sheets. auto: what the default writes."""
    return param(
        "auto",
        help="Evidence sheets, one small picture a tree: of all trees, of those to check and not measured, or none; "
        f"auto = {auto}.",
        choices=("auto", "all", "check", "none"),
    )


def plots_option() -> Any:
    """The plots that photos are searched in."""
    return param(
        None,
        help="CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); without it all that photos see well.",
        suffixes=TABLES,
    )


@dataclass(frozen=True, kw_only=True)
class PhotoInputs(KeptWorkspace):
    """Photos, and what is known of them and of the place."""

    photos: Path = param(kind="folder", help="Folder with the original drone photos (JPEG) of one plot or block.")
    geotags: Path | None = param(
        None,
        kind="files",
        help="Folder or file with MRK and RTKLIB .pos (PPK), or a CSV; without it EXIF/XMP positions are used.",
    )
    geotags_crs: str | None = geotags_crs_option()
    gcp: Path | None = param(
        None,
        help="Ground control and check points: gcp_list.txt of OpenDroneMap, or CSV with label, easting, northing, "
        "height (or lon, lat, height), photo, u, v; for drones without PPK, for photos without any position (three or "
        "more points), and to check any block. In a CSV also known lengths between two marked points (bar, length_m), "
        "for the scale.",
        suffixes=(".txt", ".csv"),
    )
    calibration: Path | None = param(
        None,
        help="camera.json of an earlier reconstruction with the same camera and photo size; without it the lens is "
        "taken from the photos' metadata.",
        suffixes=(".json",),
    )
    dtm: Path | None = param(
        None,
        help="Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is found in the photos.",
        suffixes=(".tif", ".tiff"),
    )
    crs: str | None = project_crs_option()
    plots: Path | None = plots_option()


@dataclass(frozen=True, kw_only=True)
class PhotosToDbhSettings(PhotoInputs):
    """Parameters of the whole chain."""

    field_stems: Path | None = param(
        None,
        help="Stems that a field crew knows: a point layer, or CSV with x, y or lon, lat and tree_id; each that the "
        "search does not find by itself is looked for at its place, and ends as a tree or with the reason why not.",
        suffixes=TREE_LAYERS,
    )
    field_error_m: float = param(
        0.5, help="How far a place of --field-stems or --at may be from its stem.", unit="m", minimum=0.1, maximum=2.0
    )
    at: Path | None = param(
        None,
        help="Measure the stems at these points (layer or CSV as for --field-stems) from the finished run in the "
        "workspace, in seconds, and add them to its tree layer; the other settings have to be those of that run. A "
        "point named 'again 12' measures tree 12 anew with its foot there, 'former 12' takes that back.",
        suffixes=TREE_LAYERS,
    )
    flight_plan: Path | None = param(
        None,
        help="Flight plan (plan.gpkg of plan-flight) that was flown: planned and got are compared.",
        suffixes=(".gpkg",),
    )
    preset: str = param(
        "balanced",
        help="How much is modelled: fast and best differ in photos and features used; paper = the published method on "
        "the whole plot (hours).",
        choices=("fast", "balanced", "best", "paper"),
    )
    fit: str = param(
        "auto",
        help="auto, photos = stems fitted straight to the photos; gaussians, paper = the published method.",
        choices=("auto", "photos", "gaussians", "paper"),
    )
    time_limit: float = time_limit_option()
    device: str = device_option()
    dense: Path | None = dense_option()
    bh_m: float = param(
        BREAST_HEIGHT_M,
        help="Breast height above ground.",
        unit="m",
        minimum=LOWEST_BREAST_HEIGHT_M,
        maximum=HIGHEST_BREAST_HEIGHT_M,
    )
    max_dbh_cm: float = param(
        PhotoStemOptions.max_dbh_cm,
        help="Thickest stem that is looked for; thicker ones are refused as too large.",
        unit="cm",
        minimum=20,
        maximum=500,
    )
    sheets: str = sheets_option("as the preset: those to check with fast, all otherwise")
    heights: str = param(
        "auto",
        help="Tree heights and a canopy height model (chm.tif) from the photos; auto = as the preset: not with fast.",
        choices=("auto", "photos", "none"),
    )
    orthophoto: bool = param(
        True,
        help="Write the orthophoto of the ground below the crowns (ortho.tif): each place from the photos that see it; "
        "a few seconds a plot.",
    )
    stem_network: str = param(
        "auto",
        help="A small network, trained on simulated photos, is asked which pixels show stems and ivy: auto = where the "
        "photos show the ground behind the stems; off = never.",
        choices=("auto", "off"),
    )
    #: Of every random choice; of the library only.
    seed: int = 0
    dry_run: bool = param(
        False,
        help="Only check inputs, overlap, fixed positions, memory and disk, and estimate the time; writes nothing.",
    )
    workspace: Path = workspace_option()
    output: Path = param(
        kind="output_file",
        help="Tree layer to write (.gpkg, .shp, .geojson or .csv).",
        suffixes=(".gpkg", ".shp", ".geojson", ".csv"),
    )


@dataclass(frozen=True)
class Preset:
    """How much of the scene is modelled. sheets: trees that get an evidence sheet: ``all``, or those to ``check`` and
    not measured. heights: whether tree heights are measured in the photos."""

    reconstruct: ReconstructOptions
    stems: PhotoStemOptions
    sheets: str = "all"
    heights: bool = True


CHAIN_PRESETS = {
    "fast": Preset(
        ReconstructOptions(max_features=4000, neighbours=12),
        PhotoStemOptions(max_views=32, max_lean_deg=10.0),
        sheets="check",
        heights=False,
    ),
    "balanced": Preset(ReconstructOptions(), PhotoStemOptions()),
    "best": Preset(ReconstructOptions(max_features=16000, neighbours=30), PhotoStemOptions(max_views=200)),
    "paper": Preset(ReconstructOptions(), PhotoStemOptions()),
}


@dataclass(frozen=True, kw_only=True)
class CloudSettings:
    """Input options of the point-cloud verbs."""

    input: Path = param(
        help="point cloud: LAS, LAZ, COPC, E57, or text with x y z per line",
        suffixes=("laz", "las", "e57", "txt", "xyz", "csv"),
    )
    dtm: Path | None = param(
        None, help="terrain raster; without it the ground is found in the cloud", suffixes=("tif", "tiff")
    )
    crs: str | None = param(
        None,
        kind="crs",
        help="CRS of a cloud that holds none: EPSG:CODE, or 'local' for metres without a place on the map",
    )
    z_is: str = param(
        "auto",
        help="what z is: elevation, or height above ground (a normalised cloud); auto = read from the points",
        choices=("auto", "elevation", "height"),
    )


@dataclass(frozen=True, kw_only=True)
class PointcloudToDbhSettings(MeasureOptions, CloudSettings):
    """Options of ``pointcloud-to-dbh``."""

    output: Path = param(kind="output_file", help="tree layer", suffixes=TREE_LAYERS)
    dry_run: bool = param(
        False,
        help="Only check the cloud, its CRS, density and DTM, memory and disk, and estimate the time; writes nothing",
    )
    plots: Path | None = param(
        None,
        help="CSV of plots: plot_id, easting, northing, radius_m (or lon, "
        "lat); only stems in them are measured, without it those of the whole cloud",
        suffixes=TABLES,
    )
    report: Path | None = param(
        None,
        kind="output_file",
        help="also write a report: map, each DBH, what the cloud did not show, cost",
        suffixes=("html", "htm"),
    )
    sheets: str = sheets_option("those to check and not measured")
