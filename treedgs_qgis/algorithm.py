"""The base of every algorithm: one verb of the engine, checked before it starts and run as a child process."""

from __future__ import annotations

import difflib
import html
import os
from functools import partial
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsSettings,
)
from qgis.PyQt.QtGui import QIcon

from . import checks, engine, i18n, layers, loading, pages
from .listener import Listener, duration, is_cancelled
from .parameters import (
    DESTINATIONS,
    PAGES,
    engine_values,
    help_text,
    label,
    make_outputs,
    make_parameter,
    result_values,
)
from .words import declarations, in_labels, in_qgis_words, qgis_name

ICONS = Path(__file__).with_name("icons")
ICON = ICONS / "treedgs.svg"


def unknown_name(algorithm: QgsProcessingAlgorithm, parameters: dict) -> str:
    """The sentence about a parameter that does not exist, with the one that may be meant, or ''."""
    known = [definition.name() for definition in algorithm.parameterDefinitions()]
    for name in parameters:
        if name not in known:
            near = difflib.get_close_matches(name.upper(), known, n=1)
            hint = (
                i18n.tr("did you mean {name}?").format(name=near[0])
                if near
                else i18n.tr("known: {names}.").format(names=", ".join(known) or "-")
            )
            text = i18n.tr("Parameter {name} is unknown to {algorithm}; {hint}")
            return text.format(name=name, algorithm=algorithm.id(), hint=hint)
    return ""


class BaseAlgorithm(QgsProcessingAlgorithm):
    """What all algorithms share: icon, translation, and refusing names that do not exist."""

    def tr(self, text: str) -> str:
        """Translate."""
        return i18n.tr(text)

    def paragraphs(self, text: str) -> str:
        """A help text for the dialog, which would begin a paragraph with every line of it."""
        return " ".join(text.split())

    def createInstance(self) -> QgsProcessingAlgorithm:
        """A fresh copy, as QGIS asks for."""
        return type(self)()

    def icon(self) -> QIcon:
        """A picture of what it does."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """``icons/<id>.svg``, or the provider's icon where there is none."""
        own = ICONS / f"{self.name()}.svg"
        return str(own if own.exists() else ICON)

    def helpUrl(self) -> str:
        """Its page of the docs."""
        return pages.address(self.name())

    def checkParameterValues(self, parameters: dict, context: QgsProcessingContext) -> tuple[bool, str]:
        """Refuse with one sentence before anything starts."""
        unknown = unknown_name(self, parameters)
        if unknown:
            return False, unknown
        problem = self.problem(parameters, context)
        if problem:
            return False, self.in_words(problem)
        return super().checkParameterValues(parameters, context)

    def problem(self, parameters: dict, context: QgsProcessingContext) -> str:
        """The sentence that says what is wrong with the values, or ''."""
        return ""

    def in_words(self, text: str) -> str:
        """A sentence in the words of what the user looks at."""
        return text


