"""Finding a program, and a Python to build the engine with. Standard library only, Python 3.9 or newer."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .words import tr

#: The engine's libraries have wheels for these.
OLDEST, NEWEST = (3, 10), (3, 14)
#: In this order: what most libraries are tested with first.
MINORS = (12, 13, 11, 14, 10)

_PYTHON_CHECK = """
import sys
import ensurepip, venv
print("%d.%d" % sys.version_info[:2])
"""


class SetupError(Exception):
    """One sentence: what is missing and what to do."""


def find_program(name: str) -> str | None:
    """Absolute path of a program on the PATH (or the path itself); never one of the current folder, which an empty
    entry of the PATH means and where Windows looks first."""
    places = [place for place in os.environ.get("PATH", "").split(os.pathsep) if os.path.isabs(place)]
    found = shutil.which(name, path=os.pathsep.join(places))
    return found if found and os.path.isabs(found) else None


def no_window() -> dict[str, Any]:
    """Arguments of ``subprocess``: a program without a console window of its own."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NO_WINDOW}
    return {}


def bare_environment() -> dict[str, str]:
    """This process's environment without what binds a Python to another one's folders (OSGeo4W sets PYTHONHOME)."""
    return {name: value for name, value in os.environ.items() if not name.upper().startswith(("PYTHON", "CONDA_"))}


def version_of(python: str) -> tuple[int, int] | None:
    """Major and minor of a Python that can make virtual environments; ``None`` for anything else."""
    try:
        done = subprocess.run(
            [python, "-I", "-c", _PYTHON_CHECK],
            capture_output=True,
            text=True,
            timeout=60,
            cwd=tempfile.gettempdir(),
            env=bare_environment(),
            **no_window(),
        )
    except (OSError, ValueError, subprocess.SubprocessError):
        return None
    found = re.fullmatch(r"(\d+)\.(\d+)", done.stdout.strip())
    return (int(found[1]), int(found[2])) if done.returncode == 0 and found else None


def usable_python(python: str) -> bool:
    """True when ``python`` is 3.10 or newer and can make virtual environments."""
    version = version_of(python)
    return version is not None and version >= OLDEST


def find_python(wanted: str = "", version: Callable[[str], tuple[int, int] | None] = version_of) -> str:
    """A Python to build the environment with: ``wanted``, or the first usable one of the system.

    version: asks a Python for its version (see :func:`version_of`).

    Raises:
        SetupError: there is none.
    """
    if wanted:
        found = version(wanted)
        if found is None or found < OLDEST:
            raise SetupError(
                tr(
                    "{path}: is not a Python 3.10 or newer with venv and ensurepip; install one or name another."
                ).format(path=wanted)
            )
        return wanted
    too_new = ""
    for python in candidates():
        found = version(python)
        if found is not None and OLDEST <= found <= NEWEST:
            return python
        if found is not None and found > NEWEST:
            too_new = too_new or f"{python} ({found[0]}.{found[1]})"
    if too_new:
        raise SetupError(
            tr(
                "{path} is newer than the engine's libraries, which exist for Python 3.10 to 3.14; install one of "
                "these beside it and run this again."
            ).format(path=too_new)
        )
    raise SetupError(
        tr(
            "No Python 3.10 or newer with venv was found; install one (Debian and Ubuntu: apt install python3-venv; "
            "Windows and macOS: python.org, version 3.12) and run this again."
        )
    )


def candidates() -> Iterator[str]:
    """Pythons of this computer, each once, those that are quick to find first. Not all of them work."""
    seen: set[str] = set()
    for python in _everywhere():
        key = os.path.normcase(os.path.realpath(python))
        # Windows' own python.exe only opens its shop; that of QGIS makes environments that break outside its shell.
        if key not in seen and "windowsapps" not in key.lower() and not _of_qgis(key):
            seen.add(key)
            yield python


