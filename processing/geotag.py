"""``treedgs:geotag``: camera stations from PPK files or EXIF."""

from __future__ import annotations

from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``geotag``."""

    COMMAND = "geotag"
    LAYER_NAME = "Camera stations"
    TAGS = ("ppk", "rtk", "mrk", "exif", "camera", "photo")
