"""Which tests are slow, which need QGIS, and which failed most often: marks and order of a run.

``tests/slow_tests.txt`` lists the slow ones (written by ``tools/find_slow_tests.py`` from a run's own times); every
test in ``tests/qgis`` needs QGIS. How often a test has failed on this computer is kept in pytest's cache: those that
fail most often run first, so that ``make quick`` ends early when it is going to fail.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

SLOW_TESTS = Path(__file__).with_name("slow_tests.txt")
_KEPT = "treedgs/failures"
#: Fixtures that simulate, render or run a chain: what uses them is slow, whichever test comes first and pays.
SLOW_FIXTURES = {
    "tests/run": {"finished"},
    "tests/stems/photos/test_choice.py": {"fits"},
    "tests/stems/photos/test_level_photos.py": {"fits", "views"},
    "tests/stems/photos/test_odd_stems.py": {"fits"},
    "tests/stems/photos/test_shown.py": {"shown", "stack"},
    "tests/stems/photos/test_stems_from_photos.py": {"fits", "views"},
    "tests/inventory/test_stand_files.py": {"written"},
    "tests/reconstruction/test_canopy.py": {"seen", "views"},
    "tests/reconstruction/test_ground_alignment.py": {"flown"},
    "tests/lab/simulate/test_camera.py": {"flown", "scene"},
    "tests/lab/simulate/test_control.py": {"marked"},
    "tests/lab/simulate/test_grid.py": {"surveyed"},
    "tests/lab/simulate/test_simulate_plot.py": {"bare", "leafy"},
}


def plain_name(item_id: str) -> str:
    """A test's id without its parameters."""
    return item_id.partition("[")[0]


def slow_tests() -> set[str]:
    """Names in :data:`SLOW_TESTS`, without parameters."""
    lines = SLOW_TESTS.read_text(encoding="utf-8").splitlines()
    return {line.strip() for line in lines if line.strip() and not line.startswith("#")}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark, and put what failed most often first; otherwise the order stays."""
    slow = slow_tests()
    for item in items:
        costly = (names for place, names in SLOW_FIXTURES.items() if item.nodeid.startswith(place))
        if plain_name(item.nodeid) in slow or any(names & set(item.fixturenames) for names in costly):
            item.add_marker(pytest.mark.slow)
        if item.nodeid.startswith("tests/qgis/"):
            item.add_marker(pytest.mark.qgis)
    cache = getattr(config, "cache", None)  # gone with -p no:cacheprovider
    if cache is not None:
        counts = cache.get(_KEPT, {})
        items.sort(key=lambda item: -counts.get(plain_name(item.nodeid), 0))


class FailureCounter:
    """Adds this run's failures to those kept."""

    def __init__(self) -> None:
        self.failed: Counter[str] = Counter()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count a failure."""
        if report.failed:
            self.failed[plain_name(report.nodeid)] += 1

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Keep the counts."""
        if self.failed and getattr(session.config, "cache", None) is not None:
            counts = Counter(session.config.cache.get(_KEPT, {}))
            session.config.cache.set(_KEPT, dict((counts + self.failed).most_common(500)))
