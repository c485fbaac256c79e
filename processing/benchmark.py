"""``treedgs:benchmark``: speed against accuracy, and stability."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``benchmark``."""

    COMMAND = "benchmark"
    TAGS = ("speed", "accuracy", "pareto", "stability", "robustness")
