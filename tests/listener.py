"""A reporter that keeps its warnings."""

from __future__ import annotations

from treedgs_geo.core.progress import Reporter


class Listener(Reporter):
    """Keeps warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)
