"""Pairs of photos matched along predicted bands: where photo i's feature can lie in photo j, given rough poses and the height of the scene.

The band holds a twentieth of the photo's features, so the ratio test asks a twentieth as much as in plain matching.
"""

from __future__ import annotations

import numba
import numpy as np

from .adjustment import camera_to_colmap
from .guided import MAX_SQUARED, grid_cells
from .poses import rotation_angle_deg
from .tracks import Block


def match_band(block: Block, descriptors: list[np.ndarray], i: int, j: int, low_z: float, high_z: float, radius_px: float,
               ratio: float) -> np.ndarray:
    """(M, 2) keypoints of posed photos i and j that match, one to one and mutually best within the band.

    Args:
        low_z, high_z: local heights between which the scene lies, metres. radius_px: how far the poses may be off.
    """
    found = []
    for a, b in ((i, j), (j, i)):
        near, far = _segments(block, a, b, low_z, high_z)
        found.append(_search_band(near, far, descriptors[a], block.keypoints[b], descriptors[b],
                                  *grid_cells(block.keypoints[b], block.camera.width, block.camera.height), radius_px, ratio * ratio, MAX_SQUARED))
    forth, back = found
    rows = np.flatnonzero(forth >= 0)
    rows = rows[back[forth[rows]] == rows]
    return np.column_stack([rows, forth[rows]])


def verify_pair(block: Block, i: int, j: int, matches: np.ndarray, least: int = 10, max_error_px: float = 2.0, gate_deg: float = 4.0,
                seed: int = 1) -> np.ndarray:
    """The matches that one epipolar geometry explains (RANSAC); none where there are fewer than ``least`` or where that geometry
    turns or shifts the photos by more than ``gate_deg`` from their predicted poses."""
    import pycolmap

    nothing = np.empty((0, 2), np.int64)
    if len(matches) < least:
        return nothing
    options = pycolmap.TwoViewGeometryOptions()
    options.min_num_inliers, options.ransac.max_error, options.ransac.random_seed = least, max_error_px, seed
    options.detect_watermark, options.compute_relative_pose = False, True
    camera = camera_to_colmap(block.camera)
    geometry = pycolmap.estimate_two_view_geometry(camera, block.keypoints[i], camera, block.keypoints[j], matches.astype(np.uint32), options)
    inliers = np.asarray(geometry.inlier_matches, np.int64).reshape(-1, 2)
    if len(inliers) < least or geometry.cam2_from_cam1 is None:
        return nothing
    found = geometry.cam2_from_cam1.matrix()
    turn = block.rotations[j] @ block.rotations[i].T
    shift = block.translations[j] - turn @ block.translations[i]
    if rotation_angle_deg(found[:, :3] @ turn.T) > gate_deg:
        return nothing
    return inliers if np.linalg.norm(shift) > 0 else nothing


def band_matches(block: Block, descriptors: list[np.ndarray], pairs: np.ndarray, low_z: float, high_z: float, radius_px: float,
                 ratio: float = 0.8, max_error_px: float = 2.0) -> dict[tuple[int, int], np.ndarray]:
    """Verified band matches of many pairs, (i, j) -> (m, 2)."""
    found = {}
    posed = block.is_posed
    for i, j in pairs:
        if posed[i] and posed[j]:
            kept = verify_pair(block, i, j, match_band(block, descriptors, i, j, low_z, high_z, radius_px, ratio), max_error_px=max_error_px)
            if len(kept):
                found[(int(i), int(j))] = kept
    return found


def _segments(block: Block, i: int, j: int, low_z: float, high_z: float) -> tuple[np.ndarray, np.ndarray]:
    """Images in photo j of where photo i's rays cross two heights: (K, 2) each, NaN where they do not."""
    keypoints, camera = block.keypoints[i], block.camera
    x, y = camera.undistort(keypoints[:, 0], keypoints[:, 1])
    rays = np.column_stack([x, y, np.ones_like(x)]) @ block.rotations[i]
    centre = -block.rotations[i].T @ block.translations[i]
    ends = []
    for z in (low_z, high_z):
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (z - centre[2]) / rays[:, 2]
            reach = np.where((reach > 0) & (rays[:, 2] < -0.05), reach, np.nan)
            local = (centre + reach[:, None] * rays) @ block.rotations[j].T + block.translations[j]
            u, v = camera.distort(local[:, 0] / local[:, 2], local[:, 1] / local[:, 2])
        pixels = np.column_stack([camera.fx * u + camera.cx, camera.fy * v + camera.cy])
        pixels[local[:, 2] <= 0] = np.nan
        ends.append(pixels)
    return ends[0], ends[1]


@numba.njit(cache=True, parallel=True)
def _search_band(near, far, descriptors, points, others, order, starts, columns, rows, radius, ratio2, limit):  # noqa: ANN001, ANN202
    count = len(near)
    best = np.full(count, -1, np.int64)
    for k in numba.prange(count):
        ax, ay, bx, by = near[k, 0], near[k, 1], far[k, 0], far[k, 1]
        if not (np.isfinite(ax) and np.isfinite(bx) and np.isfinite(ay) and np.isfinite(by)):
            continue
        dx, dy = bx - ax, by - ay
        length2 = dx * dx + dy * dy + 1e-9
        c0, c1 = max(int((min(ax, bx) - radius) // 16), 0), min(int((max(ax, bx) + radius) // 16), columns - 1)
        r0, r1 = max(int((min(ay, by) - radius) // 16), 0), min(int((max(ay, by) + radius) // 16), rows - 1)
        first, second, who = limit, limit, -1
        for r in range(r0, r1 + 1):
            for c in range(c0, c1 + 1):
                mx, my = c * 16 + 8.0 - ax, r * 16 + 8.0 - ay
                s = min(max((mx * dx + my * dy) / length2, 0.0), 1.0)
                ex, ey = mx - s * dx, my - s * dy
                if ex * ex + ey * ey > (radius + 12.0) ** 2:
                    continue  # the whole cell is off the band
                cell = r * columns + c
                for place in range(starts[cell], starts[cell + 1]):
                    q = order[place]
                    px, py = points[q, 0] - ax, points[q, 1] - ay
                    s = min(max((px * dx + py * dy) / length2, 0.0), 1.0)
                    ex, ey = px - s * dx, py - s * dy
                    if ex * ex + ey * ey > radius * radius:
                        continue
                    total = 0
                    for b in range(128):
                        step = np.int32(descriptors[k, b]) - np.int32(others[q, b])
                        total += step * step
                    if total < first:
                        first, second, who = total, first, q
                    elif total < second:
                        second = total
        if who >= 0 and first < ratio2 * second:
            best[k] = who
    return best
