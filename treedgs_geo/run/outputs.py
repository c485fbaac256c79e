"""What a photo run writes at its end: the layer, its copy in the workspace, the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..core import workspace as names
from ..core.errors import OutputError
from ..core.files import write_json
from ..core.geopackage import is_whole, move_aside
from ..core.progress import Reporter
from ..inventory.report import write_report
from ..inventory.reviewed import reviewed
from ..inventory.searched import read_searched
from ..inventory.tree_layer import write_trees
from ..inventory.tree_reading import LAYER
from ..planning.flown import planned_and_got
from ..stems.quality.tops import heights_sentence
from ..stems.quality.tree import Tree
from .context import Aligned, Flight, Run
from .report_facts import kept_table, photo_facts
from .stages import Collector

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd
    from pyproj import CRS


def write_layers(
    run: Run,
    trees: list[Tree],
    crs: CRS,
    reporter: Reporter,
    searched: gpd.GeoDataFrame | None = None,
    readings: pd.DataFrame | None = None,
) -> None:
    """The layer asked for, and its copy in the workspace. searched, readings: what goes into both
    (:func:`.inventory.searched.searched_table`, :func:`.inventory.readings.readings_table`)."""
    output, copy, sheets = run.settings.output, run.path(names.TREES), run.path(names.SHEETS)
    write_trees(output, trees, crs, reporter=reporter, sheets=sheets, searched=searched, readings=readings)
    if output.resolve() == copy.resolve():
        return
    try:
        if copy.exists() and not is_whole(copy, LAYER):
            reporter.warn(f"{copy}: was damaged and is kept as {move_aside(copy).name}.")
        write_trees(copy, trees, crs, copies=(output,), sheets=sheets, searched=searched, readings=readings)
    except OutputError as problem:  # the result itself is written
        reporter.warn(str(problem))


def compare_with_plan(run: Run, aligned: Aligned | None, trees: list[Tree], reporter: Reporter) -> list[str]:
    """``planned.json`` in the workspace and its sentences, where a flight plan was given."""
    if not run.settings.flight_plan:
        return []
    compared = planned_and_got(run.settings.flight_plan, trees, len(aligned.views) if aligned else 0)
    write_json(run.space.folder / "planned.json", compared)
    said = compared["sentences"]
    reporter.info(said[0])
    for sentence in said[1:]:
        reporter.warn(sentence)
    return said


def write_page(
    run: Run,
    run_id: str,
    flight: Flight,
    aligned: Aligned | None,
    trees: list[Tree],
    sheets: dict[int, Path],
    reporter: Collector,
    planned: Sequence[str] = (),
) -> None:
    """The report. aligned: ``None`` where nothing was matched. sheets: ``tree_id`` -> evidence sheet. planned:
    sentences about the flight plan."""
    stages = {
        name: entry
        for name, entry in run.space.record["stages"].items()
        if name != "write" and (aligned or name == "geotag")
    }
    stations, crs = flight.stations, flight.stations.crs
    views, sfm = (aligned.views, aligned.report) if aligned else ([], {})
    megapixels = sum(view.camera.width * view.camera.height for view in views) / 1e6
    facts = {
        "photos": f"{sfm['registered']} of {sfm['photos']} registered, {megapixels:.0f} megapixels"
        if sfm
        else f"{len(stations)}, not matched",
        "method": stages.get("measure", {}).get("result", {}).get("fit", "none"),
        "breast height": f"{run.settings.bh_m:g} m",
        "CRS": crs.to_string(),
        "ground": stages["ground"]["result"]["ground"] if sfm else "not looked for",
        "preset": run.settings.preset,
        "TreeDGS": run.space.record["version"],
        "run": run_id,
    }
    facts = photo_facts(run.space, views, flight.plots, sfm, read_searched(run.path(names.TREES))) | facts
    if heights := heights_sentence(trees):
        facts["heights"] = heights
    if planned:
        facts["planned and got"] = planned[0]
    warnings = run.steps.warnings + reporter.warnings
    # The layer has what a person decided in earlier runs; the page shows what counts.
    table, review = reviewed(kept_table(run.path(names.TREES), trees, crs), run.settings.output)
    if review.total:
        facts["decided by a person"] = review.sentences(run.settings.output.name)[0]
    write_report(run.path(names.REPORT), table, flight.plots, facts, warnings, stages, sheets)
