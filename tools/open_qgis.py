"""QGIS with the plugin, in the repository's private profile: ``make qgis``. Files given are opened as layers."""

from __future__ import annotations

import os
import subprocess
import sys

import qgis_run


def main() -> int:
    """Start QGIS and wait for it."""
    program = qgis_run.qgis()
    if program is None:
        print("error: QGIS was not found; run make setup", file=sys.stderr)
        return 1
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if not display:
        print("error: there is no display; make screenshot draws QGIS without one", file=sys.stderr)
        return 1
    command = [program, "--noversioncheck", "--nologo", *sys.argv[1:]]
    return subprocess.call(command, env=qgis_run.environment(DISPLAY=os.environ.get("DISPLAY", ":0")))


if __name__ == "__main__":
    sys.exit(main())
