"""Slow, plain float64 twins of the kernels, straight from the definitions. Tests compare the two; nothing else uses
them.

Where ``on_torch/project.py`` uses ray-space algebra, this module inverts 3D covariances: the two share no derivation.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from treedgs_geo.stems.splats.camera import CropCamera
from treedgs_geo.stems.splats.field import COLOUR, LOG_SCALE, LOGIT, MEAN, QUATERNION, quaternion_matrices
from treedgs_geo.stems.splats.kernels import ALPHA_MAX


def seen(parameters: np.ndarray, camera: CropCamera) -> SimpleNamespace:
    """What the kernels draw: colour (H, W, 3), alpha, depth, median_depth and normals, NaN where nothing is drawn."""
    from treedgs_geo.stems.splats.on_torch.rasterize import draw

    planes = draw(parameters, camera, full=True)
    alpha = 1 - planes[3]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(alpha > 0, planes[4] / alpha, np.nan)
        normals = np.moveaxis(planes[6:9], 0, -1)
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    median = np.where(planes[3] <= 0.5, planes[5], np.nan)
    colour = np.moveaxis(planes[:3], 0, -1)
    return SimpleNamespace(colour=colour, alpha=alpha, depth=depth, median_depth=median, normals=normals)


def camera_gaussians(parameters: np.ndarray, camera: CropCamera) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) centres and (N, 3, 3) covariances in camera axes."""
    axes = camera.rotation @ quaternion_matrices(parameters[:, QUATERNION]) * np.exp(parameters[:, None, LOG_SCALE])
    return parameters[:, MEAN] @ camera.rotation.T + camera.translation, axes @ axes.transpose(0, 2, 1)


def dilated(centre: np.ndarray, covariance: np.ndarray, camera: CropCamera, dilation: float) -> np.ndarray:
    """(3, 3) camera-axes covariance whose image is ``dilation`` px^2 wider at the same distance from the camera."""
    x, y, z = centre
    jac = np.array(
        [
            [camera.fx / z, 0, -camera.fx * x / z**2],
            [0, camera.fy / z, -camera.fy * y / z**2],
            centre / np.linalg.norm(centre),
        ]
    )
    back = np.linalg.inv(jac)
    return covariance + back @ np.diag([dilation, dilation, 0]) @ back.T


def render_reference(
    parameters: np.ndarray, camera: CropCamera, dilation: float = 0.0, alpha_min: float = 1 / 255
) -> dict[str, np.ndarray]:
    """Composite every Gaussian over every pixel: colour, alpha, sum of w d (plane), median depth, sum of w n."""
    parameters = np.asarray(parameters, float)
    centre, covariance = camera_gaussians(parameters, camera)
    h, w = camera.height, camera.width
    px = np.stack(np.meshgrid(np.arange(w) + 0.5, np.arange(h) + 0.5), axis=-1)
    out = {
        "colour": np.zeros((h, w, 3)),
        "trans": np.ones((h, w)),
        "depth_sum": np.zeros((h, w)),
        "median": np.full((h, w), np.nan),
        "normal_sum": np.zeros((h, w, 3)),
    }
    opacity = 1 / (1 + np.exp(-parameters[:, LOGIT]))
    for k in np.argsort(np.linalg.norm(centre, axis=1), kind="stable"):
        x, y, z = centre[k]
        if z <= 3 * np.sqrt(covariance[k, 2, 2]):
            continue
        jac = np.array([[camera.fx / z, 0, -camera.fx * x / z**2], [0, camera.fy / z, -camera.fy * y / z**2]])
        cov2 = jac @ covariance[k] @ jac.T
        wide = cov2 + dilation * np.eye(2)
        o = opacity[k] * (np.sqrt(max(np.linalg.det(cov2), 0) / np.linalg.det(wide)) if dilation else 1)
        offset = px - [camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy]
        raw = o * np.exp(-0.5 * np.einsum("hwi,ij,hwj->hw", offset, np.linalg.inv(wide), offset))
        alpha = np.where(raw >= alpha_min, np.minimum(raw, ALPHA_MAX), 0)
        distance, slope, normal = distance_plane(centre[k], dilated(centre[k], covariance[k], camera, dilation), camera)
        d = distance + offset @ slope
        weight = alpha * out["trans"]
        out["median"] = np.where((alpha > 0) & (out["trans"] > 0.5), d, out["median"])
        out["colour"] += weight[..., None] * parameters[k, COLOUR]
        out["depth_sum"] += weight * d
        out["normal_sum"] += weight[..., None] * normal
        out["trans"] *= 1 - alpha
    out["alpha"] = 1 - out["trans"]
    return out


