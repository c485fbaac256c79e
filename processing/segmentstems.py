"""``treedgs:segmentstems``: the points of each stem."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``segment-stems``."""

    COMMAND = "segment-stems"
    TAGS = ("lidar", "point cloud", "segmentation")
