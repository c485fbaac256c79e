"""Sun and sky: where the sun stands, and how much light reaches ground, bark and every leaf."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from .casting import blocked
from .foliage import Faces, Material
from .options import WeatherSettings
from .world import World

#: Irradiance of the direct sun on a facing surface and of the whole sky on a level one, relative units, RGB.
SUN_RGB = np.array([1.00, 0.94, 0.84])
SKY_RGB = np.array([0.27, 0.31, 0.37])
#: The same of an overcast sky; there is no sun then.
OVERCAST_RGB = np.array([0.92, 0.97, 1.03])
#: Extinction of the sun by one more air mass, RGB, and the elevation that :data:`SUN_RGB` is for, degrees.
EXTINCTION = np.array([0.08, 0.14, 0.25])
USUAL_ELEVATION_DEG = 48.0
#: Start of a ray from a face to the sun, m from its middle: patches of a scan lie in several layers on one another; and
#: the share of the area of such patches that hides the sky.
LIFT_M, SCANNED_LIFT_M, SCANNED_SHARE = 0.004, 0.04, 0.3
#: Angular radius of the sun disc, rad (widened by haze).
SUN_RADIUS = 0.006


@dataclass(frozen=True)
class Weather:
    """sun: RGB of the facing sun. sky: of the whole sky on level ground. bounce: of what lit ground throws back.
    samples: rays to the sun's disc a ground cell. elevation_deg: where the sun is held, ``None`` = by the clock.
    exposure: what the camera's automatic makes of it."""

    sun: np.ndarray
    sky: np.ndarray
    bounce: np.ndarray
    samples: int = 2
    elevation_deg: float | None = None
    exposure: float = 1.0


def weather_of(settings: WeatherSettings) -> Weather:
    """The light that the settings ask for; a low sun is weaker and redder."""
    usual = float(SUN_RGB[1] * np.sin(np.radians(USUAL_ELEVATION_DEG)) + SKY_RGB[1])
    if settings.sky == "overcast":
        dark = np.zeros(3)
        return Weather(dark, OVERCAST_RGB, 0.5 * OVERCAST_RGB, settings.shadow_samples, None, usual / OVERCAST_RGB[1])
    if settings.sun_elevation_deg is None:
        return Weather(SUN_RGB, SKY_RGB, SUN_RGB, settings.shadow_samples)
    height = np.sin(np.radians(settings.sun_elevation_deg))
    sun = SUN_RGB * np.exp(-EXTINCTION * (1 / height - 1 / np.sin(np.radians(USUAL_ELEVATION_DEG))))
    exposure = usual / float(sun[1] * height + SKY_RGB[1])
    return Weather(sun, SKY_RGB, sun, settings.shadow_samples, settings.sun_elevation_deg, exposure)


CLEAR = Weather(SUN_RGB, SKY_RGB, SUN_RGB)


def held_at(sun: np.ndarray, elevation_deg: float | None) -> np.ndarray:
    """The (3,) direction to the sun at another elevation, same azimuth; itself for ``None``."""
    if elevation_deg is None:
        return sun
    flat, height = np.hypot(sun[0], sun[1]), np.radians(elevation_deg)
    return np.array([*(np.cos(height) * sun[:2] / flat), np.sin(height)])


@dataclass(frozen=True)
class Light:
    """Baked light of one flight. ground: (n, n, 3) float32 irradiance, cell centres at low + (j + 0.5) step;
    stems: (V, 3) float32 irradiance a vertex; faces: (F, 3) float32 radiance a leaf or stick face."""

    low: float
    step: float
    ground: np.ndarray
    stems: np.ndarray
    faces: np.ndarray


