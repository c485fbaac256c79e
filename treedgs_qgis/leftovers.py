"""What the engine takes on disk, and getting rid of it: environments of former versions, or all of it.

Jobs (their logs) and results are never touched. Standard library only.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

from . import engine_users
from .engine import PLUGIN_ROOT, data_dir, managed_environment, python_in
from .pythons import no_window

#: pip's own copies while it installs: kept when it is cut short, so that the next try does not begin anew.
PIP_CACHE = "pip-cache"
_ENVIRONMENT = re.compile(r"engine-[0-9a-f]{10}(-going)?")
_LIST = re.compile(r"(engine-[0-9a-f]{10})-\w+\.txt")


def size_bytes(path: Path) -> int:
    """Bytes of a file or of all files below a folder; links count nothing."""
    if path.is_file() or path.is_symlink():
        return 0 if path.is_symlink() else path.stat().st_size
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            try:
                total += os.lstat(os.path.join(folder, name)).st_size
            except OSError:
                continue
    return total


def environments() -> list[Path]:
    """The engine environments in the data folder, whatever version of the plugin made them."""
    base = data_dir()
    if not base.is_dir():
        return []
    return sorted(path for path in base.iterdir() if _ENVIRONMENT.fullmatch(path.name) and path.is_dir())


def in_use(environment: Path) -> bool:
    """Whether a program of it runs now (Windows refuses to move the folder then: see :func:`remove_folder`)."""
    python = str(python_in(environment))
    lines: list[str] = []
    if os.path.isdir("/proc/self"):
        for entry in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                lines.append(entry.read_bytes().split(b"\0")[0].decode("utf-8", "replace"))
            except OSError:
                continue
    elif os.name == "posix":
        done = subprocess.run(["/bin/ps", "-A", "-o", "args="], capture_output=True, text=True, **no_window())
        lines = done.stdout.splitlines()
    return any(line.startswith(python) for line in lines)


def remove_folder(folder: Path) -> int:
    """Delete one; returns the bytes that became free: 0 where a program uses it.

    It is moved aside first: nobody finds half an environment, and Windows refuses while a file of it is open.
    """
    freed = size_bytes(folder)
    if in_use(folder):
        return 0
    going = folder if folder.name.endswith("-going") else folder.with_name(f"{folder.name}-going")
    try:
        if going != folder:
            shutil.rmtree(going, ignore_errors=True)
            folder.rename(going)
    except OSError:
        return 0
    shutil.rmtree(going, ignore_errors=True)
    return freed - size_bytes(going) if going.exists() else freed


def remove_former() -> tuple[int, list[Path]]:
    """Environments of other lists than today's, and pip's copies: the bytes freed, and what is still in use.

    Those that the plugin in another profile or version of QGIS uses stay.
    """
    return _remove_engines({managed_environment().name, *used_elsewhere()})


def remove_all() -> tuple[int, list[Path]]:
    """As :func:`remove_former`, today's environment and the Python that was fetched for them too."""
    engine_users.leaves(data_dir(), PLUGIN_ROOT)
    freed, kept = _remove_engines(set(used_elsewhere()))
    # The environments stand on the fetched Python: while one is there it stays too.
    return freed + (0 if environments() else _remove_file_tree(data_dir() / "python")), kept


def used_elsewhere() -> dict[str, str]:
    """Names of environments that other plugin folders use, and such a folder each."""
    there = {path.name for path in environments()}
    return {name: plugin for name, plugin in engine_users.of_others(data_dir(), PLUGIN_ROOT).items() if name in there}


def _remove_engines(needed: set[str]) -> tuple[int, list[Path]]:
    """All environments and lists but the needed, and pip's copies: the bytes freed, and what is still in use."""
    base = data_dir()
    freed, kept = _remove_file_tree(base / PIP_CACHE), []
    for folder in environments():
        if folder.name not in needed:
            freed += remove_folder(folder)
            kept += [folder] if folder.exists() else []
    for path in base.iterdir() if base.is_dir() else ():
        if (named := _LIST.fullmatch(path.name)) and named[1] not in needed:
            freed += _remove_file_tree(path)
    return freed, kept


def _remove_file_tree(path: Path) -> int:
    if not path.exists():
        return 0
    freed = size_bytes(path)
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
    return freed - (size_bytes(path) if path.exists() else 0)
