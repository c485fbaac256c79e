"""``treedgs:reconstruct``: georeferenced structure from motion."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``reconstruct``."""

    COMMAND = "reconstruct"
    TAGS = ("sfm", "photogrammetry", "colmap", "camera", "photo", "orientation")
