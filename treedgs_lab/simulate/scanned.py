"""A plot whose world is a terrestrial scan: its points as small patches, its ground, and the rings measured in it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.pointcloud.cloud import thin
from treedgs_geo.pointcloud.file_crs import LOCAL
from treedgs_geo.run.cloud import GROUND, READ, STEMS, CloudJob, run_cloud_stages
from treedgs_geo.run.settings import PointcloudToDbhSettings
from treedgs_geo.stems.quality.tree import Tree

from .foliage import LYING, Faces, Material
from .layout import Layout
from .settings import SimulateSettings
from .surfels import surfels
from .terrain import Ground

#: Points are thinned to cells of this size, m, up to ``HIGH_M`` over the ground and above.
LOW_CELL_M, HIGH_CELL_M, HIGH_M = 0.012, 0.03, 6.0
#: So many points make up a copy of the scan, up to ``NEAR_M`` outside the plot and beyond; with fewer, larger patches.
NEAR_POINTS, FAR_POINTS, NEAR_M = 250_000, 60_000, 3.0
#: Copies of the scan stand about it as far as this outside the plot, m: what hides its stems and shades them.
COPIES_M = 25.0
#: Patches of surfaces up to ``HIGH_M`` are bent in cells of this size, those of copies are of one, m.
CELL_M, WHOLE_M = 0.016, 1.0
#: What lies level this near the ground is the ground, and all that is still nearer, m.
LEVEL_M, ON_GROUND_M = 0.10, 0.03
#: Linear reflectance that the darkest and the brightest points of a scan with intensities get.
REFLECTANCE = 0.05, 0.45
#: Tints of surfaces and of twigs and needles.
BARK_RGB, LEAF_RGB = np.array([1.0, 0.84, 0.70]), np.array([0.62, 0.80, 0.36])
#: Stems whose scanned bark goes round by this much, degrees, are truth: of others the photos would see the open side.
CLOSED_DEG = 300.0
#: Largest radius of a plot, m.
MAX_RADIUS_M = 15.0


@dataclass(frozen=True)
class ScannedForest:
    """A scan in the plot's frame: x, y from the middle of its extent, z from the plane of the ground there, m.

    xyz: (N, 3). albedo: (N, 3) linear, without the tint; colour: it has one of its own. half_m: (2,) half sides of its
    extent. ground: (rows, cols) heights at ``-half_m + step (col, row)``. slope: (2,) of the ground's plane. origin:
    (3,) of the frame in the scan's coordinates. trees: measured in it, there. sections: of its stems.
    """

    xyz: np.ndarray
    albedo: np.ndarray
    colour: bool
    half_m: np.ndarray
    ground: np.ndarray
    step: float
    slope: np.ndarray
    origin: np.ndarray
    trees: list[Tree]
    sections: list[dict[str, Any]]

    def folded(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) places -> (N, 2) those in the scan that stand there in its mirrored copies."""
        period = 4 * self.half_m
        q = np.mod(xy + self.half_m, period)
        return np.minimum(q, period - q) - self.half_m

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) -> (N,) ground, m; beyond the scan mirrored, on its own slope."""
        inside = self.folded(xy)
        z = map_coordinates(self.ground, ((inside + self.half_m) / self.step).T[::-1], order=1, mode="nearest")
        return z + (xy - inside) @ self.slope

    def ground_mesh(self, half_m: float, step_m: float) -> Ground:
        """The ground as the simulator has it."""
        n = int(np.ceil(2 * half_m / step_m)) + 1
        low = -step_m * (n - 1) / 2
        x, y = np.meshgrid(low + step_m * np.arange(n), low + step_m * np.arange(n))
        return Ground(low, step_m, self.height(np.column_stack([x.ravel(), y.ravel()])).reshape(n, n))


def read_scan(path: Path, reporter: Reporter) -> ScannedForest:
    """Read a cloud, find its ground and measure its stems as ``pointcloud-to-dbh`` does.

    Raises:
        InputError: no cloud can be read there, or no stem of it is measured.
    """
    with tempfile.TemporaryDirectory() as folder:
        asked = PointcloudToDbhSettings(input=path, output=Path(folder) / "trees.gpkg", crs=LOCAL, sheets="none")
        job = CloudJob(asked, reporter, attributes=None)
        run_cloud_stages((READ, GROUND, STEMS), job)
    if not any(map(is_true, job.trees)):
        raise InputError(f"{path}: no stem with a closed ring is measured in it, expected a dense terrestrial scan.")
    low, high = job.low[:2], job.high[:2]
    half, step = (high - low) / 2, 0.25
    nodes = np.ceil(2 * half / step).astype(int) + 1
    x, y = np.meshgrid(*(low[a] + np.minimum(step * np.arange(nodes[a]), 2 * half[a]) for a in (0, 1)))
    z = job.ground.dtm.height(x.ravel(), y.ravel()).reshape(x.shape)
    z = z[tuple(distance_transform_edt(np.isnan(z), return_distances=False, return_indices=True))]
    middle = low + half
    plane = np.column_stack([x.ravel() - middle[0], y.ravel() - middle[1], np.ones(x.size)])
    (east, north, level), *_ = np.linalg.lstsq(plane, z.ravel(), rcond=None)
    origin = np.array([*middle, level])
    albedo, colour = _albedo(job.cloud.attributes, len(job.cloud))
    return ScannedForest(
        job.cloud.xyz - origin, albedo, colour, half, z - level, step, np.array([east, north]), origin, job.trees,
        job.sections,
    )  # fmt: skip


def is_true(tree: Tree) -> bool:
    """The tree's diameter is truth: flagged ok, on a ring that is closed."""
    return tree.qc_flag == "ok" and (tree.arc_deg or 0.0) >= CLOSED_DEG


