"""The offer to set up the engine: one click in the dialog that needs it, with size, time and a progress bar.

Only in the graphical QGIS. The set-up itself is the algorithm ``treedgs:setupengine``, run as a task.
"""

from __future__ import annotations

import functools
import html
import importlib
from typing import Any, ClassVar

from qgis.core import (
    QgsApplication,
    QgsProcessingAlgRunnerTask,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsSettings,
)
from qgis.PyQt.QtCore import QObject, QTimer, QUrl, pyqtSignal
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QApplication, QHBoxLayout, QProgressBar, QPushButton, QWidget

from . import engine, environment, extras, suggest
from .compat import LOG_SUCCESS, LOG_WARNING
from .i18n import tr
from .missing import EngineMissing, takes
from .so_far import StemsSoFar

ALGORITHM = "treedgs:setupengine"
#: Set once a user has seen the offer on the main window.
SEEN = "treedgs/setup_offered"
#: Steps of the progress bar.
STEPS = 1000


class TaskFeedback(QgsProcessingFeedback):
    """What a task reports: the last words, and the sentence that it failed with."""

    said = pyqtSignal(str)

    def __init__(self) -> None:
        super().__init__()
        self.errors: list[str] = []

    def setProgressText(self, text: str) -> None:
        """Words for beside the progress bar."""
        self.said.emit(text)

    def reportError(self, error: str, fatalError: bool = False) -> None:
        """Kept: the last one is why the task failed."""
        self.errors.append(error)
        super().reportError(error, fatalError)


class Job(QObject):
    """The set-up as a task of QGIS, once at a time, for everything that wants to show how far it is."""

    reported = pyqtSignal(float, str)
    ended = pyqtSignal(bool, str)

    def __init__(self) -> None:
        super().__init__()
        self.algorithm = ALGORITHM
        self.percent, self.words = 0.0, ""
        self.task: Any = None
        self._kept: tuple[Any, ...] = ()

    def start(self, values: dict[str, Any]) -> None:
        """Begin, unless it runs already."""
        if self.task is not None:
            return
        self.percent, self.words = 0.0, tr("Starting …")
        feedback, context = TaskFeedback(), QgsProcessingContext()
        feedback.progressChanged.connect(self._moved)
        feedback.said.connect(self._said)
        made = QgsApplication.processingRegistry().algorithmById(self.algorithm)
        self.task = QgsProcessingAlgRunnerTask(made, values, context, feedback)
        # The task holds neither of these.
        self._kept = (feedback, context, made)
        self.task.executed.connect(self._executed)
        QgsApplication.taskManager().addTask(self.task)
        self.reported.emit(self.percent, self.words)

    def stop(self) -> None:
        """Ask it to end; what is finished stays."""
        if self.task is not None:
            self.task.cancel()

    def _moved(self, percent: float) -> None:
        self.percent = percent
        self.reported.emit(self.percent, self.words)

    def _said(self, words: str) -> None:
        self.words = words
        self.reported.emit(self.percent, self.words)

    def _executed(self, successful: bool, _results: dict) -> None:
        feedback = self._kept[0]
        self.task = None
        if feedback.isCanceled():
            self.ended.emit(False, tr("Stopped; run it again to go on where it ended."))
        elif successful:
            self.ended.emit(True, tr("The engine is set up; the algorithms can run."))
        else:
            self.ended.emit(False, feedback.errors[-1] if feedback.errors else tr("It failed; see the log."))


class Controls(QWidget):
    """In a message bar: the button that begins, then progress and a button that stops."""

    #: QGIS keeps what is on the screen, Python what answers to clicks: without this the next collection of garbage
    #: leaves a dead button, or takes the message from the bar.
    _shown: ClassVar[set[Controls]] = set()

    def __init__(self, job: Job, item: Any, label: str, values: dict[str, Any]) -> None:
        super().__init__()
        self._shown.add(self)
        self.destroyed.connect(functools.partial(self._shown.discard, self))
        self.job, self.item, self.values = job, item, values
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        self.button, self.bar, self.stopper = QPushButton(label), QProgressBar(), QPushButton(tr("Stop"))
        self.bar.setRange(0, STEPS)
        self.bar.setMinimumWidth(160)
        for widget in (self.button, self.bar, self.stopper):
            row.addWidget(widget)
        self.button.clicked.connect(self.begin)
        self.stopper.clicked.connect(self.halt)
        job.reported.connect(self.show_progress)
        job.ended.connect(self.ended)
        self.show_running(job.task is not None)

    def begin(self) -> None:
        """The one click."""
        self.job.start(self.values)

    def halt(self) -> None:
        """Stop it."""
        self.job.stop()

    def show_running(self, running: bool) -> None:
        """Either the button, or bar and stop."""
        self.button.setVisible(not running)
        self.bar.setVisible(running)
        self.stopper.setVisible(running)

    def show_progress(self, percent: float, words: str) -> None:
        """Progress of the job, whoever began it."""
        self.show_running(True)
        self.bar.setValue(round(percent / 100 * STEPS))
        self.item.setText(words)

    def ended(self, successful: bool, words: str) -> None:
        """Done, or the sentence and the button again."""
        self.show_running(False)
        self.button.setVisible(not successful)
        self.item.setText(words)
        self.item.setLevel(LOG_SUCCESS if successful else LOG_WARNING)


