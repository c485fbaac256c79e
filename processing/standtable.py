"""``treedgs:standtable``: stand and stock tables, and the report."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``stand-table``."""

    COMMAND = "stand-table"
    NEED = "Trees and plots, or pairs"
    TAGS = (
        "inventory",
        "report",
        "volume",
        "biomass",
        "basal area",
        "stock",
        "FVS",
        "cruise",
        "timber",
        "export",
        "Excel",
    )
