"""How QGIS is started with this repository as its plugin, in a private profile: for the demo, tests and screenshots.

Standard library only. ``python tools/qgis_run.py list`` passes its arguments to ``qgis_process``.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SETUP = ROOT / ".setup"


def qgis_process() -> str | None:
    """The program; Debian's wrapper passes it an option it does not know, so the binary behind it comes first."""
    return shutil.which("qgis_process.bin") or shutil.which("qgis_process")


def qgis() -> str | None:
    """The graphical program."""
    return shutil.which("qgis.bin") or shutil.which("qgis")


def with_windows(script: Path, screen: str = "1280x1000x24") -> list[str] | None:
    """The graphical program under Xvfb, which runs a script inside (``--code``); ``None`` where one is missing."""
    frame, program = shutil.which("xvfb-run"), qgis()
    if frame is None or program is None:
        return None
    return [frame, "-a", "-s", f"-screen 0 {screen}", program, "--noversioncheck", "--nologo", "--code", str(script)]


def environment(setup: Path = SETUP, **more: str) -> dict[str, str]:
    """Variables for a QGIS that sees only the private profile below ``setup``.

    TREEDGS_HOME is set, so that job logs and managed environments stay there too.
    """
    runtime = setup / "runtime"
    runtime.mkdir(parents=True, exist_ok=True)
    runtime.chmod(0o700)
    dropped = ("PYTHON", "QGIS_", "VIRTUAL_ENV")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(dropped)}
    kept.update(
        QGIS_CUSTOM_CONFIG_PATH=str(setup / "qgis"),
        QGIS_PLUGINPATH=str(setup / "plugins"),
        XDG_RUNTIME_DIR=str(runtime),
        TREEDGS_HOME=os.environ.get("TREEDGS_HOME", str(setup / "home")),
        PYTHONDONTWRITEBYTECODE="1",
        PYTHONWARNINGS="ignore",
        # The Python inside QGIS takes its libraries from beside the first python3 on the PATH: the system's.
        PATH=os.pathsep.join(["/usr/bin", "/bin", os.environ.get("PATH", "")]),
    )
    if not more.get("DISPLAY"):
        kept["QT_QPA_PLATFORM"] = "offscreen"
    kept.update(more)
    return kept


def make_profile(setup: Path = SETUP) -> None:
    """Link the repository as the plugin ``treedgs`` into a private profile and switch it on.

    Raises:
        RuntimeError: QGIS is missing or does not take the plugin.
    """
    program = qgis_process()
    if program is None:
        raise RuntimeError(
            "qgis_process was not found; install QGIS 3.22 or newer (Debian and Ubuntu: apt install qgis)"
        )
    link = setup / "plugins" / "treedgs"
    link.parent.mkdir(parents=True, exist_ok=True)
    if not link.exists() or link.resolve() != ROOT:
        link.unlink(missing_ok=True)
        link.symlink_to(ROOT, target_is_directory=True)
    done = subprocess.run(
        [program, "plugins", "enable", "treedgs"], env=environment(setup), capture_output=True, text=True
    )
    listed = subprocess.run([program, "plugins"], env=environment(setup), capture_output=True, text=True)
    if "* treedgs" not in listed.stdout:
        raise RuntimeError(f"QGIS did not switch the plugin on: {done.stdout}{done.stderr}{listed.stdout}")


class WithoutDots:
    """Takes the progress that ``qgis_process`` writes between and into lines (``0...10...``) out of them."""

    def __init__(self) -> None:
        self._left = [part for ten in range(0, 100, 10) for part in (str(ten), ".", ".", ".")] + ["100", " - done."]

    def line(self, text: str) -> str | None:
        """The line without the progress at its beginning; ``None`` when nothing else was in it."""
        rest = text
        while self._left and rest.startswith(self._left[0]):
            after = rest[len(self._left[0]) :]
            # A number of the message's own: "80 photos", "30,000 points", "40 % of it".
            if self._left[0].isdigit() and re.match(r"[\d,%]|\.\d| \S", after) and not after.startswith(" - done."):
                break
            rest = after
            self._left.pop(0)
        return None if rest != text and not rest.strip() else rest


def run_algorithm(algorithm: str, parameters: dict[str, object], setup: Path = SETUP, log: Path | None = None) -> int:
    """``qgis_process run``, its messages on ours. Returns its exit code; 1 with a message when QGIS is missing.

    log: gets all that it prints; the terminal then only gets what a person reads.
    """
    program = qgis_process()
    if program is None:
        print("error: qgis_process was not found; run make setup", file=sys.stderr)
        return 1
    values = [f"{name}={value}" for name, value in parameters.items()]
    command = [program, "run", algorithm, "--", *values]
    if log is None:
        return subprocess.call(command, env=environment(setup))
    log.parent.mkdir(parents=True, exist_ok=True)
    dots = WithoutDots()
    with (
        open(log, "w", encoding="utf-8") as kept,
        subprocess.Popen(
            command, env=environment(setup), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            encoding="utf-8", errors="replace",
        ) as process,
    ):  # fmt: skip
        assert process.stdout is not None
        for line in process.stdout:
            kept.write(line)
            shown = dots.line(line.rstrip("\n"))
            if shown is not None and not shown.startswith(("Engine: ", "-----")):
                print(shown, flush=True)
    return process.returncode


def main() -> int:
    """``--make-profile``, or arguments for ``qgis_process``."""
    if sys.argv[1:] == ["--make-profile"]:
        try:
            make_profile()
        except RuntimeError as problem:
            print(f"error: {problem}", file=sys.stderr)
            return 1
        return 0
    program = qgis_process()
    if program is None:
        print("error: qgis_process was not found; run make setup", file=sys.stderr)
        return 1
    return subprocess.call([program, *sys.argv[1:]], env=environment())


if __name__ == "__main__":
    sys.exit(main())