class Offer(QObject):
    """Offers to set up the engine wherever it is missed."""

    #: An :class:`EngineMissing`, from whatever thread met it.
    missed = pyqtSignal(object)

    def __init__(self, iface: Any) -> None:
        super().__init__()
        self.iface = iface
        self.job = Job()
        self.so_far = StemsSoFar(iface)
        self.pages: list[tuple[str, str, str]] = []
        self.missed.connect(self.show)
        QgsApplication.taskManager().statusChanged.connect(self.task_ended)

    def sentence(self, problem: EngineMissing) -> str:
        """What is missing, how much it is, how long it takes."""
        parts = self.parts(problem)
        if problem.broken:
            return tr("The engine is damaged; setting it up anew takes {takes}. Jobs and results stay.").format(
                takes=takes(parts)
            )
        if problem.parts:
            return tr("This needs a part of the engine that is not set up: {names} ({takes}).").format(
                names=", ".join(name.upper() for name in problem.parts), takes=takes(parts)
            )
        return tr("The engine is not set up ({takes}).").format(takes=takes(parts))

    def parts(self, problem: EngineMissing) -> list[str]:
        """What has to be installed: '' is the engine itself."""
        target = engine.managed_environment()
        there = environment.read_record(target) and not problem.broken
        kept = environment.read_record(target).get("extras", []) if problem.broken else []
        return list(problem.parts) if there else list(dict.fromkeys(["", *extras.USUAL, *kept, *problem.parts]))

    def show(self, problem: EngineMissing, bar: Any = None) -> None:
        """On a message bar: a given one, that of the dialog in front, or the main window's."""
        front = QApplication.activeModalWidget()
        if bar is None and front is not None and hasattr(front, "messageBar"):
            bar = front.messageBar()
        bar = bar or self.iface.messageBar()
        if not problem.helps and self.job.task is None:
            bar.pushMessage("TreeDGS", str(problem), LOG_WARNING, 0)
            return
        item = bar.createMessage("TreeDGS", str(problem) if self.job.task is not None else self.sentence(problem))
        values: dict[str, Any] = {name.upper(): name in self.parts(problem) for name in extras.CHOICES}
        if problem.broken:
            values["REBUILD"] = True
        label = tr("Set up again") if problem.broken else tr("Add it now") if problem.parts else tr("Set up now")
        item.layout().addWidget(Controls(self.job, item, label, values))
        bar.pushWidget(item, LOG_WARNING)

    def page(self, path: str, title: str, folder: str) -> None:
        """On the main window's message bar: the page that a run wrote, with a button that opens it, and the folder of
        its results; once QGIS has said that its task is complete, which would cover it."""
        self.pages.append((path, title, folder))
        if not QgsApplication.taskManager().countActiveTasks():
            self.show_pages()

    def task_ended(self, *_: Any) -> None:
        """After what QGIS says of a task."""
        QTimer.singleShot(0, self.show_pages)

    def show_pages(self) -> None:
        """The messages of :meth:`page`."""
        bar = self.iface.messageBar()
        for path, title, folder in self.pages:
            link = f'<a href="{html.escape(QUrl.fromLocalFile(folder).toString())}">{html.escape(folder)}</a>'
            item = bar.createMessage("TreeDGS", f"{html.escape(title)} {link}")
            button = QPushButton(tr("Open the report"), item)
            button.clicked.connect(functools.partial(self.open_page, path))
            item.layout().addWidget(button)
            bar.pushWidget(item, LOG_SUCCESS)
        self.pages = []

    def open_page(self, path: str, *_: Any) -> None:
        """In the program that shows web pages."""
        QDesktopServices.openUrl(QUrl.fromLocalFile(path))

    def dialog(self, algorithm: Any, problem: EngineMissing | None = None) -> Any:
        """QGIS' own dialog of an algorithm, filled in as the project says, with the offer above its parameters."""
        # QGIS' own package, which has the name of our own folder.
        module = importlib.import_module("processing.gui.AlgorithmDialog")
        made = module.AlgorithmDialog(algorithm, False, self.iface.mainWindow())
        made.setParameters(suggest.values(algorithm.name(), self.iface.activeLayer()))
        if problem is not None:
            self.show(problem, made.messageBar())
        return made

    def first_time(self) -> None:
        """Once in a user's life, when nothing is there: on the main window, before any dialog is opened."""
        settings = QgsSettings()
        if settings.value(SEEN, "") or engine.configured(str(settings.value("treedgs/python", "") or "")):
            return
        settings.setValue(SEEN, "1")
        self.show(EngineMissing(""), self.iface.messageBar())
