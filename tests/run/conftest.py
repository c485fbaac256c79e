"""One finished run of the photo chain, shared by the tests that look at it."""

from __future__ import annotations

from pathlib import Path

import pytest
from chain_runs import chain_arguments

from treedgs_geo.cli import main


@pytest.fixture(scope="session")
def finished(simulated_plot, tmp_path_factory) -> Path:
    """A finished run: work/ and trees.gpkg, in a folder with a space and an accent."""
    folder = tmp_path_factory.mktemp("run") / "plot é 1"
    assert main(chain_arguments(simulated_plot, folder)) == 0
    return folder
