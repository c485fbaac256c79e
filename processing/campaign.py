"""``treedgs:campaign``: many plots from one table."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``campaign``."""

    COMMAND = "campaign"
    LAYER_NAME = "Trees"
    TAGS = ("many", "batch", "plots", "cluster", "inventory")
