"""How far the fit of a whole scene came."""

from __future__ import annotations

from dataclasses import dataclass

from ..options import PUBLISHED_STEPS, SceneOptions

#: Share of the Gaussians at the start below which those that are left are a warning: a fit makes more of them.
FEW_LEFT = 0.5


@dataclass(frozen=True)
class SceneReport:
    """What a fit did. factor: size of the photos. steps_planned: foreseen; steps: done. tried: steps that the
    controller took back. full: no more were allowed. ended: ``schedule`` or ``time limit``. loss: of the first and the
    last tenth of the steps."""

    photos: int
    factor: float
    megapixels: float
    steps_planned: int
    steps: int
    tried: int
    gaussians_first: int
    gaussians: int
    full: bool
    counts: dict[str, int]
    phases_tried: int
    cpu_s: float
    ended: str
    loss: tuple[float, float]

    def sentence(self) -> str:
        """How far it came, in words."""
        size = "" if self.factor == 1 else f" at {self.factor:g} times their size"
        return (
            f"{self.photos} photos{size}, {self.steps:,} of the published {PUBLISHED_STEPS:,} steps ({self.ended}), "
            f"{self.gaussians_first:,} Gaussians grown to {self.gaussians:,}, {self.cpu_s / 60:.1f} minutes."
        )

    def warnings(self, options: SceneOptions) -> list[str]:
        """A sentence each where the fit was cut short, lost most of the scene, or was not allowed more Gaussians."""
        said = []
        if self.steps < PUBLISHED_STEPS or self.factor < 1:
            limit = (
                "" if options.time_limit_min is None else f" by the time limit of {options.time_limit_min:g} minutes"
            )
            said.append(
                f"The published fit was cut short{limit}: {self.sentence()} Diameters may be better with a longer "
                "--time-limit."
            )
        if self.gaussians < FEW_LEFT * self.gaussians_first:
            said.append(
                f"Pruning left {self.gaussians:,} of the {self.gaussians_first:,} Gaussians that the published fit "
                "began with, too few to show stems; give a longer --time-limit, or a smaller plot."
            )
        if self.full:
            said.append(
                f"Densification stopped at {options.max_gaussians:,} Gaussians, the most that this run keeps in hand; "
                "the published method has no such limit."
            )
        return said
