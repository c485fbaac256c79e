"""From the settings of ``stand-table`` to its files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyproj

from ... import __version__
from ...core.crs import check_projected, project_crs
from ...core.errors import CRSError, InputError
from ...core.files import ensure_writable, fingerprint, write_json
from ...core.folder_lock import one_writer
from ...core.map_scale import check_place
from ...core.plots import Plot, as_in_plots
from ...core.progress import Reporter
from ...core.shown import count_of, some
from ...core.tables import is_table
from ...report.blocks import Document, known
from ...report.html import write_html
from ...report.pdf import write_pdf
from ..declination import parse_date
from ..double_sampling.other_trees import outlier_sentences, outliers, tapes_of_other_trees
from ..double_sampling.tapes import join, read_taped
from ..field_trees import place
from ..searched import flown_days, flown_on
from .document import make_document
from .equations import read_equations
from .expansion import expand
from .files import (
    CSV_TABLES,
    csv_name,
    long_names,
    write_csv,
    write_fvs,
    write_geopackage,
    write_shapefiles,
    write_workbook,
)
from .sample import SamplePlot, census, crs_of_plots, empty_rim, read_boundary, read_sample
from .species import unknown_sentences
from .stem_volume import add_stem_volumes
from .survey import Stand, make_stand
from .tables import missing_sentences
from .taped import TapeInput, taped_sentences, taped_summary
from .treelist import TreeList, from_tally, label_species, measured_trees, on_the_map, read_tally
from .units import METRIC
from .values import ValueOptions

#: The bias that the DBHs of a survey share, as seen on rendered and simulated plots with known truth (README).
_COMMON_SE_CM = 0.2


def make_report(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``StandTableSettings``. Returns the result of ``stand-table``.

    Raises:
        InputError: as :func:`read_stand`, or the output would overwrite an input.
    """
    folder = Path(settings.output)
    ensure_writable(folder / "summary.json")
    # The year of the inventory: when the photos were taken, else of the field work.
    day = parse_date(settings.field_date, "--field-date") if settings.field_date else None
    if settings.trees is not None:
        day = flown_on(settings.trees) or day
    stand = read_stand(settings, reporter)
    with reporter.stage("write", 0.4, 1.0):
        document = make_document(stand, settings.units, settings.class_width, _facts(settings, stand))
        with one_writer(folder):
            _write(folder, stand, document, None if day is None else day.year, reporter)
    found = {
        "output": str(folder),
        "report": str(folder / "report.html"),
        "pdf": str(folder / "report.pdf"),
        "layers": str(folder / "stand.gpkg"),
        "n_plots": stand.design.n,
        "n_trees": int((stand.rows["kind"] == "measured").sum()),
        "n_missing": len(stand.missing),
        "n_reviewed": stand.review.total,
        "ba_se_m2_ha": known(stand.estimates["ba"].se),
        **{METRIC[name].key: known(estimate.mean) for name, estimate in stand.estimates.items()},
    }
    return {key: round(value, 4) if isinstance(value, float) else value for key, value in found.items()}


def read_stand(settings: Any, reporter: Reporter) -> Stand:
    """Read the inputs and compute; writes nothing. Warnings and notes go to the reporter too.

    Raises:
        InputError: inputs that are missing or do not fit together.
    """
    if settings.trees is None and settings.field is None:
        raise InputError("Give --trees (a tree layer) or --field (a field tally).")
    if settings.plots is None and settings.boundary is None:
        raise InputError("Give --plots, or --boundary to count every tree of the stand.")
    if settings.pairs is not None and settings.trees is None:
        raise InputError("--pairs: says who the trees of --trees are, so it needs --trees.")
    if settings.taped is not None and settings.trees is None:
        raise InputError("--taped: corrects measured trees, so it needs --trees (a field tally is taped already).")
    with reporter.stage("read", 0.0, 0.2):
        book = read_equations(settings.equations)
        own = [name for equation in book for name in equation.named]
        if settings.species and (odd := unknown_sentences([settings.species], own)):
            raise InputError(f"--species: {odd[0]}")
        trees = _read_trees(settings)
        plots, boundary = _read_plots(settings, trees, reporter)
        trees.trees = label_species(trees.trees, settings.species)
        tapes = _read_tapes(settings, trees)
        if settings.trees is not None and (said := add_stem_volumes(trees.trees, settings.trees, settings.top_cm)):
            trees.notes.append(said)
    with reporter.stage("estimate", 0.2, 0.4):
        expanded = expand(
            trees, plots, boundary, settings.edge, settings.min_dbh_cm, settings.plots or settings.boundary
        )
        common = settings.common_se_cm
        if common is None:
            common = 0.0 if trees.from_field else _COMMON_SE_CM
        heights = trees.trees["bh_m"].dropna()
        breast_height_m = float(heights.median()) if len(heights) else settings.breast_height_m
        stand = make_stand(
            trees,
            expanded,
            book,
            ValueOptions(settings.heights, settings.origin, settings.dbh_se_cm, common, breast_height_m),
            settings.missing,
            settings.confidence_pct / 100,
            settings.stand_id.strip() or "stand",
            boundary,
            tapes,
        )
    stand.warnings[:0] = missing_sentences(stand, settings.units)
    if stand.taped:
        stand.notes[:0] = taped_sentences(stand.taped, stand.estimates, settings.units, stand.design.census)
    listed = stand.listed()["tree"].unique()
    stand.warnings += unknown_sentences(stand.trees["species"].to_numpy(object)[listed], own)
    stand.warnings += long_names(stand)
    reporter.tell(stand.warnings, (*stand.notes, *stand.values.curves))
    return stand


