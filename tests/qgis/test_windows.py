"""What Windows and macOS do otherwise, simulated: ``docs/windows.md`` lists the cases, and what no test can show."""

from __future__ import annotations

import ast
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import types
import zipfile
from pathlib import Path

import pytest
from qgis_driver import ROOT, load

from treedgs_geo.core import files
from treedgs_geo.core.children import was_killed
from treedgs_geo.core.errors import OutputError

load("treedgs_shell", ROOT / "treedgs_qgis" / "__init__.py", ROOT / "treedgs_qgis")
engine = load("treedgs_shell.engine", ROOT / "treedgs_qgis" / "engine.py")
environment = load("treedgs_shell.environment", ROOT / "treedgs_qgis" / "environment.py")
own_python = load("treedgs_shell.own_python", ROOT / "treedgs_qgis" / "own_python.py")
groups, job, pythons = (sys.modules[f"treedgs_shell.{name}"] for name in ("groups", "windows_job", "pythons"))
HIDDEN = 0x08000000


class Key:
    """A key of a registry that is a dict: path -> {value name: value}; a key below is a path that goes on."""

    def __init__(self, tree, path):
        self.tree, self.path = tree, path

    def __enter__(self):
        return self

    def __exit__(self, *error):
        return False


def registry(tree) -> types.ModuleType:
    """``winreg`` over such a dict."""
    module = types.ModuleType("winreg")
    module.HKEY_CURRENT_USER, module.HKEY_LOCAL_MACHINE = "HKCU", "HKLM"

    def open_key(root, path):
        whole = (root.path if isinstance(root, Key) else root) + "\\" + path
        if not any(name == whole or name.startswith(whole + "\\") for name in tree):
            raise FileNotFoundError(2, "no such key", whole)
        return Key(tree, whole)

    def below(key):
        start = key.path + "\\"
        return sorted({name[len(start) :].split("\\")[0] for name in tree if name.startswith(start)})

    def value(key, name):
        if name not in tree.get(key.path, {}):
            raise FileNotFoundError(2, "no such value", name)
        return tree[key.path][name], 1

    module.OpenKey, module.QueryValueEx = open_key, value
    module.QueryInfoKey = lambda key: (len(below(key)), 0, 0)
    module.EnumKey = lambda key, number: below(key)[number]
    return module


