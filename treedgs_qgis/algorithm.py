"""The base of every algorithm: one verb of the engine, checked before it starts and run as a child process."""

from __future__ import annotations

import difflib
import html
import os
import time
from pathlib import Path
from typing import Any, ClassVar

import qgis.utils
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsMapLayer,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsSettings,
)
from qgis.PyQt.QtCore import QCoreApplication
from qgis.PyQt.QtGui import QIcon

from . import compat, engine, location
from .parameters import (
    DESTINATIONS,
    LOCAL,
    declarations,
    engine_values,
    help_text,
    make_outputs,
    make_parameter,
    qgis_name,
    result_values,
)

ICON = Path(__file__).with_name("icons") / "treedgs.svg"
HELP_URL = (Path(__file__).resolve().parents[1] / "docs" / "qgis.md").as_uri()
#: QGIS keeps every estimate as a line of its log: not too many of them.
ESTIMATE_EVERY_S = 20


class BaseAlgorithm(QgsProcessingAlgorithm):
    """What all algorithms share: icon, translation, and refusing names that do not exist."""

    def tr(self, text: str) -> str:
        """Translate."""
        return QCoreApplication.translate("TreeDGS", text)

    def createInstance(self) -> QgsProcessingAlgorithm:  # noqa: N802
        """A fresh copy, as QGIS asks for."""
        return type(self)()

    def icon(self) -> QIcon:
        """The provider's icon."""
        return QIcon(str(ICON))

    def svgIconPath(self) -> str:  # noqa: N802
        """The same icon as a file."""
        return str(ICON)

    def helpUrl(self) -> str:  # noqa: N802
        """The documentation folder."""
        return HELP_URL

    def checkParameterValues(self, parameters: dict, context: QgsProcessingContext) -> tuple[bool, str]:  # noqa: N802
        """Refuse with one sentence before anything starts."""
        known = [definition.name() for definition in self.parameterDefinitions()]
        for name in parameters:
            if name not in known:
                near = difflib.get_close_matches(name.upper(), known, n=1)
                hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(known) or 'none'}."
                return False, f"Parameter {name} is unknown to {self.id()}; {hint}"
        problem = self.problem(parameters, context)
        if problem:
            return False, problem
        return super().checkParameterValues(parameters, context)

    def problem(self, parameters: dict, context: QgsProcessingContext) -> str:
        """The sentence that says what is wrong with the values, or ''."""
        return ""