def _albedo(attributes: dict[str, np.ndarray], count: int) -> tuple[np.ndarray, bool]:
    """(N, 3) linear reflectance by a cloud's own colours, else by its intensities, else one for all; and whether those
    are colours."""
    rgb = np.column_stack([attributes.get(name, np.zeros(count)) for name in ("red", "green", "blue")]).astype(float)
    if rgb.any():
        return np.clip((rgb / np.percentile(rgb, 99.5)) ** 2.2, 0, 1) * REFLECTANCE[1], True
    tone = np.asarray(attributes.get("intensity", np.zeros(count)), float)
    low, high = np.percentile(tone, [2, 98])
    share = np.clip((tone - low) / (high - low), 0, 1) if high > low else np.full(count, 0.25)
    return np.repeat((REFLECTANCE[0] + (REFLECTANCE[1] - REFLECTANCE[0]) * share)[:, None], 3, axis=1), False


def scanned_settings(settings: SimulateSettings, scan: ScannedForest) -> SimulateSettings:
    """The settings with a plot that holds the scan, where no radius was given.

    Raises:
        InputError: what is known of grown stands only was asked for.
    """
    if settings.labels or settings.wind_sway_cm or settings.wind_flutter_cm:
        raise InputError(
            "--from-cloud: a scan does not say what is stem and what is leaf; leave labels, wind_sway_cm "
            "and wind_flutter_cm out."
        )
    radius = float(np.clip(np.hypot(*scan.half_m), 2.0, MAX_RADIUS_M))
    return settings if settings.radius_m is not None else replace(settings, radius_m=round(radius, 1))


def scanned_faces(rng: np.random.Generator, scan: ScannedForest, radius_m: float, layout: Layout) -> Faces:
    """The scan's points as patches; around it mirrored copies of it, coarse where they are far from the plot."""
    above = scan.xyz[:, 2] - scan.height(scan.xyz[:, :2])
    low = above < HIGH_M
    below, over = (
        np.flatnonzero(part)[thin(scan.xyz[part], cell)] for part, cell in ((low, LOW_CELL_M), (~low, HIGH_CELL_M))
    )
    bent, plain, crowns = (
        _patches(rng, scan, own, above, cell) for own, cell in ((below, CELL_M), (below, WHOLE_M), (over, np.inf))
    )
    parts = [bent[0], crowns[0]]
    whole, point = Faces.join([plain[0], crowns[0]]), np.concatenate([plain[1], crowns[1]])
    near, far = radius_m + NEAR_M, min(layout.stand_radius_m, radius_m + COPIES_M)
    for most, inner, outer in ((NEAR_POINTS, 0.0, near), (FAR_POINTS, near, far)):
        share = min(1.0, 2 * most / len(point))
        drawn = (rng.random(len(scan.xyz)) < share)[point]
        middle = scan.xyz[point[drawn], None]
        larger, albedo = middle + (whole.corners[drawn] - middle) / np.sqrt(share), whole.albedo[drawn]
        reach = np.ceil((outer / scan.half_m + 1) / 2).astype(int)
        for i, j in np.ndindex(*(2 * reach + 1)):
            tile = np.array([i, j]) - reach
            away = np.hypot(*copied(larger[:, 0], scan, tile)[:, :2].T)
            keep = (away >= inner) & (away < outer) & tile.any()
            corners = copied(larger[keep], scan, tile)
            parts.append(Faces.of(Material.SCANNED, corners, albedo[keep], 0.0))
    faces = Faces.join(parts)
    return replace(faces, owner=np.full(len(faces.kind), LYING, np.int32))


def copied(places: np.ndarray, scan: ScannedForest, tile: np.ndarray) -> np.ndarray:
    """(..., 3) places of the scan in its copy that stands ``tile`` (2,) of its extents away, every other mirrored."""
    copy = places.astype(np.float64)
    copy[..., :2] = 2 * scan.half_m * tile + np.where(tile % 2, -1, 1) * copy[..., :2]
    copy[..., 2] += (copy[..., :2] - places[..., :2]) @ scan.slope
    return copy


def _patches(
    rng: np.random.Generator, scan: ScannedForest, chosen: np.ndarray, above: np.ndarray, cell_m: float
) -> tuple[Faces, np.ndarray]:
    """The chosen points that are not the ground as patches (:func:`.surfels.surfels`), and the (F,) point of each
    triangle. above: (N,) heights of all points over the ground."""
    found = surfels(scan.xyz[chosen], rng, cell_m)
    level = np.abs(found.normal[:, 2]) > 0.8
    standing = (above[chosen] > ON_GROUND_M) & ~(level & (above[chosen] < LEVEL_M))
    albedo = scan.albedo[chosen]
    if not scan.colour:
        albedo = albedo * np.where(found.flat[:, None], BARK_RGB, LEAF_RGB)
    # No two patches are equally bright: bark and leaves have grain.
    albedo = np.clip(albedo * np.exp(0.25 * rng.standard_normal((len(albedo), 1))), 0.02, 0.6)
    keep = standing[found.point]
    point = found.point[keep]
    return Faces.of(Material.SCANNED, found.corners[keep], albedo[point], 0.0), chosen[point]
