"""Photos turned until they show the ground where the others show it.

Where crowns move and the ground lies in their shade, a photo has hardly a feature on the ground, and those of its
crowns agree on a wrong turn. The picture of the ground that the other photos give together (:mod:`.orthophoto`) tells:
its tiles are looked for in the photo (normalised cross-correlation), and the photo is turned to where it shows the most
of them. Crowns hide many; nothing alike is found there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path

import cv2
import numpy as np
from numba import njit, prange
from numpy.lib.stride_tricks import sliding_window_view
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.fft import irfft2, rfft2
from scipy.spatial.transform import Rotation

from ..core.errors import InputError
from ..core.machine import EXACT, in_threads
from ..terrain.sparse_ground import LAYER_M, dtm_from_sparse
from .adjustment import Known
from .cameras import View
from .orthophoto import STEP_PX, drape, ground_picture, split
from .poses import nearest_rotation
from .sift import FeatureStore
from .tracks import Block

#: A photo is placed by its ground where it shows so many points of it that three photos prove.
_MIN_GROUND_POINTS = 12
#: Photos that show more give the picture; fewer than this many photos give none.
_MIN_PHOTOS = 6
#: Pixel of the picture, metres; side of a tile and from one to the next, pixels; the least of a tile that is shown.
_PIXEL_M, _TILE, _APART, _SHOWN = 0.03, 14, 14, 0.9
#: Photos are turned so far, degrees: what gimbals err by; and where none of the flight tells how its compass errs, and
#: less than so many are found so. The ground is looked for up to so many heights above it from a photo.
_REACH_DEG, _FIRST_REACH_DEG, _FIRST_FOUND, _FAR = 1.2, 2.5, 3, 1.5
#: Correlation above which a tile speaks for a turn (squared excess), and the least contrast of a tile, grey values.
_ALIKE, _MIN_SPREAD = 0.35, 4.0
#: Variance of a piece of a photo, grey values squared, below which it is alike to nothing.
_MIN_VARIANCE = 0.1
#: Steps of a byte in which that is kept.
_STEPS = 255 / (1 - _ALIKE) ** 2
#: Tiles without which nothing is said, and with which it is searched: of twice as many every other one. Turns that are
#: followed from one halving of the maps to the next.
_MIN_TILES, _SEARCHED, _FOLLOWED = 40, 1000, 1024
_CORNERS = np.array(list(product((-1, 1), repeat=3)))
#: A pose is believed where so many tiles, such a share of all, and of those that are found about there, lie within so
#: many pixels of where it puts them (78 photos of five stands: five wrong ones at most 0.016 and 0.28, right ones 0.021
#: and, but for one, 0.32 and more; another ground altogether 0.04 and 0.25, once 0.33).
_NEAR_PX, _MIN_NEAR, _NEAR_SHARE, _FOUND_SHARE = 1.5, 8, 0.02, 0.3
#: Photos have one picture of the ground together within so many metres; tiles that are looked at at once: memory.
_GROUP_M, _TILES_AT_ONCE = 150.0, 4096
#: Tiles are ties where a photo shows one with such a correlation, up to so many pixels of the picture off, and so many
#: of its own from the median of all.
_TIED, _TIE_REACH, _ASIDE_PX = 0.5, 4, 2.5


@dataclass(frozen=True)
class GroundPicture:
    """The ground as photos show it together. corner: (2,) local x, y of the north-western corner. ground: local x, y
    (N,) -> local height, NaN where unknown. grey: (H, W) uint8. tiles: (T, 2) row and column of the first pixel of the
    tiles that are shown. places: (T, 3) of their middles, local metres."""

    corner: np.ndarray
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray]
    grey: np.ndarray
    tiles: np.ndarray
    places: np.ndarray

    def draped(self, view: View, k: int) -> np.ndarray:
        """(H, W) uint8, a photo laid on the ground, 0 where it does not show it; pixels averaged k by k."""
        nodes = _nodes(self.corner, self.grey.shape, self.ground)
        return cv2.cvtColor(drape(view, nodes, self.grey.shape, k), cv2.COLOR_RGB2GRAY)

    def seen_by(self, view: View) -> np.ndarray:
        """Numbers of the tiles that a photo may show."""
        return np.flatnonzero(view.contains(view.project(self.places)[0]))


def shown_ground(block: Block) -> tuple[np.ndarray, Callable[[np.ndarray, np.ndarray], np.ndarray] | None]:
    """(N,) bool which photos show enough points near the ground that three photos prove, and the ground's height by
    local x, y; no ground where the points show none."""
    try:
        ground = dtm_from_sparse(block.points).height
    except InputError:
        return np.zeros(len(block.keypoints), bool), None
    with np.errstate(invalid="ignore"):
        near = np.abs(block.points[:, 2] - ground(block.points[:, 0], block.points[:, 1])) < LAYER_M
    near &= np.bincount(block.point, minlength=len(block.points)) >= 3
    shown = np.bincount(block.image[near[block.point]], minlength=len(block.keypoints))
    return shown >= _MIN_GROUND_POINTS, ground


def tie_to_ground(
    block: Block,
    store: FeatureStore,
    paths: list[Path],
    known: Known,
    pictures: dict[int, list[GroundPicture]],
    shown: np.ndarray,
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Turn the photos that show hardly a point of the ground to where they show its picture, and tie all that show it
    to its tiles; (N,) bool which were turned, and which should show it. Turned ones stand at their geotags, without
    other observations.

    Geotags that are not precise, or gimbals that are not known, say too little of where a photo looks: none is turned.
    paths: of the photos. pictures: of each flight, those of an earlier round; those of this one take their place.
    shown, ground: of :func:`shown_ground`.
    """
    turned, should = np.zeros((2, len(paths)), bool)
    if ground is None or known.gimbal is None or not known.is_precise:
        return turned, should
    aimed = np.isfinite(known.gimbal).all(axis=(1, 2))
    sure = block.is_posed & shown
    few = ~sure & aimed & np.isfinite(known.xyz).all(axis=1)
    if not few.any() or not (sure & aimed).any():
        return turned, should
    views = {i: replace(block.view(i), path=paths[i]) for i in np.flatnonzero(sure | few).tolist()}
    for flight in np.unique(block.sensor.flight[few]):
        pictures[int(flight)] = []
    for group in _neighbours(known.xyz, few, block.sensor.flight):
        # Shadows move: under one sun the ground is far more alike. And a compass errs otherwise from flight to flight.
        own = sure & (block.sensor.flight == block.sensor.flight[group[0]])
        is_first = own.sum() < _MIN_PHOTOS
        beside = sure if is_first else own
        errors = np.einsum("nij,nkj->ik", block.rotations[beside & aimed], known.gimbal[beside & aimed])
        views |= {i: _at(views[i], nearest_rotation(errors) @ known.gimbal[i], known.xyz[i]) for i in group}
        loose = [views[i] for i in group]
        picture = picture_of_ground([views[i] for i in np.flatnonzero(beside).tolist()], loose, ground)
        if picture is None:
            continue
        pictures[int(block.sensor.flight[group[0]])].append(picture)
        should[[i for i, view in views.items() if len(picture.seen_by(view)) >= _MIN_TILES]] = True
        found = list(in_threads(partial(turned_to_ground, picture=picture), loose))
        if is_first and sum(rotation is not None for rotation in found) < _FIRST_FOUND:
            found = list(in_threads(partial(turned_to_ground, picture=picture, reach_deg=_FIRST_REACH_DEG), loose))
        for i, rotation in zip(group, found, strict=True):
            if rotation is not None:
                turned[i], views[i] = True, _at(views[i], rotation, known.xyz[i])
    if turned.any():
        block.unpose(turned)
        for i in np.flatnonzero(turned).tolist():
            block.rotations[i], block.translations[i] = views[i].rotation, views[i].translation
        _tie(block, store, {i: views[i] for i in np.flatnonzero(sure | turned).tolist()}, sum(pictures.values(), []))
    return turned, should


