"""Who works on a folder now: a lease that works on a shared folder and survives the death of its holder.

Files ``lease.N`` beside the work. The one with the highest number counts; taking over means to create ``N+1``
exclusively, which only one can. The holder renews the file's time; one that was not renewed for :data:`STALE_S` is
dead, and so is one of this host whose process is gone. Times are compared on the folder's own clock. A holder that was
asleep finds a higher number and must stop. A process may work on a folder whose lease another one holds for it, when
that one has handed it the lease's key (:data:`HANDED`).
"""

from __future__ import annotations

import json
import os
import re
import socket
import sys
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

#: Seconds between two renewals, and without any until a lease of another host counts as dead.
RENEW_S, STALE_S = 5.0, 60.0
#: Environment variable with the key of a lease that the parent process holds for its child.
HANDED = "TREEDGS_LEASE"
_NAME = re.compile(r"lease\.(\d{6})(\.free)?")


class Busy(Exception):
    """Somebody alive holds the lease; ``holder`` says who."""

    def __init__(self, holder: dict[str, Any]) -> None:
        who = f"{holder.get('host', '?')}, process {holder.get('pid', '?')}"
        super().__init__(f"{who}, since {holder.get('since', '?')}")
        self.holder = holder


class Lost(Exception):
    """Somebody else has taken the lease over."""


class Lease:
    """A lease held by this process, or (not ``own``) by the parent for it."""

    def __init__(self, folder: Path, number: int, key: str, own: bool = True) -> None:
        self.folder, self.number, self.key, self.own = Path(folder), number, key, own
        self._file = self.folder / f"lease.{number:06d}"
        self._renewed = time.monotonic()

    @classmethod
    def take(cls, folder: Path, stale_s: float = STALE_S) -> Lease:
        """Take the folder's lease. stale_s: silence after which another host may count this holder as dead.

        Raises:
            Busy: somebody alive holds it. OSError: the folder cannot be written.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        number, free = _highest(folder)
        if number and not free:
            holder = _holder(folder / f"lease.{number:06d}")
            if _handed(holder):
                return cls(folder, number, holder["key"], own=False)
            if _alive(folder, number, holder):
                raise Busy(holder)
        lease = cls(folder, number + 1, uuid.uuid4().hex)
        text = json.dumps(
            {
                "host": host(),
                "pid": os.getpid(),
                "started": started(os.getpid()),
                "space": pid_space(),
                "since": time.strftime("%Y-%m-%d %H:%M:%S"),
                "stale_s": stale_s,
                "key": lease.key,
            }
        )
        # Written aside and linked into place: whoever sees the lease sees its holder.
        aside = folder / f".lease.{uuid.uuid4().hex[:12]}"
        try:
            aside.write_text(text, encoding="utf-8")
            try:
                os.link(aside, lease._file)
            except FileExistsError:
                raise
            except OSError:  # a file system without links: exclusive creation is nearly as good
                with open(lease._file, "x", encoding="utf-8") as stream:
                    stream.write(text)
        except FileExistsError:
            raise Busy(_holder(lease._file)) from None
        finally:
            aside.unlink(missing_ok=True)
        for old in folder.glob("lease.*"):
            match = _NAME.fullmatch(old.name)
            if match and int(match.group(1)) < lease.number:
                old.unlink(missing_ok=True)
        try:
            lease.check()
        except Lost:  # somebody came and went while we looked
            lease.free()
            raise Busy(_holder(lease._file)) from None
        return lease

    def renew(self) -> None:
        """Say that the holder lives; cheap when called often.

        Raises:
            Lost: somebody has taken over.
        """
        if time.monotonic() - self._renewed < RENEW_S or not self.own:
            return
        self.check()
        try:
            os.utime(self._file)
        except OSError:
            self.check()
        self._renewed = time.monotonic()

    def check(self) -> None:
        """Whether the lease is still ours.

        Raises:
            Lost: somebody has taken over, or the folder is gone.
        """
        if _highest(self.folder) != (self.number, False):
            raise Lost(f"{self.folder}: another process has taken this folder over.")

    def free(self) -> None:
        """Give it back. Never raises: a lease that cannot be freed goes stale."""
        if not self.own:
            return
        with suppress(OSError):
            # A rename needs no room on a full disk.
            os.rename(self._file, self._file.with_name(self._file.name + ".free"))

    @contextmanager
    def renewed(self) -> Iterator[Lease]:
        """Renew it in the background until the block ends, then give it back."""
        ended = threading.Event()

        def renew() -> None:
            while not ended.wait(RENEW_S):
                with suppress(Lost):  # the block finds out when it checks
                    self.renew()

        thread = threading.Thread(target=renew, daemon=True, name="lease")
        thread.start()
        try:
            yield self
        finally:
            ended.set()
            thread.join()
            self.free()
            with suppress(OSError):
                names = os.listdir(self.folder)
                if all(name.endswith(".free") and _NAME.fullmatch(name) for name in names):
                    # Nothing was made here: leave nothing behind.
                    for name in names:
                        os.unlink(self.folder / name)


@contextmanager
def one_writer(folder: Path) -> Iterator[None]:
    """Wait until no other process of ours reads and rewrites files of this folder, for the length of the block. Where
    the system or the file system knows no such locks, go on at once."""
    if sys.platform == "win32":  # a file that is read there cannot be replaced
        yield
        return
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def holder_of(folder: Path) -> dict[str, Any] | None:
    """Who else holds the folder's lease now, or None: not the parent that holds it for this process."""
    number, free = _highest(Path(folder))
    if not number or free:
        return None
    holder = _holder(Path(folder) / f"lease.{number:06d}")
    return holder if not _handed(holder) and _alive(Path(folder), number, holder) else None


