"""What a run of the photo chain carries from stage to stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.crs import LocalFrame
from ..core.plots import Plot
from ..core.workspace import Workspace
from ..geotags.stations import Stations
from ..reconstruction.area import Area
from ..reconstruction.cameras import View
from ..terrain.dtm import Dtm
from .stages import Steps

if TYPE_CHECKING:
    from .routes import Preset
    from .settings import PhotosToDbhSettings


@dataclass(frozen=True)
class Run:
    """What was asked for, how much of the scene that models, where it is kept and which stages are done."""

    settings: PhotosToDbhSettings
    preset: Preset
    space: Workspace
    steps: Steps

    def path(self, name: str) -> Path:
        """A file of the workspace (:mod:`treedgs_geo.core.workspace` has the names)."""
        return self.space.path(name)


@dataclass(frozen=True)
class Flight:
    """What is known before anything is matched: photos with their positions, and the plots (none: all that is seen)."""

    stations: Stations
    plots: list[Plot]


@dataclass(frozen=True)
class Aligned:
    """Registered photos. frame: the local frame that views and points are in. points: (N, 3) sparse points, metres.
    report: of the reconstruction."""

    frame: LocalFrame
    views: list[View]
    points: np.ndarray
    report: dict[str, Any]


@dataclass(frozen=True)
class Site:
    """Where stems are looked for: photos, the frame that they and the area are in, and the ground (project
    coordinates)."""

    frame: LocalFrame
    views: list[View]
    dtm: Dtm
    area: Area

    @property
    def ground(self) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """Local x, y (N,) -> local height of the ground, NaN where unknown."""
        return self.dtm.local(self.frame).height
