"""How far pip is, from what it prints and from what is there: for a progress bar. Standard library only.

The first part counts the megabytes of the wheels that pip names, the second the packages that it has finished (each
has its ``INSTALLER`` file then), weighted by the size of their wheels, the last the files that are compiled.
"""

from __future__ import annotations

import re
import time
from pathlib import Path
from urllib.parse import unquote

from .words import tr

#: Seconds between two looks at the folder of packages.
LOOK_S = 0.5
#: pip tells of parts of a download since 24.1.
RAW_SINCE = (24, 1)
#: Share of the bar for making the environment, before pip begins.
BEFORE = 0.03
#: Share of compiling in what comes after the download.
COMPILING = 0.5
_UNITS = {"bytes": 1e-6, "kB": 1e-3, "MB": 1.0, "GB": 1e3}
_WHEEL = re.compile(
    r"^\s*(Downloading|Using cached|Processing) (.+?\.whl)(?: \(([\d.]+) (bytes|kB|MB|GB)\))?(?: \(from .*\))?\s*$"
)
_RAW = re.compile(r"^\s*Progress (\d+) of (\d+)\s*$")
_COMPILED = re.compile(r"^Compiled (\d+) of (\d+)$")
_NAMES = re.compile(r"^\s*Installing collected packages: (.+)$")


def plain(name: str) -> str:
    """A package's name as all of its spellings have it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def progress_words(site: Path | None) -> list[str]:
    """What makes this environment's pip print what is read here. site: its folder of packages."""
    found = next(site.glob("pip-*.dist-info"), None) if site else None
    version = re.match(r"pip-(\d+)\.(\d+)", found.name) if found else None
    raw = version is not None and (int(version[1]), int(version[2])) >= RAW_SINCE
    return ["--progress-bar", "raw" if raw else "off"]


class Meter:
    """Reads pip's lines. ``fraction`` of the whole and ``message`` in words; both change in place.

    total_mb: what is downloaded. download_s, install_s: seconds that the two parts take elsewhere: their shares.
    """

    def __init__(self, total_mb: float, download_s: float, install_s: float) -> None:
        self.total_mb = max(total_mb, 1.0)
        self.boundary = BEFORE + (1 - BEFORE) * download_s / max(download_s + install_s, 1.0)
        self.compiling = 1 - COMPILING * (1 - self.boundary)
        self.fraction, self.message = 0.0, ""
        self.site: Path | None = None
        self._sizes: dict[str, float] = {}
        self._current, self._current_mb = "", 0.0
        self._wanted: list[str] = []
        self._before: set[str] = set()
        self._looked = 0.0

    def line(self, text: str) -> bool:
        """One line that pip printed; true when it is only for the bar."""
        if found := _RAW.match(text):
            self._sizes[self._current] = min(int(found[1]) / 1e6, self._current_mb or int(found[2]) / 1e6)
            self._download()
            return True
        if found := _COMPILED.match(text):
            self._wanted = []
            self._reach(self.compiling + (1 - self.compiling) * int(found[1]) / int(found[2]))
            self.message = tr("Preparing the libraries for a quick start")
            return True
        if found := _WHEEL.match(text):
            self._close()
            path = unquote(found[2].removeprefix("file://"))
            self._current = plain(re.split(r"[/\\]", path)[-1].split("-")[0])
            self._current_mb = float(found[3]) * _UNITS[found[4]] if found[3] else _size_mb(path)
            self._sizes.setdefault(self._current, 0.0)
            if found[1] != "Downloading":
                self._close()
            self._download()
        elif found := _NAMES.match(text):
            self._close()
            self._wanted = [plain(name) for name in found[1].split(", ")]
            self._before = self._installed()
            self._install()
        return False

    def look(self) -> None:
        """Called often while nothing is printed: what has been installed since the last look."""
        now = time.monotonic()
        if self._wanted and now - self._looked >= LOOK_S:
            self._looked = now
            self._install()

    def _close(self) -> None:
        """The wheel named last is here."""
        if self._current:
            self._sizes[self._current] = self._current_mb
            self._current = ""

    def _download(self) -> None:
        there = min(sum(self._sizes.values()), self.total_mb)
        self._reach(BEFORE + (self.boundary - BEFORE) * there / self.total_mb)
        name = self._current or next(reversed(self._sizes), "")
        self.message = tr("Fetching {name} ({done} of {all} MB are here)").format(
            name=name, done=round(there), all=round(self.total_mb)
        )

    def _install(self) -> None:
        mean = sum(self._sizes.values()) / len(self._sizes) if self._sizes else 1.0
        weights = {name: self._sizes.get(name) or mean for name in self._wanted}
        # What another version of was there before is counted as soon as pip gets beyond it.
        done = self._installed() - self._before
        last = max((place for place, name in enumerate(self._wanted, 1) if name in done), default=0)
        share = sum(weights[name] for name in self._wanted[:last]) / max(sum(weights.values()), 1e-9)
        self._reach(self.boundary + (self.compiling - self.boundary) * share)
        if last < len(self._wanted):
            self.message = tr("Installing {name} ({number} of {all})").format(
                name=self._wanted[last], number=last + 1, all=len(self._wanted)
            )

    def _installed(self) -> set[str]:
        found = self.site.glob("*.dist-info/INSTALLER") if self.site else ()
        return {plain(path.parent.name.split("-")[0]) for path in found}

    def _reach(self, fraction: float) -> None:
        """Never back, and the end is said by whoever knows that it is the end."""
        self.fraction = max(self.fraction, min(fraction, 0.99))


def _size_mb(path: str) -> float:
    try:
        return Path(path).stat().st_size / 1e6
    except OSError:
        return 0.0