class EngineAlgorithm(BaseAlgorithm):
    """One verb. A subclass names :attr:`COMMAND` and adds its own checks in :meth:`needs`."""

    COMMAND = ""
    #: What the layer is called in the project; empty: as QGIS would.
    LAYER_NAME = ""
    #: Search words beside those in the title.
    TAGS: tuple[str, ...] = ()

    @property
    def declaration(self) -> dict[str, Any]:
        """The engine's declaration of this verb."""
        return declarations()[self.COMMAND]

    def name(self) -> str:
        """The id, never translated."""
        return self.declaration["id"]

    def displayName(self) -> str:  # noqa: N802
        """The title in the toolbox."""
        return self.tr(self.declaration["title"])

    def group(self) -> str:
        """The group in the toolbox."""
        return self.tr(self.declaration["group"])

    def groupId(self) -> str:  # noqa: N802
        """The group's id."""
        return self.declaration["group"].lower().replace(" ", "")

    def tags(self) -> list[str]:
        """Search words."""
        return ["treedgs", "forest", "tree", "dbh", "diameter", "stem", self.COMMAND, *self.TAGS]

    def shortDescription(self) -> str:  # noqa: N802
        """One line."""
        return self.tr(self.declaration["summary"])

    def shortHelpString(self) -> str:  # noqa: N802
        """The help panel: what it does, every input with its unit, every output, the same on the command line."""
        entry = self.declaration
        lines = [f"<p><b>{html.escape(entry['summary'])}</b></p>", f"<p>{html.escape(entry['help'])}</p>"]
        if entry["parameters"]:
            lines.append("<h3>Parameters</h3><ul>")
            lines += [
                f"<li><b>{qgis_name(p['name'])}</b>: {html.escape(help_text(p))}</li>" for p in entry["parameters"]
            ]
            lines.append("</ul>")
        if entry["outputs"]:
            lines.append("<h3>Results</h3><ul>")
            lines += [
                f"<li><b>{qgis_name(key)}</b>: {html.escape(text)}</li>" for key, text in entry["outputs"].items()
            ]
            lines.append("</ul>")
        lines.append(f"<p>On the command line:<br><code>{html.escape(entry['example'])}</code></p>")
        return "\n".join(lines)

    def initAlgorithm(self, configuration: Any = None) -> None:  # noqa: N802
        """Declare parameters and outputs."""
        # What has to be given comes first; otherwise the verb's own order.
        for entry in sorted(self.declaration["parameters"], key=lambda entry: not entry["required"]):
            self.addParameter(make_parameter(entry))
        for output in make_outputs(self.declaration):
            self.addOutput(output)

    def canExecute(self) -> tuple[bool, str]:  # noqa: N802
        """False with the reason when the engine is missing; ``qgis_process`` 3.22 does not ask."""
        try:
            self.engine()
        except engine.EngineError as problem:
            return False, str(problem)
        return True, ""

    def engine(self) -> engine.Engine:
        """The engine for this verb.

        Raises:
            EngineMissing: with what to do.
        """
        return engine.find_engine(str(QgsSettings().value("treedgs/python", "") or ""), self.declaration["needs"])

    def problem(self, parameters: dict, context: QgsProcessingContext) -> str:
        """Missing files, numbers out of range, an unusable CRS; then the verb's own needs."""
        for entry in self.declaration["parameters"]:
            name, given = qgis_name(entry["name"]), parameters.get(qgis_name(entry["name"]))
            if given in (None, "") and not (entry["required"] and entry["kind"] == "crs"):
                if entry["required"] and entry["kind"] not in DESTINATIONS:
                    return f"{name} is required: {help_text(entry)}"
                continue
            sentence = self._value_problem(entry, name, given, parameters, context)
            if sentence:
                return sentence
        return self.needs(parameters, context)

    def needs(self, parameters: dict, context: QgsProcessingContext) -> str:
        """Checks of one verb: the sentence that says what is wrong, or ''."""
        return ""

    def _value_problem(
        self, entry: dict, name: str, given: Any, parameters: dict, context: QgsProcessingContext
    ) -> str:
        kind = entry["kind"]
        if kind in ("file", "files", "folder"):
            path = Path(os.path.expanduser(self.parameterAsString(parameters, name, context).split("|")[0]))
            if not path.exists():
                return f"{name}: {path} does not exist; give {'a folder' if kind == 'folder' else 'a file'} that does."
            if kind == "file" and path.is_dir():
                return f"{name}: {path} is a folder, expected a file."
            if kind == "folder" and not path.is_dir():
                return f"{name}: {path} is a file, expected a folder."
        elif kind in ("integer", "number"):
            return _number_problem(entry, name, given)
        elif kind == "choice" and isinstance(given, str) and given not in entry["choices"]:
            return f"{name}: found {given!r}, expected one of {', '.join(entry['choices'])}."
        elif kind == "crs":
            return self._crs_problem(name, given, parameters, context)
        elif kind == "output_file" and isinstance(given, str) and given.startswith("memory:"):
            return f"{name}: a layer in memory cannot be written; give a file name."
        elif kind == "output_file" and isinstance(given, str) and entry.get("suffixes"):
            suffix = os.path.splitext(given.split("|")[0])[1].lower()
            if suffix and suffix not in entry["suffixes"] and not given.startswith("ogr:"):
                return f"{name}: {given} ends in {suffix}, expected {' or '.join(entry['suffixes'])}."
        return ""

    def _crs_problem(self, name: str, given: Any, parameters: dict, context: QgsProcessingContext) -> str:
        if given == LOCAL:
            return ""
        crs: QgsCoordinateReferenceSystem = self.parameterAsCrs(parameters, name, context)
        if not crs.isValid() and given in (None, ""):
            return f"{name} is required: give a projected CRS in metres, like EPSG:32615."
        if not crs.isValid():
            return f"{name}: {given!r} is not a coordinate reference system; give one like EPSG:32615."
        if crs.isGeographic():
            zone = location.utm_suggestion([p for p in map(str, parameters.values()) if os.path.exists(p)])
            hint = (
                f"use the UTM zone of your plot, {zone}"
                if zone
                else ("use the UTM zone of your plot (for example EPSG:32615 for 93 W, north)")
            )
            return (
                f"{name}: {crs.authid()} ({crs.description()}) is geographic (degrees), expected a projected CRS in "
                f"metres; {hint}."
            )
        if crs.mapUnits() != compat.DISTANCE_METERS:
            return (
                f"{name}: {crs.authid()} ({crs.description()}) is not in metres; choose the metric version of this "
                "CRS or the UTM zone."
            )
        return ""

    def processAlgorithm(
        self,
        parameters: dict,
        context: QgsProcessingContext,  # noqa: N802
        feedback: QgsProcessingFeedback,
    ) -> dict:
        """Run the verb in the engine; progress, messages, cancel and results pass through."""
        try:
            chosen = self.engine()
            values = engine_values(self, self.declaration, parameters, context)
            job_dir = engine.new_job_dir(self.COMMAND)
            feedback.pushDebugInfo(f"Engine: {chosen.python} ({chosen.source}); log: {job_dir / 'engine.log'}")
            outcome = engine.run_job(
                chosen, self.COMMAND, values, job_dir, Listener(feedback), lambda: is_cancelled(feedback)
            )
        except engine.EngineError as problem:
            raise QgsProcessingException(str(problem)) from None
        results = result_values(self.declaration, values, outcome.result)
        for value in results.values():
            if isinstance(value, str) and context.willLoadLayerOnCompletion(value):
                details = context.layerToLoadOnCompletionDetails(value)
                details.setPostProcessor(DefaultStyle.make())
                if self.LAYER_NAME:
                    details.name = self.LAYER_NAME
        feedback.pushInfo(f"Done in {outcome.seconds:.0f} s.")
        return results