def _neighbours(xyz: np.ndarray, chosen: np.ndarray, flight: np.ndarray) -> Iterator[list[int]]:
    """Numbers of the chosen of (N, 3) places in groups of one flight, (N,), no wider than :data:`_GROUP_M`."""
    for each in np.unique(flight[chosen]):
        own = np.flatnonzero(chosen & (flight == each))
        group = np.ones(1) if len(own) < 2 else fcluster(linkage(xyz[own, :2], "complete"), _GROUP_M, "distance")
        yield from (own[group == number].tolist() for number in np.unique(group))


def _at(view: View, rotation: np.ndarray, centre: np.ndarray) -> View:
    return replace(view, rotation=rotation, translation=-rotation @ centre)


def _tie(block: Block, store: FeatureStore, views: dict[int, View], pictures: list[GroundPicture]) -> None:
    """Tie photos, by their numbers, to the tiles that they show, in place of the ties of before."""
    block.keep(block.key < np.array([len(own.keypoints) for own in store.own])[block.image])
    firsts = len(block.points) + np.cumsum([0, *(len(picture.places) for picture in pictures[:-1])])

    def ties(view: View) -> tuple[np.ndarray, np.ndarray]:
        found = [ties_to_ground(view, picture) for picture in pictures]
        points = np.concatenate([first + tiles for first, (tiles, *_) in zip(firsts, found, strict=True)])
        pixels, off_px = (np.concatenate(each) for each in list(zip(*found, strict=True))[1:])
        # What is alike by chance lies anywhere about; the ground is off to one side at most.
        aside_px = np.linalg.norm(off_px - np.median(off_px, axis=0), axis=1) if len(off_px) else np.zeros(0)
        good = (aside_px < _ASIDE_PX) & _believed(aside_px, sum(len(picture.seen_by(view)) for picture in pictures))
        return points[good], pixels[good]

    points, pixels = zip(*in_threads(ties, list(views.values())), strict=True)
    key = store.with_places(list(views), list(pixels))
    block.add(np.repeat(list(views), [len(each) for each in points]), key, np.concatenate(points))
    block.points = np.concatenate([block.points, *(picture.places for picture in pictures)])
    block.keep(np.ones(len(block.image), bool))  # what one photo alone shows is no tie


