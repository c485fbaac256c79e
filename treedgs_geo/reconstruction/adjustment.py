"""Bundle adjustment with the geotags as priors (pycolmap / Ceres)."""

from __future__ import annotations

import numpy as np

from ..core.errors import ReconstructionError
from .cameras import Camera
from .tracks import Block


def camera_to_colmap(camera: Camera):
    """Our camera as a pycolmap camera with id 1: ``OPENCV``, or ``FULL_OPENCV`` where it has a k3."""
    import pycolmap

    more = [camera.k3, 0.0, 0.0, 0.0] if camera.k3 else []
    return pycolmap.Camera(
        model="FULL_OPENCV" if more else "OPENCV",
        width=camera.width,
        height=camera.height,
        camera_id=1,
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


def to_colmap(block: Block, names: list[str], colours: np.ndarray | None = None):
    """The block as a pycolmap reconstruction: image ids 1..N in the order of ``names``, posed photos and observed
    points only.
    """
    import pycolmap

    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(camera_to_colmap(block.camera))
    order = np.argsort(block.image, kind="stable")
    starts = np.searchsorted(block.image[order], np.arange(len(names) + 1))
    place = np.empty(len(order), np.int64)
    observed = block.observed()
    for i in np.flatnonzero(block.is_posed):
        rows = order[starts[i] : starts[i + 1]]
        place[rows] = np.arange(len(rows))
        image = pycolmap.Image(name=names[i], keypoints=observed[rows].reshape(-1, 2), camera_id=1, image_id=int(i) + 1)
        pose = pycolmap.Rigid3d(np.column_stack([block.rotations[i], block.translations[i]]))
        model.add_image_with_trivial_frame(image, pose)
    by_point = np.argsort(block.point, kind="stable")
    bounds = np.searchsorted(block.point[by_point], np.arange(len(block.points) + 1))
    grey = np.full(3, 128, np.uint8)
    for p, xyz in enumerate(block.points):
        track = pycolmap.Track()
        for row in by_point[bounds[p] : bounds[p + 1]]:
            track.add_element(int(block.image[row]) + 1, int(place[row]))
        model.add_point3D_with_id(
            p + 1, pycolmap.Point3D(xyz=xyz, track=track, color=grey if colours is None else colours[p])
        )
    return model


def adjust(
    block: Block,
    prior_xyz: np.ndarray,
    prior_sd: np.ndarray,
    *,
    free_focal: bool,
    free_principal_point: bool,
    free_distortion: bool,
    loss_px: float = 1.0,
    prior_factor: float = 6.0,
    iterations: int = 60,
    min_observations: int = 6,
) -> float:
    """Bundle-adjust the block in place; returns the RMS reprojection error in pixels.

    SOFT_L1 on the image, CAUCHY on the geotags (a wrong one must not bend the block). The geotag standard deviations
    are taken
    ``prior_factor`` times larger than stated: image residuals are weighted as if 1 px, the true ones are smaller
    (``docs/analyst/reconstruction.md``).

    Args:
        prior_xyz: (N, 3) local metres, NaN = none. prior_sd: (N, 3) metres.

    Raises:
        ReconstructionError: no point is left that two photos see alike.
    """
    import pycolmap

    if not len(block.points) or not np.isfinite(loss_px):
        raise ReconstructionError(
            f"No point is left that two of the {int(block.is_posed.sum())} placed photos see alike; they overlap too "
            "little, show too little texture or have wrong geotags: use preset balanced, or fly with 80 % overlap."
        )
    names = [str(i) for i in range(len(block.keypoints))]
    model = to_colmap(block, names)
    config = pycolmap.BundleAdjustmentConfig()
    counts = np.bincount(block.image, minlength=len(names))
    priors = []
    for i in np.flatnonzero(block.is_posed):
        config.add_image(int(i) + 1)
        if counts[i] < min_observations:
            config.set_constant_rig_from_world_pose(model.image(int(i) + 1).frame_id)
        if np.isfinite(prior_xyz[i]).all():
            prior = pycolmap.PosePrior()
            prior.corr_data_id = model.image(int(i) + 1).data_id
            prior.position = prior_xyz[i]
            prior.position_covariance = np.diag((prior_factor * prior_sd[i]) ** 2)
            prior.coordinate_system = pycolmap.PosePriorCoordinateSystem.CARTESIAN
            priors.append(prior)
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_focal_length = free_focal
    options.refine_principal_point = free_principal_point
    options.refine_extra_params = free_distortion
    options.print_summary = False
    options.ceres.loss_function_type = pycolmap.LossFunctionType.SOFT_L1
    options.ceres.loss_function_scale = loss_px
    options.ceres.use_gpu = False
    options.ceres.solver_options.max_num_iterations = iterations
    # One thread: several add up in another order each time, and a point at a limit then stays in one run and not in
    # the next (cameras a centimetre apart). It costs some seconds a plot.
    options.ceres.solver_options.num_threads = 1
    options.ceres.solver_options.function_tolerance = 1e-7
    prior_options = pycolmap.PosePriorBundleAdjustmentOptions()
    prior_options.alignment_ransac.max_error = 1.0
    prior_options.ceres.prior_position_loss_function_type = pycolmap.LossFunctionType.CAUCHY
    if not (free_focal or free_principal_point or free_distortion):
        config.set_constant_cam_intrinsics(1)
    pycolmap.create_pose_prior_bundle_adjuster(options, prior_options, config, priors, model).solve()
    block.camera = camera_from_colmap(model.camera(1))
    for i in np.flatnonzero(block.is_posed):
        pose = model.image(int(i) + 1).cam_from_world().matrix()
        block.rotations[i], block.translations[i] = pose[:, :3], pose[:, 3]
    block.points = np.array([model.point3D(p + 1).xyz for p in range(len(block.points))]).reshape(-1, 3)
    error = block.residuals()
    return float(np.sqrt(np.nanmean(np.sum(error**2, axis=1)))) if len(error) else float("nan")


def prune(block: Block, limit_px: float, min_angle_deg: float = 1.5) -> None:
    """Drop observations beyond ``limit_px`` and points whose rays meet under too small an angle."""
    from .tracks import widest_angle_deg

    error = np.linalg.norm(block.residuals(), axis=1)
    block.keep(np.isfinite(error) & (error <= limit_px))
    if len(block.point):
        block.keep(widest_angle_deg(block)[block.point] >= min_angle_deg)
