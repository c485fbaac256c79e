"""What the first run on a machine waits for: ``photos-to-dbh`` with nothing compiled, compiled ahead, and again.

    python -m treedgs_lab.benchmarks.chain.cold_start --plot ../shared/data/plot_a --core 1
        --output docs/results/cold_start.json

Three runs from nothing, each in a workspace of its own: with an empty cache of compiled code; with a cache that
``treedgs doctor --compile`` has filled, as setting up the engine does; and once more with the cache of the first run.
Processor seconds (own and children's) are what other work on the machine changes least. The trees of the three are
compared bit by bit.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.verbs import photo_inputs, words

assert sys.platform != "win32", "this benchmark needs Linux"

#: Of every random choice: the verb's own.
SEED = 0


def timed(command: list[str], cache: Path, core: int | None) -> dict[str, float]:
    """Run a command with a cache of compiled code; its processor and wall seconds."""
    pinned = ["taskset", "-c", str(core)] if core is not None else []
    alone = {"OMP_NUM_THREADS": "1"} if core is not None else {}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([*pinned, *command], check=True, env={**os.environ, **alone, "NUMBA_CACHE_DIR": str(cache)})
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - began
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"processor_s": round(used, 1), "wall_s": round(wall, 1)}


def compiled(cache: Path) -> dict[str, Any]:
    """What a cache holds: functions, functions with their types, megabytes."""
    code = list(cache.rglob("*.nbc"))
    return {
        "functions": len(list(cache.rglob("*.nbi"))),
        "with_their_types": len(code),
        "megabytes": round(sum(path.stat().st_size for path in code) / 1e6, 1),
    }


def main() -> int:
    """Run, print and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--core", type=int, help="processor core that all runs share")
    parser.add_argument("--only", nargs="+", choices=("cold", "ahead", "warm"), default=("cold", "ahead", "warm"))
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    options = parser.parse_args()
    found: dict[str, Any] = {"plot": options.plot.resolve().name, "cores": 1 if options.core is not None else None}
    layers: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="treedgs-cold-") as folder:
        scratch = Path(folder)
        caches = {"cold": scratch / "first", "ahead": scratch / "ahead", "warm": scratch / "first"}
        if "ahead" in options.only:
            command = words("doctor", "--compile", "--log-format", "plain")
            found["compiling_ahead"] = {**timed(command, caches["ahead"], options.core), **compiled(caches["ahead"])}
            print("compiling ahead", found["compiling_ahead"], flush=True)
        for name in options.only:
            trees = scratch / name / "work" / "trees.json"
            where = ["--workspace", trees.parent, "--output", scratch / name / "trees.gpkg", "--log-format", "quiet"]
            before = compiled(caches[name])["with_their_types"]
            found[name] = timed(words("photos-to-dbh", *photo_inputs(options.plot), *where), caches[name], options.core)
            held = compiled(caches[name])
            found[name]["compiled"], found[name]["cache"] = held["with_their_types"] - before, held
            layers[name] = hashlib.sha256(trees.read_bytes()).hexdigest()
            print(name, found[name], flush=True)
    found["same_trees"] = len(set(layers.values())) == 1
    write_record(options.output, found, [SEED])
    return 0


if __name__ == "__main__":
    sys.exit(main())
