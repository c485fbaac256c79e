"""From 3D Gaussians to what a pixel needs.

Everything follows from one 3 x 3 matrix. Let (u, v, r) be the pixel coordinates and the distance from the camera
centre; J its Jacobian at the Gaussian's centre and V = J W R_q diag(s) (W = world -> camera). Then V V^T is the
covariance in ray space; its upper 2 x 2 block (plus an optional dilation) is the image ellipse (EWA splatting, Zwicker
et al. 2001), and the conditional mean of r given (u, v),

    d(u) = r_k + slope . (u - u_k),     slope = cov_2d^-1 cov(uv, r),

is the ray-distance plane of eq:radegs_depth_plane (g = -slope): to first order the distance at which the ray meets the
Gaussian's maximum. No inverse of the 3D covariance is needed, so flat and needle-like Gaussians need no special
branch. The conditional standard deviation sigma_ray = sqrt(var(r) - slope . cov(uv, r)) is the depth falloff of the
point query (``sample.py``): Delta^T Sigma^-1 Delta of eq:radegs_point_offset equals conic(u) + ((r - d(u)) /
sigma_ray)^2 exactly. The surface normal is the gradient of r - d(u) in camera axes, pointing at the camera.

Kernels are scalar per Gaussian, float64 inside. ``on_torch/project.py`` is the twin that gradients go through,
``tests/gaussian_reference.py`` the one in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

#: Rows of the projected matrix. U, V pixel centre; A, B, C conic; OPACITY after dilation; RANGE distance; SX, SY
#: plane slopes; NX..NZ normal in camera axes; ISR 1/sigma_ray^2; CUT largest squared Mahalanobis distance drawn;
#: RED.. colour.
U, V, A, B, C, OPACITY, RANGE, SX, SY, NX, NY, NZ, ISR, CUT, RED, GREEN, BLUE = range(17)
N_ROWS = 17


@dataclass(frozen=True)
class CropCamera:
    """A pinhole camera over a rectangle of interest.

    width, height: pixels. fx, fy, cx, cy: pixels, relative to the crop's own corner; the centre of the first pixel is
    (0.5, 0.5). rotation (3, 3), translation (3,): world -> camera, OpenCV axes.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    rotation: np.ndarray
    translation: np.ndarray

    @property
    def intrinsics(self) -> np.ndarray:
        """(4,) fx, fy, cx, cy."""
        return np.array([self.fx, self.fy, self.cx, self.cy], float)

    @property
    def centre(self) -> np.ndarray:
        """(3,) camera centre in the world frame."""
        return -self.rotation.T @ self.translation

    def scaled(self, factor: float) -> CropCamera:
        """The same view at ``factor`` times the resolution (pixel corners, not centres, scale)."""
        width, height = max(int(round(self.width * factor)), 1), max(int(round(self.height * factor)), 1)
        along, down = width / self.width, height / self.height
        return replace(
            self, width=width, height=height,
            fx=self.fx * along, fy=self.fy * down, cx=self.cx * along, cy=self.cy * down,
        )  # fmt: skip

    def part(self, left: int, top: int, width: int, height: int) -> CropCamera:
        """A piece of the view, given in its pixels."""
        return replace(self, width=width, height=height, cx=self.cx - left, cy=self.cy - top)

    def moved(self, origin: np.ndarray) -> CropCamera:
        """The same view in a world frame whose origin is ``origin`` (3,) of the present one."""
        return replace(self, translation=self.translation + self.rotation @ np.asarray(origin, float))

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) world -> (N, 2) pixels, (N,) depth along the axis; NaN pixels at depth <= 0."""
        local = np.asarray(points, float) @ self.rotation.T + self.translation
        depth = local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = np.column_stack([self.fx * local[:, 0] / depth + self.cx, self.fy * local[:, 1] / depth + self.cy])
        pixels[depth <= 0] = np.nan
        return pixels, depth

    def pixel_rays(self) -> np.ndarray:
        """(height, width, 3) float64 unit viewing directions through the pixel centres, camera axes."""
        x = (np.arange(self.width) + 0.5 - self.cx) / self.fx
        y = (np.arange(self.height) + 0.5 - self.cy) / self.fy
        rays = np.stack([*np.meshgrid(x, y), np.ones((self.height, self.width))], axis=-1)
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


@numba.njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _rotation(q, out):
    n = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    n = max(n, 1e-30)
    w, x, y, z = q[0] / n, q[1] / n, q[2] / n, q[3] / n
    out[0, 0], out[0, 1], out[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _ray_space(p, intr, rot, trans, m, rq, mat, jac, vec):
    """Fill camera centre m, rotation rq, mat = W R S, jac = J, vec = J W R S."""
    _rotation(p[3:7], rq)
    for i in range(3):
        m[i] = rot[i, 0] * p[0] + rot[i, 1] * p[1] + rot[i, 2] * p[2] + trans[i]
    for k in range(3):
        scale = np.exp(p[7 + k])
        for i in range(3):
            mat[i, k] = (rot[i, 0] * rq[0, k] + rot[i, 1] * rq[1, k] + rot[i, 2] * rq[2, k]) * scale
    z = m[2]
    length = np.sqrt(m[0] * m[0] + m[1] * m[1] + z * z)
    jac[0, 0], jac[0, 1], jac[0, 2] = intr[0] / z, 0.0, -intr[0] * m[0] / (z * z)
    jac[1, 0], jac[1, 1], jac[1, 2] = 0.0, intr[1] / z, -intr[1] * m[1] / (z * z)
    for k in range(3):
        jac[2, k] = m[k] / length
    for i in range(3):
        for k in range(3):
            vec[i, k] = jac[i, 0] * mat[0, k] + jac[i, 1] * mat[1, k] + jac[i, 2] * mat[2, k]


@numba.njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _hair(a, b, c):
    """Variance to add to both image axes of a needle: the conic of one more than 300 times longer than wide would lose
    its determinant in float32."""
    return 1e-5 * (a + c) if a * c - b * b < 1e-4 * a * c else 0.0


@numba.njit(cache=True, nogil=True, error_model="numpy")
def project_kernel(params, intr, rot, trans, width, height, dilation, alpha_min, out, index):
    """Project every Gaussian; write the drawable ones as columns of ``out`` (N_ROWS, >= N), their numbers to ``index``.

    Left out: not wholly in front of the camera (3 sigma; this also covers a camera inside a splat), fainter than
    ``alpha_min``, off the crop, or numerically degenerate (never drawn rather than drawn as NaN). Returns how many
    were written.
    """
    m, rq, mat = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    jac, vec = np.empty((3, 3)), np.empty((3, 3))
    count = 0
    for g in range(params.shape[0]):
        p = params[g]
        z = rot[2, 0] * p[0] + rot[2, 1] * p[1] + rot[2, 2] * p[2] + trans[2]
        if not z > 0:
            continue
        _ray_space(p, intr, rot, trans, m, rq, mat, jac, vec)
        if not z > 3 * np.sqrt(mat[2, 0] ** 2 + mat[2, 1] ** 2 + mat[2, 2] ** 2):
            continue
        a0 = vec[0, 0] ** 2 + vec[0, 1] ** 2 + vec[0, 2] ** 2
        c0 = vec[1, 0] ** 2 + vec[1, 1] ** 2 + vec[1, 2] ** 2
        b = vec[0, 0] * vec[1, 0] + vec[0, 1] * vec[1, 1] + vec[0, 2] * vec[1, 2]
        a, c = a0 + dilation, c0 + dilation
        hair = _hair(a, b, c)
        a, c = a + hair, c + hair
        det = a * c - b * b
        det0 = a0 * c0 - b * b
        if not (det > 1e-12 * a * c and det < 1e30):
            continue
        opacity = 1 / (1 + np.exp(-p[10]))
        if dilation > 0:
            opacity *= np.sqrt(max(det0, 0.0) / det)
        if not opacity > alpha_min:
            continue
        cut = 2 * np.log(opacity / alpha_min)
        u, v = intr[0] * m[0] / z + intr[2], intr[1] * m[1] / z + intr[3]
        reach_u, reach_v = np.sqrt(cut * a), np.sqrt(cut * c)
        if not (u + reach_u > 0.5 and u - reach_u < width - 0.5 and v + reach_v > 0.5 and v - reach_v < height - 0.5):
            continue
        ka, kb, kc = c / det, -b / det, a / det
        e = vec[0, 0] * vec[2, 0] + vec[0, 1] * vec[2, 1] + vec[0, 2] * vec[2, 2]
        f = vec[1, 0] * vec[2, 0] + vec[1, 1] * vec[2, 1] + vec[1, 2] * vec[2, 2]
        sx, sy = ka * e + kb * f, kb * e + kc * f
        length = np.sqrt(m[0] ** 2 + m[1] ** 2 + m[2] ** 2)
        var = vec[2, 0] ** 2 + vec[2, 1] ** 2 + vec[2, 2] ** 2 - (e * sx + f * sy)
        # A splat seen face-on may have no thickness: a hundredth of a pixel's footprint keeps the falloff finite.
        var = max(var, (0.01 * length / intr[0]) ** 2)
        nx = -(jac[2, 0] - sx * jac[0, 0] - sy * jac[1, 0])
        ny = -(jac[2, 1] - sx * jac[0, 1] - sy * jac[1, 1])
        nz = -(jac[2, 2] - sx * jac[0, 2] - sy * jac[1, 2])
        norm = np.sqrt(nx * nx + ny * ny + nz * nz)
        out[0, count], out[1, count] = u, v
        out[2, count], out[3, count], out[4, count] = ka, kb, kc
        out[5, count], out[6, count] = opacity, length
        out[7, count], out[8, count] = sx, sy
        out[9, count], out[10, count], out[11, count] = nx / norm, ny / norm, nz / norm
        out[12, count], out[13, count] = 1 / var, cut
        out[14, count], out[15, count], out[16, count] = p[11], p[12], p[13]
        index[count] = g
        count += 1
    return count


@numba.njit(cache=True, nogil=True)
def gather_columns(source, order, out):
    """out[:, i] = source[:, order[i]], in float32."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[row, i] = source[row, order[i]]
