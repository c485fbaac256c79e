"""What is true of the rendered plot: diameters of the very meshes, lean, and which photo sees which stem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M

from .scene import PlantedStem, axis_at
from .spacing import centre_distance
from .stem_mesh import StemMesh
from .world import World

#: The band of the stem whose visibility counts, m of arc length.
BAND_M = (1.0, 1.8)


@dataclass(frozen=True)
class Section:
    """A stem's cross-section: hull perimeter / pi and extreme calliper widths, m; centre: (3,) axis point."""

    diameter: float
    narrow: float
    wide: float
    centre: np.ndarray


def section(mesh: StemMesh, index: int, stem: PlantedStem, s_m: float) -> Section:
    """Cut one stem's triangles by the plane across its axis at arc length ``s_m``.

    The diameter is the convex hull's perimeter over pi: what a tape reads (Cauchy: the mean calliper width).
    """
    centre, tangent, _ = (part[0] for part in axis_at(stem, np.array([s_m])))
    corners = mesh.vertices[mesh.triangles[mesh.first[index] : mesh.first[index + 1]]]
    side = (corners - centre) @ tangent
    cut = (side.min(axis=1) < 0) & (side.max(axis=1) >= 0)
    corners, side = corners[cut], side[cut]
    points = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        crosses = (side[:, a] < 0) != (side[:, b] < 0)
        share = (side[crosses, a] / (side[crosses, a] - side[crosses, b]))[:, None]
        points.append(corners[crosses, a] + share * (corners[crosses, b] - corners[crosses, a]))
    cloud = np.concatenate(points) - centre
    # Only the ring about this arc length: a strongly swept stem could be cut twice.
    cloud = cloud[np.linalg.norm(cloud, axis=1) < 1.5 * stem.dbh_m + 0.05]
    e1 = np.cross([0, 1.0, 0], tangent)
    e1 /= np.linalg.norm(e1)
    flat = np.column_stack([cloud @ e1, cloud @ np.cross(tangent, e1)])
    hull = flat[ConvexHull(flat).vertices]
    perimeter = np.linalg.norm(hull - np.roll(hull, 1, axis=0), axis=1).sum()
    turn = np.radians(np.arange(0, 180, 1.0))
    reach = hull @ np.stack([np.cos(turn), np.sin(turn)])
    width = reach.max(axis=0) - reach.min(axis=0)
    return Section(perimeter / np.pi, width.min(), width.max(), centre)


def stem_table(
    mesh: StemMesh, stems: list[PlantedStem], reach_m: float, centres: np.ndarray
) -> tuple[list[dict], dict[str, list], list[list[float]]]:
    """Stems within ``reach_m`` of one of the ``centres`` (n, 2).

    Rows of ``trees.csv`` (without the visibility columns), ``stems.json`` profiles, and saplings (x, y, DBH cm).
    """
    rows, profiles, saplings = [], {}, []
    for index, stem in enumerate(stems):
        base = stem.axis[0]
        if stem.kind == "sapling":
            diameter = section(mesh, index, stem, BREAST_HEIGHT_M).diameter
            saplings.append([float(base[0]), float(base[1]), 100 * diameter])
            continue
        if stem.kind == "branch" or centre_distance(base[None, :2], centres)[0] > reach_m:
            continue
        cut = section(mesh, index, stem, BREAST_HEIGHT_M)
        profile = []
        for s in np.arange(0, min(8.0, stem.height_m - 1) + 1e-9, 0.5):
            part = section(mesh, index, stem, float(s))
            profile.append([float(s), 100 * part.diameter, *map(float, part.centre)])
        profiles[stem.tree_id] = profile
        upper = np.array(profile)[2:]
        taper = -np.polyfit(upper[:, 0], upper[:, 1], 1)[0]
        tangent = axis_at(stem, np.array([BREAST_HEIGHT_M]))[1][0]
        top = stem.axis[-1] - base
        rows.append(
            {
                "tree_id": stem.tree_id,
                "kind": stem.kind,
                "status": stem.status,
                "in_plot": bool(stem.in_plot),
                "bh": cut.centre,
                "base": base,
                "dbh_cm": 100 * cut.diameter,
                "w_min_cm": 100 * cut.narrow,
                "w_max_cm": 100 * cut.wide,
                "height_m": float(top[2]),
                "lean_deg": float(np.degrees(np.arctan2(np.hypot(*top[:2]), top[2]))),
                "lean_bh_deg": float(np.degrees(np.arccos(np.clip(tangent[2], -1, 1)))),
                "lean_az_grid_deg": float(np.degrees(np.arctan2(top[0], top[1])) % 360),
                "crown_base_m": stem.crown_base_m,
                "taper_cm_m": float(taper),
                "index": index,
            }
        )
    return rows, profiles, saplings


def visibility(world: World, stem: PlantedStem, index: int, dbh_m: float, view: View) -> dict:
    """Share of the camera-facing band that the camera sees, DBH in pixels, frame and foreshortening.

    Points on the mesh's nominal surface, 12 heights by 11 directions within 75 degrees of the camera's; a point is seen
    when the first thing that its ray hits is this stem, or nothing before the point.
    """
    s = np.linspace(*BAND_M, 12)
    point, tangent, radius = axis_at(stem, s)
    middle, axis, _ = (part[0] for part in axis_at(stem, np.array([BREAST_HEIGHT_M])))
    centre = view.at_point(middle).centre
    to_camera = centre - point
    to_camera -= (to_camera * tangent).sum(1, keepdims=True) * tangent
    to_camera /= np.linalg.norm(to_camera, axis=1, keepdims=True)
    side = np.cross(tangent, to_camera)
    turn = np.radians(np.linspace(-75, 75, 11))
    surface = (
        point[:, None]
        + radius[:, None, None]
        * (np.cos(turn)[None, :, None] * to_camera[:, None] + np.sin(turn)[None, :, None] * side[:, None])
    ).reshape(-1, 3)
    distance, primitive = world.first_hits(centre, surface - centre)
    on_stem = (primitive >= world.ground_faces) & (primitive < world.ground_faces + world.stem_faces)
    hit_owner = np.full(len(primitive), -1)
    hit_owner[on_stem] = world.stem_owner[primitive[on_stem] - world.ground_faces]
    slack = 0.03 / np.linalg.norm(surface - centre, axis=1)
    seen = (hit_owner == index) | (distance > 1 - slack)
    pixels, depth = view.project(np.vstack([surface, middle]))
    ray = (middle - centre) / np.linalg.norm(middle - centre)
    return {
        "visible_fraction": float(seen.mean()),
        "width_px": float(view.camera.fx * dbh_m / depth[-1]),
        "in_frame": int(view.contains(pixels).all()),
        "foreshortening": float(np.linalg.norm(np.cross(axis, ray))),
    }


def count_views(records: list[dict]) -> dict:
    """The visibility columns of ``trees.csv`` from one tree's records, in photo order."""

    def good(record: dict, share: float) -> bool:
        return bool(record["in_frame"] and record["visible_fraction"] >= share and record["foreshortening"] > 0.35)

    framed = [r["width_px"] for r in records if r["in_frame"]]
    open_ = [r["width_px"] for r in records if good(r, 0.7)]
    return {
        "n_in_frame": len(framed),
        "n_unoccluded_bh_views": len(open_),
        "n_half_visible_bh_views": sum(good(r, 0.5) for r in records),
        "mean_width_px": float(np.mean(framed)) if framed else None,
        "mean_width_px_unoccluded": float(np.mean(open_)) if open_ else None,
    }
