"""``treedgs:compare``: growth, ingrowth and mortality between two dates."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``compare``."""

    COMMAND = "compare"
    LAYER_NAME = "Change"
    TAGS = ("growth", "increment", "ingrowth", "mortality", "permanent plot", "remeasurement", "inventory")
