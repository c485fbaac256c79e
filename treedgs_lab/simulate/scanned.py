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
from .scene import AXIS_STEP, PlantedStem, axis_at
from .settings import SimulateSettings
from .surfels import surfels
from .terrain import Ground
from .world import World

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
MOST_RADIUS_M = 15.0


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
    if not any(map(_sure, job.trees)):
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


def _sure(tree: Tree) -> bool:
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
    if settings.labels or settings.wind_smooth or settings.wind_flutter_cm:
        raise InputError(
            "--from-cloud: a scan does not say what is stem and what is leaf; leave labels, wind_smooth and "
            "wind_flutter_cm out."
        )
    radius = float(np.clip(np.hypot(*scan.half_m), 2.0, MOST_RADIUS_M))
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
    copied, point = Faces.join([plain[0], crowns[0]]), np.concatenate([plain[1], crowns[1]])
    near, far = radius_m + NEAR_M, min(layout.stand_radius_m, radius_m + COPIES_M)
    for most, inner, outer in ((NEAR_POINTS, 0.0, near), (FAR_POINTS, near, far)):
        share = min(1.0, 2 * most / len(point))
        drawn = (rng.random(len(scan.xyz)) < share)[point]
        middle = scan.xyz[point[drawn], None]
        larger, albedo = middle + (copied.corners[drawn] - middle) / np.sqrt(share), copied.albedo[drawn]
        reach = np.ceil((outer / scan.half_m + 1) / 2).astype(int)
        for i, j in np.ndindex(*(2 * reach + 1)):
            tile = np.array([i, j]) - reach
            away = np.hypot(*_copied(larger[:, 0], scan, tile)[:, :2].T)
            keep = (away >= inner) & (away < outer) & tile.any()
            corners = _copied(larger[keep], scan, tile)
            parts.append(Faces.of(Material.SCANNED, corners, albedo[keep], 0.0))
    faces = Faces.join(parts)
    return replace(faces, owner=np.full(len(faces.kind), LYING, np.int32))


def _copied(places: np.ndarray, scan: ScannedForest, tile: np.ndarray) -> np.ndarray:
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


def scanned_stems(scan: ScannedForest, radius_m: float) -> list[PlantedStem]:
    """The stems whose diameter is truth (:func:`_sure`), and again in its copies beside the plot."""
    stems = []
    for tree in filter(_sure, scan.trees):
        curve = [row for row in scan.sections if row["tree_id"] == tree.tree_id]
        h = np.array([row["height_m"] for row in curve] or [tree.bh_m])
        xy = np.array([(row["x"], row["y"]) for row in curve] or [(tree.x, tree.y)])
        lean = np.polyfit(h, xy, 1)[0] if len(h) > 2 else np.zeros(2)
        s = AXIS_STEP * np.arange(int((tree.height_m or max(float(h.max()), 3.0)) / AXIS_STEP) + 1)
        rise = s / np.sqrt(1 + lean @ lean)
        axis = np.column_stack([np.array([tree.x, tree.y]) + (rise[:, None] - tree.bh_m) * lean, rise + tree.z_ground])
        axis, dbh_m = axis - scan.origin, (tree.dbh_cm or np.nan) / 100
        for i in range(-2, 3):
            for j in range(-2, 3):
                placed = _copied(axis, scan, np.array([i, j]))
                at = float(np.hypot(*placed[round(tree.bh_m / AXIS_STEP), :2]))
                own = i == j == 0
                if not own and at > radius_m + 5:
                    continue
                stems.append(
                    PlantedStem(
                        f"S{tree.tree_id}" + ("" if own else f"_{i}_{j}"), "scanned" if own else "copy", "live",
                        own and at <= radius_m, placed, np.full(len(s), dbh_m / 2), dbh_m, float(s[-1]), float(s[-1]),
                        float(np.arctan2(*(lean * np.where((i % 2, j % 2), -1, 1))[::-1])), 2,
                    )
                )  # fmt: skip
    return stems


def rendered_width(world: World, stem: PlantedStem, s_m: float) -> float:
    """What a tape would read of the patches that stand for a stem at arc length ``s_m``, m: the mean over directions of
    its width, out to where nothing stands at half of nine heights; twigs that touch it count, too."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ahead = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(24)])[:, None, None]
    side = np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(24)])[:, None, None]
    centre = axis_at(stem, s_m + np.linspace(-0.12, 0.12, 9))[0][None, :, None]
    back, offset = stem.dbh_m / 2 + 0.03, stem.dbh_m * np.linspace(0, 0.8, 241)
    width = np.zeros(24)
    for sign in (-1, 1):
        start = centre - back * ahead + sign * offset[:, None] * side
        way = np.broadcast_to(2 * back * ahead, start.shape).reshape(-1, 3)
        met = (world.first_hits(start.reshape(-1, 3), way)[0] <= 1).reshape(24, 9, -1)
        open_ = met.mean(axis=1) < 0.5
        width += offset[np.where(open_.any(axis=1), np.argmax(open_, axis=1) - 1, -1)]
    return float(width.mean())


def scanned_table(
    scan: ScannedForest, stems: list[PlantedStem], world: World
) -> tuple[list[dict[str, Any]], dict[str, list], list[list[float]]]:
    """As :func:`.truth.stem_table`, from the rings measured in the scan; what of it is not sure (:func:`_sure`)
    stands with the saplings: it is no truth, and nothing false either."""
    trees, rows = {tree.tree_id: tree for tree in scan.trees}, []
    for index, stem in enumerate(stems):
        tree = trees[int(stem.tree_id[1:].split("_")[0])]
        top = stem.axis[-1] - stem.axis[0]
        lean = float(np.degrees(np.arctan2(np.hypot(*top[:2]), top[2])))
        rows.append(
            {
                "tree_id": stem.tree_id, "kind": stem.kind, "status": stem.status, "in_plot": bool(stem.in_plot),
                "bh": stem.axis[round(tree.bh_m / AXIS_STEP)], "base": stem.axis[0], "dbh_cm": tree.dbh_cm,
                "dbh_se_cm": tree.dbh_se_cm, "w_min_cm": None, "w_max_cm": None, "height_m": stem.height_m,
                "lean_deg": lean, "lean_bh_deg": lean, "crown_base_m": None,
                "lean_az_grid_deg": float(np.degrees(np.arctan2(*top[:2])) % 360),
                "taper_cm_m": None if tree.taper_cm_m is None else -tree.taper_cm_m,
                "index": index,
                "rendered_cm": 100 * rendered_width(world, stem, tree.bh_m) if stem.kind == "scanned" else None,
            }
        )  # fmt: skip
    curves: dict[str, list] = {}
    for row in scan.sections:
        z = (trees[row["tree_id"]].z_ground or 0.0) + row["height_m"]
        place = (np.array([row["x"], row["y"], z]) - scan.origin).tolist()
        curves.setdefault(f"S{row['tree_id']}", []).append([row["height_m"], row["d_cm"], *place])
    others = []
    for tree in (tree for tree in scan.trees if not _sure(tree)):
        place = np.array([[tree.x, tree.y, scan.origin[2]]]) - scan.origin
        copies = [_copied(place, scan, np.array([i, j]))[0] for i in range(-2, 3) for j in range(-2, 3)]
        others += [[*copy[:2].tolist(), tree.dbh_cm or 0.0] for copy in copies]
    return rows, curves, others
