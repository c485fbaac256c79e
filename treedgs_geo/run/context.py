"""What a run of the photo chain carries from stage to stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..core.crs import LocalFrame
from ..core.plots import Plot
from ..core.progress import Collector, Reporter
from ..core.workspace import Workspace
from ..geotags.control import ControlPoints
from ..geotags.stations import Stations
from ..reconstruction.area import Area, area_seen
from ..reconstruction.cameras import View
from ..stems.quality.tree import Tree
from ..terrain.dtm import Dtm
from .forecast import PlannedSearch
from .settings import PhotosToDbhSettings, Preset
from .stage import Steps


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


def area_of(frame: LocalFrame, views: list[View], points: np.ndarray, plots: list[Plot]) -> Area:
    """Where stems are looked for, local: the plots, or without any what enough oblique photos see (no circle where
    nothing is). points: (N, 3) sparse points, local."""
    if plots:
        centres = frame.to_local(np.array([[p.x, p.y, frame.origin[2]] for p in plots]))[:, :2]
        return Area.circles(centres, np.array([p.radius_m for p in plots]))
    return area_seen(views, float(np.percentile(points[:, 2], 20)) if len(points) else 0.0)


@dataclass
class PhotoJob:
    """A photo run. What was asked for; then what its stages found, in their order.

    preset: how much of the scene is modelled. steps: what is done; space: where it is kept (in a dry run nowhere).
    photos: the files; files: by the name that the workspace knows them by. stations: photos with their positions;
    read_ahead: the same, read before there was a workspace, and what was said of them then.
    plots: none = all that is seen. given: the user's terrain model. nothing: why no stem can be measured, empty
    where one may. planned: cameras by geotags and gimbal, about the middle of the flight; search: for stems, by these.
    aligned, site: ``None`` where nothing was matched. trees: project coordinates. planned_said: sentences that compare
    them with the flight plan.
    """

    settings: PhotosToDbhSettings
    preset: Preset
    reporter: Reporter
    steps: Steps
    space: Workspace = field(init=False)
    photos: list[Path] = field(default_factory=list)
    files: dict[str, Path] = field(default_factory=dict)
    stations: Stations = field(init=False)
    read_ahead: tuple[Stations, Collector] | None = None
    control: ControlPoints | None = None
    plots: list[Plot] = field(default_factory=list)
    given: Dtm | None = None
    nothing: str = ""
    planned: list[View] = field(default_factory=list)
    search: PlannedSearch | None = None
    aligned: Aligned | None = None
    area: Area | None = None
    site: Site | None = None
    trees: list[Tree] = field(default_factory=list)
    planned_said: list[str] = field(default_factory=list)

    def path(self, name: str) -> Path:
        """A file of the workspace (:mod:`treedgs_geo.core.workspace` has the names)."""
        return self.settings.workspace / name

    @property
    def run_id(self) -> str:
        """Names what measured the trees: the same inputs and settings give the same id."""
        ids = self.steps.run_ids
        return ids.get("measure", ids["geotag"])

    @property
    def block(self) -> Aligned:
        """The registered photos, which have to be there."""
        assert self.aligned is not None
        return self.aligned

    @property
    def place(self) -> Site:
        """Where stems are looked for, which has to be known."""
        assert self.site is not None
        return self.site
