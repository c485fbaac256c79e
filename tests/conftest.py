"""Shared fixtures. No path games: the library is installed in the environment (``make setup``)."""

from __future__ import annotations

import contextlib
import hashlib
import shutil
import tempfile
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from order import FailureCounter, pytest_collection_modifyitems  # noqa: F401 - pytest finds the hook here

# Machines are noisy: no test may fail because it was slow.
settings.register_profile("noisy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("noisy")

ROOT = Path(__file__).resolve().parents[1]


def pytest_configure(config: pytest.Config) -> None:
    """How often tests fail is counted."""
    config.pluginmanager.register(FailureCounter())


@pytest.fixture(scope="session")
def simulated_plot(pytestconfig: pytest.Config) -> Path:
    """A small simulated plot (preset ``test``): images/, PPK files, lidar/, truth/. Read-only for the tests.

    Rendered once and kept in pytest's cache until the simulator changes.
    """
    from treedgs_lab.simulate.settings import SimulateSettings
    from treedgs_lab.simulate.simulate import simulate_plot

    source = hashlib.sha256()
    for part in sorted((ROOT / "treedgs_lab" / "simulate").glob("*.py")):
        source.update(part.read_bytes())
    cache = Path(pytestconfig.cache.mkdir("plots"))
    folder = cache / f"test-{source.hexdigest()[:12]}"
    if not folder.exists():
        for old in cache.iterdir():  # of an earlier simulator; not one that another run may be rendering or reading
            if time.time() - old.stat().st_mtime > 86400:
                shutil.rmtree(old, ignore_errors=True)
        fresh = Path(tempfile.mkdtemp(prefix="rendering-", dir=cache))
        simulate_plot(SimulateSettings(output=fresh / "plot", preset="test", name="test"))
        with contextlib.suppress(OSError):  # another run was quicker
            (fresh / "plot").rename(folder)
        shutil.rmtree(fresh)
    return folder
