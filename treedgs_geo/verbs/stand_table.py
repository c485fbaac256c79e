"""``stand-table``: per-hectare tables with their errors, from measured trees or a field tally, and the report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import PLOT_FILES, TABLES, TREE_LAYERS, param
from ..inventory.options import FieldProtocol
from ..stems.quality.priors import BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M

#: Everything that a run may write into its folder.
FILES = (
    "report.html",
    "report.pdf",
    "stand_table.xlsx",
    *(f"stand_{table}.csv" for table in ("summary", "table", "plots", "corrections", "equations", "trees")),
    *(f"stand_{name}.{suffix}" for name in ("plots", "trees") for suffix in ("shp", "shx", "dbf", "prj", "cpg")),
    "stand.gpkg",
    "FVS_Data.db",
    "summary.json",
)


@dataclass(frozen=True, kw_only=True)
class StandTableSettings(FieldProtocol):
    """Options of ``stand-table``."""

    trees: Path | None = param(None, help="measured trees: the tree layer", suffixes=TREE_LAYERS)
    plots: Path | None = param(
        None,
        help="plots: centre and radius_m (or width_m, length_m), or a polygon layer; without: the whole boundary is "
        "one census",
        suffixes=PLOT_FILES,
    )
    boundary: Path | None = param(
        None, help="the stand's outline: finds plots that reach over its edge", suffixes=("gpkg", "geojson", "shp")
    )
    pairs: Path | None = param(
        None, help="pairs layer of match-plots: species and status of the measured trees", suffixes=("gpkg",)
    )
    field: Path | None = param(
        None,
        help="field tally: heights of the paired trees; without --trees it is the tree list itself",
        suffixes=TABLES,
    )
    taped: Path | None = param(
        None,
        help="the tape table of tape-sample, filled in: corrects trees, basal area, volume and biomass",
        suffixes=("gpkg", "csv"),
    )
    units: str = param("metric", choices=("metric", "us"), help="units of the report")
    class_width: float | None = param(
        None,
        unit="cm, or inches in US units",
        minimum=0.1,
        maximum=100,
        help="width of a DBH class (5 cm or 2 inches where not given)",
    )
    min_dbh_cm: float = param(0.0, unit="cm", minimum=0, help="smallest DBH that counts")
    species: str | None = param(
        None, help="species of trees that have none: PLANTS symbol, FIA number or name (PITA, 131, Pinus taeda)"
    )
    origin: str = param("natural", choices=("natural", "planted"), help="how the stand came about")
    missing: str = param(
        "impute",
        choices=("impute", "exclude"),
        help="stems seen but without a DBH: count each, by its chance of being a tree, as the mean of its plot's "
        "measured trees, or leave them out (both results are reported)",
    )
    heights: str = param(
        "fitted",
        choices=("fitted", "measured", "published"),
        help="heights of trees that have none: from a curve fitted to the measured ones, none at all, or from a "
        "published regional curve",
    )
    equations: Path | None = param(None, help="your own equations, tried before the built-in ones", suffixes=TABLES)
    top_cm: float = param(
        7.0,
        unit="cm",
        minimum=0,
        maximum=50,
        help="top diameter of the stem volumes that measured stem curves give (sections of the tree layer)",
    )
    edge: str = param(
        "zone",
        choices=("zone", "walkthrough", "area", "none"),
        help="trees and plots at the stand's edge: zone (a tree weighs by the part of the plot-sized zone around it "
        "that is inside), walkthrough (some trees count twice), area (only the plot's part inside) or none (only "
        "flagged)",
    )
    plot_size: str = param(
        "horizontal",
        choices=("horizontal", "slope"),
        help="plot sizes are horizontal, or were laid out along the slope (then slope_pct or slope_deg is needed)",
    )
    dbh_se_cm: float | None = param(
        None, unit="cm", minimum=0, maximum=50, help="standard error of DBH for trees that have none"
    )
    common_se_cm: float | None = param(
        None,
        unit="cm",
        minimum=0,
        maximum=20,
        help="standard error of a bias that all DBHs share (not given: 0.2 for measured trees, 0 for a field tally)",
    )
    confidence_pct: float = param(95.0, unit="%", minimum=50, maximum=99.9, help="confidence of the intervals")
    breast_height_m: float = param(
        BREAST_HEIGHT_M,
        unit="m",
        minimum=LOWEST_BREAST_HEIGHT_M,
        maximum=HIGHEST_BREAST_HEIGHT_M,
        help="breast height of the height curve, for a field tally (a tree layer says its own)",
    )
    stand_id: str = param("stand", help="name of the stand, in every file")
    crs: str | None = param(None, kind="crs", help="CRS of trees in a CSV, or of a layer without one")
    output: Path = param(
        kind="output_folder", help="folder for the report and the tables", holds=FILES, known_by="stand.gpkg"
    )


COMMAND = Command(
    name="stand-table",
    title="Stand table and report",
    group="4 Report",
    summary="Stand and stock tables per hectare with their errors, and a report for the client.",
    help=(
        "Expands the trees of fixed-area plots (round, rectangular or any polygon) to the hectare: trees, basal area, "
        "quadratic mean diameter, Lorey's and dominant height, volume and biomass by species and DBH class, plot means "
        "with standard errors and t intervals. Basal area and volume are freed of what the DBHs' own errors add to "
        "them, and the amount is shown. Stems without a DBH are counted and either imputed or left out; both are "
        "reported. With --taped (tape-sample) trees, basal area, volume and biomass are corrected by taped trees, and "
        "the interval is that of the tapes and the plots. Plots over the stand's edge are flagged and weighted. Volume "
        "and biomass come from a table of equations with source and range (loblolly and other pines first); give your "
        "own with --equations. From one plot no error for the stand can be given, and none is. Writes report.html, "
        "report.pdf, stand_table.xlsx, CSV files, stand.gpkg, shapefiles and FVS_Data.db (US units, for the Forest "
        "Vegetation Simulator), all with the same numbers. Result figures are metric."
    ),
    settings=StandTableSettings,
    run=run_by("inventory.stand.run", "make_report"),
    main=("trees", "plots", "species", "pairs", "field", "boundary", "taped", "units", "min_dbh_cm", "output"),
    example="treedgs stand-table --trees trees.gpkg --plots flight/plots.csv --species PITA --output stand",
    outputs={
        "output": "folder",
        "report": "the page to open",
        "pdf": "the same as PDF",
        "layers": "plots and trees as map layers",
        "n_plots": "plots",
        "n_trees": "trees measured in the plots",
        "n_missing": "stems seen without a DBH",
        "n_reviewed": "trees that a person decided on",
        "trees_ha": "trees per hectare",
        "ba_m2_ha": "basal area, m²/ha",
        "ba_se_m2_ha": "its standard error, m²/ha",
        "qmd_cm": "quadratic mean diameter, cm",
        "lorey_m": "Lorey's mean height, m",
        "dominant_m": "dominant height, m",
        "volume_m3_ha": "volume, m³/ha",
        "biomass_t_ha": "above-ground biomass, t/ha",
    },
)
