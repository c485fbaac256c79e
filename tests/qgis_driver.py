"""Drives real QGIS for the tests: ``qgis_process`` and PyQGIS as child processes, in a private profile."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
#: Nothing here takes minutes on a free machine; a hung process must still end the test.
PATIENCE_S = 3600


def load(name: str, file: Path, package: Path | None = None) -> ModuleType:
    """Import one file without touching ``sys.path``."""
    places = [str(package)] if package else None
    spec = importlib.util.spec_from_file_location(name, file, submodule_search_locations=places)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


class Qgis:
    """``qgis_process`` and PyQGIS in the private profile."""

    def __init__(self, setup: Path) -> None:
        self.tools = load("treedgs_tools_qgis_run", ROOT / "tools" / "qgis_run.py")
        self.program = self.tools.qgis_process()
        self.setup = setup
        self.tools.make_profile(setup)

    def environment(self, **more: object) -> dict[str, str]:
        """Variables of a QGIS process; the engine is the Python that runs these tests."""
        return {
            "TREEDGS_PYTHON": sys.executable,
            **self.tools.environment(self.setup),
            **{k: str(v) for k, v in more.items()},
        }

    def start(self, *arguments: object, **more: object) -> subprocess.Popen:
        """``qgis_process`` running, output captured."""
        return subprocess.Popen(
            [self.program, *map(str, arguments)],
            env=self.environment(**more),
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def __call__(self, *arguments: object, **more: object) -> subprocess.CompletedProcess:
        """``qgis_process`` to its end (at most PATIENCE_S)."""
        return subprocess.run(
            [self.program, *map(str, arguments)],
            env=self.environment(**more),
            text=True,
            timeout=PATIENCE_S,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def run(
        self, algorithm: str, _more: dict[str, object] | None = None, **parameters: object
    ) -> subprocess.CompletedProcess:
        """``qgis_process run treedgs:ALGORITHM -- NAME=VALUE …``; ``_more``: further variables."""
        values = [f"{name}={value}" for name, value in parameters.items()]
        return self("run", f"treedgs:{algorithm}", "--", *values, **(_more or {}))

    def windows(self, script: str, seen: Path, without: tuple[str, ...] = (), **more: object) -> dict[str, Any]:
        """What a script of ``tests/qgis`` saw in the graphical QGIS under Xvfb, where it writes it; skips where QGIS or
        Xvfb is missing. without: variables that are not passed on."""
        command = self.tools.with_windows(ROOT / "tests" / "qgis" / script)
        if command is None:
            pytest.skip("the graphical QGIS or xvfb-run is not installed here; make setup installs them")
        dropped = {"QT_QPA_PLATFORM", *without}
        variables = {name: value for name, value in self.environment(**more).items() if name not in dropped}
        variables["PYTHONPATH"] = str(ROOT / "tests" / "qgis")
        done = subprocess.run(command, env=variables, timeout=PATIENCE_S, capture_output=True, text=True)
        assert seen.exists(), done.stdout + done.stderr
        report = json.loads(seen.read_text(encoding="utf-8"))
        assert "error" not in report, report
        return report

    def python(self, code: str, *arguments: object, **more: object) -> subprocess.CompletedProcess:
        """A PyQGIS script in the system's Python, with the plugin and QGIS' own Processing loaded."""
        return subprocess.run(
            ["/usr/bin/python3", "-c", PRELUDE + code + EPILOGUE, *map(str, arguments)],
            text=True,
            timeout=PATIENCE_S,
            env=self.environment(**more),
            capture_output=True,
        )


PRELUDE = """
import os, sys
from qgis.core import QgsApplication
application = QgsApplication([], False)
application.initQgis()
sys.path += [QgsApplication.pkgDataPath() + "/python/plugins", os.environ["QGIS_PLUGINPATH"]]
import qgis.utils
from processing.core.Processing import Processing
Processing.initialize()
import processing
qgis.utils.plugin_paths = [os.environ["QGIS_PLUGINPATH"]]
qgis.utils.updateAvailablePlugins()
assert qgis.utils.loadPlugin("treedgs"), "the plugin does not load"
qgis.utils.plugins["treedgs"] = sys.modules["treedgs"].classFactory(None)
qgis.utils.plugins["treedgs"].initProcessing()
provider = QgsApplication.processingRegistry().providerById("treedgs")
"""


#: QGIS 3.22 may crash while Python tears it down; what a test wants is done by then.
EPILOGUE = """
sys.stdout.flush()
os._exit(0)
"""

FAKE = '''#!{python}
"""Stands for an engine's Python: answers the probe like a real one, then behaves as it was set to."""
import json, os, signal, subprocess, sys, time
if "--job" not in sys.argv:
    os.execv({python!r}, [{python!r}, *sys.argv[1:]])
def say(**message):
    print(json.dumps(message), flush=True)
job = json.load(open(sys.argv[-1], encoding="utf-8"))
say(t="hello", protocol=1, version="fake")
say(t="progress", fraction=0.1, message="", eta_s=None)
{behaviour}
'''


#: An engine that does not listen to SIGTERM and has a child that does not either; both pids go to a file.
STUBBORN = """
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen(["/bin/sh", "-c", "trap '' TERM INT; while :; do sleep 0.2; done"])
open(os.environ["PIDS"], "w").write(f"{os.getpid()} {child.pid}")
while True:
    time.sleep(0.2)
    say(t="progress", fraction=0.2, message="", eta_s=None)
"""


def alive(pid: int) -> bool:
    """A process that runs (a zombie does not)."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")
    return not status.exists() or status.read_text().rpartition(")")[2].split()[0] != "Z"


def outlived(pids: list[int]) -> list[int]:
    """Those that do not end, however busy the machine is; they are killed."""
    until = time.monotonic() + 120
    while any(map(alive, pids)) and time.monotonic() < until:
        time.sleep(0.02)
    left = [pid for pid in pids if alive(pid)]
    for pid in left:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return left
