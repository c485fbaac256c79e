"""``treedgs:tapecheck``: what taped trees say of the measured ones."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``tape-check``."""

    COMMAND = "tape-check"
    LAYER_NAME = "Tape check"
    TAGS = ("tape", "double sampling", "bias", "validation")
