"""Memory and disk that ran out, however a library says so, as one of our own errors."""

from __future__ import annotations

import errno
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import MemoryShortage, OutputError, TreeDGSError

_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
#: What libraries write into exceptions of their own (C++ allocators, GDAL, SQLite, LAZ).
_DISK_WORDS = re.compile(
    r"no space left|not enough space|disk is full|disk full|sqlite_full|file too large|disk quota|"
    r"errno 28\b|errno 122\b|\d+ requested and \d+ written"
)
#: Libraries that write files and do not always say why they could not.
_WRITERS = ("pyogrio", "rasterio", "laspy", "lazrs", "sqlite3")
_MEMORY_WORDS = (
    "bad_alloc", "bad allocation", "length_error", "cannot allocate memory", "unable to allocate", "out of memory",
    "failed to allocate", "can't start new thread", "failed to map segment",
)  # fmt: skip
#: Where so much cannot be written after a write has failed, the disk is full.
_PROBE_BYTES = 1_000_000


def shortage_of(problem: BaseException) -> TreeDGSError | None:
    """The sentence for a lack of memory or disk that ``problem``, or what it came from, reports; ``None`` otherwise."""
    seen: list[BaseException] = []
    link: BaseException | None = problem
    while link is not None and link not in seen:
        text = " ".join(str(link).split())[:120]
        number = getattr(link, "errno", None)
        if isinstance(link, OSError) and number in _DISK or _DISK_WORDS.search(text.lower()):
            return full_disk(getattr(link, "filename", None) or "Output", text)
        if (
            isinstance(link, MemoryError)
            or number == errno.ENOMEM
            or any(word in text.lower() for word in _MEMORY_WORDS)
        ):
            detail = f" ({text})" if text else ""
            return MemoryShortage(
                f"Not enough memory{detail}; use a smaller plot or cloud, fewer photos or a faster "
                "preset, raise the limit (ulimit -v), or use a machine with more memory."
            )
        seen.append(link)
        link = link.__cause__ or link.__context__
    return None


def full_disk(where: object, detail: str) -> OutputError:
    """The sentence for an output that finds no room."""
    return OutputError(
        f"{where}: cannot be written, the disk is full or a limit on file size or space is reached "
        f"({detail}); make room or choose an output on another disk."
    )


@contextmanager
def reporting_full_disk(target: Path) -> Iterator[None]:
    """Turn what libraries say about a full disk while ``target`` is written into one sentence; they often do not say
    so. To be left before what was written is removed.

    Raises:
        OutputError: the disk is full, or a limit on the size of files is reached.
    """
    try:
        yield
    except TreeDGSError:
        raise
    except Exception as problem:
        writing = isinstance(problem, OSError) or type(problem).__module__.split(".")[0] in _WRITERS
        said = isinstance(shortage_of(problem), OutputError)
        if said or writing and _files_are_limited() or not _room_in(target.parent):
            detail = f"{type(problem).__name__}: {' '.join(str(problem).split())[:80]}"
            raise full_disk(target, detail) from problem
        raise


def is_full(message: str) -> bool:
    """Whether a message speaks of a full disk."""
    return bool(_DISK_WORDS.search(message.lower()))


def _room_in(folder: Path) -> bool:
    """Whether a file of :data:`_PROBE_BYTES` can be written there."""
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"0" * _PROBE_BYTES)
            probe.flush()
    except OSError as problem:
        return problem.errno not in _DISK
    return True


def _files_are_limited() -> bool:
    """Whether this process may write files of a limited size only (``ulimit -f``, as queues set it)."""
    if sys.platform == "win32":
        return False
    import resource

    return resource.getrlimit(resource.RLIMIT_FSIZE)[0] != resource.RLIM_INFINITY
