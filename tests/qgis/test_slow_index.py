"""The index that a set-up is timed with: pip installs from it, no faster than the line."""

from __future__ import annotations

import subprocess
import sys
import time
import zipfile

from qgis_driver import ROOT, load

slow_index = load("treedgs_tools_slow_index", ROOT / "tools" / "slow_index.py")


def test_pip_installs_over_a_line_of_known_speed(tmp_path):
    (tmp_path / "wheels").mkdir()
    info = "tiny_thing-1.0.dist-info"
    wheel = tmp_path / "wheels" / "tiny_thing-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("tiny_thing.txt", bytes(1_000_000))
        archive.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: tiny-thing\nVersion: 1.0\n")
        archive.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr(f"{info}/RECORD", "")
    with slow_index.serving(tmp_path / "wheels", 8.0, 0.01) as (address, line):
        command = [sys.executable, "-I", "-m", "pip", "--isolated", "install", "-q", "--no-cache-dir", "--no-deps"]
        began = time.monotonic()
        words = ["--index-url", address, "--target", str(tmp_path / "there"), "tiny.thing"]
        done = subprocess.run([*command, *words], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert 1.0 <= time.monotonic() - began
        assert line.sent_bytes == wheel.stat().st_size and (tmp_path / "there" / "tiny_thing.txt").exists()
        done = subprocess.run([*command, "--index-url", address, "no-such-thing"], capture_output=True, text=True)
        assert done.returncode == 1 and "No matching distribution" in done.stderr