def _everywhere() -> Iterator[str]:
    names = [f"python3.{minor}" for minor in MINORS] + ["python3", "/usr/bin/python3", "python"]
    for name in names:
        found = find_program(name)
        if found:
            yield found
    if sys.platform == "win32":
        yield from _from_launcher()
        yield from _from_registry()
        for base in _usual_folders():
            yield from _in_order(base.glob("Python3*/python.exe"))
    elif sys.platform == "darwin":
        # Programs that are started from the Finder see neither Homebrew's nor python.org's folder on the PATH.
        for minor in MINORS:
            for place in (
                f"/Library/Frameworks/Python.framework/Versions/3.{minor}/bin/python3.{minor}",
                f"/opt/homebrew/bin/python3.{minor}",
                f"/usr/local/bin/python3.{minor}",
            ):
                if os.path.exists(place):
                    yield place


def _of_qgis(path: str) -> bool:
    """Whether a Windows Python belongs to QGIS or OSGeo4W: its environments need QGIS' own shell to work."""
    if sys.platform != "win32":
        return False
    return any(word in path.lower() for word in ("osgeo4w", os.sep + "qgis", "/qgis"))


def _from_launcher() -> Iterator[str]:
    """Pythons that ``py`` knows (python.org installs it beside Windows' own programs)."""
    launcher = find_program("py") or os.path.join(os.environ.get("SYSTEMROOT", r"C:\Windows"), "py.exe")
    try:
        done = subprocess.run(
            [launcher, "-0p"], capture_output=True, text=True, timeout=30, cwd=tempfile.gettempdir(), **no_window()
        )
    except (OSError, ValueError, subprocess.SubprocessError):
        return
    yield from _in_order(Path(found) for found in listed_by_launcher(done.stdout))


def listed_by_launcher(text: str) -> list[str]:
    """Paths in the answer of ``py -0p``: `` -V:3.12 *        C:\\...\\python.exe``."""
    line = re.compile(r"^\s*-\S+(?:\s+\*)?\s+(\S.*python[\w.]*\.exe)\s*$", re.M | re.I)
    return [found[1].strip() for found in line.finditer(text)]


def _from_registry() -> Iterator[str]:
    """Pythons that are registered with Windows (PEP 514), the user's before the computer's."""
    if sys.platform != "win32":
        return
    import winreg

    found = []
    for root in (winreg.HKEY_CURRENT_USER, winreg.HKEY_LOCAL_MACHINE):
        try:
            with winreg.OpenKey(root, r"Software\Python\PythonCore") as core:
                tags = [winreg.EnumKey(core, number) for number in range(winreg.QueryInfoKey(core)[0])]
                for tag in tags:
                    with winreg.OpenKey(core, tag + r"\InstallPath") as place:
                        found.append(_installed_at(winreg, place))
        except OSError:
            continue
    yield from _in_order(path for path in found if path)


def _installed_at(winreg: Any, place: Any) -> Path | None:
    """The program that an ``InstallPath`` key names."""
    try:
        return Path(winreg.QueryValueEx(place, "ExecutablePath")[0])
    except OSError:
        pass
    try:
        return Path(winreg.QueryValueEx(place, "")[0]) / "python.exe"
    except OSError:
        return None


def _usual_folders() -> list[Path]:
    named = [
        (os.environ.get("LOCALAPPDATA"), "Programs/Python"),
        (os.environ.get("PROGRAMFILES"), ""),
        (os.environ.get("PROGRAMFILES(X86)"), ""),
        (os.environ.get("SYSTEMDRIVE"), "/"),
    ]
    return [Path(base + "/" + below if below == "/" else os.path.join(base, below)) for base, below in named if base]


def _in_order(paths: Any) -> Iterator[str]:
    """By the order of :data:`MINORS`, as far as the path tells; what does not exist is left out."""

    def rank(path: Path) -> int:
        found = re.search(r"3\.?(\d\d?)(?!\d)", path.parent.name)
        return MINORS.index(int(found[1])) if found and int(found[1]) in MINORS else len(MINORS)

    yield from (str(path) for path in sorted(paths, key=rank) if path.exists())
