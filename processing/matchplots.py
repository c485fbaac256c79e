"""``treedgs:matchplots``: field trees paired with measured trees."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``match-plots``."""

    COMMAND = "match-plots"
    LAYER_NAME = "Pairs"
    TAGS = ("field", "tally", "pair", "stem map", "inventory", "export")
