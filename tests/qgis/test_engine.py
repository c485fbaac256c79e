"""The child process without QGIS: finding Python, a clean environment, messages, cancel, crashes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from qgis_driver import ROOT, STUBBORN, load, outlived

load("treedgs_shell", ROOT / "treedgs_qgis" / "__init__.py", ROOT / "treedgs_qgis")
engine = load("treedgs_shell.engine", ROOT / "treedgs_qgis" / "engine.py")
environment = load("treedgs_shell.environment", ROOT / "treedgs_qgis" / "environment.py")
pythons, pipwords = sys.modules["treedgs_shell.pythons"], sys.modules["treedgs_shell.pipwords"]


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    """A data folder of the test's own, and no engine configured."""
    monkeypatch.setenv("TREEDGS_HOME", str(tmp_path / "données"))
    monkeypatch.delenv("TREEDGS_PYTHON", raising=False)


def run(python: Path, cancelled=lambda: False, command: str = "doctor"):
    seen: list[dict] = []
    job = engine.new_job_dir(command)
    return engine.run_job(engine.Engine(python, "test"), command, {}, job, seen.append, cancelled), seen


def test_protocol_equals_the_librarys():
    from treedgs_geo.core.progress import PROTOCOL

    assert engine.PROTOCOL == PROTOCOL


def test_the_real_engine_answers_in_the_protocol(tmp_path):
    seen: list[dict] = []
    python, job = engine.Engine(Path(sys.executable), "test"), engine.new_job_dir("doctor")
    with pytest.raises(engine.EngineError, match="'nonsense' is unknown"):
        engine.run_job(python, "doctor", {"nonsense": 1}, job, seen.append, lambda: False)
    assert seen[0]["t"] == "hello" and seen[0]["protocol"] == engine.PROTOCOL


def test_lines_that_are_no_protocol_go_to_the_log(fake_engine):
    outcome, seen = run(
        fake_engine("""
print("{ a native library talks }", flush=True)
print('{"no": "t"}', flush=True)
print("on stderr", file=sys.stderr, flush=True)
say(t="result", result={"n": 1})
""")
    )
    assert outcome.result == {"n": 1}
    logged = [message["message"] for message in seen if message["t"] == "log"]
    assert set(logged) == {"on stderr", '{"no": "t"}', "{ a native library talks }"}


@pytest.mark.parametrize(
    ("behaviour", "expected"),
    [
        ("os.kill(os.getpid(), 9)", "memory ran out"),
        ("os.kill(os.getpid(), 11)", "crashed .SIGSEGV"),
        ("print('OpenBLAS error: Memory allocation still failed after 10 retries', file=sys.stderr); sys.exit(1)",
         "memory ran out"),
        ("print('terminate called after throwing std::bad_alloc', file=sys.stderr, flush=True); os.abort()",
         "memory ran out"),
        # The system's own limit: the allocation is refused for real.
        ("import resource\nresource.setrlimit(resource.RLIMIT_AS, (300 << 20,) * 2)\nbytearray(1 << 30)",
         "memory ran out"),
        ("os.kill(os.getpid(), 15)", "stopped from outside"),
        ("print('the last word', file=sys.stderr); sys.exit(7)", "code 7: the last word"),
        (
            "say(t='error', message='The photos are blurred; take others.'); sys.exit(2)",
            "^The photos are blurred; take others.$",
        ),
        ("say(t='hello', protocol=99)", "protocol 99, this plugin 1"),
    ],
)  # fmt: skip
def test_every_bad_end_is_one_sentence(fake_engine, behaviour, expected):
    with pytest.raises(engine.EngineError, match=expected) as caught:
        run(fake_engine(behaviour))
    assert "\n" not in str(caught.value)


def test_a_result_is_kept_when_the_engine_takes_its_time_to_end(fake_engine):
    outcome, _ = run(fake_engine('say(t="result", result={"n": 2})\nos.close(1); os.close(2)\ntime.sleep(1.5)'))
    assert outcome.result == {"n": 2}


