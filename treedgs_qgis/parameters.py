"""From the engine's declarations (``parameters.json``) to QGIS parameters, and QGIS values back to the engine's."""

from __future__ import annotations

import json
import os
import re
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingOutputHtml,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
    QgsProcessingParameterVectorDestination,
    QgsProcessingParameterVectorLayer,
)

from . import compat, layers
from .i18n import tr
from .words import in_qgis_words, qgis_name

#: What some verbs take instead of a CRS: metres without a place on the map.
LOCAL = "local"
DESTINATIONS = ("output_file", "output_folder")
#: Results that are pages to read, the one to open first: QGIS lists them in its Results Viewer.
PAGES = ("report", "page", "paper")

_WORDS = {
    "dtm": "DTM",
    "crs": "CRS",
    "dbh": "DBH",
    "bh": "breast height",
    "id": "ID",
    "gsd": "ground sample distance",
    "se": "standard error",
    "sd": "standard deviation",
    "ha": "hectare",
    "gcp": "ground control points",
}
#: Names that do not say what is meant, in words.
_LABELS = {
    "input": "Point cloud",
    "field": "Field trees (table)",
    "taped": "Taped trees (table)",
    "boundary": "Stand boundary",
    "stand": "Canopy heights, cloud or trees there",
    "fit": "Way of measuring",
    "sheets": "Evidence sheets (a picture a tree)",
    "orthophoto": "Orthophoto of the ground below the crowns",
    "n": "Trees to tape",
    "highest_m": "Highest flight over the ground",
    "clearance_m": "Distance kept from the crowns",
    "missing": "Stems without a DBH",
    "to": "Distances reach to",
    "distance": "Distances were taken",
    "weights": "Reliability of points",
    "against": "Pairs of another method",
    "at": "Only at these points of a finished run",
    "north": "North of the bearings",
}
#: Endings of a name that only repeat the unit.
_UNIT_WORDS = {"m", "cm", "mm", "deg", "s", "px", "gb", "pct", "m2", "ha", "min", "ms"}
_NUMBER = re.compile(r"^(n_.+|cores|seed|.+_(m|cm|mm|m2|m3|s|gb|mb|pct|ha|px|deg|cm_m|count)|seconds)$")


def label(entry: dict[str, Any]) -> str:
    """What stands beside the widget: words, with the unit in brackets."""
    words, unit = entry["name"].split("_"), entry.get("unit", "")
    if entry["name"] in _LABELS:
        return f"{_LABELS[entry['name']]} [{unit}]" if unit else _LABELS[entry["name"]]
    # A unit of two words is two endings: speed_m_s.
    for _ in range(1 + unit.count("/")) if unit else ():
        if len(words) > 1 and words[-1] in _UNIT_WORDS:
            words.pop()
    if unit and words[-1] == "per":
        words.pop()
    text = " ".join(_WORDS.get(word, word) for word in words)
    text = text[0].upper() + text[1:]
    return f"{text} [{unit}]" if unit else text


