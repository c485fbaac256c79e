"""A Python of the engine's own, where the computer has none that will do: fetched by uv, which pip fetches.

uv (Astral) comes as a wheel whose hash stands in ``uv-locked.txt`` (``make lock``); it installs a Python of the project
python-build-standalone, whose hash it knows, in the data folder. Neither the system, nor the registry of Windows, nor
QGIS is touched. Standard library only.
"""

from __future__ import annotations

import os
import shutil
import stat
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

from .pythons import SetupError, usable_python
from .words import tr

LOCKED = Path(__file__).with_name("uv-locked.txt")
VERSION = "3.12"
#: What Windows and macOS call the program, and where a Python of uv has it.
_INSIDE = ("python.exe", "bin/python3.12")

Runner = Callable[[list], int]


def fetched(folder: Path) -> str:
    """The Python that was fetched into ``folder`` before, or ''."""
    for name in _INSIDE:
        for found in sorted(folder.glob(f"cpython-{VERSION}*/{name}"), reverse=True):
            if usable_python(str(found)):
                return str(found)
    return ""


def fetch(folder: Path, run: Runner, say: Callable[[str], None] = print) -> str:
    """Fetch a Python into ``folder``; returns its path. run: starts a command and returns its exit code.

    Raises:
        SetupError: no Python with pip to begin with, or one of the two could not be fetched.
    """
    if found := fetched(folder):
        return found
    say(tr("No suitable Python is installed; getting Python {version} for the engine alone.").format(version=VERSION))
    pip = _with_pip()
    if not pip:
        raise SetupError(
            tr(
                "No Python that will do was found, and none that could fetch one; install Python 3.12 (python.org) and "
                "run this again."
            )
        )
    scratch = folder / "uv"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    try:
        words = ["download", "--no-input", "--disable-pip-version-check", "--progress-bar", "off", "--no-deps"]
        words += ["--only-binary", ":all:", "--require-hashes", "-d", str(scratch), "-r", str(LOCKED)]
        wheel = next(scratch.glob("uv-*.whl"), None) if run([pip, "-m", "pip", *words]) == 0 else None
        if wheel is None:
            raise SetupError(_no_network("uv"))
        program = _unpacked(wheel, scratch)
        arguments = ["python", "install", VERSION, "--install-dir", str(folder), "--no-bin", "--no-config"]
        arguments += ["--cache-dir", str(scratch / "cache"), "--no-progress"]
        if run([str(program), *arguments]) != 0 or not (found := fetched(folder)):
            raise SetupError(_no_network(f"Python {VERSION}"))
        return found
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _no_network(what: str) -> str:
    return tr(
        "{what} could not be fetched; read the lines above, and check the network (behind a proxy set HTTPS_PROXY), or "
        "install Python 3.12 (python.org) and run this again."
    ).format(what=what)


def _with_pip() -> str:
    """The Python that QGIS itself runs in: it makes no environments that last, but its pip can fetch."""
    base = Path(sys.exec_prefix)
    # Within QGIS, sys.executable may be QGIS.
    places = [base / "python3.exe", base / "python.exe", base / "bin" / "python3", Path(sys.executable)]
    for place in places:
        if place.is_file() and place.name.lower().startswith("python") and os.access(place, os.X_OK):
            return str(place)
    return ""


def _unpacked(wheel: Path, folder: Path) -> Path:
    """The program out of uv's wheel."""
    name = "uv.exe" if sys.platform == "win32" else "uv"
    with zipfile.ZipFile(wheel) as archive:
        inside = next((entry for entry in archive.namelist() if entry.endswith(f".data/scripts/{name}")), None)
        if inside is None:
            raise SetupError(_no_network("uv"))
        program = folder / name
        with archive.open(inside) as source, open(program, "wb") as target:
            shutil.copyfileobj(source, target)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return program
