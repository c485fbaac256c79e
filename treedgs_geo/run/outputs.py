"""The stage ``write`` of a photo run: the layer, its copy in the workspace, the report."""

from __future__ import annotations

from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError, OutputError
from ..core.files import write_json
from ..core.geopackage import is_whole, move_aside
from ..core.plots import Plot, plot_cells
from ..core.progress import Collector, Reporter
from ..geotags.stations import Stations
from ..inventory.evidence.files import written_sheets
from ..inventory.report import write_report
from ..inventory.reviewed import reviewed
from ..inventory.searched import not_seen, partly_searched, read_searched, searched_table
from ..inventory.side_layers import readings_table
from ..inventory.tree_layer import tree_table, write_trees
from ..inventory.tree_reading import LAYER, read_trees
from ..planning.flown import planned_and_got
from ..stems.photos.fit_records import read_fits
from ..stems.quality.tops import heights_sentence
from ..stems.quality.tree import Tree
from .context import PhotoJob, Site
from .published_plot import is_published
from .searched import ENOUGH_VIEWS, day_of, over_ground, photos_looking, seen_in_photos
from .stage import Key, Stage

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd
    from pyproj import CRS


def write_outputs(job: PhotoJob, reporter: Collector) -> dict[str, Any]:
    """The layer asked for, its copy in the workspace, the comparison with the flight plan, the report."""
    trees, plots, stations = job.trees, job.plots, job.stations
    job.nothing = job.nothing or _none_measured(job)
    if job.nothing:
        reporter.warn(f"No stem is measurable: {job.nothing}.")
    if trees and plots and all(tree.plot_id is None for tree in trees):
        reporter.warn("All stems found stand outside the plots; check the plot centres.")
    searched = searched_table(seen_in_photos(job.site, plots), plots, stations.crs, day_of(stations.utc))
    why = f"elsewhere fewer than {ENOUGH_VIEWS} photos look from the side"
    if job.site is not None:
        reporter.tell(partly_searched(searched, why))
    output, copy = job.settings.output, job.path(names.TREES)
    more = {"sheets": job.path(names.SHEETS), "searched": searched, "readings": _readings(job)}
    write_trees(output, trees, stations.crs, reporter=reporter, **more)
    if output.resolve() != copy.resolve():
        try:
            if copy.exists() and not is_whole(copy, LAYER):
                reporter.warn(f"{copy}: was damaged and is kept as {move_aside(copy).name}.")
            write_trees(copy, trees, stations.crs, copies=(output,), **more)
        except OutputError as problem:  # the result itself is written
            reporter.warn(str(problem))
    job.planned_said = _compared_with_plan(job, reporter)
    write_page(job, trees, reporter)
    return {"report": str(job.path(names.REPORT))}


def _none_measured(job: PhotoJob) -> str:
    """Why a search that was made gave no diameter, empty where it gave one."""
    if any(tree.qc_flag != "reject" for tree in job.trees):
        return ""
    if job.trees:
        return f"all {len(job.trees)} stems found were refused, each with its reason in the layer"
    if is_published(job.settings):
        return "the segmentation found no stem among the points of the Gaussians"
    return "no stem was found in the photos: none shows two edges of a trunk near the ground"


def _readings(job: PhotoJob) -> pd.DataFrame | None:
    """What the refused stems were read as, where the run kept its fits."""
    path = job.path(names.FITS)
    if not job.trees or not path.exists():
        return None
    fits = read_fits(path).fits
    refused = [tree.tree_id for tree in job.trees if tree.qc_flag == "reject" and 0 < tree.tree_id <= len(fits)]
    read = [(number, fits[number - 1]) for number in refused]
    return readings_table([(number, fit.dbh_cm, fit.se_cm) for number, fit in read if np.isfinite(fit.se_cm)])


def _compared_with_plan(job: PhotoJob, reporter: Reporter) -> list[str]:
    """``planned.json`` in the workspace and its sentences, where a flight plan was given."""
    if not job.settings.flight_plan:
        return []
    compared = planned_and_got(job.settings.flight_plan, job.trees, len(job.aligned.views) if job.aligned else 0)
    write_json(job.path("planned.json"), compared)
    said = compared["sentences"]
    reporter.info(said[0])
    reporter.tell(said[1:])
    return said


def write_page(job: PhotoJob, trees: list[Tree], reporter: Collector, view: Path | None = None) -> None:
    """The report. trees: of the run. view: the stand in 3D, to be linked."""
    stages = {
        name: entry
        for name, entry in job.space.record["stages"].items()
        if name != "write" and (job.aligned or name == "geotag")
    }
    crs, copy = job.stations.crs, job.path(names.TREES)
    views, sfm = (job.aligned.views, job.aligned.report) if job.aligned else ([], {})
    megapixels = sum(view.camera.width * view.camera.height for view in views) / 1e6
    facts = {
        **photo_facts(job.stations, job.plots, sfm, job.site, read_searched(copy)),
        "photos": f"{sfm['registered']} of {sfm['photos']} registered, {megapixels:.0f} megapixels"
        if sfm
        else f"{len(job.stations)}, not matched",
        "method": stages.get("measure", {}).get("result", {}).get("fit", "none"),
        "breast height": f"{job.settings.bh_m:g} m",
        "CRS": crs.to_string(),
        "ground": stages["ground"]["result"]["ground"] if sfm else "not looked for",
        "preset": job.settings.preset,
        "TreeDGS": job.space.record["version"],
        "run": job.run_id,
    }
    if heights := heights_sentence(trees):
        facts["heights"] = heights
    if job.planned_said:
        facts["planned and got"] = job.planned_said[0]
    # The layer has what a person decided in earlier runs; the page shows what counts.
    table, review = reviewed(kept_table(copy, trees, crs), job.settings.output)
    if review.total:
        facts["decided by a person"] = review.sentences(job.settings.output.name)[0]
    sheets, warnings = written_sheets(job.path(names.SHEETS), job.run_id), job.steps.warnings + reporter.warnings
    write_report(job.path(names.REPORT), table, job.plots, facts, warnings, stages, sheets, view)


