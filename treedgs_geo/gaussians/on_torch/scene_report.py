"""How far the fit of a whole scene came."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ..options import PUBLISHED_STEPS


@dataclass(frozen=True)
class SceneReport:
    """What a fit did. factor: size of the photos. steps_planned: by the time limit; steps: done. tried: steps that the
    controller took back. full: no more were allowed. wide_px: radius in the nearest photo from which Gaussians were
    pruned. ended: ``schedule`` or ``time limit``. loss: of the first and the last tenth of the steps."""

    photos: int
    factor: float
    megapixels: float
    steps_planned: int
    steps: int
    tried: int
    gaussians_first: int
    gaussians: int
    full: bool
    wide_px: float
    counts: dict[str, int]
    controller: str
    phases_tried: int
    cpu_s: float
    ended: str
    loss: tuple[float, float]

    def as_dict(self) -> dict[str, Any]:
        """For ``run.json``."""
        return asdict(self)

    def sentence(self) -> str:
        """How far it came, in words."""
        size = "" if self.factor == 1 else f" at {self.factor:g} times their size"
        return (
            f"{self.photos} photos{size}, {self.steps:,} of the published {PUBLISHED_STEPS:,} steps ({self.ended}), "
            f"{self.gaussians_first:,} Gaussians grown to {self.gaussians:,}, {self.cpu_s / 60:.1f} minutes."
        )
