"""Real clicks on "Set up now" and Stop, in real QGIS, with garbage collected between all of them."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest


def test_the_set_up_bar_lives_as_long_as_it_is_shown(qgis, tmp_path):
    frame, program = shutil.which("xvfb-run"), qgis.tools.qgis()
    if not (frame and program):
        pytest.skip("needs the graphical QGIS and xvfb-run")
    report = tmp_path / "seen.json"
    variables = qgis.environment(TREEDGS_CLICKS=report, TREEDGS_HOME=tmp_path / "home")
    for name in ("QT_QPA_PLATFORM", "TREEDGS_PYTHON"):
        variables.pop(name, None)
    script = Path(__file__).with_name("clicks_inside.py")
    command = [frame, "-a", "-s", "-screen 0 1280x1000x24", program, "--noversioncheck", "--nologo", "--code", script]
    done = subprocess.run(command, env=variables, timeout=300, capture_output=True, text=True)
    assert report.exists(), done.stdout + done.stderr
    seen = json.loads(report.read_text(encoding="utf-8"))
    assert "error" not in seen, seen
    for turn in ("dialog", "first", "second"):
        (early,), (late,) = seen[f"{turn}_bar"]
        assert 0 < early < late, seen
        assert seen[f"{turn}_ended"]
    sentence, offered, stop = seen["meanwhile"]
    assert "is being set up" in sentence and offered and stop == ["Stop"], seen
    assert "Stopped" in seen["first_words"][0] and seen["first_buttons"] == ["Set up now"]
    assert "The engine is set up" in seen["second_words"][0] and seen["second_buttons"] == []
