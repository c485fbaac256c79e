"""``treedgs:photostodbh``: the whole chain, drone photos in, tree points with DBH out."""

from __future__ import annotations

import os
from pathlib import Path

from ..treedgs_qgis import checks, layers
from ..treedgs_qgis.algorithm import EngineAlgorithm

PHOTOS = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".dng"}
FEWEST = 3


class Algorithm(EngineAlgorithm):
    """The verb ``photos-to-dbh``."""

    COMMAND = "photos-to-dbh"
    LAYER_NAME = "Trees"
    TAGS = (
        "drone",
        "uav",
        "photo",
        "photogrammetry",
        "gaussian",
        "splatting",
        "inventory",
        "canopy",
        "treetop",
        "height",
        "timber",
    )

    def needs(self, parameters, context):
        """Enough photos, and a terrain model of this place."""
        folder = Path(os.path.expanduser(self.parameterAsString(parameters, "PHOTOS", context)))
        found = sum(1 for entry in folder.rglob("*") if entry.suffix.lower() in PHOTOS)
        if found < FEWEST:
            return self.tr(
                "PHOTOS: {folder} holds {found} photos, expected at least {least} (better 40 or more) as {kinds}."
            ).format(folder=folder, found=found, least=FEWEST, kinds=", ".join(sorted(PHOTOS)))
        dtm = layers.Given(self, "DTM", parameters, context).path()
        return checks.dtm_flight_problem(os.path.expanduser(dtm), str(folder)) if dtm else ""