def test_cancel_ends_the_whole_group(fake_engine, tmp_path, monkeypatch):
    monkeypatch.setenv("PIDS", str(tmp_path / "pids"))

    def cancelled() -> bool:
        return (tmp_path / "pids").exists() and (tmp_path / "pids").read_text().count(" ") == 1

    with pytest.raises(engine.EngineCancelled):
        run(fake_engine(STUBBORN), cancelled)
    assert not outlived([int(part) for part in (tmp_path / "pids").read_text().split()])


def test_children_do_not_outlive_an_engine_that_ends(fake_engine, tmp_path, monkeypatch):
    monkeypatch.setenv("PIDS", str(tmp_path / "pids"))
    run(
        fake_engine("""
child = subprocess.Popen(["/bin/sh", "-c", "while :; do sleep 0.2; done"])
open(os.environ["PIDS"], "w").write(str(child.pid))
say(t="result", result={})
""")
    )
    assert not outlived([int((tmp_path / "pids").read_text())])


def test_the_child_gets_a_clean_environment(monkeypatch):
    for name, value in {
        "PYTHONHOME": "/x",
        "PYTHONPATH": "/x",
        "PYTHONEXECUTABLE": "/x",
        "LD_LIBRARY_PATH": "/x",
        "QGIS_PREFIX_PATH": "/x",
        "PROJ_LIB": "/x",
        "GDAL_DATA": "/x",
        "VIRTUAL_ENV": "/x",
        "QT_PLUGIN_PATH": "/x",
        "PIP_TARGET": "/x",
        "HTTPS_PROXY": "http://proxy:1",
    }.items():
        monkeypatch.setenv(name, value)
    child = engine.child_environment()
    assert "/x" not in child.values()
    assert "PYTHONPATH" not in child, "the engine finds the library by its own command line"
    assert child["HTTPS_PROXY"] == "http://proxy:1"


def test_a_configured_engine_that_is_missing_is_not_passed_over(tmp_path, monkeypatch):
    monkeypatch.setenv("TREEDGS_PYTHON", str(tmp_path / "no python"))
    with pytest.raises(engine.EngineMissing, match="TREEDGS_PYTHON names .*no python.*treedgs:setupengine"):
        engine.find_engine()


def test_an_incomplete_engine_says_what_it_lacks(monkeypatch):
    monkeypatch.setenv("TREEDGS_PYTHON", sys.executable)
    with pytest.raises(engine.EngineMissing, match="lacks no_such_library"):
        engine.find_engine("", ["json", "no_such_library"])
    assert engine.find_engine("", ["numpy"]).source == "TREEDGS_PYTHON"


def test_the_setting_comes_after_the_variable(monkeypatch):
    assert engine.find_engine(sys.executable, ["numpy"]).source == "the QGIS setting treedgs/python"


def test_job_folders_are_made_anew_and_the_old_ones_go(tmp_path):
    first = engine.new_job_dir("geotag")
    os.utime(first, (1, 1))
    for _ in range(engine.KEPT_JOBS + 1):
        last = engine.new_job_dir("geotag")
    assert last.exists() and not first.exists()


