"""``treedgs:checkengine``: what the engine has and lacks."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``doctor``."""

    COMMAND = "doctor"
    TAGS = ("install", "environment", "dependencies", "doctor")
