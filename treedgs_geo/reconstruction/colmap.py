"""Between our block and COLMAP's model."""

from __future__ import annotations

import numpy as np

from .cameras import Camera
from .tracks import Block


def camera_to_colmap(camera: Camera, number: int = 1):
    """Our camera as a pycolmap camera with the id ``number``: ``OPENCV``, or ``FULL_OPENCV`` where it has a k3."""
    import pycolmap

    more = [camera.k3, 0.0, 0.0, 0.0] if camera.k3 else []
    return pycolmap.Camera(
        model="FULL_OPENCV" if more else "OPENCV",
        width=camera.width,
        height=camera.height,
        camera_id=number,
        has_prior_focal_length=True,
        params=[camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion[:4], *more],
    )


def camera_from_colmap(camera) -> Camera:
    """A pycolmap camera (pinhole or Brown models) as ours.

    Raises:
        ValueError: a model that has more than k1, k2, p1, p2, k3.
    """
    size, p = (camera.width, camera.height), list(camera.params)
    name = camera.model_name
    if name == "OPENCV":
        return Camera(*size, *p)
    if name == "FULL_OPENCV" and not any(p[9:]):
        return Camera(*size, *p[:9])
    if name == "PINHOLE":
        return Camera(*size, *p)
    if name == "SIMPLE_PINHOLE":
        return Camera(*size, p[0], p[0], p[1], p[2])
    if name in ("SIMPLE_RADIAL", "RADIAL"):
        return Camera(*size, p[0], p[0], p[1], p[2], *p[3:])
    raise ValueError(f"camera model {name} is not supported, use OPENCV")


def to_colmap(block: Block, names: list[str], colours: np.ndarray):
    """The block as a pycolmap reconstruction: image ids 1..N in the order of ``names``, posed photos and observed
    points only, with their colours (P, 3) uint8; one camera a flight. Poses are those of the middle row, and pixels are
    where a sensor exposed at once would have seen the points.
    """
    import pycolmap

    model = pycolmap.Reconstruction()
    sensor = block.sensor
    for flight in np.unique(sensor.flight[block.is_posed]):
        own = int(np.flatnonzero(sensor.flight == flight)[0])
        model.add_camera_with_trivial_rig(camera_to_colmap(sensor.camera_of(own), int(flight) + 1))
    order = np.argsort(block.image, kind="stable")
    starts = np.searchsorted(block.image[order], np.arange(len(names) + 1))
    place = np.empty(len(order), np.int64)
    observed = block.observed() + block.standing_still()
    for i in np.flatnonzero(block.is_posed):
        rows = order[starts[i] : starts[i + 1]]
        place[rows] = np.arange(len(rows))
        image = pycolmap.Image(
            name=names[i],
            keypoints=observed[rows].reshape(-1, 2),
            camera_id=int(sensor.flight[i]) + 1,
            image_id=int(i) + 1,
        )
        pose = pycolmap.Rigid3d(np.column_stack([block.rotations[i], block.translations[i]]))
        model.add_image_with_trivial_frame(image, pose)
    by_point = np.argsort(block.point, kind="stable")
    bounds = np.searchsorted(block.point[by_point], np.arange(len(block.points) + 1))
    for p, xyz in enumerate(block.points):
        track = pycolmap.Track()
        for row in by_point[bounds[p] : bounds[p + 1]]:
            track.add_element(int(block.image[row]) + 1, int(place[row]))
        model.add_point3D_with_id(p + 1, pycolmap.Point3D(xyz=xyz, track=track, color=colours[p]))
    return model
