"""Dense points of the stem band: semi-global matching on rectified neighbour photos, kept where two reference photos
agree.

A start for the splats and a picture of the stems, not a diameter: the points scatter by a pixel and lean inward by a
few millimetres
(``docs/analyst/reconstruction.md``). SGBM: Hirschmueller 2008, OpenCV's implementation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from ..core.progress import Reporter
from .cameras import View
from .images import load_image

#: Reference photos that must agree, partners of each, and megapixels of a rectified crop, to which larger ones are
#: reduced.
MIN_VOTES, NEIGHBOURS, MAX_MEGAPIXELS = 2, 2, 4.0
#: Pixels of a rectified crop between places whose place in the photo is computed; between them it is linear to 0.01 px.
KNOT_PX = 8


@dataclass(frozen=True, kw_only=True)
class DenseOptions:
    """How the stem band is made dense."""

    #: Ends of the band above ground, m.
    low_m: float = 0.2
    high_m: float = 3.2
    #: Cell in which two reference photos must agree, m.
    voxel_m: float = 0.04
    #: Most reference photos.
    max_views: int = 30


def densify_band(
    views: list[View],
    ground_height: Callable[[np.ndarray, np.ndarray], np.ndarray],
    centre_xy: np.ndarray,
    radius_m: float,
    options: DenseOptions | None = None,
    reporter: Reporter | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points between two heights above ground in a circle.

    Args:
        views: registered photos. ground_height: local x, y (K,) -> local z (K,), NaN outside. centre_xy: (2,) local
            metres. radius_m: of the circle.

    Returns:
        xyz (N, 3) local metres, rgb (N, 3) uint8, votes (N,) int reference photos that agree; all empty where nothing
        can be matched.
    """
    options, reporter = options or DenseOptions(), reporter or Reporter()
    empty = np.empty((0, 3)), np.empty((0, 3), np.uint8), np.empty(0, int)
    corners = _band_corners(ground_height, centre_xy, radius_m, options)
    if corners is None:
        return empty
    pairs = choose_pairs(views, corners, options.max_views)
    clouds: list[tuple[int, np.ndarray, np.ndarray]] = []
    loaded: dict[int, np.ndarray] = {}
    for number, (i, j) in enumerate(pairs):
        reporter.progress(number / len(pairs))
        for k in (i, j):
            if k not in loaded:
                if len(loaded) >= 6:  # a few photos at a time: memory stays bounded
                    loaded.pop(next(iter(loaded)))
                loaded[k] = load_image(views[k])
        xyz, rgb = match_pair(views[i], views[j], loaded[i], loaded[j], corners)
        if len(xyz):
            inside = np.linalg.norm(xyz[:, :2] - centre_xy, axis=1) <= radius_m
            above = xyz[:, 2] - ground_height(xyz[:, 0], xyz[:, 1])
            with np.errstate(invalid="ignore"):
                inside &= (above >= options.low_m) & (above <= options.high_m)
            if inside.any():
                clouds.append((i, xyz[inside], rgb[inside]))
    if not clouds:
        return empty
    return vote(clouds, options.voxel_m, MIN_VOTES)