class DefaultStyle(QgsProcessingLayerPostProcessorInterface):
    """Gives a loaded layer the style that came in its file: Processing itself opens layers without it."""

    #: QGIS does not own post-processors; without this they are gone before they are used.
    _kept: ClassVar[list[DefaultStyle]] = []

    @classmethod
    def make(cls) -> DefaultStyle:
        """A new one for each layer."""
        made = cls()
        cls._kept = [*cls._kept[-20:], made]
        return made

    def postProcessLayer(  # noqa: N802
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        """Apply the style."""
        layer.loadDefaultStyle()
        layer.triggerRepaint()


def is_cancelled(feedback: QgsProcessingFeedback) -> bool:
    """Whether the user asked to stop.

    ``qgis_process`` learns of Ctrl-C through its event loop, which nobody runs while we wait: so it is run here. With
    a window open the window's own thread does that, and running it here could re-enter what it is doing.
    """
    if qgis.utils.iface is None:
        QCoreApplication.processEvents()
    return feedback.isCanceled()


class Listener:
    """Turns the engine's messages into QGIS feedback; what native libraries print stays in ``engine.log``."""

    def __init__(self, feedback: QgsProcessingFeedback) -> None:
        self.feedback = feedback
        self.told = time.monotonic()

    def __call__(self, message: dict[str, Any]) -> None:
        kind, text = message["t"], str(message.get("message", ""))
        if kind == "progress":
            self.feedback.setProgress(100 * float(message.get("fraction", 0)))
            now = time.monotonic()
            if message.get("eta_s") and now - self.told > ESTIMATE_EVERY_S:
                self.told = now
                self.feedback.setProgressText(f"about {duration(message['eta_s'])} left")
        elif kind == "stage":
            self.feedback.pushInfo(f"[{message.get('name', '')}]")
        elif kind == "stage_done":
            self.feedback.pushInfo(f"  {message.get('name', '')}: {message.get('seconds', 0):.1f} s")
        elif kind == "info":
            self.feedback.pushInfo(text)
        elif kind == "warn":
            self.feedback.pushWarning(text)


def duration(seconds: float) -> str:
    """``95`` -> ``1 min 35 s``."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def _number_problem(entry: dict, name: str, given: Any) -> str:
    unit = f" in {entry['unit']}" if entry.get("unit") else ""
    try:
        number = float(given)
        if entry["kind"] == "integer" and number != int(number):
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        if not isinstance(given, (str, float, int)):
            return ""  # a modeler's property or expression: QGIS resolves it
        return (
            f"{name}: found {given!r}, expected {'a whole number' if entry['kind'] == 'integer' else 'a number'}{unit}."
        )
    low, high = entry.get("minimum"), entry.get("maximum")
    if number != number or (low is not None and number < low) or (high is not None and number > high):
        return (
            f"{name}: found {given}, expected {'any' if low is None else f'{low:g}'} to "
            f"{'any' if high is None else f'{high:g}'}{unit}."
        )
    return ""
