"""The engine as a child process: finding its Python, a clean environment, JSON lines, cancel, and what went wrong.

Standard library only, no ``qgis``: the tests and the command-line tools use it too. The protocol is in
``docs/developer/engine.md``; the other end is ``treedgs_geo.cli``.
"""

from __future__ import annotations

import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from . import engine_users, environment, extras
from .exits import explain_exit
from .groups import own_group, stop_group
from .missing import EngineCancelled, EngineError, EngineMissing, how_to_install, set_up_runs, takes
from .pythons import find_program, no_window
from .windows_job import Job
from .words import tr

#: Must equal ``treedgs_geo.core.progress.PROTOCOL``.
PROTOCOL = 1
#: The folder that holds the plugin and, inside it, the library.
PLUGIN_ROOT = Path(__file__).resolve().parents[1]
#: Seconds the engine may take to end after closing its output.
CLOSING_S = 20
#: Seconds that lines of an engine which has ended may take to arrive.
LAST_WORDS_S = 1.0
#: The engine's exit code for a mistake of its own: the only one whose log is worth naming.
DEFECT = 1
#: How many job folders (logs) are kept.
KEPT_JOBS = 20

#: Variables of QGIS, of other Pythons and of other geospatial stacks that must not reach the engine.
_DROPPED_PREFIXES = ("PYTHON", "QGIS_", "PROJ_", "GDAL_", "CONDA_", "DYLD_", "QT_", "OSGEO4W", "PYQGIS")
_DROPPED = {
    "VIRTUAL_ENV",
    "LD_LIBRARY_PATH",
    "LD_PRELOAD",
    "PIP_USER",
    "PIP_TARGET",
    "PIP_PREFIX",
    "GEOTIFF_CSV",
    "O4W_QT_PREFIX",
    "__PYVENV_LAUNCHER__",
}

#: Runs the engine that lies beside the plugin. The environment's Python is isolated (-I): the working folder, a
#: ``PYTHONPATH`` and the user's own packages are not looked at; 3.10 has no other way.
_RUN = (
    "import sys; sys.path.insert(0, sys.argv.pop(1)); import runpy; "
    "runpy.run_module('treedgs_geo', {}, '__main__', True)"
)
ISOLATED = ("-I", "-u", "-X", "utf8")

_PROBE = """
import importlib.util, json, sys
print(json.dumps({
    "version": list(sys.version_info[:3]),
    "missing": [m for m in sys.argv[1:] if importlib.util.find_spec(m) is None],
}))
"""


@dataclass(frozen=True)
class Engine:
    """A Python that can run the engine. source: where it was configured, in words."""

    python: Path
    source: str


@dataclass
class Outcome:
    """How a job ended: the verb's result and how long it took."""

    result: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0


def data_dir() -> Path:
    """Where managed environments and job logs live: ``TREEDGS_HOME`` or the user's data folder."""
    if os.environ.get("TREEDGS_HOME"):
        return Path(os.environ["TREEDGS_HOME"]).expanduser()
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Application Support")
    else:
        base = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(base) / "treedgs"


def python_in(environment: Path) -> Path:
    """The interpreter of a virtual environment."""
    return environment / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")


def managed_environment() -> Path:
    """The environment that ``setupengine`` builds; its name changes with the pinned list."""
    from .locked import lock_hash

    return data_dir() / f"engine-{lock_hash()}"


def configured(setting: str = "") -> bool:
    """Whether any engine is named or set up here, without starting it."""
    places = (managed_environment(), PLUGIN_ROOT / ".venv")
    return bool(os.environ.get("TREEDGS_PYTHON") or setting or any(python_in(place).exists() for place in places))


def find_engine(setting: str = "", modules: Iterable[str] = ()) -> Engine:
    """Resolve the engine's Python; the first one configured wins, a configured but broken one is an error.

    Order: ``TREEDGS_PYTHON``, the QGIS setting ``treedgs/python`` (``setting``), the managed environment, ``.venv``
    in the plugin folder, a ``python3`` on the PATH. modules: what the job imports; all have to be installed.

    Raises:
        EngineMissing: with what was looked at and what to do; also while the managed environment is being set up.
    """
    modules = list(modules)
    for value, source in (
        (os.environ.get("TREEDGS_PYTHON", ""), "TREEDGS_PYTHON"),
        (setting, "the QGIS setting treedgs/python"),
    ):
        if value:
            try:
                _check(Path(value).expanduser(), source, modules)
            except EngineMissing as problem:
                problem.helps = False
                raise
            return Engine(Path(value).expanduser(), source)
    if environment.set_up_runs(managed_environment()):
        raise EngineMissing(set_up_runs(), helps=False)
    problems: list[EngineMissing] = []
    for folder, source in ((managed_environment(), "the managed environment"), (PLUGIN_ROOT / ".venv", "make setup")):
        python = python_in(folder)
        if python.exists():
            try:
                _check(python, source, modules)
                if folder == managed_environment():
                    engine_users.uses(data_dir(), PLUGIN_ROOT, folder.name)
                return Engine(python, source)
            except EngineMissing as problem:
                problem.broken = not problem.parts
                problems.append(problem)
    for name in ("python3", "python"):
        found = find_program(name)
        if found:
            try:
                _check(Path(found), "PATH", modules)
                return Engine(Path(found), f"{name} on the PATH")
            except EngineMissing:
                continue
    if problems:
        raise problems[0]
    text = tr("The TreeDGS engine is not set up yet ({takes}); {do}.")
    raise EngineMissing(text.format(takes=takes(), do=how_to_install()))


