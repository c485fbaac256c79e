"""Fixtures of the campaign tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from small_campaign import Ended, make_cloud, start


@pytest.fixture(scope="session")
def clouds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with cloud_0.laz … cloud_5.laz, side by side without overlap. Read-only for the tests."""
    folder = tmp_path_factory.mktemp("clouds")
    for number in range(6):
        make_cloud(folder / f"cloud_{number}.laz", number, 500_000.0 + 20 * number)
    return folder


@pytest.fixture
def campaign() -> Callable[..., Ended]:
    """Run ``treedgs campaign`` to its end."""
    return lambda manifest, workspace, *more, **run: Ended(start(manifest, workspace, *more, **run))