class SkyField:
    """Share of the sky that reaches a point: Beer-Lambert through the needle area above, spread over 1.5 m sideways."""

    def __init__(self, faces: Faces, half_m: float, cell_m: float = 0.6) -> None:
        centre = faces.corners.mean(axis=1)
        area = 0.5 * np.linalg.norm(
            np.cross(faces.corners[:, 1] - faces.corners[:, 0], faces.corners[:, 2] - faces.corners[:, 0]), axis=1
        )
        area = np.where(faces.kind == Material.SCANNED, SCANNED_SHARE, 1.0) * area
        self._low = np.array([-half_m, -half_m, float(centre[:, 2].min()) - cell_m if len(centre) else 0.0])
        n = int(np.ceil(2 * half_m / cell_m))
        layers = int(np.ceil(((centre[:, 2].max() if len(centre) else 1.0) - self._low[2]) / cell_m)) + 2
        self._cell = cell_m
        index = np.floor((centre - self._low) / cell_m).astype(int)
        inside = ((index >= 0) & (index < [n, n, layers])).all(axis=1)
        density = np.zeros((n, n, layers))
        np.add.at(density, tuple(index[inside].T), area[inside] / cell_m**2)
        density = gaussian_filter(density, (1.5 / cell_m, 1.5 / cell_m, 0.7))
        above = np.cumsum(density[..., ::-1], axis=2)[..., ::-1]
        self._share = 0.12 + 0.88 * np.exp(-0.5 * above)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) -> (N,) share 0..1, trilinear."""
        q = ((np.asarray(points, np.float64) - self._low) / self._cell - 0.5).T
        return map_coordinates(self._share, q, order=1, mode="nearest")


def _lit(scene, points: np.ndarray, sun: np.ndarray, rng: np.random.Generator, samples: int) -> np.ndarray:
    """(N,) mean over ``samples`` rays to the sun disc that pass; ``points`` already lie off the surface."""
    total = np.zeros(len(points))
    side = np.cross(sun, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    other = np.cross(sun, side)
    for _ in range(samples):
        radius, turn = SUN_RADIUS * np.sqrt(rng.random(len(points))), rng.uniform(0, 2 * np.pi, len(points))
        way = sun + (radius * np.cos(turn))[:, None] * side + (radius * np.sin(turn))[:, None] * other
        total += ~blocked(scene, np.concatenate([points, way], axis=1))
    return total / samples


def bake(
    world: World,
    sky: SkyField,
    sun: np.ndarray,
    map_half_m: float,
    rng: np.random.Generator,
    map_step_m: float = 0.035,
    weather: Weather = CLEAR,
) -> Light:
    """Trace shadows for one position of the sun."""
    scene, ground, mesh, faces = world.scene, world.ground, world.mesh, world.faces
    shine = weather.sun.any()
    n = int(np.ceil(2 * map_half_m / map_step_m))
    axis = -map_half_m + map_step_m * (np.arange(n) + 0.5)
    x, y = np.meshgrid(axis, axis)
    xy = np.column_stack([x.ravel(), y.ravel()])
    normal = ground.normals(xy)
    points = np.column_stack([xy, ground.height(xy)]) + 0.01 * normal
    lit = _lit(scene, points, sun, rng, weather.samples) if shine else np.zeros(len(points))
    direct = gaussian_filter(lit.reshape(n, n), 0.8)
    facing = np.maximum(normal @ sun, 0).reshape(n, n)
    coarse = sky(points[:, :3]).reshape(n, n)
    floor = (direct * facing)[..., None] * weather.sun + coarse[..., None] * weather.sky

    cosine = mesh.normals @ sun
    bark = np.zeros(len(cosine))
    towards = (cosine > 0) & shine
    # Start beyond the relief, so that plates do not shade the vertex that they are made of.
    start = mesh.vertices + 0.02 * mesh.normals
    bark[towards] = _lit(scene, start[towards], sun, rng, 2 * weather.samples)
    # A vertical wall sees half the sky, and the bright ground instead of the other half.
    open_sky = sky(mesh.vertices)
    around = 0.5 + 0.5 * mesh.normals[:, 2]
    stem_light = (
        (bark * np.maximum(cosine, 0))[:, None] * weather.sun
        + (open_sky * around)[:, None] * weather.sky
        + (open_sky * (1 - around))[:, None] * 0.15 * weather.bounce
    )

    centre = faces.corners.mean(axis=1).astype(np.float64)
    across = np.cross(faces.corners[:, 1] - faces.corners[:, 0], faces.corners[:, 2] - faces.corners[:, 0])
    across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    tilt = np.abs(across @ sun)
    leaf_rays = max(1, weather.samples // 2)
    lift = np.where(faces.kind == Material.SCANNED, SCANNED_LIFT_M, LIFT_M)
    lit = _lit(scene, centre + lift[:, None] * sun, sun, rng, leaf_rays) if shine else np.zeros(len(centre))
    # Both sides of a leaf are seen: on average half of the light that comes through leaves by the far side.
    glow = lit * (tilt * (0.75 + 0.5 * faces.through) + 0.12)
    leaf = faces.albedo * (glow[:, None] * weather.sun + (sky(centre) * 0.9)[:, None] * weather.sky)
    return Light(
        -map_half_m, map_step_m, floor.astype(np.float32), stem_light.astype(np.float32), leaf.astype(np.float32)
    )
