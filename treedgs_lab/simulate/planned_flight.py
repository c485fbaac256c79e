"""The photos of a flight plan (``plan.gpkg`` of plan-flight)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from treedgs_geo.core.layer_files import read_layer
from treedgs_geo.planning.flown import PHOTOS, PLOTS


@dataclass(frozen=True)
class PlannedFlight:
    """shots: photos about the middle of the plots, heights over the ground below. centres: (n, 2) of the plots;
    radius_m: of the largest. width_px, height_px, focal_px: of the camera it is planned for."""

    photos: np.ndarray
    centres: np.ndarray
    radius_m: float
    width_px: int
    height_px: int
    focal_px: float


def read_flight(path: Path) -> PlannedFlight:
    """The photos of a plan.

    Raises:
        InputError: not a flight plan.
    """
    wanted = ("leg", "yaw_deg", "pitch_deg", "above_m", "width_px", "height_px", "focal_px")
    photos = read_layer(path, PHOTOS, wanted, "plan-flight")
    plots = read_layer(path, PLOTS, {"plot_id", "radius_m"}, "plan-flight")
    centres = np.array([[shape.centroid.x, shape.centroid.y] for shape in plots.geometry])
    middle = centres.mean(axis=0)
    place = np.array([[shape.x, shape.y] for shape in photos.geometry]) - middle
    angles = photos[["above_m", "yaw_deg", "pitch_deg"]].to_numpy(float)
    first = photos.iloc[0]
    return PlannedFlight(
        np.column_stack([place, angles]), centres - middle, float(plots["radius_m"].max()), int(first["width_px"]),
        int(first["height_px"]),
        float(first["focal_px"]),
    )  # fmt: skip
