"""``treedgs:terrain``: ground points, terrain model and heights above ground."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``terrain``."""

    COMMAND = "terrain"
    LAYER_NAME = "Terrain model"
    TAGS = ("dtm", "dem", "ground", "csf", "lidar", "height", "canopy")