class EngineAlgorithm(BaseAlgorithm):
    """One verb. A subclass names :attr:`COMMAND` and adds its own checks in :meth:`needs`."""

    COMMAND = ""
    #: What the layer is called in the project; empty: as QGIS would.
    LAYER_NAME = ""
    #: What one needs, in words; empty: the required parameters.
    NEED = ""
    #: Search words beside those in the title.
    TAGS: tuple[str, ...] = ()
    #: Of the last run.
    _results: dict[str, Any] = {}

    @property
    def declaration(self) -> dict[str, Any]:
        """The engine's declaration of this verb."""
        return declarations()[self.COMMAND]

    def name(self) -> str:
        """The id, never translated."""
        return self.declaration["id"]

    def displayName(self) -> str:
        """The title in the toolbox."""
        return self.tr(self.declaration["title"])

    def group(self) -> str:
        """The group in the toolbox."""
        return self.tr(self.declaration["group"])

    def groupId(self) -> str:
        """The group's id."""
        return self.declaration["group"].lower().replace(" ", "")

    def tags(self) -> list[str]:
        """Search words."""
        return ["treedgs", "forest", "tree", "dbh", "diameter", "stem", self.COMMAND, *self.TAGS]

    def shortDescription(self) -> str:
        """One line."""
        return self.tr(self.declaration["summary"])

    def shortHelpString(self) -> str:
        """The help panel: what it does, every input with its unit, every output, the same on the command line."""
        entry = self.declaration

        def item(name: str, text: str, shown: str = "") -> str:
            key = qgis_name(name)
            title = f"<b>{html.escape(shown)}</b> ({key})" if shown else f"<b>{key}</b>"
            return f"<li>{title}: {html.escape(text)}</li>"

        plain = [p for p in entry["parameters"] if not p.get("advanced")]
        inputs = [p for p in plain if p["kind"] not in DESTINATIONS]
        needed = [self.tr(label(p)) for p in inputs if p["required"]]
        better = [self.tr(label(p)) for p in inputs if not p["required"] and p["kind"] in ("file", "files", "folder")]
        names = self.tr(self.NEED) if self.NEED else ", ".join(needed)
        top = [self.tr("You need: {names}.").format(names=names)] if names else []
        top += [self.tr("Give if you have them: {names}.").format(names=", ".join(better))] if better else []
        top.append(self.tr("The rest can stay as it is."))
        lines = [f"<p><b>{html.escape(self.tr(entry['summary']))}</b></p>"]
        lines.append(f"<p>{'<br>'.join(map(html.escape, top))}</p>")
        lines.append(f"<p>{html.escape(in_qgis_words(self.tr(entry['help']), entry['known']))}</p>")
        expert = [p for p in entry["parameters"] if p.get("advanced")]
        for title, chosen in ((self.tr("Parameters"), plain), (self.tr("Advanced parameters"), expert)):
            if chosen:
                lines.append(f"<h3>{title}</h3><ul>")
                lines += [item(p["name"], help_text(p), self.tr(label(p))) for p in chosen] + ["</ul>"]
        if entry["outputs"]:
            lines.append(f"<h3>{self.tr('Results')}</h3><ul>")
            lines += [item(key, self.tr(text)) for key, text in entry["outputs"].items()] + ["</ul>"]
        lines.append(f"<p>{self.tr('On the command line:')}<br><code>{html.escape(entry['example'])}</code></p>")
        return "\n".join(lines)

    def initAlgorithm(self, configuration: Any = None) -> None:
        """Declare parameters and outputs."""
        # What has to be given comes first; otherwise the verb's own order.
        for entry in sorted(self.declaration["parameters"], key=lambda entry: not entry["required"]):
            # A page's own output would be called by its parameter in the Results Viewer.
            self.addParameter(make_parameter(entry), entry["name"] not in PAGES)
        for output in make_outputs(self.declaration):
            self.addOutput(output)

    def canExecute(self) -> tuple[bool, str]:
        """False with the reason when the engine is missing; ``qgis_process`` 3.22 does not ask.

        The graphical QGIS opens the dialog all the same: the offer to set the engine up stands in it.
        """
        try:
            self.engine()
        except engine.EngineError as problem:
            return self.offer() is not None, str(problem)
        return True, ""

    def in_words(self, text: str) -> str:
        """With the names of ``qgis_process``; in windows, which show labels, with these."""
        text = in_qgis_words(text, self.declaration["known"])
        labels = {qgis_name(p["name"]): self.tr(label(p)).partition(" [")[0] for p in self.declaration["parameters"]}
        return text if self.offer() is None else in_labels(text, labels)

    def offer(self) -> Any:
        """The plugin's :class:`treedgs_qgis.offer.Offer`; ``None`` without windows."""
        return getattr(self.provider(), "offer", None)

    def createCustomParametersWidget(self, parent: Any = None) -> Any:
        """QGIS' own dialog, with the offer to set up the engine where that is missing, and what the project says."""
        offer = self.offer()
        if offer is None:
            return None
        try:
            self.engine()
        except engine.EngineMissing as problem:
            return offer.dialog(self, problem)
        return offer.dialog(self)

    def engine(self) -> engine.Engine:
        """The engine for this verb.

        Raises:
            EngineMissing: with what to do.
        """
        return engine.find_engine(str(QgsSettings().value("treedgs/python", "") or ""), self.declaration["needs"])

    def problem(self, parameters: dict, context: QgsProcessingContext) -> str:
        """Missing files, numbers out of range, an unusable CRS; then the verb's own needs."""
        for entry in self.declaration["parameters"]:
            name = qgis_name(entry["name"])
            empty = parameters.get(name) in (None, "")
            if empty and entry["required"] and entry["kind"] == "crs":
                return self._value_problem(entry, name, parameters.get(name), parameters, context)
            if empty and entry["required"] and entry["kind"] not in DESTINATIONS:
                return self.tr("{name} is required: {help}").format(name=name, help=help_text(entry))
        return self.values_problem(parameters, context) or self.needs(parameters, context)

    def values_problem(self, parameters: dict, context: QgsProcessingContext) -> str:
        """What is wrong with one of the values that are given, or ''."""
        for entry in self.declaration["parameters"]:
            name, given = qgis_name(entry["name"]), parameters.get(qgis_name(entry["name"]))
            # "Not set" in a dialog is a CRS that is not valid.
            unset = isinstance(given, QgsCoordinateReferenceSystem) and not given.isValid()
            empty = given in (None, "") or (unset and not entry["required"])
            sentence = "" if empty else self._value_problem(entry, name, given, parameters, context)
            if sentence:
                return sentence
        return ""

    def needs(self, parameters: dict, context: QgsProcessingContext) -> str:
        """Checks of one verb: the sentence that says what is wrong, or ''."""
        return ""

    def _value_problem(
        self, entry: dict, name: str, given: Any, parameters: dict, context: QgsProcessingContext
    ) -> str:
        kind = entry["kind"]
        if layers.kind_of(entry):
            layer = layers.Given(self, name, parameters, context)
            plain = layer.layer is None
            return layer.problem() or (checks.path_problem(name, kind, layer.text) if plain else "")
        if kind in ("file", "files", "folder"):
            return checks.path_problem(name, kind, self.parameterAsString(parameters, name, context))
        if kind in ("integer", "number"):
            return checks.number_problem(entry, name, given)
        if kind == "choice" and isinstance(given, str) and given not in entry["choices"]:
            text = self.tr("{name}: found '{given}', expected one of {choices}.")
            return text.format(name=name, given=given, choices=", ".join(entry["choices"]))
        if kind == "crs":
            inputs = [path for path in map(str, parameters.values()) if os.path.exists(path)]
            return checks.crs_problem(name, given, self.parameterAsCrs(parameters, name, context), inputs)
        if kind == "output_file" and isinstance(given, str):
            return checks.output_problem(name, given, entry.get("suffixes", []))
        return ""

    def processAlgorithm(
        self,
        parameters: dict,
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> dict:
        """Run the verb in the engine; progress, messages, cancel and results pass through."""
        try:
            chosen = self.engine()
            values = engine_values(self, self.declaration, parameters, context, feedback)
            job_dir = engine.new_job_dir(self.COMMAND)
            feedback.pushDebugInfo(f"Engine: {chosen.python} ({chosen.source}); log: {job_dir / 'engine.log'}")
            so_far = self.offer() and self.offer().so_far
            listener = Listener(
                feedback,
                self.in_words,
                so_far and partial(so_far.found.emit, str(job_dir)),
            )
            # QGIS's file dialog asked already; for folders nobody did.
            files = [entry["name"] for entry in self.declaration["parameters"] if entry["kind"] == "output_file"]
            try:
                outcome = engine.run_job(
                    chosen, self.COMMAND, values, job_dir, listener, lambda: is_cancelled(feedback), files
                )
            finally:
                if so_far:
                    so_far.over.emit(str(job_dir))
        except (engine.EngineError, OSError) as problem:
            if isinstance(problem, engine.EngineMissing) and self.offer() is not None:
                self.offer().missed.emit(problem)
            raise QgsProcessingException(self.in_words(str(problem))) from None
        feedback.pushInfo(self.tr("Done in {time}.").format(time=duration(outcome.seconds)))
        if values.get("dry_run"):
            # Nothing was written, so there is nothing to load.
            context.setLayersToLoadOnCompletion({})
            return result_values(self.declaration, {}, outcome.result)
        results = result_values(self.declaration, values, outcome.result)
        destinations = [entry["name"] for entry in self.declaration["parameters"] if entry["kind"] in DESTINATIONS]
        lost = [qgis_name(name) for name in destinations if loading.is_temporary(str(values.get(name, "")))]
        if lost:
            text = self.tr(
                "{names}: lies in a temporary folder, which QGIS deletes when it is closed; save it elsewhere."
            )
            feedback.pushWarning(text.format(names=", ".join(lost)))
        loading.load_results(results, self.tr(self.LAYER_NAME), context)
        loading.load_folder(results, context)
        # A stem measured again is shown where it was asked for.
        self._results = {} if values.get("at") else results
        return results

    def postProcessAlgorithm(self, context: QgsProcessingContext, feedback: QgsProcessingFeedback) -> dict:
        """Offer the page that was written, in the message bar."""
        page = next(filter(None, (self._results.get(qgis_name(key)) for key in PAGES)), "")
        if page and self.offer() is not None:
            title, found, done = self.displayName(), self._results.get("N_TREES"), self._results.get("N_MEASURED")
            if found is not None and done is not None:
                title = self.tr("{done} of {all} stems measured.").format(done=done, all=found)
            written = str(self._results.get("OUTPUT") or page)
            self.offer().page(page, title, written if os.path.isdir(written) else os.path.dirname(written))
        return {}
