"""Measure a stem where a person clicked: ``photos-to-dbh --at`` from the run's own workspace, in the background."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransformContext,
    QgsFeature,
    QgsGeometry,
    QgsPointXY,
    QgsProcessingAlgRunnerTask,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsVectorFileWriter,
    QgsVectorLayer,
)

from .. import compat, layers
from ..i18n import tr
from .rules import Refused
from .trees import TreeLayer

ALGORITHM = "treedgs:photostodbh"
#: Parameters of the run that its ``--at`` does not take over.
_OWN = ("at", "output", "workspace", "dry_run")
#: Of these, relative ones are relative to the folder that the run was started in.
_PATHS = ("photos", "geotags", "gcp", "calibration", "dtm", "plots", "field_stems")


def workspace_of(trees: TreeLayer) -> str:
    """The workspace of the run that made a layer, or '' (a layer of a cloud, or one that was moved away)."""
    folder = os.path.dirname(trees.sheets()) if trees.sheets() else ""
    return folder if folder and os.path.isfile(os.path.join(folder, "run.json")) else ""


def parameters_of(workspace: str) -> dict[str, Any]:
    """The run's settings as parameters of the algorithm.

    Raises:
        Refused: the workspace holds no run of photos-to-dbh.
    """
    file = os.path.join(workspace, "run.json")
    try:
        with open(file, encoding="utf-8") as stream:
            record = json.load(stream)
        settings, start = dict(record["parameters"]), str(record.get("folder") or workspace)
        settings["photos"], settings["crs"]
    except (OSError, ValueError, KeyError, TypeError) as problem:
        text = tr("{file}: holds no run of photos ({problem}); measure the stem by tape.")
        raise Refused(text.format(file=file, problem=problem)) from None
    for name in _PATHS:
        if settings.get(name):
            settings[name] = os.path.normpath(os.path.join(start, os.path.expanduser(settings[name])))
    return {name.upper(): value for name, value in settings.items() if name not in _OWN and value is not None}


def points_file(
    folder: str, places: list[tuple[int, QgsPointXY]], crs: QgsCoordinateReferenceSystem, asked: str = ""
) -> str:
    """A layer of points, named by their tree's number, ``asked`` before it.

    Raises:
        OSError: it cannot be written.
    """
    layer = QgsVectorLayer("Point?field=tree_id:string", "points", "memory")
    layer.setCrs(crs)
    for number, place in places:
        feature = QgsFeature(layer.fields())
        feature.setAttribute("tree_id", f"{asked}{number}")
        feature.setGeometry(QgsGeometry.fromPointXY(place))
        layer.dataProvider().addFeatures([feature])
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName, options.layerName = "GPKG", "points"
    target = os.path.join(folder, "points.gpkg")
    code, why, *_ = QgsVectorFileWriter.writeAsVectorFormatV3(layer, target, QgsCoordinateTransformContext(), options)
    if code != compat.WRITTEN:
        raise OSError(f"{target}: {why}")
    return target


class Measuring:
    """One measurement in the background. done: called in the main thread with (succeeded, sentence)."""

    def __init__(
        self, trees: TreeLayer, places: list[tuple[int, QgsPointXY]], done: Callable[[bool, str], None], asked: str = ""
    ) -> None:
        """Start it.

        Raises:
            Refused: the layer has no workspace beside it, or is being edited.
        """
        workspace = workspace_of(trees)
        if not workspace:
            text = tr(
                "{layer}: its run's workspace was not found; only a layer of photos beside its workspace can do this."
            )
            raise Refused(text.format(layer=trees.layer.name()))
        if trees.layer.isEditable():
            text = tr("{layer}: is being edited; save the edits and end editing first.")
            raise Refused(text.format(layer=trees.layer.name()))
        parameters = parameters_of(workspace)
        self._done, self._path = done, trees.path()
        self._folder = tempfile.mkdtemp(prefix="treedgs-points-")
        parameters |= {
            "WORKSPACE": workspace,
            "OUTPUT": self._path,
            "AT": points_file(self._folder, places, trees.layer.crs(), asked),
        }
        self.context, self.feedback = QgsProcessingContext(), _Listening()
        algorithm = QgsApplication.processingRegistry().createAlgorithmById(ALGORITHM)
        self.task = QgsProcessingAlgRunnerTask(algorithm, parameters, self.context, self.feedback)
        self.task.executed.connect(self._finished)
        QgsApplication.taskManager().addTask(self.task)

    def _finished(self, succeeded: bool, results: dict[str, Any]) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
        layers.reload_file(self._path)
        status = str(results.get("STATUS") or "")
        points = [line for line in self.feedback.lines if line.startswith("point ")]
        text = "\n".join(points) or status or (self.feedback.error or tr("nothing was measured; the log says why"))
        self._done(bool(succeeded), text)


class _Listening(QgsProcessingFeedback):
    """Keeps what the engine says."""

    def __init__(self) -> None:
        super().__init__(False)
        self.lines: list[str] = []
        self.error = ""

    def pushInfo(self, info: str) -> None:
        """A line of the log."""
        self.lines.append(info)

    def pushWarning(self, warning: str) -> None:
        """A warning is said too."""
        self.lines.append(warning)

    def reportError(self, error: str, fatalError: bool = False) -> None:
        """The sentence that ends the run."""
        self.error = error
