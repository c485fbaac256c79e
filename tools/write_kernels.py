"""``treedgs_geo/core/kernels.json``: what real jobs run compiled, with the types they passed, for compiling ahead.

    export NUMBA_CACHE_DIR=FOLDER
    .venv/bin/treedgs photos-to-dbh …; .venv/bin/treedgs pointcloud-to-dbh …
    .venv/bin/python tools/write_kernels.py FOLDER

FOLDER was empty before the jobs; the list is what numba has left in it. Jobs that take every way: a plot whose cameras
are guided and one that climbs, heights and sheets, a cloud. Weights are kilobytes of machine code: what compiling takes
is about in proportion, and the progress bar needs no more.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import json
import os
import pkgutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "treedgs_geo" / "core" / "kernels.json"
#: Modules that need libraries of an extra.
OUTSIDE = ("on_torch",)


def modules() -> list[Any]:
    """Every module of the library that can be imported without its extras."""
    import treedgs_geo

    names = [found.name for found in pkgutil.walk_packages(treedgs_geo.__path__, "treedgs_geo.")]
    return [
        importlib.import_module(name)
        for name in names
        if not name.endswith("__main__") and not any(part in name for part in OUTSIDE)
    ]


def calls(kernel: Any) -> list[str]:
    """The modules of the other kernels that one calls."""
    from numba.core.dispatcher import Dispatcher

    seen = {**kernel.py_func.__globals__, **inspect.getclosurevars(kernel.py_func).nonlocals}
    called = (seen.get(name) for name in (*kernel.py_func.__code__.co_names, *kernel.py_func.__code__.co_freevars))
    return [other.py_func.__module__ for other in called if isinstance(other, Dispatcher)]


def kept(kernel: Any) -> tuple[list[Any], float]:
    """Its types in the cache and kilobytes of their code."""
    from treedgs_geo.core.precompile import described

    files, code = kernel._cache._cache_file, kernel.targetctx.codegen()
    # Functions that one factory makes share a file; the rest of the key tells them apart.
    own = {key: name for key, name in files._load_index().items() if kernel._cache._index_key(key[0], code) == key}
    size = sum(os.path.getsize(files._data_path(name)) for name in own.values())
    return [[described(kind) for kind in key[0]] for key in own], size / 1000


def entry_of(module: Any, before: dict[str, Any]) -> dict[str, Any]:
    """What the list says of a module: the types in the cache after those listed ``before``. Its weight is that of the
    cache where that holds all of its functions, and never less than before elsewhere: a job that did not come here says
    nothing of how long compiling takes."""
    from numba.core.dispatcher import Dispatcher

    kernels: dict[str, Any] = {}
    after, weight, whole = set(), 0.0, True
    for name, kernel in vars(module).items():
        if not isinstance(kernel, Dispatcher) or kernel.py_func.__module__ != module.__name__:
            continue
        signatures, size = kept(kernel) if kernel.stats.cache_path else ([], 0.0)
        listed = before.get("kernels", {}).get(name, [])
        if not signatures and not listed:
            continue
        kernels[name] = sorted([*listed, *(each for each in signatures if each not in listed)], key=json.dumps)
        after |= {other for other in calls(kernel) if other != module.__name__}
        weight, whole = weight + size, whole and all(each in signatures for each in kernels[name])
    least = 1 if whole else max(before.get("weight", 1), 1)
    return {"weight": max(round(weight), least), "after": sorted(after), "kernels": kernels}


def in_lines(found: dict[str, Any]) -> str:
    """JSON with a line for each function, so that a change shows."""
    lines = []
    for name, entry in found["modules"].items():
        kernels = ",\n".join(f"   {json.dumps(key)}: {json.dumps(value)}" for key, value in entry["kernels"].items())
        head = f'"weight": {entry["weight"]}, "after": {json.dumps(entry["after"])}'
        lines.append(f'  {json.dumps(name)}: {{{head}, "kernels": {{\n{kernels}}}}}')
    joined = ",\n".join(lines)
    return f'{{\n "written_by": "{found["written_by"]}",\n "modules": {{\n{joined}\n }}\n}}\n'


def main() -> int:
    """Read the cache, write the list."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=Path, help="the folder that was NUMBA_CACHE_DIR of the jobs")
    parser.add_argument("--add", action="store_true", help="keep what the list has already")
    options = parser.parse_args()
    os.environ["NUMBA_CACHE_DIR"] = str(options.cache.resolve())
    sys.path.insert(0, str(ROOT))
    before = json.loads(TARGET.read_text(encoding="utf-8"))["modules"] if options.add else {}
    found = {module.__name__: entry_of(module, before.get(module.__name__, {})) for module in modules()}
    found = {name: entry for name, entry in found.items() if entry["kernels"]}
    for entry in found.values():
        entry["after"] = [name for name in entry["after"] if name in found]
    TARGET.write_text(in_lines({"written_by": "tools/write_kernels.py", "modules": found}), encoding="utf-8")
    functions = [signatures for entry in found.values() for signatures in entry["kernels"].values()]
    print(f"{len(found)} modules, {len(functions)} functions, {sum(map(len, functions))} with their types")
    return 0


if __name__ == "__main__":
    sys.exit(main())
