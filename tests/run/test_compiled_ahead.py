"""The list of what is compiled ahead holds what the main jobs call: their first run compiles nothing more."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from chain_runs import chain_arguments

ROOT = Path(__file__).resolve().parents[2]
#: Runs a verb, then prints what was called with types that are not listed.
SCRIPT = """
import json, sys
from numba.core.dispatcher import Dispatcher
from treedgs_geo.cli import main
from treedgs_geo.core.precompile import described, listed
code = main(sys.argv[1:])
missing = []
for name, module in sorted(sys.modules.items()):
    for function, kernel in vars(module).items() if name.startswith("treedgs_geo.") else ():
        if isinstance(kernel, Dispatcher) and kernel.py_func.__module__ == name and kernel.stats.cache_path:
            known = listed().get(name, {"kernels": {}})["kernels"].get(function, [])
            found = [[described(kind) for kind in signature] for signature in kernel.signatures]
            missing += [f"{name}.{function}{signature}" for signature in found if signature not in known]
print("MISSING", json.dumps(missing))
sys.exit(code)
"""


def missing(*words: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", SCRIPT, *words], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(next(line for line in done.stdout.splitlines() if line.startswith("MISSING"))[8:])


def test_a_flight(simulated_plot, tmp_path):
    assert missing(*chain_arguments(simulated_plot, tmp_path)) == []


def test_a_cloud(simulated_plot, tmp_path):
    cloud = next((simulated_plot / "lidar").glob("*.laz"))
    assert missing("pointcloud-to-dbh", "--input", str(cloud), "--output", str(tmp_path / "trees.gpkg")) == []
