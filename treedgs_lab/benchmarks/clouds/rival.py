"""What the scripts that run another program share; standard library and numpy, for each runs in its own environment."""

import argparse
import importlib.metadata
import json
import re
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np


def peak_gb() -> float:
    """The largest memory of this process, without what the one that started it held. Linux."""
    found = re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())
    return int(found[1]) / 1e6 if found else float("nan")


def run(
    text: str,
    package: str,
    measure: Callable[[np.ndarray, argparse.Namespace], list[dict]],
    **options: dict,
) -> None:
    """CLOUD.npy ((N, 3) metres, local origin) measured and OUT.json written: version, seconds on the clock and of the
    processor, peak of memory, trees (x, y, dbh_cm), and why there are none where the program gave up.

    text: the script's. package: whose version is noted. options: of ``add_argument``, by name.
    """
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("cloud", "out"):
        parser.add_argument(name)
    for name, how in options.items():
        parser.add_argument(f"--{name.replace('_', '-')}", **how)
    args = parser.parse_args()
    xyz = np.load(args.cloud).astype(float)
    trees, note, began, cpu = [], "", time.perf_counter(), time.process_time()
    try:
        trees = measure(xyz, args)
    except Exception as problem:  # a cloud on which it gives up counts as no tree
        note = f"{type(problem).__name__}: {problem}"[:200]
    record = {
        "version": importlib.metadata.version(package),
        "seconds": time.perf_counter() - began,
        "cpu_seconds": time.process_time() - cpu,
        "peak_gb": peak_gb(),
        "trees": trees,
        "note": note,
    }
    Path(args.out).write_text(json.dumps(record), encoding="utf-8")
