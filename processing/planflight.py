"""``treedgs:planflight``: what to fly for a wanted error."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``plan-flight``."""

    COMMAND = "plan-flight"
    LAYER_NAME = "Flight plan"
    NEED = "Plots; and what stands there, as a layer (with trees also the crown base) or in numbers"
    TAGS = ("flight", "drone", "UAV", "mission", "waypoints", "KMZ", "WPML", "QGroundControl", "Litchi", "plan")
