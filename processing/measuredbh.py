"""``treedgs:measuredbh``: slices, fits, taper and the diameter of each stem."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``measure-dbh``."""

    COMMAND = "measure-dbh"
    LAYER_NAME = "Trees"
    TAGS = ("taper", "circle", "cylinder", "slice")