@pytest.fixture
def windows(monkeypatch, tmp_path):
    """The platform says that it is Windows; an empty registry, no Python on the PATH."""
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(subprocess, "CREATE_NO_WINDOW", HIDDEN, raising=False)
    monkeypatch.setattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0x200, raising=False)
    monkeypatch.setitem(sys.modules, "winreg", registry({}))
    for name in ("LOCALAPPDATA", "PROGRAMFILES", "PROGRAMFILES(X86)", "SYSTEMDRIVE", "SYSTEMROOT"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.setattr(pythons, "find_program", lambda name: None)


def made(path: Path) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch()
    return str(path)


def test_the_launchers_list_is_read():
    text = (
        "  *               C:\\Users\\Jo Doe\\v\\Scripts\\python.exe\n"
        " -V:3.13 *        C:\\Users\\Jo Doe\\AppData\\Local\\Programs\\Python\\Python313\\python.exe\n"
        " -V:3.10-32       C:\\Program Files (x86)\\Python310-32\\python.exe\n"
        " -3.9-64\t\tC:\\Python39\\python.exe\n"
        "No suitable Python runtime found\n"
    )
    assert pythons.listed_by_launcher(text) == [
        "C:\\Users\\Jo Doe\\AppData\\Local\\Programs\\Python\\Python313\\python.exe",
        "C:\\Program Files (x86)\\Python310-32\\python.exe",
        "C:\\Python39\\python.exe",
    ]


def test_a_python_is_found_in_the_registry_and_in_the_usual_folders(windows, tmp_path, monkeypatch):
    core = "\\Software\\Python\\PythonCore\\"
    one = made(tmp_path / "user" / "Python313" / "python.exe")
    two = made(tmp_path / "all" / "Python310" / "python.exe")
    tree = {
        f"HKCU{core}3.13\\InstallPath": {"ExecutablePath": one},
        f"HKLM{core}3.10\\InstallPath": {"": str(Path(two).parent)},
        f"HKLM{core}3.11\\InstallPath": {"ExecutablePath": str(tmp_path / "gone" / "python.exe")},
    }
    monkeypatch.setitem(sys.modules, "winreg", registry(tree))
    usual = made(tmp_path / "LOCALAPPDATA" / "Programs" / "Python" / "Python312" / "python.exe")
    third = made(tmp_path / "PROGRAMFILES" / "Python314" / "python.exe")
    made(tmp_path / "PROGRAMFILES" / "QGIS 3.40" / "apps" / "Python312" / "python.exe")
    assert list(pythons.candidates()) == [one, two, usual, third]
    assert pythons.find_python("", lambda path: (3, 15) if path == one else (3, 12)) == two
    monkeypatch.setitem(sys.modules, "winreg", registry({}))
    assert pythons.find_python("", lambda path: (3, 12)) == usual


def test_the_pythons_of_qgis_and_of_the_shop_are_passed_over(windows, tmp_path, monkeypatch):
    """OSGeo4W resets PATH and PYTHONHOME, so that environments made with its Python break; the shop's is no Python."""
    bad = [
        tmp_path / "OSGeo4W" / "apps" / "Python312" / "python.exe",
        tmp_path / "QGIS 3.40.1" / "apps" / "Python312" / "python.exe",
        tmp_path / "Microsoft" / "WindowsApps" / "python.exe",
    ]
    good = made(tmp_path / "Python312" / "python.exe")
    monkeypatch.setattr(pythons, "_everywhere", lambda: iter([*map(made, bad), good]))
    assert list(pythons.candidates()) == [good]


def test_the_mac_looks_where_the_finder_does_not(monkeypatch):
    there = "/Library/Frameworks/Python.framework/Versions/3.13/bin/python3.13"
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(pythons, "find_program", lambda name: None)
    monkeypatch.setattr(os.path, "exists", lambda path: path == there)
    assert list(pythons.candidates()) == [there]


def test_a_python_is_asked_without_what_osgeo4w_sets(monkeypatch):
    """A PYTHONHOME of QGIS keeps every other Python from starting."""
    monkeypatch.setenv("PYTHONHOME", "/nonexistent")
    monkeypatch.setenv("PYTHONPATH", "/nonexistent")
    assert pythons.version_of(sys.executable) == sys.version_info[:2]


def test_no_child_of_the_plugin_opens_a_console_window():
    """Every child that is started inside QGIS says so; ``make setup`` alone runs in a terminal."""
    without = []
    for path in [*(ROOT / "treedgs_qgis").rglob("*.py"), *(ROOT / "processing").glob("*.py")]:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for function in [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]:
            for node in ast.walk(function):
                called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
                if called in ("subprocess.run", "subprocess.Popen", "subprocess.call") and not {
                    "no_window()",
                    "own_group()",
                } & {ast.unparse(word.value) for word in node.keywords if word.arg is None}:
                    without.append(f"{path.name}: {function.name}")
                assert not called.startswith("os.system")
    assert sorted(set(without)) == ["environment.py: _pulls_cuda", "environment.py: logged", "environment.py: run"]


class Kernel:
    """Records what is asked of Windows; refuses what is named."""

    def __init__(self, refuses=""):
        self.calls, self.refuses = [], refuses

    def __getattr__(self, name):
        def call(*arguments):
            self.calls.append((name, *arguments))
            return 0 if name == self.refuses else 77

        return call

    @property
    def names(self):
        return [call[0] for call in self.calls]


def test_a_job_holds_the_engine_and_ends_with_qgis():
    kernel, process = Kernel(), types.SimpleNamespace(_handle=123)
    held = job.Job(process, kernel)
    assert kernel.names == ["CreateJobObjectW", "SetInformationJobObject", "AssignProcessToJobObject"]
    _, handle, kind, limits, size = kernel.calls[1]
    assert (handle, kind, size) == (77, 9, ctypes.sizeof(job.ExtendedLimits)) and kernel.calls[2] == (
        "AssignProcessToJobObject",
        77,
        123,
    )
    # KILL_ON_JOB_CLOSE: the last handle goes with QGIS, however QGIS ends.
    assert limits._obj.BasicLimitInformation.LimitFlags == 0x2000
    assert held.end() and kernel.names[-2:] == ["TerminateJobObject", "CloseHandle"]
    count = len(kernel.calls)
    assert not held.end() and len(kernel.calls) == count
    if ctypes.sizeof(ctypes.c_void_p) == 8:
        assert ctypes.sizeof(job.ExtendedLimits) == 144  # winnt.h, 64 bits
        assert job.ExtendedLimits.ProcessMemoryLimit.offset == 112


@pytest.mark.parametrize("refuses", ["CreateJobObjectW", "SetInformationJobObject", "AssignProcessToJobObject"])
def test_without_a_job_the_tree_of_children_is_ended(windows, monkeypatch, refuses):
    """An old Windows, or a policy: the handle is closed again, and ``taskkill`` finds the children."""
    kernel = Kernel(refuses)
    held = job.Job(types.SimpleNamespace(_handle=1), kernel)
    assert not held.handle and (refuses == "CreateJobObjectW") != ("CloseHandle" in kernel.names)
    seen = []
    monkeypatch.setattr(subprocess, "run", lambda command, **more: seen.append((command, more)))
    groups.stop_group(types.SimpleNamespace(pid=4242, poll=lambda: None), held)
    ((command, more),) = seen
    assert command[0].endswith("taskkill.exe") and os.path.isabs(command[0])
    assert command[1:] == ["/T", "/F", "/PID", "4242"] and more["creationflags"] == HIDDEN


def test_cancel_ends_the_job_even_when_the_engine_itself_has_ended(windows, monkeypatch):
    kernel = Kernel()
    held = job.Job(types.SimpleNamespace(_handle=1), kernel)
    monkeypatch.setattr(subprocess, "run", lambda *a, **k: pytest.fail("taskkill would miss orphans"))
    groups.stop_group(types.SimpleNamespace(pid=1, poll=lambda: 0), held)
    assert "TerminateJobObject" in kernel.names


def test_elsewhere_there_is_no_job(tmp_path):
    process = engine.start([sys.executable, "-c", "pass"], tmp_path)
    assert process.job.handle == 0 and not process.job.end()
    list(engine.stream(process, lambda: False))


def test_the_childs_environment_on_windows(windows, monkeypatch):
    for name in ("OSGEO4W_ROOT", "O4W_QT_PREFIX", "PYTHONHOME", "GDAL_DATA", "QT_PLUGIN_PATH"):
        monkeypatch.setenv(name, "C:\\OSGeo4W")
    child = engine.child_environment()
    assert "C:\\OSGeo4W" not in child.values() and child["NoDefaultCurrentDirectoryInExePath"] == "1"
    assert groups.own_group() == {"creationflags": 0x200 | HIDDEN}
    assert engine.python_in(Path("env")).parts == ("env", "Scripts", "python.exe")


def test_no_signal_is_named_that_windows_lacks(monkeypatch):
    for name in ("SIGKILL", "SIGHUP", "SIGALRM"):
        monkeypatch.delattr(signal, name)
    from treedgs_geo.campaign.engine_process import explain

    assert was_killed(-9) and was_killed(137) and not was_killed(1) and not was_killed(None)
    assert explain(-9, "")[0] == "memory" and explain(3221225477, "")[0] == "defect"
    tree = ast.parse((ROOT / "treedgs_geo" / "reconstruction" / "colmap_process.py").read_text(encoding="utf-8"))
    assert not [node for node in ast.walk(tree) if isinstance(node, ast.Attribute) and node.attr == "SIGKILL"]


def test_nothing_is_forked():
    """Windows cannot, macOS should not: children are new programs."""
    forks = []
    for path in [*(ROOT / "treedgs_geo").rglob("*.py"), *(ROOT / "treedgs_qgis").rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in (
                "fork",
                "forkpty",
                "Pool",
                "Process",
            ):
                if ast.unparse(node.func) != "psutil.Process":
                    forks.append(f"{path.name}: {ast.unparse(node.func)}")
            if isinstance(node, ast.Constant) and node.value in ("fork", "forkserver"):
                forks.append(f"{path.name}: {node.value!r}")
    # A low fork is a thing of trees.
    assert [found for found in forks if not found.endswith("'fork'")] == []


def test_long_paths_are_refused_before_hours_of_work(windows, tmp_path, monkeypatch):
    deep = tmp_path / ("d" * 100) / ("e" * 100)
    target = deep / "trees.gpkg"
    with pytest.raises(OutputError, match="expected at most 227 on this Windows.*LongPathsEnabled"):
        files.check_name(target)
    files.check_name(tmp_path / "trees.gpkg")
    key = "HKLM\\SYSTEM\\CurrentControlSet\\Control\\FileSystem"
    monkeypatch.setitem(sys.modules, "winreg", registry({key: {"LongPathsEnabled": 1}}))
    files.check_name(target)
    monkeypatch.setitem(sys.modules, "winreg", registry({key: {"LongPathsEnabled": 0}}))
    with pytest.raises(OutputError, match="LongPathsEnabled"):
        files.check_name(target)
    with pytest.raises(environment.SetupError, match="TREEDGS_HOME to a short folder"):
        environment.build(deep / "engine", [], "k", "python", say=str)
    monkeypatch.setattr(sys, "platform", "linux")
    files.check_name(target)


@pytest.fixture
def uv(tmp_path, monkeypatch):
    """``run(command)`` as pip and uv would: a wheel with a program in it, which links this Python as its own."""
    said = []
    wheel = tmp_path / "uv-9.whl"
    script = '#!/bin/sh\nd="$5/cpython-3.12.9-x/bin"; mkdir -p "$d"; ' + f'ln -s "{sys.executable}" "$d/python3.12"\n'
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("uv-9.data/scripts/uv", script)
    fails: set[str] = set()

    def run(command):
        said.append([str(word) for word in command])
        name = "pip" if "pip" in said[-1] else "uv"
        if name in fails:
            return 1
        if name == "pip":
            shutil.copy(wheel, Path(said[-1][said[-1].index("-d") + 1]) / "uv-9-py3-none-linux_x86_64.whl")
            return 0
        return subprocess.call(said[-1])

    run.said, run.fails = said, fails
    return run


def test_a_python_is_fetched_once_where_there_is_none(uv, tmp_path):
    folder, told = tmp_path / "data" / "python", []
    found = own_python.fetch(folder, uv, told.append)
    assert pythons.usable_python(found) and Path(found).is_relative_to(folder) and len(told) == 1
    pip, program = uv.said
    assert "--require-hashes" in pip and pip[-1].endswith("uv-locked.txt") and ":all:" in pip
    assert program[1:4] == ["python", "install", "3.12"] and "--no-bin" in program and "--no-config" in program
    assert not (folder / "uv").exists(), "only the Python stays"
    assert own_python.fetch(folder, uv) == found and len(uv.said) == 2
    assert own_python.fetched(tmp_path / "nowhere") == ""


@pytest.mark.parametrize(("broken", "what"), [("pip", "uv could not be fetched"), ("uv", "Python 3.12 could not be")])
def test_without_network_nothing_half_fetched_stays(uv, tmp_path, broken, what):
    uv.fails.add(broken)
    with pytest.raises(environment.SetupError, match=f"{what}.*HTTPS_PROXY.*python.org"):
        own_python.fetch(tmp_path / "python", uv, str)
    assert not (tmp_path / "python" / "uv").exists() and own_python.fetched(tmp_path / "python") == ""


def test_uv_is_locked_with_hashes():
    lines = [line for line in own_python.LOCKED.read_text(encoding="utf-8").splitlines() if line[:1] != "#"]
    assert len(lines) == 1 and lines[0].startswith("uv==") and lines[0].count("--hash=sha256:") >= 10