def picture_of_ground(
    sure: list[View], loose: list[View], ground: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> GroundPicture | None:
    """The ground that the loose photos may show, as the sure ones have it; None where these are too few.

    sure: photos whose poses are believed. loose: as they may stand. ground: local x, y (N,) -> local height, NaN where
    unknown.
    """
    boxes = np.array([box for view in loose if (box := _about(view, ground)) is not None])
    if len(sure) < _MIN_PHOTOS or not len(boxes):
        return None
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    columns, rows = (STEP_PX * int(np.ceil(size / _PIXEL_M / STEP_PX)) for size in high - low)
    corner = np.array([low[0], high[1]])
    picture, gains = np.zeros((rows, columns, 4), np.uint8), dict[str, np.ndarray]()
    for top, left in ((top, left) for top in split(rows) for left in split(columns)):
        shape = top.stop - top.start, left.stop - left.start
        x0, y1 = corner + _PIXEL_M * np.array([left.start, -top.start])
        x1, y0 = x0 + _PIXEL_M * shape[1], y1 - _PIXEL_M * shape[0]
        if ((boxes[:, 0] < x1) & (boxes[:, 2] > x0) & (boxes[:, 1] < y1) & (boxes[:, 3] > y0)).any():
            picture[top, left] = ground_picture(sure, _nodes(np.array([x0, y1]), shape, ground), shape, gains)
    grey, shown = cv2.cvtColor(picture[..., :3], cv2.COLOR_RGB2GRAY), picture[..., 3] > 0
    tiles = np.stack(np.meshgrid(*[np.arange(0, size - _TILE, _APART) for size in (rows, columns)], indexing="ij"))
    tiles = tiles.reshape(2, -1).T
    of_tiles = [sliding_window_view(each, (_TILE, _TILE)) for each in (shown, grey)]
    good = []
    for part in np.array_split(tiles, len(tiles) // _TILES_AT_ONCE + 1):
        is_shown, contents = (each[part[:, 0], part[:, 1]] for each in of_tiles)
        good.append((is_shown.mean(axis=(1, 2)) >= _SHOWN) & (contents.std(axis=(1, 2)) >= _MIN_SPREAD))
    tiles = tiles[np.concatenate(good)]
    places = _places(corner, tiles + _TILE / 2, ground)
    known = np.isfinite(places[:, 2])
    return GroundPicture(corner, ground, grey, tiles[known], places[known])


def _places(corner: np.ndarray, at: np.ndarray, ground: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """(K, 3) local places of (K, 2) rows and columns of a picture; the first pixel's middle is at (0.5, 0.5)."""
    xy = corner + _PIXEL_M * at[:, ::-1] * np.array([1.0, -1.0])
    return np.column_stack([xy, ground(xy[:, 0], xy[:, 1])])


def _nodes(
    corner: np.ndarray, shape: tuple[int, ...], ground: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """(R, C, 3) places spread evenly from the middle of a picture's first pixel to that of its last."""
    rows, columns = (np.linspace(0.5, size - 0.5, size // STEP_PX + 2) for size in shape)
    at = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1)
    return _places(corner, at.reshape(-1, 2), ground).reshape(*at.shape[:2], 3)


def _about(view: View, ground: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray | None:
    """(4,) x0, y0, x1, y1 of the ground that a photo may show; None where it looks at none."""
    camera, level = view.camera, ground(*view.centre[:2, None])[0]
    corners = np.array([[u, v] for u in (0.0, camera.width) for v in (0.0, camera.height)])
    rays = view.rays(corners)
    height = view.centre[2] - (level if np.isfinite(level) else 0.0)
    away = rays[:, :2] * (height / np.maximum(-rays[:, 2:], 1e-3))
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True) / (_FAR * height), 1.0)
    if (rays[:, 2] >= 0).all() or height <= 0:
        return None
    places = view.centre[:2] + away
    return np.concatenate([places.min(axis=0), places.max(axis=0)])


def turned_to_ground(view: View, picture: GroundPicture, reach_deg: float = _REACH_DEG) -> np.ndarray | None:
    """(3, 3) rotation of a photo, so far from the one that it has, at which it shows the most of a picture of the
    ground; None where none is clear."""
    seen = picture.seen_by(view)
    if len(seen) < _MIN_TILES:
        return None
    tiles = seen[:: max(len(seen) // _SEARCHED, 1)]
    rays = picture.places[tiles] - view.centre
    away = np.linalg.norm(rays, axis=1)
    # A multiple of eight, as maps are halved three times.
    reach = 8 * int(np.radians(reach_deg) * np.median(away**2 / -rays[:, 2]) / _PIXEL_M / 8 + 1)
    # Of a byte each: a photo has a thousand tiles and more.
    found = np.empty((len(tiles), 2 * reach + 1, 2 * reach + 1), np.uint8)
    photo, weight, contents = _compared(view, picture, tiles, reach)
    for one, content, (row, column) in zip(found, contents, picture.tiles[tiles].tolist(), strict=True):
        around = photo[row : row + _TILE + 2 * reach, column : column + _TILE + 2 * reach]
        # Faster than OpenCV's normalised match, which takes the spread of what lies under each tile anew.
        alike = cv2.matchTemplate(around, content, cv2.TM_CCORR)
        alike *= weight[row : row + len(one), column : column + len(one)]
        one[:] = np.rint(_STEPS * np.clip(alike - _ALIKE, 0, None) ** 2)
    # Pixels (down, right) by which a place on the ground moves when its ray is turned about each axis, radians.
    moves = np.empty((len(tiles), 2, 3))
    for axis, turn in enumerate(np.eye(3)):
        on = np.cross(turn, rays)
        on -= rays * (on[:, 2] / rays[:, 2])[:, None]
        moves[:, :, axis] = on[:, 1::-1] * np.array([-1.0, 1.0]) / _PIXEL_M
    mean = rays.mean(axis=0)
    head = mean / np.linalg.norm(mean)
    tilts = np.linalg.pinv(moves.mean(axis=0))
    tilts -= head[:, None] * (head @ tilts)
    # A head moves the picture's rim by what a tilt moves its middle.
    rim = np.percentile(np.linalg.norm(moves @ head - (moves @ head).mean(axis=0), axis=1), 80)
    basis = np.column_stack([tilts, head / rim])
    maps = [found]
    for _ in range(3):
        maps.append(_halved(maps[-1]))
    tried = _grid(np.zeros(3), 8.0, np.ceil(np.array([reach, reach, np.radians(reach_deg) * rim]) / 8).astype(int))
    for halved in (3, 2, 1):
        score = _scores(maps[halved], moves @ basis / 2**halved, tried)
        best = tried[np.argsort(-score, kind="stable")[:_FOLLOWED]]
        tried = (best[:, None] + 2.0 ** (halved - 2) * _CORNERS).reshape(-1, 3)
    tried = _grid(best[0], 0.5, np.array([6, 6, 6]))
    turn = tried[_scores(found, moves @ basis, tried).argmax()]
    # Where the ground of the picture lies is where the photo shows it once the photo is turned back.
    rotation = view.rotation @ Rotation.from_rotvec(basis @ turn).as_matrix()
    there = _at(view, rotation, view.centre)
    _, _, off_px = ties_to_ground(there, picture)
    return rotation if _believed(np.linalg.norm(off_px, axis=1), len(seen)) else None


def _believed(off_px: np.ndarray, seen: int) -> bool:
    """Whether a photo shows the picture's ground: (K,) how far tiles found in it are off, of so many it may show."""
    near = int((off_px < _NEAR_PX).sum())
    return near >= max(_MIN_NEAR, _NEAR_SHARE * seen, _FOUND_SHARE * len(off_px))


def _grid(middle: np.ndarray, step: float, counts: np.ndarray) -> np.ndarray:
    """(Q, 3) places about a middle (3,), so many steps along each axis."""
    axes = [np.arange(-count, count + 1) for count in counts]
    return middle + step * np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _halved(found: np.ndarray) -> np.ndarray:
    """Each map at half its size, the largest of what lies about each of its pixels."""
    return np.stack([cv2.dilate(each, np.ones((3, 3), np.uint8))[::2, ::2] for each in found])


def ties_to_ground(view: View, picture: GroundPicture) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(K,) numbers of the tiles that a photo shows, (K, 2) its pixels there, and (K, 2) by how much these are off where
    its pose puts them."""
    tiles = picture.seen_by(view)
    if not len(tiles):
        return tiles, np.zeros((0, 2)), np.zeros((0, 2))
    photo, weight, contents = _compared(view, picture, tiles, _TIE_REACH)
    size, (row, column) = 2 * _TIE_REACH + 1, picture.tiles[tiles].T
    around = sliding_window_view(photo, (_TILE + size - 1,) * 2)[row, column]
    products = irfft2(rfft2(around) * rfft2(contents, around.shape[1:]).conj(), around.shape[1:])[:, :size, :size]
    alike = products * sliding_window_view(weight, (size, size))[row, column]
    flat = alike.reshape(len(tiles), -1)
    down, right = np.divmod(flat.argmax(axis=1), 2 * _TIE_REACH + 1)
    inner = (np.minimum(down, right) > 0) & (np.maximum(down, right) < 2 * _TIE_REACH) & (flat.max(axis=1) >= _TIED)
    tiles, alike, down, right = tiles[inner], alike[inner], down[inner], right[inner]
    own = np.arange(len(tiles))
    middle, moved = alike[own, down, right], []
    for low, high in (
        (alike[own, down - 1, right], alike[own, down + 1, right]),
        (alike[own, down, right - 1], alike[own, down, right + 1]),
    ):  # the top of a parabola
        moved.append(0.5 * (low - high) / np.minimum(low + high - 2 * middle, -1e-6))
    at = picture.tiles[tiles] + _TILE / 2 + np.column_stack([down, right]) - _TIE_REACH + np.column_stack(moved)
    pixels = view.project(_places(picture.corner, at, picture.ground))[0]
    good = view.contains(pixels)
    tiles, pixels = tiles[good], pixels[good]
    return tiles, pixels, pixels - view.project(picture.places[tiles])[0]


def _compared(
    view: View, picture: GroundPicture, tiles: np.ndarray, reach: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(H, W) float32: a photo laid on a picture's ground, so many pixels more on each side; (H, W) float32: times which
    the sum of its products with a tile that begins there is their correlation; (T, 14, 14) float32: the tiles, of mean
    zero and s.d. one."""
    away = float(np.median(np.linalg.norm(picture.places[tiles] - view.centre, axis=1)))
    photo = np.pad(picture.draped(view, max(int(_PIXEL_M * view.camera.fx / away), 1)), reach)
    side, corner = (_TILE, _TILE), (0, 0)
    mean = cv2.boxFilter(photo, cv2.CV_32F, side, anchor=corner)
    variance = cv2.sqrBoxFilter(photo, cv2.CV_32F, side, anchor=corner) - mean**2
    weight = np.where(variance > _MIN_VARIANCE, 1 / (_TILE**2 * np.sqrt(np.maximum(variance, _MIN_VARIANCE))), 0)
    windows = sliding_window_view(picture.grey, (_TILE, _TILE))
    contents = windows[picture.tiles[tiles, 0], picture.tiles[tiles, 1]].astype(np.float32)
    contents -= contents.mean(axis=(1, 2), keepdims=True)
    contents /= contents.std(axis=(1, 2), keepdims=True)
    return photo.astype(np.float32), weight.astype(np.float32), contents


@njit(parallel=True, **EXACT)
def _scores(found, moves, turns):  # pragma: no cover - compiled
    """(Q,) how much (T, K, K) tiles speak for each of (Q, 3) turns; moves: (T, 2, 3) pixels a unit of each."""
    reach = found.shape[1] // 2
    score = np.zeros(len(turns))
    for q in prange(len(turns)):
        a, b, c = turns[q]
        for t in range(len(found)):
            down = int(np.floor(moves[t, 0, 0] * a + moves[t, 0, 1] * b + moves[t, 0, 2] * c + 0.5)) + reach
            right = int(np.floor(moves[t, 1, 0] * a + moves[t, 1, 1] * b + moves[t, 1, 2] * c + 0.5)) + reach
            if 0 <= down < found.shape[1] and 0 <= right < found.shape[2]:
                score[q] += found[t, down, right]
    return score
