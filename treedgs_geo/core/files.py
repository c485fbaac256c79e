"""Files that appear whole or not at all, and checks before hours of work start."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from .errors import InputError, OutputError
from .shortage import full_disk, no_room_for


@contextmanager
def atomic_path(target: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``target`` with the same suffix; renamed onto it only if the block succeeds.

    Raises:
        OutputError: the folder cannot be made or written, or the disk is full.
    """
    target = Path(target)
    ensure_writable(target)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem[:40]}.", suffix=target.suffix)
    os.close(handle)
    temporary = Path(name)
    temporary.unlink()
    try:
        yield temporary
        if not temporary.exists():
            raise OutputError(f"{target}: nothing was written; this is a defect, please report it.")
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, target)
    except Exception as problem:
        if (full := no_room_for(target, temporary, problem)) is not None:
            raise full from problem
        raise
    finally:
        for leftover in target.parent.glob(temporary.name + "*"):
            leftover.unlink(missing_ok=True)


@contextmanager
def atomic_geopackage(target: Path) -> Iterator[Path]:
    """Yield a temporary GeoPackage that becomes ``target`` only if the block succeeds.

    An existing database is filled in one transaction instead of being replaced: while QGIS shows it, its write-ahead
    log lies beside it, and SQLite would replay that log into a new file of the same name.

    Raises:
        OutputError: the folder cannot be written, or the file is locked by an edit session.
    """
    target = Path(target)
    if not _is_database(target):
        with atomic_path(target) as temporary:
            yield temporary
        return
    ensure_writable(target)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.stem[:40]}.") as folder:
        temporary = Path(folder) / target.name
        yield temporary
        ensure_unlocked(target)
        try:
            with closing(sqlite3.connect(temporary)) as source, closing(sqlite3.connect(target, timeout=10)) as there:
                source.backup(there)
        except sqlite3.Error as problem:
            raise OutputError(_locked(target, problem)) from None


def ensure_unlocked(target: Path) -> None:
    """Prove that an existing GeoPackage may be written, before hours of work.

    Raises:
        OutputError: QGIS or another program is editing it.
    """
    if not _is_database(target):
        return
    try:
        with closing(sqlite3.connect(target, timeout=10)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.rollback()
    except sqlite3.Error as problem:
        raise OutputError(_locked(target, problem)) from None


def _is_database(path: Path) -> bool:
    try:
        with open(path, "rb") as stream:
            return stream.read(16) == b"SQLite format 3\0"
    except OSError:
        return False


def _locked(path: Path, problem: Exception) -> str:
    return f"{path}: cannot be written ({problem}); save or drop the edits in QGIS and run again."


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder that replaces ``target`` only if the block succeeds."""
    target = Path(target)
    ensure_writable(target / "x")
    temporary = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}."))
    try:
        yield temporary
        os.chmod(temporary, 0o777 & ~_umask())
        if target.exists():
            shutil.rmtree(target)
        os.replace(temporary, target)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def ensure_writable(target: Path) -> None:
    """Make ``target``'s folder and prove that a file can be made there.

    Raises:
        OutputError: naming the folder and what the system said.
    """
    target = Path(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=target.parent):
            pass
        if target.is_dir() and target.suffix:
            raise OutputError(f"{target}: is a folder, expected a file name; choose another output.")
    except OSError as problem:
        raise OutputError(
            f"{target}: the folder cannot be written ({problem.strerror or problem}); choose another output folder."
        ) from None


@contextmanager
def no_empty_folders(targets: Iterable[Path]) -> Iterator[None]:
    """When the block fails, remove the folders that it made for ``targets`` (files or folders) and left empty."""
    places = [Path(os.path.abspath(target)) for target in targets]
    absent = {folder for place in places for folder in (place, *place.parents) if not folder.exists()}
    try:
        yield
    except BaseException:
        for folder in sorted(absent, key=lambda folder: len(folder.parts), reverse=True):
            with suppress(OSError):  # never made, a file, or not empty
                folder.rmdir()
        raise


def reserve(path: Path, size: int) -> None:
    """Make a file of ``size`` bytes whose room on the disk is really there: writing into a mapped file that finds none
    ends the process.

    Raises:
        OutputError: no room.
    """
    try:
        with open(path, "wb") as stream:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(stream.fileno(), 0, max(size, 1))
            else:
                stream.truncate(max(size, 1))
    except OSError as problem:
        raise full_disk(path.parent, f"{size / 1e9:.1f} GB, {problem.strerror}") from None


def write_json(target: Path, value: Any) -> None:
    """Write JSON atomically."""
    with atomic_path(target) as temporary:
        temporary.write_text(json.dumps(value, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read_json(source: Path) -> Any:
    """Read JSON.

    Raises:
        InputError: missing or broken file.
    """
    try:
        return json.loads(Path(source).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{source}: not found; run the step that writes it first.") from None
    except (OSError, ValueError) as problem:
        raise InputError(f"{source}: is not readable JSON ({problem}); restore or delete it.") from None


def fingerprint(paths: list[Path]) -> str:
    """Short hash over names, sizes and content ends (first and last 64 KiB): changes when an input changes."""
    digest = hashlib.sha256()
    for path in sorted(Path(p) for p in paths):
        size = path.stat().st_size
        digest.update(f"{path.name}:{size}:".encode())
        with open(path, "rb") as stream:
            digest.update(stream.read(65536))
            if size > 131072:
                stream.seek(-65536, os.SEEK_END)
                digest.update(stream.read())
    return digest.hexdigest()[:16]


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
