"""``treedgs:setupengine``: builds the engine's own Python environment; nothing goes into QGIS."""

from __future__ import annotations

import math
import time
from pathlib import Path

from qgis.core import (
    QgsProcessingException,
    QgsProcessingOutputString,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFile,
    QgsSettings,
)

from ..treedgs_qgis import (
    compat,
    engine,
    engine_users,
    environment,
    extras,
    gpu,
    leftovers,
    locked,
    missing,
    own_python,
    pythons,
)
from ..treedgs_qgis.algorithm import BaseAlgorithm
from ..treedgs_qgis.listener import duration, is_cancelled
from ..treedgs_qgis.parameters import file_filter
from ..treedgs_qgis.pip_meter import Meter

HELP = """<p><b>Install the libraries that the TreeDGS algorithms need, in an environment of their own.</b></p>
<p>Makes a Python environment in your data folder (or in TREEDGS_HOME; {takes} at 50 Mbit/s), and installs the locked
list of libraries with pip. QGIS and its Python are not touched. Python 3.10 to 3.14 with venv is found on this
computer, or fetched for the engine alone. It needs the network or a folder of wheels. In the end the parts of TreeDGS
that compute most are compiled for this processor, so that the first job does not wait for it. What was cut short is
taken up by running it again. Engines of former versions are removed in the end; jobs and results stay. <b>Remove the
engine</b> frees the disk.</p>
<p>Parts that not everybody needs are ticked; run it again to add one. What is there stays, unless you start from
scratch.</p>
<p>On a machine with <code>make</code>, <code>make setup</code> does the same for the repository.</p>"""


