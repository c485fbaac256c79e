"""Building the engine's Python environment: used by ``make setup`` (as a program) and by ``treedgs:setupengine``.

Standard library only, Python 3.9 or newer. Both install the locked list (:mod:`.locked`); ``make setup`` adds the
developers' list, torch where it comes without CUDA (from the ranges of ``requirements.txt``) and the library itself.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from .pip_meter import progress_words
from .pipwords import why_pip_failed
from .pythons import SetupError, find_python, usable_python, version_of
from .words import tr

ROOT = Path(__file__).resolve().parents[1]
REQUIREMENTS = Path(__file__).with_name("requirements.txt")
READY = "treedgs-ready.json"
NEEDED_DISK_GB = 4
#: Windows allows 259 characters in a path; the longest path below an environment has 150.
LONGEST_TARGET = 100
#: Lines of pip's log that are shown when it fails.
TAIL = 15
#: A set-up that has not said so (:func:`going_on`) for this long, seconds, is over or was killed.
SILENT_S = 30.0
#: Compiles what pip installed, on all processors; pip itself does it on one, for most of its time. The libraries' own
#: tests, half of their code, are never imported. It cannot fail: what does not compile here is compiled, or refused,
#: when it is imported.
COMPILE = """
import compileall, functools, os, sys
from concurrent.futures import ProcessPoolExecutor
files = []
for at, folders, names in os.walk(sys.argv[1]):
    folders[:] = [name for name in folders if name not in ("tests", "test")]
    files += [os.path.join(at, name) for name in names if name.endswith(".py")]
one = functools.partial(compileall.compile_file, quiet=2)
with ProcessPoolExecutor(min(os.cpu_count() or 1, 8)) as pool:
    for number, _ in enumerate(pool.map(one, files, chunksize=50), 1):
        if number % 250 == 0 or number == len(files):
            print("Compiled", number, "of", len(files), flush=True)
