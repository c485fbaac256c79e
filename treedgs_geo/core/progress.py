"""How a running job talks: stages, progress with an estimate, messages, the result.

Library functions take a :class:`Reporter` (default: silent). The command line picks a terminal bar, plain log lines or
JSON lines; the QGIS plugin reads the JSON lines (``docs/developer/engine.md``). Cancelling arrives as
:class:`Cancelled`.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from .errors import TreeDGSWarning

if TYPE_CHECKING:
    from .crs import LocalFrame

#: Version of the JSON-lines protocol; the plugin refuses an engine that speaks another one.
PROTOCOL = 1
#: A stage that is over sooner than this was kept from an earlier run: it says nothing about the speed of the rest.
KEPT_S = 0.5


class Reporter:
    """Base reporter: silent. Nested :meth:`stage` calls map a stage's 0..1 onto its share of the whole.

    Examples:
        >>> import treedgs_geo as tg
        >>> class Warnings(tg.Reporter):
        ...     def warn(self, message):
        ...         print("warning:", message)
        >>> Warnings().warn("3 photos are blurred")
        warning: 3 photos are blurred
    """

    def __init__(self) -> None:
        self._low, self._high = 0.0, 1.0
        self._fraction = 0.0
        self._free = 0.0
        self._started = time.monotonic()
        #: Turns a message into the words of where it is shown.
        self.words: Callable[[str], str] = str
        self._frame: LocalFrame | None = None

    @contextmanager
    def stage(self, name: str, low: float = 0.0, high: float = 1.0) -> Iterator[None]:
        """Run a named stage that covers ``low``..``high`` of the enclosing stage's progress."""
        outer = self._low, self._high
        span = outer[1] - outer[0]
        self._low, self._high = outer[0] + low * span, outer[0] + high * span
        self._emit("stage", {"name": name})
        self.progress(0.0)
        began, free = time.monotonic(), self._free
        try:
            yield
            if time.monotonic() - began < KEPT_S:
                self._free = free + (self._high - self._low)
            self.progress(1.0)
            self._emit("stage_done", {"name": name, "seconds": round(time.monotonic() - began, 2)})
        finally:
            self._low, self._high = outer

    def progress(self, fraction: float, message: str = "") -> None:
        """Progress 0..1 of the current stage."""
        fraction = min(max(float(fraction), 0.0), 1.0)
        self._fraction = self._low + fraction * (self._high - self._low)
        spent = time.monotonic() - self._started
        worked = self._fraction - self._free
        eta = spent * (1 - self._fraction) / worked if worked > 0.02 and spent > 2 else None
        self._emit("progress", {"fraction": round(self._fraction, 4), "message": message, "eta_s": eta and round(eta)})

    @contextmanager
    def placed(self, frame: LocalFrame) -> Iterator[None]:
        """In here, places are local ones of ``frame``."""
        self._frame = frame
        try:
            yield
        finally:
            self._frame = None

    def stem(self, x: float, y: float, dbh_cm: float) -> None:
        """A stem as it is first measured, to be looked at while the rest goes on: what follows may change it, move it
        or leave it out. x, y: local, m. Nothing is said where no frame is known (:meth:`placed`)."""
        if self._frame is not None:
            import numpy as np

            east, north, _ = self._frame.to_project(np.array([x, y, 0.0])).round(3).tolist()
            self._emit("stem", {"x": east, "y": north, "dbh_cm": round(dbh_cm, 1), "crs": self._frame.crs.to_wkt()})

    def info(self, message: str) -> None:
        """A line a technician understands."""
        self._emit("info", {"message": message})

    def warn(self, message: str) -> None:
        """Something recoverable that may have cost accuracy or trees."""
        self._emit("warn", {"message": message})

    def tell(self, warnings: Iterable[str] = (), notes: Iterable[str] = ()) -> None:
        """Several sentences."""
        for sentence in warnings:
            self.warn(sentence)
        for sentence in notes:
            self.info(sentence)

    def error(self, message: str) -> None:
        """The sentence that ends the run."""
        self._emit("error", {"message": message})

    def result(self, value: dict[str, Any]) -> None:
        """The outcome, once, last."""
        self._emit("result", {"result": value})

    def close(self) -> None:
        """Release the terminal."""

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        pass


