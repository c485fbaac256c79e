"""What the report says, in order: one list of blocks that the page and the PDF are both made from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import charts
from .corrections import correction_table
from .survey import Stand
from .tables import (
    Column,
    Table,
    cross_table,
    equations_table,
    plots_table,
    species_class_table,
    stock_table,
    summary_table,
    trees_table,
)
from .units import UNITS


@dataclass(frozen=True)
class ReportBlock:
    """kind: ``cards``, ``heading``, ``warnings``, ``list``, ``table``, ``picture`` or ``folded`` (a long table).

    text: heading, sentence or a picture's alternative text. items: sentences, or (label, value, interval) of cards.
    columns: keys to show (all where empty).
    """

    kind: str
    text: str = ""
    items: list[Any] = field(default_factory=list)
    table: Table | None = None
    picture: bytes = b""
    columns: tuple[str, ...] = ()

    def rows(self, most: int) -> tuple[list[dict[str, Any]], str]:
        """The table's rows to show, and a sentence about those left out."""
        assert self.table is not None
        rows = self.table.rows
        if self.kind != "folded" or len(rows) <= most:
            return rows, ""
        return rows[:most], f"{len(rows) - most} more in stand_{self.table.name}.csv and stand_table.xlsx."

    @property
    def shown(self) -> list[Column]:
        """The table's columns to show: those asked for that hold anything."""
        assert self.table is not None
        return [
            column
            for column in self.table.columns
            if (not self.columns or column.key in self.columns)
            and (column.decimals is None or any(_holds(row.get(column.key)) for row in self.table.rows))
        ]


@dataclass
class Document:
    """title, subtitle, blocks; tables: every table by name, for the spreadsheet and the CSV files."""

    title: str
    subtitle: str
    blocks: list[ReportBlock]
    tables: dict[str, Table]
    units: str


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
    about = Table(
        "about",
        "Inputs and settings",
        [Column("what", "What"), Column("value", "Value")],
        [{"what": key, "value": value} for key, value in facts.items()],
    )
    blocks = [ReportBlock("cards", items=_cards(stand, units))]
    if stand.warnings:
        blocks.append(ReportBlock("warnings", items=stand.warnings))
    blocks += [
        ReportBlock("table", table=tables["summary"]),
        ReportBlock("heading", "Diameter distribution"),
        ReportBlock(
            "picture", "trees and basal area by DBH class and species", picture=charts.draw_classes(long, units)
        ),
    ]
    blocks.append(ReportBlock("table", table=stock_table(long)))
    if len({row["species"] for row in long.rows} - {"all"}) > 1:
        shown = [name for name in ("trees", "ba", "volume") if np.isfinite(stand.estimates[name].mean)]
        blocks += [ReportBlock("table", table=cross_table(long, units, name)) for name in shown]
    blocks.append(ReportBlock("heading", "Plots"))
    for picture, text in (
        (charts.draw_overview(stand), "map of the plots, coloured by basal area"),
        (charts.draw_plots(stand), "trees of the plots; discs grow with DBH, numbers are DBH in cm"),
    ):
        if picture is not None:
            blocks.append(ReportBlock("picture", text, picture=picture))
    q = UNITS[units]
    plot_columns: tuple[str, ...] = ("plot_id", "edge", "n_trees", "n_missing", q["area"].key, "expansion")
    plot_columns += tuple(q[name].key for name in ("trees", "ba", "qmd", "dominant", "volume", "biomass"))
    blocks += [
        ReportBlock("table", table=tables["plots"], columns=plot_columns),
        ReportBlock("heading", "How the figures were made"),
        ReportBlock("table", table=tables["corrections"]),
        ReportBlock("list", items=[*stand.notes, *stand.values.curves, *_dead(stand, units)]),
    ]
    if tables["equations"].rows:
        columns = ("id", "n", "beyond", "range", "source")
        blocks.append(ReportBlock("table", table=tables["equations"], columns=columns))
    blocks += [ReportBlock("table", table=about), ReportBlock("folded", table=tables["trees"])]
    kind = "census" if stand.design.census else f"{stand.design.n} plot{'s' if stand.design.n != 1 else ''}"
    area = f"{stand.design.areas.sum() * q['area'].factor:.3g} {q['area'].unit}"
    source = "field tally" if stand.from_field else "measured trees"
    return Document(
        f"Stand table: {stand.stand_id}",
        f"{kind}, {area} in all, from {source}",
        blocks,
        {**tables, "about": about},
        units,
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


def _holds(value: Any) -> bool:
    return value is not None and not (isinstance(value, float) and not np.isfinite(value))
