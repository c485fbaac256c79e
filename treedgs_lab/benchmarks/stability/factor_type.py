"""What a factor of the stability suite is, and the plots that factors start from (standard library only)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

#: The plot that every factor starts from: small, stems well seen. Levels change one thing about it.
BASE: dict[str, Any] = {
    "preset": "micro",
    "stems_per_ha": 1100.0,
    "leaf_area_m2": 12.0,
    "float_epochs": 0,
    "shrubs_per_m2": 0.10,
    "lean_max_deg": 3.0,
}
#: What a method reads.
PHOTOS, CLOUD = "photos", "cloud"


@dataclass(frozen=True)
class Factor:
    """key: short name. title, unit: for the axis. levels: values, harmless first. render: the settings of
    ``simulate-plot`` at a level (the plot is then rendered anew). perturb: name of what is done to the base plot
    instead (:mod:`.perturb`). inputs: which methods it concerns. about: one sentence for the page. labels: words for
    levels that are no number of the unit."""

    key: str
    title: str
    unit: str
    levels: tuple[float, ...]
    about: str
    render: dict[float, dict[str, Any]] = field(default_factory=dict)
    perturb: str = ""
    inputs: tuple[str, ...] = (PHOTOS, CLOUD)
    labels: dict[float, str] = field(default_factory=dict)

    def label(self, level: float) -> str:
        """A level as charts show it."""
        return self.labels.get(level, f"{level:g}")

    def label_with_unit(self, level: float) -> str:
        """A level as tables show it."""
        return self.labels.get(level, f"{level:g} {self.unit}")


def each(name: str, levels: tuple[float, ...], **also: Any) -> dict[float, dict[str, Any]]:
    """``render`` of a factor whose levels are values of one setting; ``also``: more settings of every level."""
    return {level: {name: level, **also} for level in levels}


def rendered(
    key: str,
    title: str,
    unit: str,
    about: str,
    render: dict[float, dict[str, Any]],
    inputs: tuple[str, ...] = (PHOTOS, CLOUD),
    labels: dict[float, str] | None = None,
) -> Factor:
    """A factor of plots that are rendered anew."""
    return Factor(key, title, unit, tuple(render), about, render, "", inputs, labels or {})


def perturbed(key: str, title: str, unit: str, about: str, levels: tuple[float, ...], *inputs: str) -> Factor:
    """A factor that spoils what was made of the base plot."""
    return Factor(key, title, unit, levels, about, {}, key, inputs)
