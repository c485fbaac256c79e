"""What the machine gives this process."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import itertools
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

from .errors import MemoryShortage

_T = TypeVar("_T")
_R = TypeVar("_R")

#: How Numba compiles. Divisions as NumPy's: a test before each, which Python's need, keeps loops from being vectorised.
EXACT = {"nogil": True, "cache": True, "error_model": "numpy"}
#: And sums in any order, where nothing is infinite.
FAST = EXACT | {"fastmath": True}
#: Where a container's limit and use of memory stand (control groups, version 2).
_CGROUP = Path("/sys/fs/cgroup")


def cores() -> int:
    """Processor cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def available_threads() -> int:
    """Threads to use: :func:`cores`; ``TREEDGS_THREADS`` sets it where several plots share a machine."""
    asked = os.environ.get("TREEDGS_THREADS", "")
    return int(asked) if asked.isdigit() and int(asked) else cores()


def in_threads(work: Callable[[_T], _R], items: Sequence[_T]) -> Iterator[_R]:
    """``work`` of each item, in their order, at once on the threads to use. What has not begun is dropped where the
    caller does not take the rest."""
    workers = ThreadPoolExecutor(max(min(available_threads(), len(items)), 1))
    try:
        yield from workers.map(work, items)
    finally:
        workers.shutdown(cancel_futures=True)
        release_memory()


def release_memory() -> None:
    """Give back to the system what was let go of: glibc keeps it, that of each thread apart."""
    if sys.platform == "linux":
        with contextlib.suppress(AttributeError):
            ctypes.CDLL(None).malloc_trim(0)


def ahead(items: Iterator[_T]) -> Generator[_T]:
    """The same items, each made in a thread while the caller works on the one before."""
    with ThreadPoolExecutor(1) as maker:
        coming = maker.submit(list, itertools.islice(items, 1))
        while item := coming.result():
            coming = maker.submit(list, itertools.islice(items, 1))
            yield item.pop()


def ensure_code_cache() -> None:
    """Before numba is imported: where it may keep compiled code neither beside the source nor in the user's own cache,
    it refuses to start; this run and its children then have a temporary folder for it."""
    source = Path(__file__).resolve().parents[1]
    if os.environ.get("NUMBA_CACHE_DIR") or _writable(source / "__pycache__") or _writable(_user_cache() / "numba"):
        return
    folder = tempfile.mkdtemp(prefix="treedgs-code-")
    os.environ["NUMBA_CACHE_DIR"] = folder
    atexit.register(shutil.rmtree, folder, ignore_errors=True)


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path(os.path.expanduser("~/Library/Caches"))
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))


def _writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made: numba asks the same way."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def free_memory() -> float:
    """Bytes that this process can still get: of the machine, its container and its own limits (``ulimit -v``)."""
    import psutil

    free = [float(psutil.virtual_memory().available)]
    if sys.platform != "win32":
        import resource

        own = psutil.Process().memory_info()
        for limit, used in ((resource.RLIMIT_AS, own.vms), (resource.RLIMIT_DATA, getattr(own, "data", own.rss))):
            soft = resource.getrlimit(limit)[0]
            if soft != resource.RLIM_INFINITY:
                free.append(float(soft - used))
    try:
        allowed, taken = ((_CGROUP / f"memory.{name}").read_text().strip() for name in ("max", "current"))
        cache = sum(
            int(line.split()[1])
            for line in (_CGROUP / "memory.stat").read_text().splitlines()
            if line.startswith(("inactive_file ", "active_file "))
        )
        if allowed != "max":
            free.append(float(int(allowed) - int(taken) + cache))
    except (OSError, ValueError):
        pass
    return max(min(free), 0.0)


def require_memory(needed_bytes: float, what: str, advice: str) -> None:
    """End before memory does: compiled libraries abort the whole process when they get none.

    Raises:
        MemoryShortage: more is needed than :func:`free_memory`.
    """
    if needed_bytes > 5e7 and needed_bytes > (free := free_memory()):
        raise MemoryShortage(
            f"{what} needs about {needed_bytes / 1e9:.1f} GB of memory, {free / 1e9:.1f} GB are free; {advice}."
        )
