"""``treedgs:planflight``: what to fly for a wanted error."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``plan-flight``."""

    COMMAND = "plan-flight"
    LAYER_NAME = "Flight plan"
    TAGS = ("flight", "drone", "UAV", "mission", "waypoints", "KMZ", "WPML", "QGroundControl", "Litchi", "plan")