def _check(python: Path, source: str, modules: list[str]) -> None:
    words = {"python": python, "source": source, "do": how_to_install()}
    if not python.is_file() or not os.access(python, os.X_OK):
        raise EngineMissing(
            tr("The TreeDGS engine is missing: {source} names {python}, which is not a Python program; {do}.").format(
                **words
            )
        )
    try:
        done = subprocess.run(
            [str(python), "-I", "-c", _PROBE, *modules],
            capture_output=True,
            text=True,
            timeout=60,
            env=child_environment(),
            cwd=tempfile.gettempdir(),
            **no_window(),
        )
        answer = json.loads(done.stdout.strip().splitlines()[-1])
    except (OSError, subprocess.SubprocessError, ValueError, IndexError) as problem:
        raise EngineMissing(
            tr("The TreeDGS engine does not start: {python} ({source}) gave no answer ({problem}); {do}.").format(
                **words, problem=problem
            )
        ) from None
    if tuple(answer["version"]) < (3, 10):
        raise EngineMissing(
            tr("The TreeDGS engine needs Python 3.10 or newer: {python} ({source}) is {version}; {do}.").format(
                **words, version=".".join(map(str, answer["version"]))
            )
        )
    if answer["missing"] and (lacking := extras.missing(answer["missing"])):
        chosen = [f"{name}, {extras.size(name)}" for name in lacking]
        raise EngineMissing(
            tr(
                "This algorithm needs a part of the engine that is not set up ({extras}); run 'Set up the engine' "
                "(treedgs:setupengine) once more and tick it ({names})."
            ).format(extras="; ".join(chosen), names=", ".join(f"{name.upper()}=true" for name in lacking)),
            lacking,
        )
    if answer["missing"]:
        raise EngineMissing(
            tr("The TreeDGS engine is incomplete: {python} ({source}) lacks {names}; {do}.").format(
                **words, names=", ".join(answer["missing"])
            )
        )


def child_environment() -> dict[str, str]:
    """The parent's environment without what belongs to QGIS or to another Python; proxies and CA settings stay."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in _DROPPED and not name.upper().startswith(_DROPPED_PREFIXES)
    }
    # For programs that the engine starts; its own Python is isolated and reads none of these (ISOLATED).
    kept.update(PYTHONIOENCODING="utf-8", PYTHONUTF8="1")
    if sys.platform == "win32":
        kept["NoDefaultCurrentDirectoryInExePath"] = "1"
    return kept


def new_job_dir(command: str) -> Path:
    """A fresh folder for one job's files and log; the oldest ones are removed."""
    base, prefix = data_dir() / "jobs", time.strftime("%Y%m%d-%H%M%S-") + command + "-"
    try:
        base.mkdir(parents=True, exist_ok=True)
        for old in sorted(base.iterdir(), key=lambda path: path.stat().st_mtime)[:-KEPT_JOBS]:
            if time.time() - old.stat().st_mtime > 3600:
                shutil.rmtree(old, ignore_errors=True)
        return Path(tempfile.mkdtemp(dir=base, prefix=prefix))
    except OSError:
        # In the folder that all users share: one of its own, which nobody else can have made before.
        with suppress(OSError):
            return Path(tempfile.mkdtemp(prefix=f"treedgs-{prefix}"))
    raise EngineError(
        tr(
            "No folder for the job's files can be made in {folder}; set TREEDGS_HOME to a folder that can be written."
        ).format(folder=data_dir())
    )