def make_parameter(entry: dict[str, Any]) -> QgsProcessingParameterDefinition:
    """One declared parameter as a QGIS definition."""
    kind, name, text = entry["kind"], qgis_name(entry["name"]), tr(label(entry))
    default = entry["default"]
    # With a default nothing has to be given, but nothing can be left empty either: not what QGIS calls optional.
    optional = not entry["required"] and default is None
    suffixes = entry.get("suffixes", [])
    if layers.kind_of(entry) == "vector":
        made = QgsProcessingParameterVectorLayer(name, text, [compat.SOURCE_VECTOR], default, optional)
    elif layers.kind_of(entry) == "raster":
        made = QgsProcessingParameterRasterLayer(name, text, default, optional)
    elif kind in ("file", "files"):
        made = QgsProcessingParameterFile(name, text, compat.FILE, "", default, optional, file_filter(suffixes))
    elif kind == "folder":
        made = QgsProcessingParameterFile(name, text, compat.FOLDER, "", default, optional)
    elif kind == "output_folder":
        made = QgsProcessingParameterFolderDestination(name, text, None, optional, not optional)
    elif kind == "output_file":
        made = _destination(name, text, suffixes, optional)
    elif kind == "crs":
        made = QgsProcessingParameterCrs(name, text, "ProjectCrs" if entry["required"] else default, optional)
    elif kind == "choice":
        made = QgsProcessingParameterEnum(name, text, entry["choices"], False, default, optional, True)
    elif kind == "flag":
        made = QgsProcessingParameterBoolean(name, text, default, optional)
    elif kind in ("integer", "number"):
        made = QgsProcessingParameterNumber(
            name, text, compat.INTEGER if kind == "integer" else compat.DOUBLE, default, optional
        )
        # Limits are checked in algorithm.py too: QGIS would refuse without saying what was expected.
        if entry.get("minimum") is not None:
            made.setMinimum(entry["minimum"])
        if entry.get("maximum") is not None:
            made.setMaximum(entry["maximum"])
    else:
        made = QgsProcessingParameterString(name, text, default, False, optional)
    if kind == "number":
        # QGIS would show six decimals.
        shown = max(2, len(f"{default or 0:.6f}".rstrip("0").partition(".")[2]))
        made.setMetadata({"widget_wrapper": {"decimals": shown}})
    made.setHelp(help_text(entry))
    if entry.get("advanced"):
        made.setFlags(made.flags() | compat.FLAG_ADVANCED)
    return made


def help_text(entry: dict[str, Any]) -> str:
    """The parameter's help with unit and limits."""
    text = tr(entry["help"])
    parts = [text[:1].upper() + text[1:].rstrip(".")]
    if entry.get("unit"):
        parts.append(tr("in {unit}").format(unit=entry["unit"]))
    parts.append(limits(entry.get("minimum"), entry.get("maximum")))
    return in_qgis_words(", ".join(filter(None, parts)) + ".", entry["known"])


def limits(low: float | None, high: float | None) -> str:
    """``0.5 to 2.5``, ``at least 1``, ``at most 9``; '' without limits."""
    if low is not None and high is not None:
        return tr("{low} to {high}").format(low=f"{low:g}", high=f"{high:g}")
    if low is not None:
        return tr("at least {low}").format(low=f"{low:g}")
    return tr("at most {high}").format(high=f"{high:g}") if high is not None else ""


def make_outputs(declaration: dict[str, Any]) -> list[Any]:
    """The verb's results that are not files the user names: numbers, texts, pages."""
    named = {entry["name"] for entry in declaration["parameters"] if entry["kind"] in DESTINATIONS}
    outputs = []
    for key, text in declaration["outputs"].items():
        if key in PAGES:
            # The Results Viewer shows the description alone, in a narrow list.
            outputs.append(QgsProcessingOutputHtml(qgis_name(key), tr(declaration["title"])))
        elif key in named:
            continue
        elif _NUMBER.match(key):
            outputs.append(QgsProcessingOutputNumber(qgis_name(key), tr(text)))
        else:
            outputs.append(QgsProcessingOutputString(qgis_name(key), tr(text)))
    return outputs


