"""``treedgs:trial``: measured diameters tested on a plot of one's own."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``trial``."""

    COMMAND = "trial"
    LAYER_NAME = "Trees to tape"
    TAGS = ("tape", "trial", "accuracy", "equivalence", "blind test")
