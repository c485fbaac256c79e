"""What the report says, in order: one list of blocks that the page and the PDF are both made from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...report.blocks import Block, Cards, Document, Heading, Picture, Sentences, facts_table
from . import charts
from .survey import Stand
from .tables import (
    correction_table,
    cross_table,
    equations_table,
    plots_table,
    species_class_table,
    stock_table,
    summary_table,
    trees_table,
)
from .units import UNITS


def make_document(stand: Stand, units: str, class_width: float | None, facts: dict[str, str]) -> Document:
    """Compose the report. facts: label -> value rows about inputs and settings."""
    long = species_class_table(stand, units, class_width)
    tables = {
        table.name: table
        for table in (
            summary_table(stand, units),
            long,
            plots_table(stand, units),
            correction_table(stand, units),
            equations_table(stand),
            trees_table(stand, units),
        )
    }
    about = facts_table("about", "Inputs and settings", facts)
    blocks: list[Block] = [
        Cards(_cards(stand, units)),
        Sentences(stand.warnings, "Read this first"),
        tables["summary"],
        Heading("Diameter distribution"),
        Picture("trees and basal area by DBH class and species", charts.draw_classes(long, units)),
        stock_table(long),
    ]
    if len({row["species"] for row in long.rows} - {"all"}) > 1:
        shown = [name for name in ("trees", "ba", "volume") if np.isfinite(stand.estimates[name].mean)]
        blocks += [cross_table(long, units, name) for name in shown]
    blocks.append(Heading("Plots"))
    for picture, text in (
        (charts.draw_overview(stand), "map of the plots, coloured by basal area"),
        (charts.draw_plots(stand), "trees of the plots; discs grow with DBH, numbers are DBH in cm"),
    ):
        if picture is not None:
            blocks.append(Picture(text, picture))
    q = UNITS[units]
    plot_columns = ["plot_id", "edge", "n_trees", "n_missing", q["area"].key, "expansion"]
    plot_columns += [q[name].key for name in ("trees", "ba", "qmd", "dominant", "volume", "biomass")]
    blocks += [
        tables["plots"].only(*plot_columns),
        Heading("How the figures were made"),
        tables["corrections"],
        Sentences([*stand.notes, *stand.values.curves, *_dead(stand, units)]),
    ]
    if tables["equations"].rows:
        blocks.append(tables["equations"].only("id", "n", "beyond", "range", "source"))
    blocks += [about, replace(tables["trees"], folded=True, more="stand_trees.csv and stand_table.xlsx")]
    kind = "census" if stand.design.census else f"{stand.design.n} plot{'s' if stand.design.n != 1 else ''}"
    area = f"{stand.design.areas.sum() * q['area'].factor:.3g} {q['area'].unit}"
    source = "field tally" if stand.from_field else "measured trees"
    return Document(
        f"Stand table: {stand.stand_id}",
        f"{kind}, {area} in all, from {source}",
        blocks,
        {**tables, "about": about},
        letter=units == "us",
    )


def _cards(stand: Stand, units: str) -> list[tuple[str, str, str]]:
    """(label, value with unit, interval) of the figures that are known."""
    cards = []
    for name in ("trees", "ba", "qmd", "dominant", "volume", "biomass"):
        found, q = stand.estimates[name], UNITS[units][name]
        if not np.isfinite(found.mean):
            continue
        value = f"{found.mean * q.factor:,.{q.decimals}f}".replace(",", "\u202f")
        interval = ""
        # From one plot the interval is of measuring it; beside the stand's figure it would be taken for the stand's.
        one = stand.design.n == 1 and not stand.design.census
        if (not one or found.se_missing > 0) and np.isfinite(found.low) and np.isfinite(found.high):
            low, high = (f"{x * q.factor:,.{q.decimals}f}".replace(",", "\u202f") for x in (found.low, found.high))
            interval = f"{low} to {high}" + (" in this plot" if one else "")
        label = "QMD" if name == "qmd" else q.label
        cards.append((label, f"{value} {q.unit}", interval))
    return cards


def _dead(stand: Stand, units: str) -> list[str]:
    sentences = []
    if len(stand.dead):
        q = UNITS[units]
        sentences.append(
            f"Dead trees are no part of any figure above: {stand.dead_per_ha['trees'] * q['trees'].factor:.1f} "
            f"{q['trees'].unit}, {stand.dead_per_ha['ba'] * q['ba'].factor:.2f} {q['ba'].unit} (uncorrected)."
        )
    return sentences
