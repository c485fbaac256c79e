"""Compiling ahead: the list fits the code, fills the cache that later runs read, and ends whatever happens."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from treedgs_geo.core import machine, precompile
from treedgs_geo.core.children import python_command
from treedgs_geo.core.progress import Reporter

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("treedgs_geo.pointcloud.cloud", "treedgs_geo.terrain.dtm")


class Bar(Reporter):
    """Keeps the fractions."""

    def __init__(self) -> None:
        super().__init__()
        self.fractions: list[float] = []

    def _emit(self, kind, body) -> None:
        if kind == "progress":
            self.fractions.append(body["fraction"])


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """An empty cache of the children's own."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "code"))
    return tmp_path / "code"


def few(monkeypatch, **more) -> None:
    """The parent knows of a few small modules only; what they hold is read by the children themselves."""
    whole = precompile.listed()
    chosen = {name: whole[name] for name in SMALL} | more
    monkeypatch.setattr(precompile, "listed", lambda: chosen)


def write_kernels():
    """The tool that writes the list."""
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        return importlib.import_module("write_kernels")
    finally:
        sys.path.remove(str(ROOT / "tools"))


def test_the_list_fits_the_code():
    """Each entry names a compiled function of today, types that can be read, and every module that it calls."""
    from numba.core.dispatcher import Dispatcher

    calls, modules = write_kernels().calls, precompile.listed()
    assert len(modules) > 20
    for name, entry in modules.items():
        module = importlib.import_module(name)
        for function, signatures in entry["kernels"].items():
            kernel = getattr(module, function, None)
            assert isinstance(kernel, Dispatcher), f"{name}.{function}: run tools/write_kernels.py"
            assert signatures
            for signature in signatures:
                kinds = tuple(map(precompile.type_of, signature))
                assert [precompile.described(kind) for kind in kinds] == signature
                assert len(kinds) == kernel.py_func.__code__.co_argcount, f"{name}.{function}: run write_kernels.py"
            others = {other for other in calls(kernel) if other != name and other in modules}
            assert others <= set(entry["after"])
        assert set(entry["after"]) < set(modules)


def test_adding_to_the_list_leaves_the_weight_of_what_no_job_ran(monkeypatch):
    tool, name = write_kernels(), SMALL[0]
    module, before = importlib.import_module(name), precompile.listed()[name]
    types = {function: list(signatures) for function, signatures in before["kernels"].items()}
    ran: dict[str, float] = {}
    monkeypatch.setattr(tool, "kept", lambda kernel: _in_cache(kernel, types, ran))
    assert tool.entry_of(module, before) == before  # nothing of it ran
    one, *others = types
    assert others, "the module should have two functions"
    ran[one] = 3.0
    assert tool.entry_of(module, before)["weight"] == before["weight"] > 3
    ran |= dict.fromkeys(others, 2.0)
    assert tool.entry_of(module, before)["weight"] == 3 + 2 * len(others)
    assert tool.entry_of(module, {})["kernels"] == before["kernels"]
    ran.clear()
    assert not tool.entry_of(module, {})["kernels"]


def _in_cache(kernel, types: dict, ran: dict[str, float]) -> tuple[list, float]:
    name = kernel.py_func.__name__
    return (types.get(name, []), ran[name]) if name in ran else ([], 0.0)


def test_types_are_written_and_read():
    from numba.core import types

    from treedgs_geo.stems.photos.images.crops import PhotoArrays

    array = types.Array(types.float32, 2, "C")
    for kind in (
        types.boolean,
        types.int64,
        types.none,
        types.Array(types.boolean, 1, "A", readonly=True),
        types.UniTuple(types.float64, 3),
        types.Tuple((array, types.int64)),
        types.BaseTuple.from_types((array,) * len(PhotoArrays._fields), PhotoArrays),
        types.Omitted(2.5),
        types.literal(30),
    ):
        assert precompile.type_of(json.loads(json.dumps(precompile.described(kind)))) == kind
    with pytest.raises(ValueError, match="no description of the type"):
        precompile.described(types.DictType(types.int64, types.int64))


def test_what_is_compiled_is_found_by_the_next_process(cache, monkeypatch):
    few(monkeypatch)
    bar = Bar()
    first = precompile.compile_ahead(bar, processes=2)
    assert first.compiled == len(list(cache.rglob("*.nbc"))) > 2 and not first.kept and not first.failed
    assert bar.fractions == sorted(bar.fractions) and bar.fractions[-1] == 1
    again = precompile.compile_ahead(processes=1)
    assert again.compiled == 0 and again.kept == first.compiled


def test_what_cannot_be_compiled_is_named_and_the_rest_is_done(cache, monkeypatch):
    few(monkeypatch, nowhere={"weight": 1, "after": [SMALL[0]], "kernels": {"f": [["int64"]]}})
    found = precompile.compile_ahead(processes=1)
    assert found.compiled > 2 and len(found.failed) == 1 and found.failed[0].startswith("nowhere")


def test_processes_that_die_end_it(cache, monkeypatch):
    few(monkeypatch)
    monkeypatch.setattr(precompile, "python_command", lambda _: [sys.executable, "-c", "raise SystemExit(9)"])
    found = precompile.compile_ahead(processes=2)
    assert found.compiled == 0 and any("ended early" in reason for reason in found.failed)


def test_where_nothing_can_be_written_the_code_is_kept_for_one_run(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    machine.ensure_code_cache()
    assert "NUMBA_CACHE_DIR" not in os.environ
    monkeypatch.setattr(machine, "_writable", lambda _: False)
    ended: list[tuple] = []
    monkeypatch.setattr(machine.atexit, "register", lambda *call, **_: ended.append(call))
    # monkeypatch takes it away again in the end.
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    machine.ensure_code_cache()
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    assert folder.is_dir()
    remove, given = ended[0]
    remove(given)
    assert not folder.exists()


def test_what_can_be_written(tmp_path):
    assert machine._writable(tmp_path / "a" / "b") and not machine._writable(Path("/proc/nowhere/a"))
    (tmp_path / "file").touch()
    assert not machine._writable(tmp_path / "file" / "a")


def test_a_process_ends_with_whoever_started_it(cache):
    command = python_command("treedgs_geo.core.precompile")
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        child.stdin.close()
        assert child.wait(60) == 0