def _handed(holder: dict[str, Any]) -> bool:
    return bool(holder.get("key")) and holder["key"] == os.environ.get(HANDED)


def host() -> str:
    """This host's name; network namespaces of one machine can be distinguished with ``TREEDGS_HOST``."""
    return os.environ.get("TREEDGS_HOST") or socket.gethostname()


def _highest(folder: Path) -> tuple[int, bool]:
    """``(number, free)`` of the lease that counts; ``(0, True)`` if there is none."""
    try:
        found = filter(None, map(_NAME.fullmatch, os.listdir(folder)))
    except (FileNotFoundError, NotADirectoryError):
        return 0, True
    return max(((int(match[1]), bool(match[2])) for match in found), default=(0, True))


def _holder(file: Path) -> dict[str, Any]:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError):
        return {}


def _alive(folder: Path, number: int, holder: dict[str, Any]) -> bool:
    same = holder.get("host") == host() and holder.get("space", "") == pid_space()
    if same and isinstance(holder.get("pid"), int):
        # The start time guards against another process with the same number.
        return started(holder["pid"]) == holder.get("started")
    try:
        renewed = (folder / f"lease.{number:06d}").stat().st_mtime
        probe = folder / f".clock.{uuid.uuid4().hex[:12]}"
        probe.touch()
        try:
            return probe.stat().st_mtime - renewed < float(holder.get("stale_s") or STALE_S)
        finally:
            probe.unlink(missing_ok=True)
    except (OSError, TypeError, ValueError):
        return True


def pid_space() -> str:
    """Which numbering of processes this is: a sandbox (Flatpak, a container) has its own under the same host name."""
    try:
        return os.readlink("/proc/self/ns/pid")
    except OSError:
        return ""


def started(pid: int) -> str | None:
    """When a process started, in words that a changed clock does not change; None when it is gone."""
    import psutil

    try:
        process = psutil.Process(pid)
        if process.status() == psutil.STATUS_ZOMBIE:
            return None
        if sys.platform == "linux":
            # Field 22: ticks since the machine started. The name in brackets may hold blanks.
            line = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
            return f"{_boot()}:{line.rpartition(')')[2].split()[19]}"
        return f"{process.create_time():.1f}"
    except (psutil.Error, OSError, IndexError):
        return None


def _boot() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""
