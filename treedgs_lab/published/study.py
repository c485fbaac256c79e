"""One evaluation with clouds or workspaces: what it has, what it found, and which of several plots a picture shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from treedgs_geo.core import workspace as names
from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.tables import PairsEvidence
from treedgs_geo.report.blocks import Block, Paragraph
from treedgs_geo.report.charts import write_chart

from . import point_sets
from .methods import StemPoints
from .reference import Reference, pooled_reference
from .segmentation import LabelledPoints


@dataclass
class Study:
    """What the experiments and the paper's document draw on.

    evidence: of the pairs. metrics: for ``metrics.json``. references: stems of known DBH, plot by plot. folder: where
    tables and charts go. blocks: of the page. sources, oracle: source -> segmented points of all reference stems, by
    our labels and by the true ones (empty where not every plot has these). labelled: points whose segmentation is
    shown.
    """

    evidence: PairsEvidence
    metrics: dict[str, Any]
    plots: list[PlotFiles]
    references: list[Reference]
    folder: Path
    blocks: list[Block] = field(default_factory=list)
    sources: dict[str, StemPoints] = field(default_factory=dict)
    oracle: dict[str, StemPoints] = field(default_factory=dict)
    labelled: list[LabelledPoints] = field(default_factory=list)

    @cached_property
    def reference(self) -> Reference:
        """The stems of all plots."""
        return pooled_reference(self.references)

    def reference_of(self, plot: PlotFiles) -> Reference:
        """The stems of known DBH of a plot."""
        return self.references[self.plots.index(plot)]

    @property
    def workspaces(self) -> list[PlotFiles]:
        """The plots with a workspace."""
        return [plot for plot in self.plots if plot.workspace_in is not None]

    @property
    def gaussians(self) -> list[PlotFiles]:
        """The plots whose workspace has Gaussians and their surface samples; none where torch is not installed."""
        if find_spec("torch") is None:
            return []
        wanted = names.FIELD, names.SURFACE
        return [
            plot
            for plot in self.plots
            if (folder := plot.workspace_in) is not None and all((folder / name).is_file() for name in wanted)
        ]

    @cached_property
    def sets(self) -> list[point_sets.PointSets]:
        """Means, fused depth and samples of each of :attr:`gaussians`."""
        return [point_sets.point_sets(plot, self.reference_of(plot)) for plot in self.gaussians]

    def chart(self, name: str, figure: Any | None) -> list[Block] | None:
        """The figure, written; ``None`` where there is none."""
        return None if figure is None else [write_chart(self.folder, name, figure)]

    def first_drawn(
        self, plots: list[PlotFiles], draw: Callable[[PlotFiles, Reference], Any | None], name: str
    ) -> list[Block] | None:
        """The figure of the first plot that gives one, with the plot's name above it; ``None`` where none does."""
        for plot in plots:
            if shown := self.chart(name, draw(plot, self.reference_of(plot))):
                return [Paragraph(f"Shown: {plot.name}."), *shown]
        return None
