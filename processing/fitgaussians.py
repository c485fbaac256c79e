"""``treedgs:fitgaussians``: the Gaussians of a plot."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``fit-gaussians``."""

    COMMAND = "fit-gaussians"
    TAGS = ("gaussian", "splatting", "3dgs", "radiance field")
