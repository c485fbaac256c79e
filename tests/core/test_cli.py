"""The command line: complete help, one sentence per mistake, JSON lines that a program can read."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import MISSING

import pytest

from treedgs_geo.cli import main
from treedgs_geo.core.progress import PROTOCOL, JsonReporter, PlainReporter
from treedgs_geo.core.settings import params_of
from treedgs_geo.verbs import MODULES, all_commands, get_command


def test_overview_names_every_command(capsys):
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in MODULES)


def test_the_overview_loads_no_library():
    code = "import sys\nfrom treedgs_geo.cli import main\nmain(['--help'])\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and "photos-to-dbh" in done.stdout
    assert not {"numpy", "pandas", "scipy", "pyproj", "rasterio", "torch"} & set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize("name", list(MODULES))
def test_help_gives_units_defaults_and_an_example(name, capsys):
    with pytest.raises(SystemExit) as stop:
        main([name, "--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    assert "example:" in text and f"treedgs {name}" in text.split("example:")[1]
    assert "--log-format" in text


def test_every_parameter_is_explained_and_limits_hold_for_defaults():
    for command in all_commands():
        assert command.title and command.summary and command.help and command.outputs
        known = {name: default for name, _, default in params_of(command.settings)}
        needed = {name for name, default in known.items() if default is MISSING}
        assert needed <= set(command.main) <= set(known), f"{command.name}: what has to be given is never folded away"
        for name, spec, default in params_of(command.settings):
            assert spec.help, (command.name, name)
            if isinstance(default, (int, float)) and not isinstance(default, bool):
                assert spec.minimum is None or default >= spec.minimum, (command.name, name)
                assert spec.maximum is None or default <= spec.maximum, (command.name, name)
            if spec.kind == "choice" and default is not None:
                assert default in spec.choices, (command.name, name)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["photos-to-dhb"], "did you mean 'photos-to-dbh'"),
        (["geotag", "--photoss", "x"], "did you mean 'photos'"),
        (["geotag"], "--photos is required"),
        (["geotag", "--base-position", "-33.6,150.2,40"], "--photos is required"),
        (["geotag", "--base-position", "-.5, -60,40", "--photoss", "x"], "did you mean 'photos'"),
        (["geotag", "stray"], "options start with --"),
        (
            [
                "photos-to-dbh",
                "--photos",
                "x",
                "--crs",
                "EPSG:6344",
                "--workspace",
                "w",
                "--output",
                "t.gpkg",
                "--bh-m",
                "13",
            ],
            "expected 0.5 to 2.5 m",
        ),
    ],
)
def test_mistakes_get_one_sentence_and_code_2(arguments, words, capsys):
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert words in captured.err and "Traceback" not in captured.err


def test_describe_is_json_with_every_command(capsys):
    assert main(["describe"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["protocol"] == PROTOCOL
    assert [c["name"] for c in described["commands"]] == list(MODULES)


def test_job_speaks_json_lines_only_and_writes_its_result(tmp_path):
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"protocol": PROTOCOL, "command": "geotag", "parameters": {"nonsense": 1}}))
    done = subprocess.run([sys.executable, "-m", "treedgs_geo", "--job", str(job)], capture_output=True, text=True)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 2 and lines[0]["t"] == "hello" and lines[-1]["t"] == "error"
    assert "nonsense" in lines[-1]["message"]
    assert json.loads((tmp_path / "result.json").read_text()) == {"exit_code": 2}


def test_a_job_of_another_protocol_is_refused(tmp_path):
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"protocol": 999, "command": "doctor"}))
    done = subprocess.run([sys.executable, "-m", "treedgs_geo", "--job", str(job)], capture_output=True, text=True)
    assert done.returncode == 2 and "setupengine" in done.stdout


def test_nested_stages_map_progress_onto_the_whole(capsys):
    reporter = JsonReporter(sys.stdout)
    with reporter.stage("outer", 0.5, 1.0):
        with reporter.stage("inner", 0.0, 0.5):
            reporter._last = 0.0
            reporter.progress(1.0)
    fractions = [e["fraction"] for e in map(json.loads, capsys.readouterr().out.splitlines()) if e["t"] == "progress"]
    assert max(fractions) <= 1.0 and 0.75 in fractions


def test_plain_log_has_stages_and_tenths(capsys):
    reporter = PlainReporter(sys.stdout)
    with reporter.stage("fit"):
        for step in range(100):
            reporter.progress(step / 100)
        reporter.warn("two photos are blurred")
    text = capsys.readouterr().out
    assert "[fit]" in text and "50 %" in text and "warning: two photos are blurred" in text and text.count("%") <= 10


@pytest.mark.skipif(os.name != "posix", reason="signals as on Linux and macOS")
def test_cancel_ends_within_two_seconds_with_its_own_code(tmp_path):
    job = tmp_path / "job.json"
    job.write_text(
        json.dumps(
            {
                "protocol": PROTOCOL,
                "command": "simulate-plot",
                "parameters": {"preset": "demo", "output": str(tmp_path / "plot")},
            }
        )
    )
    engine = subprocess.Popen(
        [sys.executable, "-m", "treedgs_geo", "--job", str(job)], stdout=subprocess.PIPE, text=True
    )
    for line in engine.stdout:
        if json.loads(line)["t"] == "stage":
            break
    time.sleep(1.0)
    engine.send_signal(signal.SIGTERM)
    began = time.monotonic()
    code = engine.wait(timeout=20)
    assert code == 130
    assert time.monotonic() - began < 10  # generous: the machine is noisy; the plugin kills after two seconds anyway
    assert not (tmp_path / "plot" / "truth").exists()


def test_a_refused_verb_leaves_no_empty_folder(tmp_path, monkeypatch):
    """A folder that was there stays, one with something in it too; one that was made for nothing goes."""
    from dataclasses import replace
    from pathlib import Path

    from treedgs_geo.cli import run_command
    from treedgs_geo.core.errors import InputError
    from treedgs_geo.core.files import ensure_writable
    from treedgs_geo.core.progress import Reporter
    from treedgs_geo.verbs import get_command

    def refuse(settings, reporter):
        ensure_writable(settings.output / "summary.json")
        if "kept" in settings.output.name:
            (settings.output / "note.txt").write_text("half a result")
        raise InputError("no plot is left to count.")

    for name in ("trees.gpkg", "plots.csv"):
        (tmp_path / name).touch()
    (tmp_path / "mine").mkdir()
    command = replace(get_command("stand-table"), run=refuse)
    values = {"trees": str(tmp_path / "trees.gpkg"), "plots": str(tmp_path / "plots.csv"), "species": "PITA"}
    monkeypatch.chdir(tmp_path)
    for output in (str(tmp_path / "new" / "stand"), str(tmp_path / "mine"), "kept", "stand"):
        assert run_command(command, {**values, "output": output}, Reporter()) == 2
    assert sorted(p.name for p in Path(tmp_path).rglob("*")) == ["kept", "mine", "note.txt", "plots.csv", "trees.gpkg"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_every_verb_option_and_choice(shell, capsys):
    pytest.importorskip("shtab")
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    for command in all_commands():
        assert command.name in script
        for name, spec, _ in params_of(command.settings):
            assert name.replace("_", "-") in script and all(choice in script for choice in spec.choices)


def test_bash_completes_a_choice():
    pytest.importorskip("shtab")
    script = subprocess.run(
        [sys.executable, "-m", "treedgs_geo", "completion", "bash"], capture_output=True, text=True, check=True
    ).stdout
    asked = 'COMP_WORDS=(treedgs photos-to-dbh --preset b); COMP_CWORD=3; _shtab_treedgs; echo "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", f"{script}\n{asked}"], capture_output=True, text=True, check=True)
    choices = next(
        spec.choices for name, spec, _ in params_of(get_command("photos-to-dbh").settings) if name == "preset"
    )
    assert done.stdout.split() == [choice for choice in choices if choice.startswith("b")] != []


def test_a_shell_that_is_none_is_refused(capsys):
    pytest.importorskip("shtab")
    assert main(["completion", "cmd"]) == 2
    assert "expected one of bash" in capsys.readouterr().err