class WarningReporter(Reporter):
    """Silent but for warnings: they are Python's, of the line that called the library."""

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "warn":
            level, frame = 1, sys._getframe()
            while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith(
                ("treedgs_geo.", "treedgs_lab.")
            ):
                level, frame = level + 1, frame.f_back
            warnings.warn(self.words(body["message"]), TreeDGSWarning, stacklevel=level)


class Collector(Reporter):
    """Passes everything on and remembers the warnings, for the report and for a resumed run.

    held: messages are kept back until it is clear that the work they tell of is used (:meth:`release`).
    """

    def __init__(self, inner: Reporter, held: bool = False) -> None:
        super().__init__()
        self._inner, self._held = inner, held
        self._said: list[tuple[str, str]] = []

    @property
    def warnings(self) -> list[str]:
        """The warnings so far."""
        return [message for kind, message in self._said if kind == "warn"]

    def release(self, reporter: Reporter | None = None) -> None:
        """Pass on the messages that were kept back, in their order; reporter: to this one."""
        for kind, message in self._said if self._held else ():
            getattr(reporter or self._inner, kind)(message)
        self._held = False

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "progress":
            self._inner.progress(body["fraction"], body["message"])
        elif kind in ("info", "warn"):
            self._said.append((kind, body["message"]))
            # A reporter of the user's may have its own words for these.
            if not self._held:
                getattr(self._inner, kind)(body["message"])
        else:
            self._inner._emit(kind, body)


class JsonReporter(Reporter):
    """One JSON object a line on ``stream``; progress at most ten times a second."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._last = 0.0
        from .. import __version__

        self._emit("hello", {"protocol": PROTOCOL, "version": __version__})

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "progress":
            now = time.monotonic()
            if now - self._last < 0.1 and body["fraction"] < 1:
                return
            self._last = now
        self._stream.write(json.dumps({"t": kind, **body}) + "\n")
        self._stream.flush()


class PlainReporter(Reporter):
    """Log lines: stages, messages, and progress at every tenth of the whole."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._tenth = 0

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "progress":
            tenth = int(body["fraction"] * 10)
            if tenth <= self._tenth:
                return
            self._tenth = tenth
            eta = f", about {_duration(body['eta_s'])} left" if body["eta_s"] else ""
            line = f"  {tenth * 10} %{eta}"
        elif kind == "stage":
            line = f"[{body['name']}]"
        elif kind == "stage_done":
            line = f"  {body['name']}: {body['seconds']:.1f} s"
        elif kind in ("result", "stem"):
            return
        else:
            mark = {"warn": "warning: ", "error": "error: "}.get(kind, "")
            line = ("" if kind == "error" else "  ") + mark + self.words(body["message"])
        self._stream.write(line + "\n")
        self._stream.flush()


class BarReporter(Reporter):
    """A tqdm bar on a terminal; messages are printed above it."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        from tqdm import tqdm

        self._bar = tqdm(total=1000, file=stream, bar_format="{desc} {percentage:3.0f} %|{bar}| {elapsed} < {postfix}")
        self._bar.set_postfix_str("?")

    def _emit(self, kind: str, body: dict[str, Any]) -> None:
        if kind == "progress":
            self._bar.n = int(body["fraction"] * 1000)
            self._bar.set_postfix_str(_duration(body["eta_s"]) if body["eta_s"] else "?", refresh=False)
            self._bar.refresh()
        elif kind == "stage":
            self._bar.set_description_str(body["name"])
        elif kind in ("info", "warn", "error"):
            mark = {"warn": "warning: ", "error": "error: "}.get(kind, "")
            self._bar.write(mark + self.words(body["message"]), file=self._bar.fp)

    def close(self) -> None:
        """End the bar."""
        self._bar.close()


def make_reporter(style: str) -> Reporter:
    """``auto`` (bar on a terminal, else plain), ``bar``, ``plain``, ``json`` (on stdout) or ``quiet``."""
    if style == "quiet":
        return Reporter()
    if style == "json":
        return JsonReporter(sys.stdout)
    if style == "bar" or style == "auto" and sys.stderr.isatty():
        return BarReporter(sys.stderr)
    return PlainReporter(sys.stderr)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
