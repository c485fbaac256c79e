"""Camera stations and the terrain model."""

from __future__ import annotations

from pathlib import Path

from osgeo import gdal
from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsColorRampShader,
    QgsCubicRasterResampler,
    QgsHillshadeRenderer,
    QgsMapLayer,
    QgsProperty,
    QgsRasterLayer,
    QgsRasterShader,
    QgsRendererCategory,
    QgsSingleBandPseudoColorRenderer,
    QgsSymbolLayer,
    QgsVectorLayer,
)
from qgis.PyQt.QtGui import QColor

from .common import AMBER, GREY, labels, marker, memory_layer, said

STATIONS = {
    "name": ("string", "Photo"),
    "path": ("string", "File"),
    "quality": ("string", "Position quality"),
    "sd_e_m": ("double", "Standard deviation east [m]"),
    "sd_n_m": ("double", "Standard deviation north [m]"),
    "sd_u_m": ("double", "Standard deviation up [m]"),
    "utc": ("string", "Exposure (UTC)"),
    "utc_unix": ("double", "Exposure (UTC) [s since 1970]"),
    "flight": ("integer", "Flight"),
    "yaw_deg": ("double", "Yaw [°]"),
    "pitch_deg": ("double", "Pitch [°]"),
    "roll_deg": ("double", "Roll [°]"),
    "rel_alt_m": ("double", "Height above take-off [m]"),
    "note": ("string", "Note"),
    "v_e_m_s": ("double", "Velocity east [m/s]"),
    "v_n_m_s": ("double", "Velocity north [m/s]"),
    "v_u_m_s": ("double", "Velocity up [m/s]"),
    "v_source": ("string", "Source of the velocity"),
}


def stations() -> QgsVectorLayer:
    """Camera stations: a triangle that points where the camera looked, coloured by how well the place is known."""
    layer = memory_layer(STATIONS, "stations")
    looks = {
        "fix": ("fixed (centimetres)", "#1565c0"),
        "float": ("float (decimetres)", "#00a0b0"),
        "single": ("single (metres)", AMBER),
        "exif": ("from the photo (metres)", "#8e44ad"),
        "none": ("unknown", GREY),
    }
    categories = []
    for value, (text, colour) in looks.items():
        symbol = marker(name="triangle", color=colour, outline_color="#ffffff", size="3.6", outline_width="0.2")
        # The triangle points north; yaw turns clockwise from there.
        symbol.symbolLayer(0).setDataDefinedProperty(
            QgsSymbolLayer.PropertyAngle, QgsProperty.fromExpression('coalesce("yaw_deg", 0)')
        )
        categories.append(QgsRendererCategory(value, symbol, text))
    layer.setRenderer(QgsCategorizedSymbolRenderer("quality", categories))
    layer.setLabeling(labels('"name"', "#333333", 250))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression('"name"')
    layer.setMapTipTemplate(
        """<b>[% "name" %]</b><br>[% "quality" %]"""
        """[% coalesce(' ± ' || format_number(sqrt("sd_e_m"^2 + "sd_n_m"^2), 3) || ' m', '') %]"""
        f"""[% coalesce('<br>' || {said("yaw")} || ' ' || round("yaw_deg") || '°', '') %]"""
        f"""[% coalesce(', ' || {said("pitch")} || ' ' || round("pitch_deg") || '°', '') %]"""
    )
    return layer


def terrain(folder: Path) -> None:
    """The terrain raster as a hillshade."""
    layer = _raster("dtm")
    renderer = QgsHillshadeRenderer(layer.dataProvider(), 1, 315, 45)
    # Forest ground is nearly flat within a plot: the relief is drawn twice as high.
    renderer.setZFactor(2.0)
    layer.setRenderer(renderer)
    layer.resampleFilter().setZoomedInResampler(QgsCubicRasterResampler())
    _save(layer, folder)


def canopy(folder: Path) -> None:
    """The canopy height model, dark (low) to light (high), 0 to 40 m."""
    layer = _raster("chm")
    colours = ((2, "#3b528b"), (10, "#21918c"), (20, "#5ec962"), (30, "#fde725"), (40, "#fff7bc"))
    function = QgsColorRampShader(0, 40)
    function.setColorRampItemList(
        [QgsColorRampShader.ColorRampItem(value, QColor(colour), f"{value} m") for value, colour in colours]
    )
    shader = QgsRasterShader()
    shader.setRasterShaderFunction(function)
    renderer = QgsSingleBandPseudoColorRenderer(layer.dataProvider(), 1, shader)
    # Or the legend says "nan to nan".
    renderer.setClassificationMin(0)
    renderer.setClassificationMax(40)
    layer.setRenderer(renderer)
    _save(layer, folder)


def _raster(name: str) -> QgsRasterLayer:
    driver = gdal.GetDriverByName("GTiff")
    raster = driver.Create(f"/vsimem/{name}.tif", 8, 8, 1, gdal.GDT_Float32)
    raster.SetGeoTransform([500000, 1, 0, 4000000, 0, -1])
    raster.FlushCache()
    return QgsRasterLayer(f"/vsimem/{name}.tif", name, "gdal")


def _save(layer: QgsRasterLayer, folder: Path) -> None:
    message, ok = layer.saveNamedStyle(str(folder / f"{layer.name()}.qml"), QgsMapLayer.Symbology)
    if not ok:
        raise RuntimeError(message)
