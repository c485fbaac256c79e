"""One finished run of the photo chain, shared by the tests that look at it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from chain_runs import chain_arguments

from treedgs_geo.cli import main


@pytest.fixture(scope="session")
def finished(simulated_plot, tmp_path_factory) -> Path:
    """A finished run: work/ and trees.gpkg, in a folder with a space and an accent."""
    # What is compiled in a process of its own and what is loaded differ in the last bit: as after a set-up.
    subprocess.run([sys.executable, "-m", "treedgs_geo", "doctor", "--compile", "--log-format", "quiet"], check=True)
    folder = tmp_path_factory.mktemp("run") / "plot é 1"
    assert main(chain_arguments(simulated_plot, folder)) == 0
    return folder
