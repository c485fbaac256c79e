"""What the paper document draws on, and which of several plots a picture shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.inventory.accuracy.reference import Reference
from treedgs_geo.inventory.accuracy.tables import PairsEvidence
from treedgs_geo.report.blocks import Block, Paragraph
from treedgs_geo.report.charts import write_chart

from . import point_sets
from .labelled import LabelledPoints
from .methods import StemPoints
from .point_sets import PointSets


@dataclass(frozen=True)
class PaperInputs:
    """All that the document draws on. gathered: source -> segmented points of the reference stems. metrics: as in
    ``metrics.json``. folder: with the charts and tables that are written already. labelled: points whose segmentation
    is shown."""

    evidence: PairsEvidence
    metrics: dict[str, Any]
    plots: list[PlotFiles]
    references: list[Reference]
    gathered: dict[str, StemPoints]
    folder: Path
    labelled: list[LabelledPoints]

    @property
    def workspaces(self) -> list[PlotFiles]:
        """The plots with a workspace."""
        return [plot for plot in self.plots if plot.workspace_in is not None]

    @property
    def gaussians(self) -> list[PlotFiles]:
        """The plots whose workspace has Gaussians."""
        return [plot for plot in self.plots if point_sets.has_gaussians(plot)]

    @cached_property
    def sets(self) -> list[PointSets]:
        """Means, fused depth and samples of each of :attr:`gaussians`."""
        return [point_sets.point_sets(plot, self.reference_of(plot)) for plot in self.gaussians]

    def reference_of(self, plot: PlotFiles) -> Reference:
        """The stems of known DBH of a plot."""
        return self.references[self.plots.index(plot)]

    def first_drawn(
        self, plots: list[PlotFiles], draw: Callable[[PlotFiles], Any | None], name: str
    ) -> list[Block] | None:
        """The figure of the first plot that gives one, with the plot's name above it; ``None`` where none does."""
        for plot in plots:
            if (figure := draw(plot)) is not None:
                return [Paragraph(f"Shown: {plot.name}."), write_chart(self.folder, name, figure)]
        return None
