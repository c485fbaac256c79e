"""Files that appear whole or not at all, and checks before hours of work start."""

from __future__ import annotations

import glob
import hashlib
import itertools
import json
import os
import re
import shutil
import sys
import tempfile
import time
import unicodedata
import uuid
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from .errors import InputError, OutputError
from .folder_lock import host, pid_space, started
from .resource_errors import reporting_full_disk

#: Longest file name in bytes: file systems take 255, and SQLite and shapefiles add to it.
LONGEST_NAME = 240
#: A disk with less than this left counts as full when writing to it has failed.
FULL_BYTES = 4_000_000
#: ``.STEM.~PLACE-PID-RANDOM.SUFFIX``: a file that process PID is writing. PLACE: a host and its numbering of processes.
_TEMPORARY = re.compile(r"\.(.*)\.~([0-9a-f]{8})-(\d+)-[0-9a-f]{12}(\..*|-.*)?")
#: Seconds that a file which is held is waited for, on Windows.
HELD_S = 3.0
#: Letters that a temporary name has more than the name it stands for.
_TEMPORARY_LETTERS = 32
#: Leftovers of another host are removed after this time.
_OLD_S = 7 * 86400.0

#: Inputs of the run, which nothing may be written over.
_INPUTS: set[tuple[int, int] | str] = set()

#: Endings of photo files that are read.
PHOTO_SUFFIXES = {".jpg", ".jpeg", ".tif", ".tiff", ".png"}


@contextmanager
def atomic_path(target: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``target`` with the same suffix; renamed onto it only if the block succeeds.

    Raises:
        OutputError: the folder cannot be made or written, the disk is full, another program holds the file.
    """
    target = Path(target)
    ensure_writable(target)
    with temporary_beside(target) as temporary, reporting_full_disk(target):
        yield temporary
        put_in_place(temporary, target)


def put_in_place(temporary: Path, target: Path) -> None:
    """Give a finished file the usual permissions and its name.

    A program that holds ``target`` (on Windows Excel or QGIS does) costs no result: it is kept beside.

    Raises:
        OutputError: there is no file, or ``target`` cannot be replaced; says where the new result is.
    """
    if not temporary.exists():
        raise OutputError(f"{target}: nothing was written; this is a defect, please report it.")
    os.chmod(temporary, 0o666 & ~_umask())
    try:
        _replace(temporary, target)
    except OSError as problem:
        what = f"{target}: cannot be replaced ({problem.strerror or problem})"
        if not target.exists() or target.is_dir():
            raise OutputError(f"{what}; choose another output.") from None
        try:
            kept = keep_beside(temporary, target)
        except OSError:
            raise OutputError(f"{what}; close the programs that show it and run again.") from None
        raise OutputError(
            f"{what}: a program such as Excel or QGIS holds it open; close it there and run again. This run's result "
            f"is kept as {kept}."
        ) from None


def keep_beside(temporary: Path, target: Path) -> Path:
    """Give a finished file, whose place is taken, a name beside it (``NAME.new.csv``, ``NAME.new2.csv``); returns it.

    Raises:
        OSError: that neither.
    """
    kept = free_name(target, ".new")
    if temporary.is_file():
        os.chmod(temporary, 0o666 & ~_umask())
    os.replace(temporary, kept)
    return kept


def free_name(target: Path, mark: str = "") -> Path:
    """``target`` with a mark, and a number where that is taken: ``NAME.new.csv``, ``NAME.new2.csv``."""
    names = (f"{target.stem}{mark}{number}{target.suffix}" for number in itertools.chain([""], itertools.count(2)))
    return next(path for path in map(target.with_name, names) if not path.exists())


def _replace(temporary: Path, target: Path) -> None:
    """Rename; on Windows a virus scanner or a reader may hold either for a moment."""
    until = time.monotonic() + HELD_S
    while True:
        try:
            return os.replace(temporary, target)
        except PermissionError:
            if sys.platform != "win32" or time.monotonic() > until:
                raise
            time.sleep(0.1)


@contextmanager
def temporary_beside(target: Path) -> Iterator[Path]:
    """Yield a path beside ``target`` where nothing is yet; whatever lies there, or begins so, is removed at the end.

    What killed processes left of the same target is removed first.
    """
    target = Path(target)
    remove_leftovers(target.parent, target.stem)
    name = f".{target.stem[:40]}.~{_place()}-{os.getpid()}-{uuid.uuid4().hex[:12]}"
    try:
        yield target.parent / (name + target.suffix)
    finally:
        for leftover in target.parent.glob(f"{glob.escape(name)}*"):
            _remove(leftover)


def remove_leftovers(folder: Path, stem: str | None = None) -> None:
    """Remove temporary files (of ``stem``) whose process was killed. Never raises."""
    with suppress(OSError):
        for name in os.listdir(folder):
            match = _TEMPORARY.fullmatch(name)
            if match and (stem is None or match[1] == stem[:40]) and _is_orphan(Path(folder, name), match):
                _remove(Path(folder, name))


def _is_orphan(path: Path, match: re.Match[str]) -> bool:
    import psutil

    with suppress(OSError):
        changed = path.stat().st_mtime
        if match[2] != _place():
            return time.time() - changed > _OLD_S
        if started(int(match[3])) is None:
            return True
        with suppress(psutil.Error):
            # A process that began after the last change has only the number in common.
            return psutil.Process(int(match[3])).create_time() > changed + 2
    return False


def _place() -> str:
    return hashlib.sha256(f"{host()} {pid_space()}".encode()).hexdigest()[:8]


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()


def free_bytes(path: Path) -> int:
    """Room on the disk of ``path`` (or of the nearest folder that exists)."""
    for place in (Path(path), *Path(path).absolute().parents):
        with suppress(OSError):
            return shutil.disk_usage(place).free
    return 1 << 40


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder that replaces ``target`` only if the block succeeds.

    Raises:
        OutputError: the folder cannot be made or written, the disk is full, a program holds a file of the former one
            (which then stays as it is; the new one is kept beside).
    """
    target = Path(target)
    ensure_writable(target / "x")
    with temporary_beside(target) as temporary, reporting_full_disk(target):
        temporary.mkdir()
        yield temporary
        former = temporary.with_name(f"{temporary.name}-former")
        try:
            if target.exists():
                _replace(target, former)
            _replace(temporary, target)
        except OSError as problem:
            if former.exists() and not target.exists():
                os.replace(former, target)
            kept = keep_beside(temporary, target)
            raise OutputError(
                f"{target}: cannot be replaced ({problem.strerror or problem}): a program holds a file in it open; "
                f"close it there and run again. This run's result is kept as {kept}."
            ) from None


def ensure_writable(target: Path) -> None:
    """Make ``target``'s folder and prove that a file can be made there.

    Raises:
        OutputError: naming the folder and what the system said, or a name that no file can have.
    """
    target = Path(target)
    check_name(target)
    if _INPUTS and identity(target) in _INPUTS:
        raise OutputError(f"{target}: is an input of this run and would be written over; choose another output.")
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
def protected(inputs: Iterable[Path]) -> Iterator[None]:
    """Nothing is written over these files until the block ends (:func:`ensure_writable`)."""
    added = {identity(path) for path in inputs} - _INPUTS
    _INPUTS.update(added)
    try:
        yield
    finally:
        _INPUTS.difference_update(added)


def identity(path: Path) -> tuple[int, int] | str:
    """Equal for two names of one file: through links of both kinds, dots, and letters in another case on Windows."""
    try:
        found = os.stat(path)
        return found.st_dev, found.st_ino
    except (OSError, ValueError):
        return os.path.normcase(os.path.realpath(path))


def check_name(target: Path) -> None:
    """Refuse names that files can have, but that programs trip over. Touches nothing.

    Raises:
        OutputError: a line break or another control character, bytes that are no text, a name too long.
    """
    text = str(target)
    odd = next((letter for letter in text if unicodedata.category(letter) in ("Cc", "Cs")), None)
    if odd is not None:
        kind = "a line break" if odd in "\r\n" else f"the character {odd!a}"
        raise OutputError(f"{text!a}: holds {kind}, expected a plain path; choose another output.")
    longest = longest_path()
    length = len(os.path.abspath(target)) + _TEMPORARY_LETTERS
    if longest and length > longest:
        raise OutputError(
            f"{target}: the path has {length - _TEMPORARY_LETTERS} characters, expected at most "
            f"{longest - _TEMPORARY_LETTERS} on this Windows; choose a folder nearer to the drive's root, or let an "
            "administrator switch on long paths (LongPathsEnabled)."
        )
    for part in Path(target).parts:
        if len(os.fsencode(part)) > LONGEST_NAME:
            raise OutputError(
                f"{target}: the name {part[:30]}… has {len(os.fsencode(part))} bytes, expected at most {LONGEST_NAME}; "
                "choose a shorter one."
            )


def longest_path() -> int:
    """Characters that a path may have where that is few: 259 on Windows, unless long paths are switched on; else 0."""
    if sys.platform != "win32":
        return 0
    import winreg

    try:
        with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, r"SYSTEM\CurrentControlSet\Control\FileSystem") as key:
            return 0 if winreg.QueryValueEx(key, "LongPathsEnabled")[0] else 259
    except OSError:
        return 259


