"""A tree's own frame in a cloud, and what stands around its stem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....pointcloud.cloud import PointCloud
from ....terrain.dtm import Dtm
from ..propose.nearby import Nearby


@dataclass(frozen=True)
class TreeFrame:
    """A tree's own frame: xy from ``origin``, heights above the ground at its foot."""

    origin: np.ndarray
    ground: float
    points: np.ndarray

    @classmethod
    def of(cls, cloud: PointCloud, group: np.ndarray, dtm: Dtm) -> TreeFrame:
        """Of the points of one tree: ``group``, (M,) indices."""
        xyz = cloud.xyz[group]
        low = xyz[:, 2] <= np.percentile(xyz[:, 2], 30)
        foot = np.median(xyz[low, :2], axis=0)
        origin = np.floor(foot)
        ground = float(dtm.height(foot[0], foot[1]))
        return cls(origin, ground, np.column_stack([xyz[:, :2] - origin, xyz[:, 2] - ground]))


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
        with np.errstate(invalid="ignore"):
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
