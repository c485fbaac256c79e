"""Memory and disk that ran out, however a library says so, as one of our own errors."""

from __future__ import annotations

import errno

from .errors import MemoryShortage, OutputError, TreeDGSError

_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
#: What libraries write into exceptions of their own (C++ allocators, GDAL, SQLite, LAZ).
_DISK_WORDS = ("no space left", "disk is full", "disk full", "file too large", "disk quota exceeded")
_MEMORY_WORDS = ("bad_alloc", "bad allocation", "length_error", "cannot allocate memory", "unable to allocate",
                 "out of memory", "failed to allocate", "can't start new thread")


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
        if isinstance(link, OSError) and number in _DISK or any(word in text.lower() for word in _DISK_WORDS):
            where = getattr(link, "filename", None)
            return OutputError(f"{where or 'Output'}: cannot be written, the disk is full or a limit on file size or "
                               f"space is reached ({text}); make room or choose an output on another disk.")
        if isinstance(link, MemoryError) or number == errno.ENOMEM or any(
                word in text.lower() for word in _MEMORY_WORDS):
            detail = f" ({text})" if text else ""
            return MemoryShortage(f"Not enough memory{detail}; use a smaller plot or cloud, fewer photos or a faster "
                                  "preset, raise the limit (ulimit -v), or use a machine with more memory.")
    return None
