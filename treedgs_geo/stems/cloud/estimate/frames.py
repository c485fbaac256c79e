"""A tree's own frame in a cloud, and what stands around its stem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....pointcloud.cloud import PointCloud
from ....terrain.dtm import Dtm
from ...geometry.cone import Cone
from ...quality.priors import BREAST_HEIGHT_M
from ..propose.nearby import Nearby


@dataclass(frozen=True)
class TreeFrame:
    """A tree's own frame: xy from ``origin``, heights above the ground on the uphill side of its foot, from which
    breast height is measured. start: the cone of a search in this frame, if there was one."""

    origin: np.ndarray
    ground: float
    points: np.ndarray
    start: Cone | None = None

    @classmethod
    def of(
        cls, cloud: PointCloud, group: np.ndarray, dtm: Dtm, found: tuple[Cone, np.ndarray] | None = None
    ) -> TreeFrame:
        """Of the points of one tree: ``group``, (M,) indices. found: the cone that a search fitted to them, heights
        above the ground under each point, and (2,) where its xy count from."""
        xyz = cloud.xyz[group]
        low = xyz[xyz[:, 2] <= np.percentile(xyz[:, 2], 30), :2]
        foot = np.median(low, axis=0)
        radius = float(np.median(np.hypot(*(low - foot).T)))
        if found is not None:
            cone, corner = found
            radius = float(cone.radius(BREAST_HEIGHT_M))
            if dtm.covers(cone.centre(0.0) + corner)[0]:
                foot = cone.centre(0.0) + corner
        origin = np.floor(foot)
        ground = dtm.uphill(foot, radius)
        points = np.column_stack([xyz[:, :2] - origin, xyz[:, 2] - ground])
        if found is None:
            return cls(origin, ground, points)
        # The ground under a leaning axis rises or falls with it: its lean is that between two of its places.
        height = np.array([1.0, 2.0])
        at = cone.centre(height) + corner
        z = height + np.where(dtm.covers(at), dtm.height(*at.T) - ground, 0.0)
        (x, y), (dx, dy) = at[0] - origin, (at[1] - at[0]) / max(z[1] - z[0], 0.5)
        start = Cone(float(x), float(y), float(dx), float(dy), float(cone.radius(1.0)), cone.taper, z[0], cone.sigma)
        return cls(origin, ground, points, start)


@dataclass(frozen=True)
class Surroundings:
    """The points of the stem band that belong to no stem: twigs and shrubs that crowd the bark. index: (M,) of theirs
    in the cloud."""

    tree: Nearby
    index: np.ndarray
    has_crowns: bool

    @classmethod
    def of(cls, cloud: PointCloud, tree_id: np.ndarray, height: np.ndarray) -> Surroundings:
        """Of the points that are no stem's."""
        free = tree_id <= 0
        count = int(np.count_nonzero(free))
        crowns = count > 0 and bool(np.count_nonzero(free & (height > 8.0)) / count > 0.05)
        index = np.flatnonzero(free & (height > 0.2) & (height < 5.0))
        return cls(Nearby(cloud.xyz[index]), index, crowns)

    def near(self, frame: TreeFrame) -> tuple[np.ndarray, np.ndarray]:
        """(M, 3) in the tree's frame, within 25 cm of its points' extent, and (M,) their indices in the cloud."""
        band = (frame.points[:, 2] > 0.2) & (frame.points[:, 2] < 5.0)
        xy = frame.points[band, :2] if band.any() else frame.points[:, :2]
        middle, reach = np.median(xy, axis=0), np.percentile(np.hypot(*(xy - np.median(xy, axis=0)).T), 98)
        found = self.tree.within(middle + frame.origin, min(float(reach), 1.5) + 0.25)
        return self.tree.points[found] - [*frame.origin, frame.ground], self.index[found]
