"""``treedgs:evaluate``: accuracy against field diameters."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``evaluate``."""

    COMMAND = "evaluate"
    TAGS = ("accuracy", "rmse", "bias", "validation", "inventory", "export")
