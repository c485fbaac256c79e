"""Names that moved between QGIS 3.22 and 4: each is looked up once, newest place first."""

from __future__ import annotations

from functools import reduce
from typing import Any

import qgis.core
import qgis.gui
from qgis.core import QgsProviderRegistry
from qgis.PyQt import QtCore


def first_attr(*dotted: str, home: Any = qgis.core) -> Any:
    """The first of ``dotted`` (relative to ``home``) that this QGIS has.

    Raises:
        AttributeError: none exists; the message lists what was tried.
    """
    for name in dotted:
        try:
            return reduce(getattr, name.split("."), home)
        except AttributeError:
            continue
    raise AttributeError(f"QGIS {qgis.core.Qgis.QGIS_VERSION} has none of {', '.join(dotted)}")


FLAG_ADVANCED = first_attr("Qgis.ProcessingParameterFlag.Advanced", "QgsProcessingParameterDefinition.FlagAdvanced")
#: Not in models, not in ``qgis_process``, in the thread of the windows.
NEEDS_WINDOWS = (
    first_attr("Qgis.ProcessingAlgorithmFlag.HideFromModeler", "QgsProcessingAlgorithm.FlagHideFromModeler")
    | first_attr(
        "Qgis.ProcessingAlgorithmFlag.NotAvailableInStandaloneTool",
        "QgsProcessingAlgorithm.FlagNotAvailableInStandaloneTool",
    )
    | first_attr("Qgis.ProcessingAlgorithmFlag.NoThreading", "QgsProcessingAlgorithm.FlagNoThreading")
)
FILE = first_attr("Qgis.ProcessingFileParameterBehavior.File", "QgsProcessingParameterFile.File")
FOLDER = first_attr("Qgis.ProcessingFileParameterBehavior.Folder", "QgsProcessingParameterFile.Folder")
INTEGER = first_attr("Qgis.ProcessingNumberParameterType.Integer", "QgsProcessingParameterNumber.Integer")
DOUBLE = first_attr("Qgis.ProcessingNumberParameterType.Double", "QgsProcessingParameterNumber.Double")
SOURCE_VECTOR = first_attr("Qgis.ProcessingSourceType.Vector", "QgsProcessing.TypeVector")
WRITTEN = first_attr("QgsVectorFileWriter.WriterError.NoError", "QgsVectorFileWriter.NoError")
DISTANCE_METERS = first_attr("Qgis.DistanceUnit.Meters", "QgsUnitTypes.DistanceMeters")
LOG_CRITICAL = first_attr("Qgis.MessageLevel.Critical", "Qgis.Critical")
LOG_WARNING = first_attr("Qgis.MessageLevel.Warning", "Qgis.Warning")
LOG_SUCCESS = first_attr("Qgis.MessageLevel.Success", "Qgis.Success")
LINE_STRING = first_attr("Qgis.GeometryType.Line", "QgsWkbTypes.LineGeometry")
SNAP_ADVANCED = first_attr("Qgis.SnappingMode.AdvancedConfiguration", "QgsSnappingConfig.AdvancedConfiguration")
SNAP_VERTEX = first_attr("Qgis.SnappingType.Vertex", "QgsSnappingConfig.VertexFlag")
UNIT_PIXELS = first_attr("Qgis.MapToolUnit.Pixels", "QgsTolerance.Pixels")
#: QGIS can show LAS and LAZ (Debian 12's 3.22 is built without) and has a parameter for them (3.24).
CAN_SHOW_CLOUDS = "pdal" in QgsProviderRegistry.instance().providerList()
POINT_CLOUD_DESTINATION = (
    getattr(qgis.core, "QgsProcessingParameterPointCloudDestination", None) if CAN_SHOW_CLOUDS else None
)
SHOW_VISIBLE = first_attr(
    "QgsAttributeTableFilterModel.FilterMode.ShowVisible", "QgsAttributeTableFilterModel.ShowVisible", home=qgis.gui
)
POINT = first_attr("Qgis.GeometryType.Point", "QgsWkbTypes.PointGeometry")
try:  # Qt 6
    from qgis.PyQt.QtGui import QAction, QShortcut
except ImportError:
    from qgis.PyQt.QtWidgets import QAction, QShortcut  # noqa: F401


def new_field(name: str, text_length: int | None = None) -> Any:
    """A field of an attribute table: of text with so many characters, else of decimal numbers."""
    number = text_length is None
    if qgis.core.Qgis.QGIS_VERSION_INT >= 33800:
        kind = first_attr("QMetaType.Type.Double" if number else "QMetaType.Type.QString", home=QtCore)
    else:
        kind = first_attr("QVariant.Double" if number else "QVariant.String", home=QtCore)
    return first_attr("QgsField")(name, kind, "", text_length or 0, 0)
