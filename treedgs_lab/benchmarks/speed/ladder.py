"""The configurations that the speed-accuracy chart compares (standard library only)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

#: Reconstruction settings by name; several configurations share one reconstruction, whose seconds count for each.
SFM: dict[str, dict[str, Any]] = {
    "2000 features": {"max_features": 2000, "neighbours": 8},
    "4000 features": {"max_features": 4000, "neighbours": 12},
    "8000 features": {},
    "16000 features": {"max_features": 16000, "neighbours": 30},
    "half-size photos": {"max_image_size": 640},
}


@dataclass(frozen=True)
class Config:
    """One point of the chart.

    key: file name. title: on the chart. group: level of modelling (``docs/evidence/speed-accuracy.md``). kind:
    ``photos`` (stems fitted in the photos), ``published`` (the published method over the whole plot) or ``cloud``.
    sfm: key of :data:`SFM`. params: settings of the stage. scale: size of the photos that the stems are fitted in.
    preset: this is that preset of ``photos-to-dbh``, with all of its settings. quick: part of ``--quick``.
    """

    key: str
    title: str
    group: str
    kind: str = "photos"
    sfm: str = "8000 features"
    params: dict[str, Any] = field(default_factory=dict)
    scale: float = 1.0
    preset: str = ""
    quick: bool = False


PRESET_GROUP = "presets"
CONFIGS: tuple[Config, ...] = (
    Config("balanced", "balanced", PRESET_GROUP, preset="balanced", quick=True),
    Config("fast", "fast", PRESET_GROUP, sfm="4000 features", preset="fast", quick=True),
    Config("lidar", "LiDAR, our circles", "LiDAR", "cloud", sfm="", quick=True),
    Config(
        "lidar-cylinder",
        "LiDAR, cylinder (published)",
        "LiDAR",
        "cloud",
        sfm="",
        params={"method": "paper", "fit": "cylinder"},
        quick=True,
    ),
    Config("views-12", "12 photos", "photos used", params={"max_views": 12}, quick=True),
    Config("views-24", "24 photos", "photos used", params={"max_views": 24}, quick=True),
    Config("half", "photos at 1/2", "pixels used", params={"max_views": 96}, scale=0.5, quick=True),
    Config("sfm-2000", "2000 features", "reconstruction", sfm="2000 features", params={"max_views": 96}, quick=True),
    Config("best", "best", PRESET_GROUP, sfm="16000 features", preset="best", quick=True),
    Config("upright", "upright stems only", "stem model", params={"max_views": 96, "max_lean_deg": 0.0}),
    Config("coarse-grid", "search grid 10 cm", "stem model", params={"max_views": 96, "cell_m": 0.1}),
    Config("views-6", "6 photos", "photos used", params={"max_views": 6}),
    Config("views-48", "48 photos", "photos used", params={"max_views": 48}),
    Config("quarter", "photos at 1/4", "pixels used", params={"max_views": 96}, scale=0.25),
    Config("sfm-half", "half-size photos", "reconstruction", sfm="half-size photos", params={"max_views": 96}),
    Config("sfm-4000", "4000 features", "reconstruction", sfm="4000 features", params={"max_views": 96}),
    Config("sfm-16000", "16000 features", "reconstruction", sfm="16000 features", params={"max_views": 96}),
    Config(
        "paper",
        "paper (whole plot, 60 CPU minutes)",
        PRESET_GROUP,
        "published",
        params={"time_limit_min": 60.0},
        preset="paper",
    ),
)