def photo_facts(
    stations: Stations,
    plots: list[Plot],
    sfm: dict[str, Any],
    site: Site | None,
    searched: gpd.GeoDataFrame | None = None,
) -> dict[str, str]:
    """Rows of the run card: flight, positions, their residuals, ground sample distance, area not seen.

    sfm: report of the reconstruction; searched: :func:`.inventory.searched.searched_table`. A row whose figures they
    lack is left out.
    """
    facts = {"flown": flown(stations), "positions": positions(stations)}
    if sfm.get("geotag_rms_e_n_u_m"):
        facts["cameras against their positions"] = (
            f"{_rms(sfm['geotag_rms_e_n_u_m'])} (root mean square, {sfm['geotag_residual_quality']}); "
            f"points in the photos {sfm['reprojection_rms_px']:.2f} px"
        )
    for kind in ("control", "check"):
        if sfm.get(f"{kind}_rms_e_n_u_m"):
            facts[f"block against {kind} points"] = f"{_rms(sfm[f'{kind}_rms_e_n_u_m'])} (root mean square)"
    if sfm.get("bars"):
        told = (
            f"{bar['label']} {bar['length_m']:.3f} m, "
            + ("not seen" if bar["block_m"] is None else f"in the block {bar['block_m']:.3f} m")
            for bar in sfm["bars"]
        )
        facts["known lengths"] = f"{'; '.join(told)}; scale sure to {100 * sfm['scale_sd']:.2f} %"
    if sfm.get("level"):
        facts["photos matched"] = matched(sfm)
    if site is not None and plots:
        facts["ground sample distance"] = _sample_distance(site, plots)
    if plots and searched is not None:
        facts["plot area not seen"] = (
            f"{not_seen(searched)} is seen from the side by fewer than {ENOUGH_VIEWS} photos (trunks and leaves in the "
            "way not counted)"
        )
    return {name: text for name, text in facts.items() if text}


def _rms(metres: list[float]) -> str:
    """East, north and height in words."""
    e, n, u = (100 * float(value) for value in metres)
    return f"east {e:.1f}, north {n:.1f}, height {u:.1f} cm"


def flown(stations: Stations) -> str:
    """Day or days of the photos (UTC), ''  where they do not say."""
    known = stations.utc[np.isfinite(stations.utc)]
    if not len(known):
        return ""
    days = sorted({datetime.fromtimestamp(t, timezone.utc).date().isoformat() for t in (known.min(), known.max())})
    flights = len(np.unique(stations.flight))
    return " to ".join(days) + " (UTC)" + (f", {flights} flights" if flights > 1 else "")


def positions(stations: Stations) -> str:
    """``59 of 61 photos fixed (97 %), 2 float``."""
    counts, total = stations.counts(), len(stations)
    fixed = counts.pop("fix", 0)
    rest = "".join(f", {count} {name if name != 'none' else 'without'}" for name, count in counts.items())
    return f"{fixed} of {total} photos fixed ({100 * fixed / max(total, 1):.0f} %){rest}"


def matched(sfm: dict[str, Any]) -> str:
    """How far the reconstruction went, why, and how sure its photos are at the stems."""
    ways = {"guided": "where geotags and gimbals say, ", "fine": "where geotags, gimbals and a first block say, "}
    text = ways.get(sfm["level"], "without a guide, ")
    text += f"{sfm['pairs']} pairs"
    if sfm.get("poses_px_median") is not None:
        text += f"; sure to {sfm['poses_px_median']:.2f} px at the stems, the worst to {sfm['poses_px_worst']:.2f} px"
    if sfm.get("climbed_because") and sfm["level"] == "guided":
        text += f" (more pairs gave no better block, but {sfm['climbed_because']})"
    elif sfm.get("climbed_because"):
        text += f" (fewer pairs were tried first, but {sfm['climbed_because']})"
    elif sfm["level"] == "guided":
        text += " (sure enough: more pairs would not show in the diameters)"
    return text


def _sample_distance(site: Site, plots: list[Plot]) -> str:
    """Ground sample distance at breast height in the plots; '' without ground."""
    points = over_ground(site, plot_cells(plots, cell_m=2.0)[0])
    sizes = [] if points is None else photos_looking(site.views, points)[1]
    if not sizes:
        return ""
    low, middle, high = np.percentile(sizes, [5, 50, 95])
    return f"{middle:.2f} cm a pixel at breast height in the plots ({low:.2f} to {high:.2f}; {len(sizes)} photos)"


def kept_table(path: Path, trees: list[Tree], crs: CRS) -> gpd.GeoDataFrame:
    """The trees as the layer ``path`` holds them, with what a person wrote; as measured where it is not to be read."""
    with suppress(InputError):
        found = read_trees(path)
        if len(found) >= len(trees):
            return found
    return tree_table(trees, crs)


# The outputs may be changed by the user between runs: always written anew, it costs a second.
WRITE = Stage("write", 0.01, write_outputs, key=lambda job: Key({"output": job.settings.output}), always=True)