class Algorithm(BaseAlgorithm):
    """Set up the engine."""

    def name(self):
        """The id."""
        return "setupengine"

    def displayName(self):
        """The title."""
        return self.tr("Set up the engine")

    def group(self):
        """With the check."""
        return self.tr("Setup")

    def groupId(self):
        """With the check."""
        return "setup"

    def tags(self):
        """Search words."""
        return ["treedgs", "install", "environment", "dependencies", "python", "pip"]

    def shortDescription(self):
        """One line."""
        return self.tr("Install the engine's libraries in an environment of their own.")

    def shortHelpString(self):
        """The help panel."""
        return self.paragraphs(self.tr(HELP).format(takes=missing.takes()))

    def initAlgorithm(self, configuration=None):
        """Declare parameters."""
        parts = [
            QgsProcessingParameterBoolean(name.upper(), extras.title(name), name in extras.USUAL)
            for name in extras.CHOICES
        ]
        for part in parts:
            part.setHelp(self.tr("Measuring trees from photos and clouds does not need it; it can be added later."))
        # QGIS' own filter wants a dot in the name, which python3 has not.
        python = QgsProcessingParameterFile(
            "PYTHON", self.tr("Python to build with"), compat.FILE, "", None, True, file_filter([])
        )
        python.setHelp(self.tr("A Python 3.10 to 3.14 with venv; left empty, the system's is found."))
        wheels = QgsProcessingParameterFile(
            "WHEELS", self.tr("Folder of wheels (no network)"), compat.FOLDER, "", None, True
        )
        wheels.setHelp(
            self.tr(
                "A folder of .whl files, made on another machine with: pip download --require-hashes -r "
                "requirements-locked.txt -d FOLDER."
            )
        )
        build = QgsProcessingParameterEnum(
            "BUILD", self.tr("For which processor"), list(locked.BUILDS), False, "auto", False, True
        )
        build.setHelp(
            self.tr(
                "auto: with NVIDIA's library where a card and driver are found that it can use; cpu: without; cuda: "
                "with it in any case. Only Gaussians that are fitted with the device cuda use the card."
            )
        )
        rebuild = QgsProcessingParameterBoolean("REBUILD", self.tr("Start from scratch"), False)
        rebuild.setHelp(self.tr("Remove the environment first, to repair a broken one."))
        ahead = QgsProcessingParameterBoolean("COMPILE", self.tr("Compile for this processor"), True)
        ahead.setHelp(self.tr("The first job does not wait for it then; without it the first job compiles."))
        for advanced in (python, build, rebuild, ahead):
            advanced.setFlags(advanced.flags() | compat.FLAG_ADVANCED)
        for made in (*parts, wheels, python, build, rebuild, ahead):
            self.addParameter(made)
        self.addOutput(QgsProcessingOutputString("ENGINE", self.tr("The engine's Python")))

    def problem(self, parameters, context):
        """The named files exist."""
        wheels = self.parameterAsString(parameters, "WHEELS", context)
        if wheels and not Path(wheels).is_dir():
            text = self.tr("WHEELS: {folder} is not a folder; give the folder that holds the .whl files.")
            return text.format(folder=wheels)
        if wheels and not any(Path(wheels).glob("*.whl")):
            text = self.tr("WHEELS: {folder}: holds no .whl files, expected the wheels of the engine's libraries.")
            return text.format(folder=wheels)
        python = self.parameterAsString(parameters, "PYTHON", context)
        if python and not Path(python).is_file():
            text = self.tr("PYTHON: {path} does not exist; give a Python program or leave it empty.")
            return text.format(path=python)
        return ""

    def extras(self, parameters, context) -> list[str]:
        """The names of the chosen extras."""
        return [name for name in extras.CHOICES if self.parameterAsBoolean(parameters, name.upper(), context)]

    def python(self, wanted, offline, run, feedback) -> str:
        """The Python to build with: named, the system's, or one that is fetched.

        Raises:
            SetupError: none of these.
        """
        folder = engine.data_dir() / "python"
        try:
            return pythons.find_python(wanted or own_python.fetched(folder))
        except environment.SetupError:
            if wanted or offline:
                raise
        return own_python.fetch(folder, run, feedback.pushInfo)

    def runner(self, meter, target, feedback, share):
        """Starts commands for :mod:`environment`: their lines go to the log, ``meter`` to the first ``share`` of the
        progress bar."""
        said, told = [""], [-math.inf]

        def tell():
            feedback.setProgress(100 * share * meter.fraction)
            # A line of the log each: not for every megabyte.
            words = meter.message.split(" (")[0]
            if words != said[0]:
                said[0] = words
                feedback.setProgressText(meter.message)

        def asked():
            if time.monotonic() - told[0] > 1:
                told[0] = time.monotonic()
                environment.going_on(target)
            meter.look()
            tell()
            return is_cancelled(feedback)

        def run(command):
            words = [str(part) for part in command]
            feedback.pushCommandInfo(" ".join(words).split("\n")[0])
            meter.site = environment.packages_of(target)
            process = engine.start(words, Path.home())
            for _, line in engine.stream(process, asked):
                if not meter.line(line):
                    feedback.pushConsoleInfo(line)
            tell()
            return process.wait()

        return run

    def build_of(self, parameters, context, feedback) -> str:
        """``cpu`` or ``cuda``: chosen, or found out."""
        build = self.parameterAsEnumString(parameters, "BUILD", context)
        if build == "auto":
            choice = gpu.choose(*gpu.ask())
            build = choice.build
            text = (
                self.tr("The engine will use the graphics card: {why}.")
                if build == "cuda"
                else self.tr("The engine will use the processor only: {why}.")
            )
            feedback.pushInfo(text.format(why=choice.why))
        return build

    def processAlgorithm(self, parameters, context, feedback):
        """Build, then use it from now on."""
        wheels = self.parameterAsString(parameters, "WHEELS", context)
        target = engine.managed_environment()
        if environment.set_up_runs(target):
            raise QgsProcessingException(missing.set_up_runs())
        environment.going_on(target)
        # Before it is built: no set-up in another profile takes it for a former one.
        engine_users.uses(engine.data_dir(), engine.PLUGIN_ROOT, target.name)
        try:
            if self.parameterAsBoolean(parameters, "REBUILD", context):
                environment.remove(target)
            build = self.build_of(parameters, context, feedback)
            # What an earlier run brought stays: pip takes nothing away.
            before = environment.read_record(target).get("extras", [])
            chosen = sorted({*self.extras(parameters, context), *before})
            listed = locked.write_list(build, target.with_name(f"{target.name}-{build}.txt"), extras=chosen)
            parts = [*chosen, *([extras.GPU] if build == "cuda" else [])]
            fresh = parts if environment.read_record(target) else ["", *parts]
            download_s, install_s = sum(map(extras.download_s, fresh)), sum(map(extras.install_s, fresh))
            meter = Meter(sum(map(extras.download_mb, fresh)), download_s, install_s)
            share = (download_s + install_s) / (download_s + install_s + extras.compile_s())
            run = self.runner(meter, target, feedback, share)
            environment.build(
                target,
                [listed],
                " ".join([locked.lock_hash(), build, *chosen]),
                self.python(self.parameterAsString(parameters, "PYTHON", context), bool(wheels), run, feedback),
                wheels=Path(wheels) if wheels else None,
                run=run,
                needed_gb=extras.needed_gb(parts),
                record={"extras": chosen, "build": build},
                say=lambda text: feedback.pushInfo(
                    text.replace(environment.what(listed), self.tr("the locked list of libraries"))
                ),
                cache=engine.data_dir() / leftovers.PIP_CACHE,
            )
            environment.over(target)
            if self.parameterAsBoolean(parameters, "COMPILE", context):
                self.compile(target, feedback, share)
        except (environment.SetupError, engine.EngineError, OSError) as problem:
            if feedback.isCanceled():
                raise QgsProcessingException(self.tr("Stopped; run it again to go on where it ended.")) from None
            raise QgsProcessingException(str(problem)) from None
        finally:
            environment.over(target)
        self.tidy(feedback)
        configured = str(QgsSettings().value("treedgs/python", "") or "")
        if configured:
            feedback.pushWarning(
                self.tr(
                    "The QGIS setting treedgs/python still names {path} and comes first; clear it to use the "
                    "environment that was just built."
                ).format(path=configured)
            )
        return {"ENGINE": str(engine.python_in(target))}

    def compile(self, target, feedback, share):
        """Fill the engine's cache of compiled code; ``share``: where the progress bar stands. Jobs run without it."""
        words = self.tr("Compiling for this processor, once, so that the first job is quick")
        feedback.setProgressText(words)

        def heard(message):
            if message["t"] == "progress":
                feedback.setProgress(100 * (share + (1 - share) * float(message["fraction"])))
            elif message["t"] == "warn":
                feedback.pushWarning(str(message["message"]))

        chosen = engine.Engine(engine.python_in(target), "treedgs:setupengine")
        try:
            job = engine.new_job_dir("doctor")
            done = engine.run_job(chosen, "doctor", {"compile": True}, job, heard, lambda: is_cancelled(feedback))
        except engine.EngineCancelled:
            raise
        except (engine.EngineError, OSError) as problem:
            text = self.tr("The engine is set up, but it could not compile ahead; the first job will: {why}")
            feedback.pushWarning(text.format(why=problem))
            return
        text = self.tr("{count} functions compiled in {time}.")
        feedback.pushInfo(text.format(count=done.result.get("n_compiled", 0), time=duration(done.seconds)))

    def tidy(self, feedback):
        """Engines of former versions of the plugin, and what pip kept, are not needed any more."""
        freed, kept = leftovers.remove_former()
        if freed:
            text = self.tr("Engines of former versions and downloads are removed: {size} free again.")
            feedback.pushInfo(text.format(size=extras.in_words(freed / 1e6)))
        for folder in kept:
            text = self.tr("{folder}, the engine of a former version, is in use and stays until the next set-up.")
            feedback.pushWarning(text.format(folder=folder))
