"""TreeDGS's verbs as processes of their own, on plots as ``simulate-plot`` writes them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from treedgs_lab.benchmarking.whole_chain import chain_inputs

#: Of all rendered and simulated plots: NAD83(2011) / UTM 15N.
CRS = "EPSG:6344"


def words(verb: str, *options: Any) -> list[str]:
    """The command of a verb; options as one types them, paths and numbers too."""
    return [sys.executable, "-m", "treedgs_geo", verb, *map(str, options)]


def photo_inputs(plot: Path) -> list[Any]:
    """``--photos`` … of a plot's folder (:func:`treedgs_lab.benchmarking.whole_chain.chain_inputs`)."""
    return chain_inputs(plot, CRS)


def run_verb(verb: str, *options: Any, **how: Any) -> None:
    """Run a verb to its end; ``how`` goes to :func:`subprocess.run`.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    subprocess.run(words(verb, *options), check=True, **how)


def environment(code: Path) -> dict[str, str]:
    """In which a process imports TreeDGS from ``code`` and nowhere else.

    Raises:
        SystemExit: it does not.
    """
    env = {**os.environ, "PYTHONPATH": str(code)}
    where = subprocess.run(
        [sys.executable, "-c", "import treedgs_geo; print(treedgs_geo.__file__)"],
        cwd=code,
        env=env,
        capture_output=True,
        text=True,
    ).stdout.strip()
    if not where or not Path(where).is_relative_to(code):
        raise SystemExit(f"{code}: holds no treedgs_geo that can be imported (found: {where or 'none'})")
    return env