def _read_trees(settings: Any) -> TreeList:
    crs = project_crs(settings.crs) if settings.crs else None
    if settings.trees is None:
        return from_tally(settings.field, settings)
    tally = read_tally(settings.field, settings) if settings.field is not None else None
    found = on_the_map(measured_trees(settings.trees, crs, settings.pairs, tally), settings.trees, crs)
    found.warnings += [] if tally is None else tally.attrs["said"]
    return found


def _read_tapes(settings: Any, trees: TreeList) -> TapeInput | None:
    """The taped trees, and in ``trees`` the DBHs as they were when drawn."""
    if settings.taped is None:
        return None
    taped = read_taped(settings.taped)
    taped.sample()  # refuses a table without its draw
    rows, dbh_cm, notes = join(trees.trees, taped, settings.trees)
    if others := tapes_of_other_trees(taped, trees.trees, rows, dbh_cm):
        raise InputError(others)
    names = taped.trees["tree_id"].to_numpy()
    trees.warnings += outlier_sentences(names, outliers(dbh_cm[rows], taped.trees["taped_cm"].to_numpy(float), names))
    trees.trees["dbh_cm"] = dbh_cm
    trees.notes += notes
    warnings, said = taped.remarks()
    trees.warnings += warnings
    trees.notes += said
    species = label_species(pd.DataFrame({"species": [None]}), settings.species)["species"].iloc[0]
    return TapeInput(taped, rows, settings.min_dbh_cm, species if settings.species else None)


def _read_plots(settings: Any, trees: TreeList, reporter: Reporter) -> tuple[list[SamplePlot], Any]:
    """Plots and boundary in the trees' CRS; tally trees get their positions where plots have a place."""
    if trees.from_field:
        trees.crs = _field_crs(settings)
    boundary = None
    if settings.boundary is not None:
        if trees.crs is None:
            raise CRSError(f"{settings.boundary}: the CRS to lay it in is not known; give --crs.")
        boundary = read_boundary(settings.boundary, trees.crs)
        check_place(trees.crs, np.array(boundary.centroid.coords), str(settings.boundary))
    if settings.plots is None:
        if trees.from_field:
            trees.trees["plot_id"] = "stand"
        whole = [census(boundary, "stand")]
        return whole if trees.from_field else trees.plots_searched(whole, settings.trees.name), boundary
    plots = read_sample(settings.plots, trees.crs, settings.plot_size, on_map=not trees.from_field)
    check_place(trees.crs, np.array([[plot.x, plot.y] for plot in plots]), str(settings.plots), photos=True)
    if moved := [plot.plot_id for plot in plots if plot.plot_id in trees.centres and plot.shape == "circle"]:
        plots = [plot.moved(*trees.centres[plot.plot_id]) if plot.plot_id in moved else plot for plot in plots]
        trees.notes.append(f"Centres as match-plots found them (co-registered): {count_of(len(moved), 'plot')}.")
    if not trees.from_field:
        return trees.plots_searched(plots, settings.trees.name), boundary
    _place_tally(settings, trees, plots, reporter)
    # A crew's tally is of whole plots.
    if empty := empty_rim(_reached(trees.trees, plots)):
        trees.warnings.append(f"{Path(settings.field).name}: {empty}")
    return plots, boundary


def _reached(trees: pd.DataFrame, plots: list[SamplePlot]) -> dict[str, np.ndarray]:
    """Round plot -> distances of a tally's trees from its centre, in radii; NaN where it does not say them."""
    names = trees["plot_id"].where(trees["plot_id"].notna(), plots[0].plot_id if len(plots) == 1 else "").astype(str)
    names = names.replace(as_in_plots(names.tolist(), [plot.plot_id for plot in plots]))
    found = {}
    for plot in plots:
        mine = trees[names == plot.plot_id]
        away = np.hypot(mine["x"] - plot.x, mine["y"] - plot.y)
        found[plot.plot_id] = (pd.to_numeric(mine["distance_m"]).fillna(away) / plot.radius_m).to_numpy(float)
    return found


