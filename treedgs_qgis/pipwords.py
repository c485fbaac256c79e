"""What pip's log means, in one sentence. Standard library only."""

from __future__ import annotations

import platform
import re
from pathlib import Path

from .pythons import MINORS
from .words import tr

#: pip's last words when the index cannot be reached.
_NETWORK = re.compile(
    r"connection broken|NewConnectionError|ConnectTimeout|ReadTimeout|ProxyError|Max retries exceeded|"
    r"Could not fetch URL|Temporary failure in name resolution|CERTIFICATE_VERIFY_FAILED|\bHTTP error (?:4|5)\d\d"
)
_NOT_THERE = re.compile(r"No matching distribution found for ([A-Za-z0-9][\w.-]*?)(?:\[|[=<>~! ]|$)", re.M)
_FULL = re.compile(r"No space left on device|Errno 28|WinError 112|not enough space on the disk", re.I)
_IN_USE = re.compile(r"\[WinError (?:5|32)\]|being used by another process")


def why_pip_failed(
    said: str, packages: str, target: Path, python: tuple[int, int] | None, wheels: Path | None = None
) -> str:
    """One sentence: why the libraries could not be installed, and what to do.

    said: pip's log. packages: what was asked for, in words. python: version of the environment's Python. wheels: the
    folder that was given instead of a network.
    """
    version = ".".join(map(str, python)) if python else "?"
    words = {"packages": packages, "target": target, "python": version, "wheels": wheels}
    if _FULL.search(said):
        return tr("The disk with {target} is full; make room or set TREEDGS_HOME to a larger disk.").format(**words)
    if _IN_USE.search(said):
        return tr(
            "{target}: a file is in use; close QGIS and other programs that run the engine, and run this again."
        ).format(**words)
    if "DO NOT MATCH THE HASHES" in said:
        return tr(
            "A library that pip received is not the one that was tested (its hash differs); a proxy or a mirror may "
            "have changed it: try another network, or give a folder of wheels."
        )
    missing = _NOT_THERE.findall(said)
    if missing and wheels is not None:
        return tr(
            "{wheels}: has no wheel of {name} for Python {python} on this system; make the folder with this Python's "
            "version on the same system, or choose another Python (PYTHON)."
        ).format(**words, name=missing[-1])
    if missing and not _NETWORK.search(said) and python and python[0] == 3 and python[1] in MINORS:
        return tr(
            "{name} has no ready-made package (wheel) for this system ({system}, Python {python}); the engine runs on "
            "Windows x64, on Linux x86-64, and on macOS 15 or newer with an Apple processor. The network works."
        ).format(**words, name=missing[-1], system=this_system())
    if missing and not _NETWORK.search(said):
        return tr(
            "{name} has no ready-made package (wheel) for Python {python} on this system; install Python 3.12 and name "
            "it (PYTHON), and run this again. The network works."
        ).format(**words, name=missing[-1])
    if _NETWORK.search(said):
        return tr(
            "pip could not reach the package index to install {packages}; without network give a folder of wheels, "
            "behind a proxy set HTTPS_PROXY, then run this again."
        ).format(**words)
    return tr(
        "pip could not install {packages} into {target}; read the lines above: without network give a folder of "
        "wheels, behind a proxy set HTTPS_PROXY, then run this again."
    ).format(**words)


def this_system() -> str:
    """Its name, version and processor, like ``macOS 13.6, x86_64``."""
    mac = platform.mac_ver()[0]
    name = f"macOS {mac}" if mac else f"{platform.system()} {platform.release()}"
    return f"{name}, {platform.machine()}"
