"""``treedgs:samplesurface``: surface points with reliability from a Gaussian field."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``sample-surface``."""

    COMMAND = "sample-surface"
    TAGS = ("gaussian", "splatting", "opacity", "point cloud")
