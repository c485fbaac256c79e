"""Compiling ahead: what the main jobs run compiled, with the types they pass, so that no first run waits for it.

numba compiles a function when it is first called and keeps the machine code in a folder (``__pycache__`` beside the
source, the user's own cache where that cannot be written, ``NUMBA_CACHE_DIR`` where it is set), for this processor.
``kernels.json`` lists functions and types as real runs leave them there (``tools/write_kernels.py``); compiling the
list in processes of their own fills the same folder. What is there already is loaded, in seconds.

Run as a module it is one of these processes: names of modules on stdin, one JSON line for each on stdout.
"""

from __future__ import annotations

import importlib
import json
import queue
import signal
import subprocess
import sys
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from graphlib import TopologicalSorter
from importlib.resources import files
from typing import Any

from .children import python_command
from .files import read_json
from .machine import available_threads, free_memory
from .progress import Reporter

#: More processes than this wait for each other's modules. Each takes up to so many bytes.
MAX_PROCESSES, PROCESS_BYTES = 4, 1.0e9


@dataclass
class Compiled:
    """compiled, kept: functions (each with one list of types) compiled now, and found in the cache. failed: module and
    function with the reason, for those that cannot be compiled as listed; they are when they are called."""

    compiled: int
    kept: int
    failed: list[str]


def listed() -> dict[str, dict[str, Any]]:
    """Module -> ``weight`` (kilobytes of machine code), ``after`` (modules whose functions it calls), ``kernels``
    (function -> lists of types, each type as :func:`described`)."""
    return read_json(files(__package__).joinpath("kernels.json"))["modules"]  # type: ignore[arg-type]


def compile_ahead(reporter: Reporter | None = None, processes: int | None = None) -> Compiled:
    """Compile the list, several modules at once. processes: default one a core, as memory allows,
    :data:`MAX_PROCESSES` at most.

    A module waits for those whose functions it calls, so that nothing is compiled twice and no two processes write
    the same cache file.
    """
    reporter, modules, found = reporter or Reporter(), listed(), Compiled(0, 0, [])
    usual = min(available_threads(), MAX_PROCESSES, int(free_memory() / PROCESS_BYTES))
    count = processes or max(usual, 1)
    order = TopologicalSorter({name: entry["after"] for name, entry in modules.items()})
    order.prepare()
    started: list[subprocess.Popen[str]] = []
    idle: queue.SimpleQueue[subprocess.Popen[str]] = queue.SimpleQueue()

    def compiled(module: str) -> dict[str, Any]:
        try:
            child = idle.get_nowait()
        except queue.Empty:
            child = subprocess.Popen(
                python_command(__name__), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
            )
            started.append(child)
        try:
            child.stdin.write(module + "\n")  # type: ignore[union-attr]
            child.stdin.flush()  # type: ignore[union-attr]
            answer = json.loads(child.stdout.readline())  # type: ignore[union-attr]
        except (OSError, ValueError):
            reason = f"{module}: its process ended early, most likely for want of memory"
            return {"compiled": 0, "kept": 0, "failed": [reason]}
        idle.put(child)
        return answer

    workers = ThreadPoolExecutor(count)
    running: dict[Future[dict[str, Any]], str] = {}
    whole, done = sum(entry["weight"] for entry in modules.values()), 0.0
    try:
        while order.is_active():
            heaviest_first = sorted(order.get_ready(), key=lambda name: -modules[name]["weight"])
            running |= {workers.submit(compiled, name): name for name in heaviest_first}
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                name, answer = running.pop(future), future.result()
                found.compiled, found.kept = found.compiled + answer["compiled"], found.kept + answer["kept"]
                found.failed += answer["failed"]
                done += modules[name]["weight"]
                reporter.progress(done / whole, name)
                order.done(name)
    finally:
        workers.shutdown(wait=False, cancel_futures=True)
        for child in started:
            child.kill()
            child.wait()
    return found


def described(kind: Any) -> Any:
    """A numba type for JSON: its name, or ``[array, dtype, ndim, layout]`` (and ``readonly``), ``[tuple, ...]``,
    ``[omitted, value]``, ``[literal, value]``, ``[module:NamedTuple, ...]``.

    Raises:
        ValueError: a type of another sort.
    """
    types: Any = importlib.import_module("numba.core.types")

    if isinstance(kind, types.Array) and kind.aligned:
        return ["array", kind.dtype.name, kind.ndim, kind.layout, *([] if kind.mutable else ["readonly"])]
    if isinstance(kind, types.BaseTuple):
        owner = getattr(kind, "instance_class", tuple)
        name = "tuple" if owner is tuple else f"{owner.__module__}:{owner.__qualname__}"
        return [name, *map(described, kind.types)]
    if isinstance(kind, types.Omitted):
        return ["omitted", kind.value]
    if isinstance(kind, types.Literal):
        return ["literal", kind.literal_value]
    if kind == types.boolean or getattr(types, kind.name, None) == kind:
        return kind.name
    raise ValueError(f"no description of the type {kind}")


def type_of(found: Any) -> Any:
    """The numba type of what :func:`described` wrote."""
    types: Any = importlib.import_module("numba.core.types")

    if isinstance(found, str):
        return types.boolean if found == "bool" else getattr(types, found)
    head, *parts = found
    if head == "array":
        return types.Array(type_of(parts[0]), parts[1], parts[2], readonly=len(parts) > 3)
    if head == "omitted":
        return types.Omitted(parts[0])
    if head == "literal":
        return types.literal(parts[0])
    owner = None
    if head != "tuple":
        module, _, name = head.partition(":")
        owner = getattr(importlib.import_module(module), name)
    return types.BaseTuple.from_types(tuple(map(type_of, parts)), owner)


def compile_module(name: str) -> dict[str, Any]:
    """Compile one module's listed functions, or load them from the cache; returns the counts for a JSON line."""
    compiled, kept, failed = 0, 0, []
    for function, signatures in listed()[name]["kernels"].items():
        try:
            kernel = getattr(importlib.import_module(name), function)
            for signature in signatures:
                kernel.compile(tuple(map(type_of, signature)))
            compiled += sum(kernel.stats.cache_misses.values())
            kept += sum(kernel.stats.cache_hits.values())
        except Exception as problem:  # whatever it is, a job meets it again and says it
            failed.append(f"{name}.{function}: {type(problem).__name__}: {problem}".splitlines()[0])
    return {"compiled": compiled, "kept": kept, "failed": failed}


def _work() -> None:
    # Ctrl-C reaches the whole group: whoever started this one reports it.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    answers = sys.stdout
    sys.stdout = sys.stderr
    for line in sys.stdin:
        print(json.dumps(compile_module(line.strip())), file=answers, flush=True)


if __name__ == "__main__":
    _work()
