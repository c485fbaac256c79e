"""Values refused before anything starts: each check returns the sentence that says what is wrong, or ''."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCoordinateTransformContext,
    QgsCsException,
    QgsPointXY,
    QgsRasterLayer,
    QgsRectangle,
)

from . import compat, location
from .i18n import tr
from .parameters import LOCAL, code_of, limits

#: A flight may begin this far from the edge of the terrain model under its plots.
FLIGHT_MARGIN_M = 1000.0


def path_problem(name: str, kind: str, text: str) -> str:
    """A file, a folder, or either (``files``), that exists."""
    path = Path(os.path.expanduser(text.split("|")[0]))
    if not path.exists():
        if kind == "folder":
            return tr("{name}: {path} does not exist; give a folder that does.").format(name=name, path=path)
        return tr("{name}: {path} does not exist; give a file that does.").format(name=name, path=path)
    if kind == "file" and path.is_dir():
        return tr("{name}: {path} is a folder, expected a file.").format(name=name, path=path)
    if kind == "folder" and not path.is_dir():
        return tr("{name}: {path} is a file, expected a folder.").format(name=name, path=path)
    return ""


def output_problem(name: str, given: str, suffixes: list[str]) -> str:
    """A file that can be written, of a known kind."""
    if given.startswith("memory:"):
        return tr("{name}: a layer in memory cannot be written; give a file name.").format(name=name)
    suffix = os.path.splitext(given.split("|")[0])[1].lower()
    if suffixes and suffix and suffix not in suffixes and not given.startswith("ogr:"):
        return tr("{name}: {path} ends in {found}, expected one of {wanted}.").format(
            name=name, path=given, found=suffix, wanted=", ".join(suffixes)
        )
    return ""


def number_problem(entry: dict[str, Any], name: str, given: Any) -> str:
    """A number within its limits."""
    unit = " " + tr("in {unit}").format(unit=entry["unit"]) if entry.get("unit") else ""
    try:
        number = float(given)
        if entry["kind"] == "integer" and number != int(number):
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        if not isinstance(given, (str, float, int)):
            return ""  # a modeler's property or expression: QGIS resolves it
        text = (
            tr("{name}: found '{given}', expected a whole number{unit}.")
            if entry["kind"] == "integer"
            else tr("{name}: found '{given}', expected a number{unit}.")
        )
        return text.format(name=name, given=given, unit=unit)
    low, high = entry.get("minimum"), entry.get("maximum")
    if number != number or (low is not None and number < low) or (high is not None and number > high):
        return tr("{name}: found {given}, expected {limits}{unit}.").format(
            name=name, given=given, limits=limits(low, high), unit=unit
        )
    return ""


def crs_problem(name: str, given: Any, crs: QgsCoordinateReferenceSystem, inputs: list[str]) -> str:
    """Projected and in metres; otherwise the UTM zone of the inputs, where they say it, is suggested."""
    if given == LOCAL:
        return ""
    zone = "" if crs.isValid() and not crs.isGeographic() else location.utm_suggestion(inputs)
    if not crs.isValid() and given in (None, ""):
        text = tr("{name} is required: give a projected CRS in metres, like {zone}.")
        return text.format(name=name, zone=zone or "EPSG:CODE")
    if not crs.isValid():
        text = tr("{name}: '{given}' is not a coordinate reference system; give one like {zone}.")
        return text.format(name=name, given=given, zone=zone or "EPSG:CODE")
    code, title = code_of(crs), crs.description()
    words = {"name": name, "crs": f"{code} ({title})" if code else title}
    if crs.isGeographic():
        return tr(
            "{name}: {crs} is geographic (degrees), expected a projected CRS in metres; use the UTM zone of your "
            "plot{zone}."
        ).format(**words, zone=zone and f", {zone}")
    if crs.mapUnits() != compat.DISTANCE_METERS:
        text = tr("{name}: {crs} is not in metres; choose the metric version of this CRS or the UTM zone.")
        return text.format(**words)
    return ""


def dtm_flight_problem(dtm: str, photos: str) -> str:
    """The terrain model lies under the flight, by the photos' own positions."""
    where = location.position(Path(photos))
    if where is None:
        return ""
    box = QgsRectangle(where[0], where[1], where[0], where[1])
    what = tr("the photos in {folder}").format(folder=photos)
    return _apart(dtm, box, QgsCoordinateReferenceSystem("EPSG:4326"), FLIGHT_MARGIN_M, what)


def dtm_cloud_problem(dtm: str, cloud: str, crs: QgsCoordinateReferenceSystem) -> str:
    """The terrain model lies under the cloud, by the cloud's header. crs: what the user says."""
    found = location.las_extent(Path(cloud))
    if found is None:
        return ""
    west, south, east, north, wkt = found
    own = QgsCoordinateReferenceSystem.fromWkt(wkt) if wkt else crs
    if not own.isValid():
        return ""
    return _apart(dtm, QgsRectangle(west, south, east, north), own, 0.0, cloud)


def _apart(dtm: str, box: QgsRectangle, crs: QgsCoordinateReferenceSystem, margin_m: float, what: str) -> str:
    layer = QgsRasterLayer(dtm, "dtm", "gdal")
    if not layer.isValid():
        return tr("DTM: {dtm} is not a raster that can be read; give a terrain GeoTIFF.").format(dtm=dtm)
    if not layer.crs().isValid():
        return ""
    try:
        moved = QgsCoordinateTransform(crs, layer.crs(), QgsCoordinateTransformContext()).transformBoundingBox(box)
    except QgsCsException:
        return ""
    extent = layer.extent()
    extent.grow(margin_m if not layer.crs().isGeographic() else margin_m / 1e5)
    # A flight is one point: a rectangle without an area intersects nothing.
    if extent.intersects(moved) or extent.contains(QgsPointXY(moved.center())):
        return ""
    return tr(
        "DTM: {dtm} covers x {west} to {east}, y {south} to {north}, but {what} lies at x {x}, y {y} ({crs}); give the "
        "terrain model of this place."
    ).format(
        dtm=dtm,
        west=f"{extent.xMinimum():.0f}",
        east=f"{extent.xMaximum():.0f}",
        south=f"{extent.yMinimum():.0f}",
        north=f"{extent.yMaximum():.0f}",
        what=what,
        x=f"{moved.center().x():.0f}",
        y=f"{moved.center().y():.0f}",
        crs=code_of(layer.crs()) or layer.crs().description(),
    )