def ray_maximum(centre: np.ndarray, covariance: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact distance t* at which a ray from the camera meets a Gaussian's maximum, and the Gaussian's value there.

    centre (3,), covariance (3, 3): camera axes. direction: (..., 3) unit.
    """
    precision = np.linalg.inv(covariance)
    along = direction @ precision @ centre
    norm = np.einsum("...i,ij,...j->...", direction, precision, direction)
    t = along / norm
    offset = t[..., None] * direction - centre
    return t, np.exp(-0.5 * np.einsum("...i,ij,...j->...", offset, precision, offset))


def distance_plane(
    centre: np.ndarray, covariance: np.ndarray, camera: CropCamera
) -> tuple[float, np.ndarray, np.ndarray]:
    """Distance, its slope per pixel (2,) by differentiating t* analytically, and the unit normal -P d, camera axes."""
    x, y, z = centre
    ray = centre / z
    length_ray = np.linalg.norm(ray)
    precision = np.linalg.inv(covariance)
    q = precision @ ray
    # z-depth of the maximum: (d P m)/(d P d); at the centre its derivative along e is -z (e P ray)/(ray P ray).
    slope_z = -z * q / (ray @ q)
    slope = np.array(
        [slope_z[0] * length_ray + z * ray[0] / length_ray, slope_z[1] * length_ray + z * ray[1] / length_ray]
    )
    return float(np.linalg.norm(centre)), slope / [camera.fx, camera.fy], -q / np.linalg.norm(q)


def point_opacity_reference(
    parameters: np.ndarray, camera: CropCamera, points: np.ndarray, alpha_min: float = 1 / 255
) -> tuple[np.ndarray, np.ndarray]:
    """Opacity in front of each point (M,), and the whole ray's accumulated alpha (M,), Gaussian by Gaussian.

    The ray-space covariance is built explicitly and inverted, as eq:radegs_point_offset reads.
    """
    parameters = np.asarray(parameters, float)
    centre, covariance = camera_gaussians(parameters, camera)
    local = np.asarray(points, float) @ camera.rotation.T + camera.translation
    uv = local[:, :2] / local[:, 2:] * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    r = np.linalg.norm(local, axis=1)
    before, whole = np.ones(len(local)), np.ones(len(local))
    opacity = 1 / (1 + np.exp(-parameters[:, LOGIT]))
    for k in range(len(centre)):
        x, y, z = centre[k]
        if z <= 3 * np.sqrt(covariance[k, 2, 2]):
            continue
        length = np.linalg.norm(centre[k])
        jac = np.array(
            [[camera.fx / z, 0, -camera.fx * x / z**2], [0, camera.fy / z, -camera.fy * y / z**2], centre[k] / length]
        )
        ray_precision = np.linalg.inv(jac @ covariance[k] @ jac.T)
        uk = np.array([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy])
        slope = distance_plane(centre[k], covariance[k], camera)[1]
        d = length + (uv - uk) @ slope

        def alpha_at(distance, uk=uk, length=length, k=k, ray_precision=ray_precision):
            delta = np.column_stack([uk - uv, length - distance])
            return opacity[k] * np.exp(-0.5 * np.einsum("mi,ij,mj->m", delta, ray_precision, delta))

        full = alpha_at(d)
        drawn = full >= alpha_min
        whole *= np.where(drawn, 1 - np.minimum(full, ALPHA_MAX), 1)
        alpha = alpha_at(np.minimum(r, d))
        before *= np.where(drawn & (alpha >= alpha_min), 1 - np.minimum(alpha, ALPHA_MAX), 1)
    return 1 - before, 1 - whole


def smoothed(parameters: np.ndarray, filter_m: float) -> np.ndarray:
    """(N, 14) after the 3D smoothing filter (Mip-Splatting, arXiv 2311.16493): every Gaussian convolved with an
    isotropic one of ``filter_m``, its opacity lowered so that opacity times volume stays."""
    out = parameters.copy()
    square = np.exp(2 * parameters[:, 7:10])
    out[:, 7:10] = 0.5 * np.log(square + filter_m**2)
    opacity = np.sqrt((square / (square + filter_m**2)).prod(axis=1)) / (1 + np.exp(-parameters[:, 10]))
    out[:, 10] = np.log(opacity / (1 - opacity))
    return out


def normal_consistency(planes: np.ndarray, rays: np.ndarray, weight: np.ndarray, least_alpha: float = 0.5) -> float:
    """Rendered normals against those of the expected-depth surface: weighted mean of 1 - cos.

    planes: (8, H, W) R, G, B, alpha, sum w d, sum w n. Pixels of less alpha and the border are left out.
    """
    alpha = planes[3]
    points = (planes[4] / np.maximum(alpha, 1e-3))[..., None] * rays
    surface = -np.cross(points[1:-1, 2:] - points[1:-1, :-2], points[2:, 1:-1] - points[:-2, 1:-1])
    normal = np.moveaxis(planes[5:8], 0, -1)[1:-1, 1:-1]
    solid = alpha >= least_alpha
    use = solid[1:-1, 1:-1] & solid[1:-1, 2:] & solid[1:-1, :-2] & solid[2:, 1:-1] & solid[:-2, 1:-1]
    sizes = np.linalg.norm(surface, axis=-1), np.linalg.norm(normal, axis=-1)
    use &= (sizes[0] > 1e-12) & (sizes[1] > 1e-6)
    cosine = np.einsum("hwc,hwc->hw", surface, normal)[use] / (sizes[0] * sizes[1])[use]
    return float((weight[1:-1, 1:-1][use] * (1 - cosine)).sum() / weight.sum())


def structural_dissimilarity(shown: np.ndarray, image: np.ndarray) -> np.ndarray:
    """(1 - SSIM) / 2 of each value of (H, W, 3) pictures: 11 x 11 Gaussian window of 1.5 pixels, zeros beyond."""

    def blur(picture: np.ndarray) -> np.ndarray:
        window = np.exp(-0.5 * (np.arange(-5, 6) / 1.5) ** 2)
        window /= window.sum()
        for axis in (0, 1):
            picture = np.apply_along_axis(np.convolve, axis, picture, window, "same")
        return picture

    mean_x, mean_y = blur(shown), blur(image)
    var_x, var_y = blur(shown**2) - mean_x**2, blur(image**2) - mean_y**2
    both = blur(shown * image) - mean_x * mean_y
    over = (2 * mean_x * mean_y + 0.01**2) * (2 * both + 0.03**2)
    return 0.5 * (1 - over / ((mean_x**2 + mean_y**2 + 0.01**2) * (var_x + var_y + 0.03**2)))
