"""What a process of the ``treedgs`` command sets right before anything heavy is imported: its streams, where its
libraries come from, variables that would end it, and what GDAL and PROJ may do with files of others."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import Any, TextIO

from .children import ROOT

#: Set to 1, the network may be used: rasters and layers that name an address, PROJ's grids.
NETWORK = "TREEDGS_NETWORK"
_NOWHERE = "http://127.0.0.1:9"
#: Every request of GDAL goes through its proxy; drivers that start programs or load code; code in a VRT; PROJ's grids.
_LOCAL = {
    "GDAL_HTTP_PROXY": _NOWHERE,
    "GDAL_HTTPS_PROXY": _NOWHERE,
    "no_proxy": "",
    "NO_PROXY": "",
    "GDAL_SKIP": "ADBC,GPSBabel,GDALG",
    "GDAL_DRIVER_PATH": "disable",
    "GDAL_VRT_ENABLE_PYTHON": "NO",
    "PROJ_NETWORK": "OFF",
}


class _Lasting:
    """A stream that goes on into nothing once its reader is gone: the job's result is what counts."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        try:
            return self._stream.write(text)
        except OSError:
            self._end()
            return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError:
            self._end()

    def _end(self) -> None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def keep_streams() -> None:
    """Input, output and errors are open, and stay so: without them (``cron``, ``>&-``) the next file that is opened
    would take their place, and a reader that leaves (``| head``) would end the job."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free: this one
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream = getattr(sys, name) or open(number, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end
        with suppress(AttributeError):
            stream.reconfigure(errors="backslashreplace")
        setattr(sys, name, _Lasting(stream))


def own_libraries_first() -> None:
    """What ``PYTHONPATH`` names comes after this Python's own libraries: another numpy there is not for us."""
    named = {os.path.abspath(entry) for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry} - {ROOT}
    sys.path.sort(key=lambda entry: os.path.abspath(entry) in named)


def network_allowed() -> bool:
    """Whether the user said so."""
    return os.environ.get(NETWORK, "").strip().lower() in ("1", "yes", "true", "on")


def safe_environment() -> None:
    """A file of somebody else makes no request, starts no program and loads no code, unless the user said that the
    network may be used; a number of threads that is none, on which numba ends the process, is dropped."""
    value = os.environ.get("NUMBA_NUM_THREADS", "1").strip()
    if not (value.isdigit() and int(value)):
        del os.environ["NUMBA_NUM_THREADS"]
    if not network_allowed():
        os.environ.update(_LOCAL)


def plain_names() -> None:
    """pyogrio takes a name with ``;`` or ``!`` for an address, and writes elsewhere; to GDAL it is a name."""
    with suppress(ImportError, AttributeError):
        import pyogrio.util

        pyogrio.util._parse_uri = lambda path: (path, "", "")


def own_signals(modules: tuple[str, ...]) -> None:
    """pycolmap takes SIGTERM for itself when it is imported: it is, before the handlers are set."""
    if "pycolmap" in modules:
        with suppress(ImportError):
            import pycolmap  # noqa: F401


def explained(sentence: str) -> str:
    """An error's sentence, and why where it is the network that was not used."""
    signs = ("/vsicurl", "http:/", "https:/", f" via {_NOWHERE.split('/')[2].partition(':')[0]}")
    if network_allowed() or not any(sign in sentence for sign in signs):
        return sentence
    return f"{sentence} (It names an address; measuring uses no network unless {NETWORK}=1 is set.)"