def engine_values(
    algorithm: Any, declaration: dict[str, Any], parameters: dict[str, Any], context: Any, feedback: Any
) -> dict[str, Any]:
    """What goes into ``job.json``: the engine's names, plain JSON values, absolute paths; empty ones left out.

    Raises:
        OSError: a layer of the project cannot be copied.
    """
    values: dict[str, Any] = {}
    for entry in declaration["parameters"]:
        name, kind = qgis_name(entry["name"]), entry["kind"]
        given = parameters.get(name)
        if kind in DESTINATIONS:
            # A workspace is there for the next run: in a temporary folder that would begin anew, and find nothing.
            lost = entry["name"] == "workspace" and str(given) == "TEMPORARY_OUTPUT"
            if (given in (None, "") or lost) and not entry["required"]:
                continue
            if kind == "output_file" and _is_layer(entry.get("suffixes", [])):
                value = _path(algorithm.parameterAsOutputLayer(parameters, name, context))
            else:
                value = _path(algorithm.parameterAsFileOutput(parameters, name, context))
        elif given is None and entry["default"] is None and kind != "crs":
            continue
        elif layers.kind_of(entry):
            value = layers.Given(algorithm, name, parameters, context).file(context, feedback)
        elif kind in ("file", "files", "folder"):
            value = _path(algorithm.parameterAsString(parameters, name, context))
        elif kind == "crs" and given == LOCAL:
            value = LOCAL
        elif kind == "crs":
            crs = algorithm.parameterAsCrs(parameters, name, context)
            value = (code_of(crs) or crs.toWkt()) if crs.isValid() else ""
        elif kind == "choice":
            value = algorithm.parameterAsEnumString(parameters, name, context)
        elif kind == "flag":
            value = algorithm.parameterAsBoolean(parameters, name, context)
        elif kind == "integer":
            value = algorithm.parameterAsInt(parameters, name, context)
        elif kind == "number":
            value = algorithm.parameterAsDouble(parameters, name, context)
        else:
            value = algorithm.parameterAsString(parameters, name, context)
        if value not in ("", None):
            values[entry["name"]] = value
    return values


def code_of(crs: QgsCoordinateReferenceSystem) -> str:
    """``EPSG:32615``; '' for one without a code: those of the user (``USER:100000``) QGIS numbers by itself."""
    return "" if crs.authid().startswith("USER:") else crs.authid()


def result_values(declaration: dict[str, Any], values: dict[str, Any], result: dict[str, Any]) -> dict[str, Any]:
    """The engine's result under QGIS names, with the destinations that were written."""
    found: dict[str, Any] = {}
    for entry in declaration["parameters"]:
        if entry["kind"] in DESTINATIONS and entry["name"] in values:
            found[qgis_name(entry["name"])] = values[entry["name"]]
    for key, value in result.items():
        if key in declaration["outputs"] and qgis_name(key) not in found and value is not None:
            plain = isinstance(value, (str, int, float, bool))
            found[qgis_name(key)] = value if plain else json.dumps(value, ensure_ascii=False)
    return found


def _is_layer(suffixes: list[str]) -> bool:
    layers = (".gpkg", ".tif", ".laz") if compat.POINT_CLOUD_DESTINATION else (".gpkg", ".tif")
    return bool(suffixes) and suffixes[0] in layers


def _destination(name: str, text: str, suffixes: list[str], optional: bool) -> QgsProcessingParameterDefinition:
    if suffixes[:1] == [".gpkg"]:
        return QgsProcessingParameterVectorDestination(name, text, compat.SOURCE_VECTOR, None, optional, not optional)
    if suffixes[:1] == [".tif"]:
        return QgsProcessingParameterRasterDestination(name, text, None, optional, not optional)
    if suffixes[:1] == [".laz"] and compat.POINT_CLOUD_DESTINATION:
        return compat.POINT_CLOUD_DESTINATION(name, text, None, optional, not optional)
    return QgsProcessingParameterFileDestination(name, text, file_filter(suffixes), None, optional, not optional)


def file_filter(suffixes: list[str]) -> str:
    """A file dialog's filter; an exact one first, all files second."""
    if not suffixes:
        return "All files (*)"
    kinds = " ".join(f"*{suffix}" for suffix in suffixes)
    return f"{suffixes[0].lstrip('.').upper()} files ({kinds} {kinds.upper()});;All files (*)"


def _path(text: str) -> str:
    """An absolute plain path; a layer address like ``/x/a.gpkg|layername=b`` loses its tail."""
    if not text:
        return ""
    if text.startswith("ogr:"):
        found = re.search(r"dbname='([^']+)'", text)
        text = found.group(1) if found else text[4:]
    return os.path.abspath(os.path.expanduser(text.split("|")[0]))