def run_job(
    engine: Engine,
    command: str,
    parameters: dict[str, Any],
    job_dir: Path,
    on_message: Callable[[dict[str, Any]], None],
    is_cancelled: Callable[[], bool],
    overwrite: Iterable[str] = (),
) -> Outcome:
    """Run one verb in a child process until it ends. overwrite: outputs that may replace files of other programs.

    on_message gets each protocol line as a dict (``{"t": "progress", ...}``) and everything else as
    ``{"t": "log", "message": line}``. Cancel ends the whole process group.

    Raises:
        EngineCancelled: is_cancelled() became true.
        EngineError: the engine's own sentence, or what a crash, a kill or a broken answer means.
    """
    job = job_dir / "job.json"
    job.write_text(
        json.dumps(
            {"protocol": PROTOCOL, "command": command, "parameters": parameters, "overwrite": [*overwrite]},
            ensure_ascii=False,
            default=str,
        ),
        encoding="utf-8",
    )
    began = time.monotonic()
    outcome, sentence = Outcome(), ""
    tail: deque[str] = deque(maxlen=40)
    with open(job_dir / "engine.log", "w", encoding="utf-8") as log:
        process = start(engine_command(engine.python, "--job", str(job)), job_dir)
        with closing(stream(process, is_cancelled)) as lines:
            for from_stdout, line in lines:
                log.write(line + "\n")
                message: dict[str, Any] = _parse(line) if from_stdout else {"t": "log", "message": line}
                if message["t"] == "hello" and message.get("protocol") != PROTOCOL:
                    raise EngineError(
                        tr(
                            "The engine speaks protocol {found}, this plugin {own}; run 'Set up the engine' "
                            "(treedgs:setupengine) to update it."
                        ).format(found=message.get("protocol"), own=PROTOCOL)
                    )
                if message["t"] == "error":
                    sentence = str(message.get("message", ""))
                elif message["t"] == "result":
                    outcome.result = message.get("result") or {}
                else:
                    if message["t"] == "log":
                        tail.append(line)
                    on_message(message)
        code = process.wait()
    outcome.seconds = time.monotonic() - began
    if is_cancelled():
        raise EngineCancelled(tr("Stopped; what was finished is kept, run again to resume."))
    if code != 0:
        if code == DEFECT and sentence:
            sentence += f" Log: {job_dir / 'engine.log'}"
        raise EngineError(sentence or explain_exit(code, list(tail), job_dir / "engine.log"))
    if sentence:
        raise EngineError(sentence)
    return outcome


def engine_command(python: Path, *arguments: str) -> list[str]:
    """The command line of the engine beside the plugin; whatever lies in the working folder, it is not imported."""
    words = [str(python), *ISOLATED]
    if not os.access(PLUGIN_ROOT, os.W_OK):
        words.append("-B")
    return [*words, "-c", _RUN, str(PLUGIN_ROOT), *arguments]


def _parse(line: str) -> dict[str, Any]:
    if line.startswith("{"):
        try:
            message = json.loads(line)
            if isinstance(message, dict) and isinstance(message.get("t"), str):
                return message
        except ValueError:
            pass
    return {"t": "log", "message": line}


def start(command: list[str], cwd: Path) -> subprocess.Popen:
    """Start a child in its own process group with the clean environment.

    Raises:
        EngineError: the program cannot be started.
    """
    try:
        process = subprocess.Popen(
            command,
            cwd=cwd,
            env=child_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            **own_group(),
        )
    except OSError as problem:
        raise EngineError(
            tr("The engine cannot be started: {program} ({problem}); {do}.").format(
                program=command[0], problem=problem.strerror, do=how_to_install()
            )
        ) from None

    # At once: what the child starts belongs to its job from its first moment.
    process.job = Job(process)  # type: ignore[attr-defined]
    return process


def stream(process: subprocess.Popen, is_cancelled: Callable[[], bool]) -> Generator[tuple[bool, str], None, None]:
    """Yield ``(from stdout, line)`` until the child ends; on cancel, or when closed early, its group is ended."""
    lines: queue.Queue[tuple[bool, str] | None] = queue.Queue()

    def read(pipe: IO[bytes], from_stdout: bool) -> None:
        with pipe:
            for raw in pipe:
                lines.put((from_stdout, raw.decode("utf-8", "replace").rstrip("\r\n")))
        lines.put(None)

    readers = [
        threading.Thread(target=read, args=(pipe, first), daemon=True)
        for pipe, first in ((process.stdout, True), (process.stderr, False))
        if pipe is not None
    ]
    for reader in readers:
        reader.start()
    still_open, ended = len(readers), 0.0
    try:
        while still_open and not is_cancelled():
            try:
                item = lines.get(timeout=0.1)
            except queue.Empty:
                # A grandchild that outlives the engine may hold the pipes open: the engine's own end is what counts.
                # What it said last may still be on its way on a busy machine, and says why it ended.
                if process.poll() is not None:
                    ended = ended or time.monotonic()
                    if time.monotonic() - ended > LAST_WORDS_S:
                        break
                continue
            if item is None:
                still_open -= 1
            else:
                yield item
        # The pipes close a moment before the process is gone: it must not be taken for one that hangs.
        until = time.monotonic() + CLOSING_S
        while process.poll() is None and not is_cancelled() and time.monotonic() < until:
            time.sleep(0.02)
    finally:
        stop_group(process, getattr(process, "job", None))
