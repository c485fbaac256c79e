"""Child processes: programs of the system, and Python that imports what this process imports; nothing of either is
taken from the folder they are started in.

``python -m`` and ``python -c`` look for modules in the current folder first: a ``json.py`` that came with the data
would be executed. Python 3.11 has an option against it, 3.10 only isolated mode (``-I``), which also takes away
``PYTHONPATH``: so children are isolated and get this process's own import path.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from typing import Any

#: The folder that holds the library.
ROOT = str(Path(__file__).resolve().parents[2])
_RUN = (
    "import sys; sys.path[:] = {path!r}; import runpy; "
    "runpy.run_module(sys.argv.pop(1), run_name='__main__', alter_sys=True)"
)


def python_command(module: str, *arguments: Any) -> list[str]:
    """The command line that runs ``module`` of this library as ``python -m`` would, whatever lies in its folder."""
    words = [sys.executable, "-I", "-u", "-X", f"utf8={sys.flags.utf8_mode}"]
    if sys.dont_write_bytecode:
        words.append("-B")
    return [*words, "-c", _RUN.format(path=import_path()), module, *map(str, arguments)]


def import_path() -> list[str]:
    """This process's import path with the library on it, without entries that mean the current folder."""
    kept = [entry for entry in sys.path if Path(entry).is_absolute()]
    return kept if ROOT in kept else [ROOT, *kept]


def find_program(name: str) -> str | None:
    """Absolute path of a program on the PATH; never one of the current folder, which an empty entry of the PATH means
    and where Windows looks first."""
    places = [place for place in os.environ.get("PATH", "").split(os.pathsep) if os.path.isabs(place)]
    found = shutil.which(name, path=os.pathsep.join(places))
    return found if found and os.path.isabs(found) else None


def was_killed(code: int | None) -> bool:
    """Whether an exit code says that the system ended a process, most likely for memory. Windows has no such code, and
    no such signal."""
    return code in (-9, 137)