@contextmanager
def no_empty_folders(targets: Iterable[Path]) -> Iterator[None]:
    """When the block fails, remove the folders that it made for ``targets`` (files or folders) and left empty."""
    places = [Path(os.path.abspath(target)) for target in targets]
    absent = {folder for place in places for folder in (place, *place.parents) if not os.path.exists(folder)}
    try:
        yield
    except BaseException:
        for folder in sorted(absent, key=lambda folder: len(folder.parts), reverse=True):
            with suppress(OSError):  # never made, a file, or not empty
                folder.rmdir()
        raise


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


def short_hash(*parts: Any) -> str:
    """16 letters that the same values, as JSON (others as their texts), give again."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()[:16]


def fingerprint(paths: Iterable[Path]) -> str:
    """Short hash over names and whole contents: changes when an input changes, not when it is copied, moved or touched.

    Raises:
        InputError: a file that cannot be read.
    """
    files = [Path(p) for p in paths]
    parts = sorted(f"{path.name}:{content}:" for path, content in zip(files, content_hashes(files), strict=True))
    return hashlib.sha256("".join(parts).encode("utf-8", "surrogateescape")).hexdigest()[:16]


def content_hashes(paths: Iterable[Path]) -> list[str]:
    """SHA-256 of each file, whole.

    Raises:
        InputError: a file that cannot be read.
    """
    # Hashing and reading both leave Python to the other threads.
    with ThreadPoolExecutor(min(8, os.cpu_count() or 1)) as pool:
        return list(pool.map(content_hash, paths))


def content_hash(path: Path) -> str:
    """SHA-256 of a whole file.

    Raises:
        InputError: it cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with open(path, "rb", buffering=0) as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    except OSError as problem:
        raise InputError(f"{path}: cannot be read ({problem.strerror or problem}); copy it again.") from None
    return digest.hexdigest()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