def _place_tally(settings: Any, trees: TreeList, plots: list[SamplePlot], reporter: Reporter) -> None:
    """Map positions of tally trees, for the maps and the walkthrough; without them the figures are the same."""
    table = trees.trees
    if trees.crs is None or table["x"].notna().all() or "azimuth_deg" not in table or table["azimuth_deg"].isna().all():
        return
    centres = [Plot(p.plot_id, p.x, p.y, max(p.radius_m, 1.0)) for p in plots if np.isfinite(p.x)]
    try:
        placed = place(table.drop(columns=["x", "y"]), centres, trees.crs, settings, settings.field)
    except InputError as problem:
        reporter.info(f"The tally's trees are not on the map: {problem}")
        return
    trees.trees = table.assign(x=placed["x"].to_numpy(float), y=placed["y"].to_numpy(float), plot_id=placed["plot_id"])


def _field_crs(settings: Any) -> pyproj.CRS | None:
    """The CRS of a tally's plots: ``--crs``, or the first ``epsg`` of a plots table in metres, or the layer's own."""
    if settings.crs:
        return project_crs(settings.crs)
    if settings.plots is None:
        return None
    try:
        found = crs_of_plots(settings.plots)
        return check_projected(found, str(settings.plots)) if found and is_table(settings.plots) else found
    except (InputError, CRSError):
        return None


def _facts(settings: Any, stand: Stand) -> dict[str, str]:
    inputs = (settings.trees, settings.field, settings.pairs, settings.plots, settings.boundary, settings.taped)
    facts = {
        "Inputs": ", ".join(f"{Path(p).name} ({fingerprint([Path(p)])})" for p in inputs if p),
        "Day of the photos or points": some(dict.fromkeys(flown_days(settings.trees)), 8) if settings.trees else "",
        "Decided by": some(stand.review.by, 8),
        "Coordinates": stand.crs.name if stand.crs is not None else "none",
        "Smallest DBH that counts": f"{settings.min_dbh_cm:g} cm" if settings.min_dbh_cm else "none",
        "Stems without a DBH": {"impute": "imputed", "exclude": "left out"}[settings.missing],
        "Heights of trees without one": {
            "fitted": "from a curve fitted to the measured ones",
            "measured": "none",
            "published": "from a published regional curve",
        }[settings.heights],
        "Species where none is known": settings.species or "",
        "Origin": settings.origin,
        "Outside an equation's range": "used and flagged",
        "Rule at the stand's edge": settings.edge if settings.boundary else "",
        "Plot sizes": {"horizontal": "horizontal", "slope": "along the slope, corrected"}[settings.plot_size],
        "Mean over plots": "ratio of means (plots weigh by their area); no finite population correction",
        "Dominant height": "mean height of the 100 thickest trees per hectare, plot by plot",
        "Units": {"metric": "metric", "us": "US (international foot and acre)"}[settings.units],
        "TreeDGS": __version__,
    }
    return {label: text for label, text in facts.items() if text}


def _write(folder: Path, stand: Stand, document: Document, year: int | None, reporter: Reporter) -> None:
    """Every file; ``summary.json`` comes last, so that its presence means the rest is there."""
    (folder / "summary.json").unlink(missing_ok=True)
    write_html(folder / "report.html", document)
    reporter.progress(0.3)
    write_pdf(folder / "report.pdf", document)
    reporter.progress(0.6)
    write_workbook(folder / "stand_table.xlsx", document)
    for name in CSV_TABLES:
        write_csv(folder / csv_name(name), document.tables[name])
    write_geopackage(folder / "stand.gpkg", stand)
    write_shapefiles(folder, stand)
    write_fvs(folder / "FVS_Data.db", stand, year)
    write_json(folder / "summary.json", summary(stand))


def summary(stand: Stand) -> dict[str, Any]:
    """Everything that counts, metric, as plain values; null where nothing is known."""

    def figures(found: dict) -> dict[str, Any]:
        return {METRIC[name].key: {key: known(x) for key, x in vars(one).items()} for name, one in found.items()}

    return {
        "stand_id": stand.stand_id,
        "n_plots": stand.design.n,
        "census": stand.design.census,
        "confidence": stand.design.confidence,
        "area_ha": float(stand.design.areas.sum()),
        "treatment_of_missing": stand.treatment,
        "n_trees": int((stand.rows["kind"] == "measured").sum()),
        "n_missing": len(stand.missing),
        "n_too_small": stand.n_thin,
        "n_no_tree": stand.n_left,
        "n_dead": len(stand.dead),
        "reviewed": stand.review.counts(),
        "estimates": figures(stand.estimates),
        "other_treatment": figures(stand.other),
        "uncorrected": {METRIC[name].key: known(value) for name, value in stand.uncorrected.items()},
        "dead_per_ha": stand.dead_per_ha,
        "taped": taped_summary(stand.taped) if stand.taped else None,
        "warnings": stand.warnings,
        "notes": [*stand.notes, *stand.values.curves],
        "version": __version__,
    }