"""
Runner = Callable[[list], int]


def requirements() -> list[str]:
    """The pinned ranges, torch first."""
    lines = REQUIREMENTS.read_text(encoding="utf-8").splitlines()
    return sorted((line for line in lines if line and line[0] != "#"), key=lambda line: not line.startswith("torch"))


def read_record(target: Path) -> dict:
    """What was written down when ``target`` was finished last; empty where it was not."""
    try:
        found = json.loads((target / READY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def is_ready(target: Path, key: str) -> bool:
    """True when ``target`` was finished with the same key."""
    return read_record(target).get("key") == key


def _sign(target: Path) -> Path:
    """Touched while a set-up goes on; called like a list, so that it goes with its environment."""
    return target.with_name(f"{target.name}-setup.txt")


def going_on(target: Path) -> None:
    """Say that ``target`` is being set up: at least every few seconds, to every QGIS of this user."""
    target.parent.mkdir(parents=True, exist_ok=True)
    _sign(target).touch()


def over(target: Path) -> None:
    """The libraries are there, or the set-up ended without."""
    _sign(target).unlink(missing_ok=True)


def set_up_runs(target: Path) -> bool:
    """Whether ``target`` is being set up right now, by this QGIS or another one."""
    try:
        return abs(time.time() - _sign(target).stat().st_mtime) < SILENT_S
    except OSError:
        return False


def remove(target: Path) -> None:
    """Delete an environment that was built here; anything else is left alone."""
    if target.exists() and not (target / "pyvenv.cfg").exists():
        raise SetupError(f"{target}: is not a Python environment, so it is not removed; move it away yourself.")
    shutil.rmtree(target, ignore_errors=True)


def build(
    target: Path,
    packages: list[list[str]],
    key: str,
    python: str,
    wheels: Path | None = None,
    run: Runner = subprocess.call,
    say: Callable[[str], None] = print,
    torch: str = "cpu",
    needed_gb: float = NEEDED_DISK_GB,
    record: dict | None = None,
    cache: Path | None = None,
) -> None:
    """Make (or repair) the virtual environment ``target`` and install ``packages``, one pip call per list.

    A marker file is written last, so that a build that was cut short is taken up again. run: starts a command and
    returns its exit code. wheels: install from this folder only, without network. needed_gb: free disk that it takes.
    record: kept in the marker file (:func:`read_record`). cache: pip's folder for what it downloads (default: its own).

    Raises:
        SetupError: no disk space, or a step failed.
    """
    if is_ready(target, key):
        say(f"The engine environment {target} is complete.")
        return
    if wheels is not None and not any(wheels.glob("*.whl")):
        raise SetupError(f"{wheels}: holds no .whl files, expected the wheels of the engine's libraries.")
    target = Path(os.path.abspath(target))  # its Python is asked from another folder
    if sys.platform == "win32" and len(str(target)) > LONGEST_TARGET:
        raise SetupError(
            tr(
                "{target}: has {count} characters; the libraries' own paths would be longer than Windows allows, "
                "expected at most {most}: set TREEDGS_HOME to a short folder like C:\\treedgs."
            ).format(target=target, count=len(str(target)), most=LONGEST_TARGET)
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    free = shutil.disk_usage(target.parent).free / 1e9
    if free < needed_gb and not (target / READY).exists():
        raise SetupError(
            f"{target.parent}: {free:.1f} GB are free, about {needed_gb:g} GB are needed; make room or "
            "set TREEDGS_HOME to a larger disk."
        )
    inside = target / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not usable_python(str(inside)):
        say(f"Making {target} with {python}")
        if run([python, "-I", "-m", "venv", "--clear", str(target)]) != 0:
            raise SetupError(
                f"{target}: {python} could not make a virtual environment there (Debian and Ubuntu: apt "
                "install python3-venv)."
            )
    (target / READY).unlink(missing_ok=True)
    pip = [str(inside), "-I", "-m", "pip", "install", "--no-input", "--disable-pip-version-check"]
    log = target / "pip.log"
    pip += ["--no-compile", *progress_words(packages_of(target)), "--log", str(log)]
    if cache is not None:
        pip += ["--cache-dir", str(cache)]
    if wheels is not None:
        pip += ["--no-index", "--find-links", str(wheels)]
    for group in packages:
        if torch == "cpu" and wheels is None and group[0].startswith("torch") and _pulls_cuda(pip, group):
            say(
                f"Leaving out {', '.join(group)}: here it would bring gigabytes of CUDA, and it only serves tests "
                "(TREEDGS_TORCH=cuda installs it all the same)."
            )
            continue
        say(f"Installing {what(group)}")
        log.unlink(missing_ok=True)
        if run([*pip, *group]) != 0:
            said = log.read_text(encoding="utf-8", errors="replace") if log.exists() else ""
            raise SetupError(why_pip_failed(said, what(group), target, version_of(str(inside)), wheels))
    site = packages_of(target)
    if site is not None:
        run([str(inside), "-I", "-c", COMPILE, str(site)])
    (target / READY).write_text(
        json.dumps({**(record or {}), "key": key, "packages": packages}) + "\n", encoding="utf-8"
    )


def packages_of(target: Path) -> Path | None:
    """The folder of an environment that holds its libraries; ``None`` before there is one."""
    if sys.platform == "win32":
        found = target / "Lib" / "site-packages"
        return found if found.is_dir() else None
    return next((target / "lib").glob("python3*/site-packages"), None)


def what(group: list[str]) -> str:
    """What pip is asked for, in words."""
    if "--require-hashes" in group:
        return "the locked list of libraries"
    return "the library itself" if "-e" in group else ", ".join(group)


def logged(log: Path) -> Runner:
    """A runner that keeps what a command prints in ``log`` and shows its end when the command fails."""

    def run(command: list) -> int:
        with open(log, "ab") as stream:
            stream.write(f"$ {' '.join(map(str, command))}\n".encode())
            stream.flush()
            code = subprocess.call(command, stdin=subprocess.DEVNULL, stdout=stream, stderr=subprocess.STDOUT)
        if code:
            lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
            print("\n".join(lines[-TAIL:]), f"(all of it in {log})", sep="\n", file=sys.stderr)
        return code

    return run


def _pulls_cuda(pip: list[str], group: list[str]) -> bool:
    """Ask pip what it would install: some torch wheels drag gigabytes of CUDA along."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        done = subprocess.run([*pip, "--quiet", "--dry-run", "--report", str(report), *group], capture_output=True)
        if done.returncode != 0 or not report.exists():
            return False
        names = [item["metadata"]["name"].lower() for item in json.loads(report.read_text(encoding="utf-8"))["install"]]
    return any(name.startswith(("nvidia", "triton", "cuda")) for name in names)


def main() -> int:
    """``python -m treedgs_qgis.environment``: the development environment of ``make setup``."""
    from . import locked

    parser = argparse.ArgumentParser()
    parser.add_argument("--target", type=Path, required=True)
    parser.add_argument("--key", required=True)
    parser.add_argument("--python", default="")
    parser.add_argument("--log", type=Path, required=True)
    chosen = parser.parse_args()
    chosen.log.unlink(missing_ok=True)
    torch = [item for item in requirements() if item.startswith("torch")]
    try:
        build(
            chosen.target,
            [
                locked.write_list("cuda", chosen.log.with_name("locked.txt"), locked.DEVELOPERS),
                *([torch] if torch else []),
                ["--no-deps", "--no-build-isolation", "-e", str(ROOT)],
            ],
            chosen.key,
            find_python(chosen.python),
            run=logged(chosen.log),
            torch=os.environ.get("TREEDGS_TORCH", "cpu"),
        )
    except (SetupError, OSError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
