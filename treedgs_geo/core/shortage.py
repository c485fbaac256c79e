"""Memory and disk that ran out, however a library says so, as one of our own errors."""

from __future__ import annotations

import errno
import re
import tempfile
from pathlib import Path

from .errors import MemoryShortage, OutputError, TreeDGSError

_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
#: What libraries write into exceptions of their own (C++ allocators, GDAL, SQLite, LAZ).
_DISK_WORDS = re.compile(r"no space left|disk is full|disk full|file too large|disk quota exceeded|"
                         r"\d+ requested and \d+ written")
_MEMORY_WORDS = ("bad_alloc", "bad allocation", "length_error", "cannot allocate memory", "unable to allocate",
                 "out of memory", "failed to allocate", "can't start new thread", "failed to map segment")
#: Where so much cannot be written after a write has failed, the disk is full.
_PROBE_BYTES = 1_000_000


def shortage_of(problem: BaseException) -> TreeDGSError | None:
    """The sentence for a lack of memory or disk that ``problem``, or what it came from, reports; ``None`` otherwise."""
    chain: list[BaseException] = []
    link: BaseException | None = problem
    while link is not None and link not in chain:
        chain.append(link)
        link = link.__cause__ or link.__context__
    for link in chain:
        text = " ".join(str(link).split())[:120]
        number = getattr(link, "errno", None)
        if isinstance(link, OSError) and number in _DISK or _DISK_WORDS.search(text.lower()):
            return full_disk(getattr(link, "filename", None) or "Output", text)
        if isinstance(link, MemoryError) or number == errno.ENOMEM or any(
                word in text.lower() for word in _MEMORY_WORDS):
            detail = f" ({text})" if text else ""
            return MemoryShortage(f"Not enough memory{detail}; use a smaller plot or cloud, fewer photos or a faster "
                                  "preset, raise the limit (ulimit -v), or use a machine with more memory.")
    return None


def full_disk(where: object, detail: str) -> OutputError:
    """The sentence for an output that finds no room."""
    return OutputError(f"{where}: cannot be written, the disk is full or a limit on file size or space is reached "
                       f"({detail}); make room or choose an output on another disk.")


def no_room_for(target: Path, written: Path, problem: Exception) -> OutputError | None:
    """Whether ``problem``, met while ``written`` became ``target``, is a full disk; libraries often do not say so.

    To be asked before what was written is removed.
    """
    if isinstance(problem, TreeDGSError):
        return None
    size = written.stat().st_size if written.is_file() else 0
    full = size >= 0.99 * _largest_file() or not _room_in(target.parent)
    detail = f"{type(problem).__name__}: {' '.join(str(problem).split())[:80]}"
    said = isinstance(shortage_of(problem), OutputError)
    return full_disk(target, detail) if full or said else None


def _room_in(folder: Path) -> bool:
    """Whether a file of :data:`_PROBE_BYTES` can be written there."""
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"0" * _PROBE_BYTES)
            probe.flush()
    except OSError as problem:
        return problem.errno not in _DISK
    return True


def _largest_file() -> float:
    """Bytes that this process may write into one file (``ulimit -f``)."""
    try:
        import resource
    except ImportError:  # Windows
        return float("inf")
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return float("inf") if limit == resource.RLIM_INFINITY else float(limit)
