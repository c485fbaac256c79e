"""``treedgs:pointcloudtodbh``: a LAS/LAZ cloud in, tree points with DBH out."""

from __future__ import annotations

import os

from ..treedgs_qgis import checks, layers
from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``pointcloud-to-dbh``."""

    COMMAND = "pointcloud-to-dbh"
    LAYER_NAME = "Trees"
    TAGS = ("lidar", "las", "laz", "tls", "point cloud", "inventory", "timber", "stem curve")

    def needs(self, parameters, context):
        """What is called LAS or LAZ begins like it, and the terrain model lies under it."""
        path = os.path.expanduser(self.parameterAsString(parameters, "INPUT", context).split("|")[0])
        if path.lower().endswith((".las", ".laz")):
            with open(path, "rb") as stream:
                if stream.read(4) != b"LASF":
                    return self.tr("INPUT: {path} is not a LAS or LAZ file; convert the cloud to LAZ first.").format(
                        path=path
                    )
        dtm = layers.Given(self, "DTM", parameters, context).path()
        crs = self.parameterAsCrs(parameters, "CRS", context)
        return checks.dtm_cloud_problem(os.path.expanduser(dtm), path, crs) if dtm else ""
