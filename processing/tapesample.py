"""``treedgs:tapesample``: trees to tape, drawn with known chances."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``tape-sample``."""

    COMMAND = "tape-sample"
    LAYER_NAME = "Trees to tape"
    TAGS = ("tape", "double sampling", "field", "sample", "GPX")
