"""``treedgs:terrain``: ground points, terrain model and heights above ground."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``terrain``."""

    COMMAND = "terrain"
    TAGS = ("dtm", "dem", "ground", "csf", "lidar", "height")