def test_without_a_data_folder_a_job_has_one_of_its_own(tmp_path, monkeypatch):
    """Never one of a known name where all users write: another user could have made it before, or a link of it."""
    (tmp_path / "file").touch()
    (tmp_path / "shared").mkdir()
    monkeypatch.setenv("TREEDGS_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(engine.tempfile, "tempdir", str(tmp_path / "shared"))
    made = [engine.new_job_dir("geotag") for _ in range(2)]
    assert made[0] != made[1] and all(folder.parent == tmp_path / "shared" for folder in made)
    assert sys.platform == "win32" or made[0].stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("relative", [False, True])
def test_an_environment_is_built_once_and_repaired(tmp_path, monkeypatch, relative):
    calls: list[list[str]] = []
    monkeypatch.chdir(tmp_path)
    target = Path("env") if relative else tmp_path / "env"

    def fake(command):
        calls.append([str(part) for part in command])
        if "venv" in calls[-1]:
            inside = tmp_path / "env" / "bin"
            inside.mkdir(parents=True, exist_ok=True)
            (inside / "python").unlink(missing_ok=True)
            (inside / "python").symlink_to(sys.executable)
        return 1 if "broken" in calls[-1] else 0

    def build(packages, key="k"):
        environment.build(target, packages, key, sys.executable, run=fake, say=lambda text: None)

    with pytest.raises(environment.SetupError, match="could not install broken"):
        build([["broken"]])
    assert not environment.is_ready(tmp_path / "env", "k")
    build([["laspy"]])
    assert environment.is_ready(tmp_path / "env", "k")
    count = len(calls)
    build([["laspy"]])
    assert len(calls) == count
    build([["laspy"]], key="other list")
    assert len(calls) > count
    assert sum("venv" in call for call in calls) == 1, "what is installed is kept, whatever the list says"


def test_all_is_compiled_but_the_libraries_own_tests(tmp_path):
    for name in ("one.py", "deep/two.py", "deep/tests/three.py", "test/four.py", "testing/five.py", "bad.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("def (" if name == "bad.py" else "X = 1\n")
    done = subprocess.run([sys.executable, "-I", "-c", environment.COMPILE, tmp_path], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.split() == ["Compiled", "4", "of", "4"], done.stderr
    assert {path.name.split(".")[0] for path in tmp_path.rglob("*.pyc")} == {"one", "two", "five"}


def test_wheels_from_a_folder_need_no_network(tmp_path):
    (tmp_path / "wheels").mkdir()
    python = tmp_path / "env" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.symlink_to(sys.executable)
    calls: list[list[str]] = []
    with pytest.raises(environment.SetupError, match="holds no .whl"):
        environment.build(tmp_path / "env", [["laspy"]], "k", sys.executable, tmp_path / "wheels", calls.append, str)
    (tmp_path / "wheels" / "laspy-2.0-py3-none-any.whl").touch()
    environment.build(
        tmp_path / "env",
        [["laspy"]],
        "k",
        sys.executable,
        tmp_path / "wheels",
        lambda command: calls.append(command) or 0,
        str,
    )
    assert "--no-index" in calls[-1] and str(tmp_path / "wheels") in calls[-1]


def test_a_folder_that_is_no_environment_is_never_removed(tmp_path):
    (tmp_path / "precious").mkdir()
    with pytest.raises(environment.SetupError, match="not a Python environment"):
        environment.remove(tmp_path / "precious")
    assert (tmp_path / "precious").exists()


def test_the_job_file_keeps_accents(fake_engine, tmp_path):
    python = fake_engine('say(t="result", result=job["parameters"])')
    job = engine.new_job_dir("terrain")
    found = engine.run_job(
        engine.Engine(python, "test"), "terrain", {"input": "/données/nuage é.laz"}, job, print, lambda: False
    )
    assert found.result == {"input": "/données/nuage é.laz"}
    assert json.loads((job / "job.json").read_text(encoding="utf-8"))["command"] == "terrain"


def test_what_pip_prints_goes_to_a_file(tmp_path, capfd):
    log = tmp_path / "pip.log"
    run = environment.logged(log)
    assert run([sys.executable, "-c", "print('chatter')"]) == 0
    assert capfd.readouterr() == ("", "")
    assert run([sys.executable, "-c", "print(*range(100), sep='\\n'); raise SystemExit(3)"]) == 3
    out, err = capfd.readouterr()
    assert out == "" and "99" in err and "chatter" not in err and str(log) in err
    assert len(err.splitlines()) == environment.TAIL + 1 and "chatter" in log.read_text()


TRAP = "open(__file__ + '.executed', 'w').close()\n"


@pytest.mark.parametrize("name", ["json", "numpy", "runpy", "treedgs_geo", "sitecustomize"])
def test_no_file_of_the_job_folder_is_executed(name, monkeypatch):
    """Nor one of a folder that a PYTHONPATH with an empty entry names. The engine is the one beside the plugin."""
    job = engine.new_job_dir("doctor")
    (job / f"{name}.py").write_text(TRAP)
    monkeypatch.setenv("PYTHONPATH", os.pathsep)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    seen: list[dict] = []
    with pytest.raises(engine.EngineError, match="'nonsense' is unknown"):
        engine.run_job(
            engine.Engine(Path(sys.executable), "test"), "doctor", {"nonsense": 1}, job, seen.append, lambda: False
        )
    assert seen[0]["t"] == "hello" and not list(job.glob("*.executed"))


def test_the_engine_is_the_one_beside_the_plugin(tmp_path):
    code = engine._RUN.replace("runpy.run_module('treedgs_geo', {}, '__main__', True)", "import treedgs_geo as t")
    command = engine.engine_command(Path(sys.executable))
    command[command.index(engine._RUN)] = f"{code}; print(t.__file__)"
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=engine.child_environment())
    assert Path(done.stdout.strip()).parents[1] == ROOT, done.stderr


def test_building_an_environment_executes_nothing_of_the_current_folder(tmp_path, monkeypatch):
    """The system's Python makes it, and pip fills it, for real."""
    for name in ("venv", "pip", "json", "ensurepip"):
        (tmp_path / f"{name}.py").write_text(TRAP)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(environment.SetupError, match="has no ready-made package"):
        environment.build(tmp_path / "env", [["--no-index", "no-such-library"]], "k", sys.executable, say=str)
    assert (tmp_path / "env" / "bin" / "pip").exists() and not list(tmp_path.glob("*.executed"))


def test_a_library_without_a_wheel_is_not_called_a_network_problem(tmp_path):
    """pip, for real, in a folder of wheels that has the library for another Python only; and its words online."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    (wheels / "treels_filter-1.1-cp36-cp36m-win_amd64.whl").touch()
    with pytest.raises(environment.SetupError, match="no wheel of treels-filter for Python 3") as caught:
        environment.build(tmp_path / "env", [["treels-filter==1.1"]], "k", sys.executable, wheels, say=str)
    assert "proxy" not in str(caught.value)
    why = pipwords.why_pip_failed
    online = (
        "2026-11-23T04:00:00,000 ERROR: Could not find a version that satisfies the requirement "
        "cloth-simulation-filter==1.1.7 (from versions: none)\n"
        "2026-11-23T04:00:00,001 ERROR: No matching distribution found for cloth-simulation-filter==1.1.7\n"
    )
    text = why(online, "the locked list", tmp_path, (3, 15))
    assert text.startswith("cloth-simulation-filter has no ready-made package (wheel) for Python 3.15")
    # Another Python would not help an old system, or another processor.
    text = why(online, "the locked list", tmp_path, (3, 14))
    assert pipwords.this_system() in text and "macOS 15" in text and "install Python" not in text
    offline = "WARNING: Retrying (Retry(total=4)) after connection broken by 'NewConnectionError(...)'\n" + online
    assert "could not reach the package index" in why(offline, "the locked list", tmp_path, (3, 14))
    assert "is full" in why("ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device",
                            "x", tmp_path, (3, 12))  # fmt: skip
    assert "in use" in why("OSError: [WinError 5] Access is denied: 'numpy.pyd'", "x", tmp_path, (3, 12))
    assert "hash differs" in why("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES", "x", tmp_path, (3, 12))
    assert "read the lines above" in why("", "x", tmp_path, None)


def test_a_python_is_found_that_the_libraries_know(tmp_path, monkeypatch):
    """Newer than the wheels is passed over, and named where there is no other."""
    place = tmp_path / "bin"
    place.mkdir()
    for name in ("python3.12", "python3", "python"):
        (place / name).write_text(f"#!/bin/sh\n# {name}\n")
        (place / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(place))
    monkeypatch.setattr(pythons, "_everywhere", lambda: iter([str(place / n) for n in ("python3", "python3.12")]))
    ages = {"python3": (3, 15), "python3.12": (3, 12)}
    assert pythons.find_python("", lambda path: ages.get(Path(path).name)).endswith("python3.12")
    with pytest.raises(environment.SetupError, match=r"python3 \(3.15\) is newer .*3.10 to 3.14"):
        pythons.find_python("", lambda path: (3, 15))
    with pytest.raises(environment.SetupError, match="No Python 3.10 or newer"):
        pythons.find_python("", lambda path: None)
    with pytest.raises(environment.SetupError, match="is not a Python 3.10"):
        pythons.find_python("/old", lambda path: (3, 9))
    assert pythons.version_of(sys.executable) == sys.version_info[:2] and pythons.version_of(str(place)) is None
