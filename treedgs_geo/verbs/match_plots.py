"""``match-plots``: field trees and measured trees, paired by position."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.command import Command
from ..core.progress import Reporter
from ..core.settings import TABLES, TREE_LAYERS, param
from ..inventory.options import FieldProtocol, PairingOptions


@dataclass(frozen=True, kw_only=True)
class MatchPlotsSettings(PairingOptions, FieldProtocol):
    """Options of ``match-plots``."""

    trees: Path = param(help="measured trees: a tree layer, or CSV with tree_id, x, y, dbh_cm", suffixes=TREE_LAYERS)
    field: Path = param(
        help="field tally: plot_id, tree_id, azimuth_deg, distance_m (or easting, northing), dbh_cm", suffixes=TABLES
    )
    plots: Path = param(help="plot centres: plot_id, easting, northing, epsg (or lon, lat), radius_m", suffixes=TABLES)
    trees_dbh_unit: str = param(
        "auto",
        choices=("auto", "cm", "mm", "m", "in"),
        help="unit of a DBH column in a CSV of measured trees that does not say it (auto: from a name like dbh_cm)",
    )
    crs: str | None = param(None, kind="crs", help="CRS of measured trees in a CSV, or of a layer without one")
    output: Path = param(
        kind="output_file", help="pairs layer; pairs locked in an existing file are kept", suffixes=("gpkg",)
    )


def run(settings: MatchPlotsSettings, reporter: Reporter) -> dict[str, Any]:
    """Read, place the field trees, co-register, pair, write."""
    import numpy as np

    from ..core.crs import check_projected, project_crs
    from ..core.errors import CRSError, InputError
    from ..core.files import ensure_writable
    from ..core.geopackage import ensure_unlocked
    from ..core.map_scale import check_place
    from ..core.plots import read_plots
    from ..core.wrong_units import wrong_unit
    from ..inventory.field_trees import drop_unplaced, place, read_field_trees
    from ..inventory.match import is_stuck, match_plots, offsets_apart, tally_of_other_trees, turn_advice
    from ..inventory.measured import read_measured
    from ..inventory.pairs_layer import OWN_LAYERS, read_locked, write_pairs
    from ..inventory.reviewed import reviewed
    from ..inventory.searched import searched_area

    ensure_writable(settings.output)
    ensure_unlocked(settings.output, OWN_LAYERS)
    crs = project_crs(settings.crs) if settings.crs else None
    measured, review = reviewed(read_measured(settings.trees, crs, settings.trees_dbh_unit), settings.trees)
    reporter.tell(notes=review.sentences(settings.trees.name))
    if measured.crs is None:
        if crs is None:
            raise CRSError(f"{settings.trees}: holds no CRS; give it with --crs.")
        measured = measured.set_crs(crs)
    check_projected(measured.crs, str(settings.trees))
    check_place(measured.crs, measured[["x", "y"]].to_numpy(float), str(settings.trees), reporter)
    plots = read_plots(settings.plots, measured.crs)
    tally = read_field_trees(settings.field, settings)
    reporter.tell(tally.attrs["said"])
    tally, left_out = drop_unplaced(tally, settings.field)
    tally = place(tally, plots, measured.crs, settings, settings.field)
    locked = read_locked(settings.output)
    if locked.pairs or locked.plots:
        reporter.info(f"{len(locked.pairs)} locked pairs and {len(locked.plots)} confirmed plots are kept.")
    with reporter.stage("pair trees", 0.1, 0.9):
        matched = match_plots(tally, measured, plots, settings, locked, searched_area(settings.trees, measured.crs))
    if slip := wrong_unit(*np.array([[p["field_cm"], p["dbh_cm"]] for p in matched.pairs], float).reshape(-1, 2).T):
        text = (
            f"{settings.field}: DBHs of the tally beside those of the same trees in {settings.trees.name}: "
            f"{slip.text()}; name the unit in the column (dbh_in, dbh_mm, girth_cm), correct the rows, or give "
            "--dbh-unit if it is right."
        )
        if settings.dbh_unit == "auto":
            raise InputError(text)
        reporter.warn(text)
    reporter.tell(tally_of_other_trees(matched.pairs, tally, settings.field))
    xy = measured[["x", "y"]].to_numpy(float)
    advice = turn_advice(matched.plots, plots, matched.field_trees, xy, settings, settings, measured.crs)
    reporter.tell([*left_out, *matched.warnings, *offsets_apart(matched.plots, settings.plots), *advice])
    write_pairs(settings.output, matched, measured.crs)
    good = [pair for pair in matched.pairs if pair["pair_status"] != "rejected"]
    for plot in matched.plots:
        residual = plot["residual_m"]
        reporter.info(
            f"Plot {plot['plot_id']}: {plot['n_pairs']} of {plot['n_field']} field trees paired, moved "
            f"({plot['offset_e_m']:+.2f}, {plot['offset_n_m']:+.2f}) m, turned {plot['rot_deg']:+.1f} degrees"
            + ("." if residual is None else f", residual {residual:.2f} m.")
        )
    return {
        "output": str(settings.output),
        "n_field": len(matched.field_trees),
        "n_pairs": len(good),
        "n_reviewed": review.total,
        "n_suggested": len(matched.suggested),
        "n_plots": len(matched.plots),
        "n_plots_to_check": sum(plot["status"] == "check" for plot in matched.plots),
        "n_plots_at_turn_limit": sum(is_stuck(plot, settings) for plot in matched.plots),
    }


COMMAND = Command(
    name="match-plots",
    title="Pair field and measured trees",
    group="3 Check",
    summary="Pair field trees with measured trees by position, as an editable layer.",
    help=(
        "Turns bearing and distance into coordinates (true, grid or magnetic north; level or slope distance; to "
        "the pith or the face), moves and turns each plot as a whole onto the measured trees, and pairs one to "
        "one. DBH is never used to pair, so the pairs can judge it. Where two placings fit about equally well, as"
        " in planted rows, the plot is left to you: the layer 'suggested' shows the best guess; set the plot's "
        "status to ok, or draw two pairs in the layer 'pairs', and run again. In the layer 'pairs', set "
        "pair_status to ok, moved (after dragging a line's end to another tree) or rejected: what you locked is "
        "kept when you run again onto the same file. Unpaired trees of both sides stay in the layers "
        "'field_trees' and 'measured_trees'. Units: metres, centimetres, degrees."
    ),
    settings=MatchPlotsSettings,
    run=run,
    main=("trees", "field", "plots", "north", "output"),
    example="treedgs match-plots --trees trees.gpkg --field flight/field_trees.csv --plots flight/plots.csv "
    "--output pairs.gpkg",
    outputs={
        "output": "pairs layer",
        "n_field": "field trees",
        "n_pairs": "pairs made or confirmed",
        "n_reviewed": "measured trees that a person decided on",
        "n_suggested": "suggestions left to a hand check",
        "n_plots": "plots",
        "n_plots_to_check": "plots left to a hand check",
        "n_plots_at_turn_limit": "plots that fit best at the largest turn searched",
    },
)