def _band_corners(
    ground_height: Callable, centre_xy: np.ndarray, radius_m: float, options: DenseOptions
) -> np.ndarray | None:
    """(K, 3) points on the hull of the band."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    xy = np.vstack([centre_xy, centre_xy + radius_m * np.column_stack([np.cos(turn), np.sin(turn)])])
    z = np.asarray(ground_height(xy[:, 0], xy[:, 1]), float)
    if not np.isfinite(z).any():
        return None
    z = np.where(np.isfinite(z), z, np.nanmedian(z))
    return np.vstack([np.column_stack([xy, z + options.low_m]), np.column_stack([xy, z + options.high_m])])


def choose_pairs(views: list[View], corners: np.ndarray, max_views: int) -> list[tuple[int, int]]:
    """Reference photo and partner: 4 to 18 degrees apart as seen from the band, looking the same way, from the side."""
    middle = corners.mean(axis=0)
    seen, rays = [], np.full((len(views), 3), np.nan)
    for k, view in enumerate(views):
        pixels, _ = view.project(corners)
        inside = view.contains(pixels)
        ray = middle - view.centre
        rays[k] = ray / np.linalg.norm(ray)
        if inside.mean() >= 0.4 and np.degrees(np.arccos(np.clip(-rays[k, 2], -1, 1))) > 15:
            seen.append(k)
    seen = seen[:: max(1, int(np.ceil(len(seen) / max_views)))]
    pairs: list[tuple[int, int]] = []
    for i in seen:
        angle = np.degrees(np.arccos(np.clip(rays @ rays[i], -1, 1)))
        axes = np.array(
            [np.degrees(np.arccos(np.clip(view.rotation[2] @ views[i].rotation[2], -1, 1))) for view in views]
        )
        usable = [
            j
            for j in range(len(views))
            if j != i and 4 <= angle[j] <= 18 and axes[j] <= 25 and views[j].flight == views[i].flight
        ]
        usable.sort(key=lambda j: abs(angle[j] - 8))
        pairs += [(i, j) for j in usable[:NEIGHBOURS]]
    return pairs


def match_pair(
    first: View, second: View, image_a: np.ndarray, image_b: np.ndarray, corners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) local and colours (N, 3) that photo ``first`` sees and ``second`` confirms, inside the box of the
    band's corners.
    """
    nothing = np.empty((0, 3)), np.empty((0, 3), np.uint8)
    rotation, fx = rectify(first, second), first.camera.fx
    if rotation is None:
        return nothing
    baseline = float(np.linalg.norm(second.centre - first.centre))
    sides, boxes = [], []
    for view in (first, second):
        local = (corners - view.centre) @ rotation.T
        if (local[:, 2] <= 1).any():
            return nothing
        sides.append(local)
        boxes.append(local[:, :2] / local[:, 2:] * fx)
    # Both windows share rows; columns are cut to each photo's own band.
    top, bottom = min(b[:, 1].min() for b in boxes) - 4, max(b[:, 1].max() for b in boxes) + 4
    width = max(np.ptp(b[:, 0]) for b in boxes) + 8
    scale = min(1.0, np.sqrt(MAX_MEGAPIXELS * 1e6 / max(width * (bottom - top), 1)))
    size = int(np.ceil(width * scale)), int(np.ceil((bottom - top) * scale))
    if min(size) < 32:
        return nothing
    focal = fx * scale
    lefts = [(b[:, 0].min() - 4) * scale for b in boxes]
    depth = np.concatenate([side[:, 2] for side in sides])
    crops = [
        _rectified(view, image, rotation, focal, left, top * scale, size, float(np.median(depth)))
        for view, image, left in zip((first, second), (image_a, image_b), lefts, strict=True)
    ]
    # disparity = u_first - u_second = focal * baseline / z + (left_second - left_first)
    shift = lefts[1] - lefts[0]
    low = int(np.floor(focal * baseline / depth.max() + shift)) - 2
    span = int(np.ceil(focal * baseline / depth.min() + shift)) + 2 - low
    span = max(16, -(-span // 16) * 16)
    if span > size[0] // 2 or span > 512:
        return nothing
    matcher = cv2.StereoSGBM.create(
        minDisparity=low,
        numDisparities=span,
        blockSize=5,
        P1=8 * 25,
        P2=32 * 25,
        disp12MaxDiff=1,
        uniquenessRatio=5,
        speckleWindowSize=50,
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_HH if size[0] * size[1] * span < 2.5e8 else cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    grey = [cv2.cvtColor(crop, cv2.COLOR_RGB2GRAY) for crop in crops]
    disparity = matcher.compute(*grey).astype(np.float32) / 16
    good = (disparity >= low) & (grey[0] > 0) & (disparity - shift > 1e-3)
    rows, columns = np.nonzero(good)
    if not len(rows):
        return nothing
    z = focal * baseline / (disparity[rows, columns] - shift)
    x = (columns + 0.5 + lefts[0]) / focal * z
    y = (rows + 0.5 + top * scale) / focal * z
    return np.column_stack([x, y, z]) @ rotation + first.centre, crops[0][rows, columns]


def rectify(first: View, second: View) -> np.ndarray | None:
    """(3, 3) world -> rectified, shared by both photos (x along the baseline, first to second).

    None where the baseline runs along the viewing direction.
    """
    along = second.centre - first.centre
    length = np.linalg.norm(along)
    axis = first.rotation[2] + second.rotation[2]
    axis /= np.linalg.norm(axis)
    if length < 1e-3:
        return None
    x = along / length
    z = axis - (axis @ x) * x
    if np.linalg.norm(z) < 0.7:
        return None
    z /= np.linalg.norm(z)
    return np.vstack([x, np.cross(z, x), z])


def _rectified(
    view: View,
    image: np.ndarray,
    rotation: np.ndarray,
    focal: float,
    left: float,
    top: float,
    size: tuple[int, int],
    depth_m: float,
) -> np.ndarray:
    """Window of a photo resampled to the rectified plane, black outside.

    depth_m: along the rectified axis, of what is looked for: a rolling shutter's travel moves near things more.
    """
    u, v = np.meshgrid(
        *(np.arange(0, n + KNOT_PX, KNOT_PX) + 0.5 + low for n, low in zip(size, (left, top), strict=True))
    )
    rays = np.stack([u / focal, v / focal, np.ones_like(u)], axis=-1).reshape(-1, 3) @ rotation
    pixels, ahead = view.project(view.centre + depth_m * rays)
    pixels = np.where((ahead > 0.1)[:, None], pixels, -10.0).reshape(*u.shape, 2) - 0.5
    finer = np.array([[1 / KNOT_PX, 0, 0], [0, 1 / KNOT_PX, 0]])
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    map_x, map_y = (
        cv2.warpAffine(part.astype(np.float32), finer, size, flags=how) for part in np.moveaxis(pixels, 2, 0)
    )
    return cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR)


def vote(
    clouds: list[tuple[int, np.ndarray, np.ndarray]], voxel_m: float, min_votes: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points whose voxel ``min_votes`` reference photos fill, thinned to one (the mean) per voxel and photo.

    Args:
        clouds: (reference photo, (n, 3) local, (n, 3) uint8).

    Returns:
        xyz (N, 3), rgb (N, 3) uint8, votes (N,).
    """
    low = np.min([xyz.min(axis=0) for _, xyz, _ in clouds], axis=0)
    sums, cells, references = [], [], []
    for reference, xyz, rgb in clouds:
        cell = np.floor((xyz - low) / voxel_m).astype(np.int64)
        code = (cell[:, 0] << 42) | (cell[:, 1] << 21) | cell[:, 2]
        unique, place, count = np.unique(code, return_inverse=True, return_counts=True)
        total = np.zeros((len(unique), 6))
        np.add.at(total, place, np.hstack([xyz, rgb]))
        sums.append(total / count[:, None])
        cells.append(unique)
        references.append(np.full(len(unique), reference))
    mean, codes, sources = np.concatenate(sums), np.concatenate(cells), np.concatenate(references)
    # Photos per voxel: each reference counts once however many partners it had.
    once = np.unique(np.column_stack([codes, sources]), axis=0)
    voxels, votes = np.unique(once[:, 0], return_counts=True)
    own = votes[np.searchsorted(voxels, codes)]
    keep = own >= min_votes
    return mean[keep, :3], np.clip(mean[keep, 3:], 0, 255).astype(np.uint8), own[keep]
