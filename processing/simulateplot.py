"""``treedgs:simulateplot``: a synthetic plot with known truth."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``simulate-plot``."""

    COMMAND = "simulate-plot"
    TAGS = ("demo", "synthetic", "test", "flight planning")
