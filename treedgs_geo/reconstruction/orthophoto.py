"""The ground as photos show it from above, below the crowns: each place from the photos that see the ground there.

Photos are draped on the terrain model. Where two of them see the ground they show the same; where one sees a crown or a
stem in front of it, every other photo shows something else at that place, or the same thing elsewhere. So photos that
correlate there with several others count, and a crown that hides the ground in most photos does not. Zero-mean
normalised cross-correlation: Lewis 1995, "Fast normalized cross-correlation"; its sum over photos as evidence of a
surface: Goesele, Curless and Seitz 2006, "Multi-view stereo revisited".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ..core.crs import LocalFrame
from ..core.files import atomic_path, temporary_beside
from ..core.machine import in_threads
from ..core.progress import Reporter
from .cameras import View
from .images import FINEST_GSD_M, load_image, shrink, shrink_factor, shrunk_camera
from .multi_view_correlation import between

#: Side of the pieces that are made at once, and what they overlap on each side, pixels; photos in one at most.
_PIECE_PX, _RIM_PX, MAX_PHOTOS = 1024, 24, 64
#: The same of a picture that is written and places nothing: more photos show hardly more of it (plot_a 99.7 % for 99.6,
#: plot_h 96.1 % for 95.5), and larger pieces read each photo less often.
_WRITTEN_PX, _WRITTEN_PHOTOS = 1344, 40
#: Photos are compared at every eighth pixel, in windows of 7 x 7 pixels of half the size.
STEP_PX, _WINDOW = 8, 7
#: Correlation below which two photos do not show the same; grey values squared added to a window's variance.
_MIN_ALIKE, _MIN_VARIANCE = 0.4, 9.0
#: The weight of a photo is its agreement to this power: the best photos make the picture, seams are blended.
_POWER = 16.0
#: Below this agreement nothing is shown. Chance reaches it where shadows are strong: draped on the air 4 m above the
#: ground, 9 % of plot_a and 65 % of plot_h would be shown; on the ground 99.7 and 96 %.
AGREED = 0.018


def write_orthophoto(
    path: Path,
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    frame: LocalFrame,
    box: tuple[float, float, float, float],
    reporter: Reporter,
) -> dict[str, float]:
    """Write the orthophoto of the ground: a Cloud-Optimised GeoTIFF (RGB, JPEG, overviews, in the project CRS), with a
    mask of the places where no two photos agree on what is there.

    views: registered photos. ground: local x, y (N,) -> local height, NaN where unknown. box: local x0, y0, x1, y1.

    Returns:
        ``gsd_m``: the pixel, that of the finest photo on the ground, whole millimetres, 8 or more; ``seen``: share of
        the box that is shown.

    Raises:
        InputError: a photo is missing or broken. OutputError: the file cannot be written.
    """
    import rasterio
    import rasterio.shutil
    from affine import Affine
    from rasterio.windows import Window

    middle = np.array([(box[0] + box[2]) / 2, (box[1] + box[3]) / 2])
    centre = np.array([*middle, np.nan_to_num(ground(middle[:1], middle[1:]))[0]])
    pixel = np.array([_pixel_m(view, centre) for view in views])
    gsd = float(np.ceil(1000 * max(pixel.min(), FINEST_GSD_M) - 0.1) / 1000)
    low, high = frame.to_project(np.array([[*box[:2], 0], [*box[2:], 0]]))[:, :2]
    west, north = np.floor(low[0] / gsd) * gsd, np.ceil(high[1] / gsd) * gsd
    columns, rows = int(np.ceil((high[0] - west) / gsd)), int(np.ceil((north - low[1]) / gsd))
    profile = {"driver": "GTiff", "width": columns, "height": rows, "count": 3, "dtype": "uint8", "tiled": True}
    profile |= {"crs": frame.crs.to_wkt(), "transform": Affine(gsd, 0, west, 0, -gsd, north), "photometric": "RGB"}
    gains: dict[str, np.ndarray] = {}
    parts = [(top, left) for top in split(rows, _WRITTEN_PX) for left in split(columns, _WRITTEN_PX)]
    seen = 0
    with atomic_path(path) as made, temporary_beside(path) as plain:
        with (
            rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True),
            rasterio.open(plain, "w", **profile, BIGTIFF="IF_SAFER") as target,
        ):
            for number, (top, left) in enumerate(parts):
                place = np.array([west + left.start * gsd, north - top.start * gsd])
                shape = top.stop - top.start, left.stop - left.start
                part = _piece(views, ground, frame, place, gsd, shape, gains)
                seen += int(np.count_nonzero(part[..., 3]))
                window = Window(left.start, top.start, shape[1], shape[0])
                target.write(np.moveaxis(part[..., :3], 2, 0), window=window)
                target.write_mask(part[..., 3], window=window)
                reporter.progress((number + 1) / len(parts))
        options = {"compress": "JPEG", "quality": 90, "blocksize": 512, "overview_resampling": "average"}
        rasterio.shutil.copy(plain, made, driver="COG", **options)
    return {"gsd_m": gsd, "seen": round(seen / (rows * columns), 3)}


def split(size: int, piece_px: int = _PIECE_PX) -> list[slice]:
    """Equal pieces of whole steps, at most ``piece_px``."""
    step = -(-size // (-(-size // piece_px) * STEP_PX)) * STEP_PX
    return [slice(start, min(start + step, size)) for start in range(0, size, step)]


def _pixel_m(view: View, place: np.ndarray) -> float:
    """The longer side of a photo's pixel on level ground at a place (3,), metres; of the photo as it is used."""
    ray = place - view.centre
    depth = float(view.rotation[2] @ ray)
    if depth <= 0 or ray[2] >= 0:
        return np.inf
    focal = view.camera.fx / shrink_factor(view.camera, depth)
    return depth / focal * float(np.linalg.norm(ray)) / -float(ray[2])


def _piece(
    views: list[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    frame: LocalFrame,
    corner: np.ndarray,
    gsd: float,
    shape: tuple[int, int],
    gains: dict[str, np.ndarray],
) -> np.ndarray:
    """(rows, columns, 4) uint8, RGB and whether it is shown. corner: (2,) north-western, project coordinates. gains: as
    :func:`ground_picture`."""
    rows, columns = (-(-size // STEP_PX) * STEP_PX + 2 * _RIM_PX for size in shape)
    x = corner[0] + (np.linspace(0.5, columns - 0.5, columns // STEP_PX + 2) - _RIM_PX) * gsd
    y = corner[1] - (np.linspace(0.5, rows - 0.5, rows // STEP_PX + 2) - _RIM_PX) * gsd
    nodes = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), frame.origin[2])], axis=2)
    local = frame.to_local(nodes.reshape(-1, 3))
    local[:, 2] = ground(local[:, 0], local[:, 1])
    picture = ground_picture(views, local.reshape(nodes.shape), (rows, columns), gains, _WRITTEN_PHOTOS)
    return picture[_RIM_PX : _RIM_PX + shape[0], _RIM_PX : _RIM_PX + shape[1]]


def ground_picture(
    views: list[View],
    nodes: np.ndarray,
    shape: tuple[int, int],
    gains: dict[str, np.ndarray],
    max_photos: int = MAX_PHOTOS,
) -> np.ndarray:
    """(rows, columns, 4) uint8 of the ground, RGB and whether it is shown (0 or 255).

    nodes: (R, C, 3) places spread evenly from the first pixel's centre to the last's, local metres, NaN where the
    height is unknown. shape: rows and columns, multiples of :data:`STEP_PX`. gains: factors of the colours of the
    photos levelled so far, by name, filled. max_photos: those of the finest pixels.
    """
    rows, columns = shape
    known = nodes[np.isfinite(nodes[..., 2])]
    result = np.zeros((*shape, 4), np.uint8)
    if not len(known):
        return result
    middle = known[len(known) // 2]
    pixel = np.array([_pixel_m(view, middle) for view in views])
    used = [i for i in np.argsort(pixel, kind="stable") if np.isfinite(pixel[i])]
    used = [i for i in used if views[i].contains(views[i].project(known[::7])[0]).mean() > 0.02][:max_photos]
    if len(used) < 2:
        return result

    def draped(i: int) -> np.ndarray:
        k = shrink_factor(views[i].camera, float(views[i].rotation[2] @ (middle - views[i].centre)))
        return drape(views[i], nodes, shape, k)

    stack = list(in_threads(draped, used))
    agreement = agreement_of(stack) * (pixel[used].min() / pixel[used])[:, None, None].astype(np.float32)
    best = agreement.max(axis=0)
    share = agreement / np.maximum(best, 1e-6)
    _level(stack, share, [views[i].name for i in used], gains)
    total, weights = np.zeros((rows, columns, 3), np.float32), np.full((rows, columns), 1e-9, np.float32)
    for i, image, weight in zip(used, stack, share**_POWER, strict=True):
        if weight.max() > 0.01:
            wide = cv2.resize(weight, (columns, rows), interpolation=cv2.INTER_LINEAR) * (image[..., 0] > 0)
            factors = cv2.merge([wide * gain for gain in gains[views[i].name]])
            cv2.accumulateProduct(factors, image.astype(np.float32), total)
            weights += wide
    shown = (cv2.resize(best, (columns, rows), interpolation=cv2.INTER_LINEAR) >= AGREED) & (weights > 0.01)
    result[..., :3] = np.clip(np.rint(total / weights[..., None]), 0, 255) * shown[..., None]
    result[..., 3] = 255 * shown
    return result


def drape(view: View, nodes: np.ndarray, shape: tuple[int, int], k: int) -> np.ndarray:
    """(rows, columns, 3) uint8 of a photo laid on the ground, 0 where it does not show it.

    nodes: (R, C, 3) places spread evenly from the first pixel's centre to the last's, local metres. k: pixels of the
    photo that are averaged on each side.
    """
    small = replace(view, camera=shrunk_camera(view.camera, k))
    width, height = k * small.camera.width, k * small.camera.height
    pixels = small.project(nodes.reshape(-1, 3))[0].reshape(*nodes.shape[:2], 2) - 0.5
    pixels = np.where(np.isfinite(pixels), pixels, -1e6)
    map_x, map_y = (between(pixels[..., axis], shape[1], shape[0]) for axis in (0, 1))
    image = np.maximum(shrink(load_image(view)[:height, :width], k), 1)
    return cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR, borderValue=0)


def agreement_of(stack: list[np.ndarray]) -> np.ndarray:
    """How much each of V draped photos, (H, W, 3) uint8, shows what others show: (V, H / 8, W / 8) float32, the mean
    excess of its correlations with those that show the place over the least that counts."""
    return agreement_of_halves(
        [cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for image in stack]
    )


def agreement_of_halves(half: list[np.ndarray]) -> np.ndarray:
    """The same of photos draped at half the size, (H / 2, W / 2, 3) uint8."""
    grey = np.array([cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in half])
    step, rim = STEP_PX // 2, _WINDOW // 2
    grey = np.pad(grey, ((0, 0), (rim, rim), (rim, rim)))
    windows = np.lib.stride_tricks.sliding_window_view(grey, (_WINDOW, _WINDOW), (1, 2))
    windows = windows[:, step // 2 :: step, step // 2 :: step]

    def along(row: int) -> np.ndarray:
        """(V, columns) of one row."""
        piece = np.moveaxis(windows[:, row], 0, 1).reshape(windows.shape[2], len(half), -1).astype(np.float32)
        hidden = (piece == 0).any(axis=2)
        piece -= piece.mean(axis=2, keepdims=True)
        piece /= np.sqrt((piece**2).sum(axis=2, keepdims=True) + _MIN_VARIANCE * _WINDOW**2)
        piece[hidden] = 0
        alike = np.maximum(piece @ piece.transpose(0, 2, 1) - np.float32(_MIN_ALIKE), 0)
        others = np.maximum((~hidden).sum(axis=1, keepdims=True) - 1, 1)
        return ((alike.sum(axis=2) - np.diagonal(alike, axis1=1, axis2=2)) / others).T.astype(np.float32)

    found = np.stack(list(in_threads(along, range(windows.shape[1]))), axis=1)
    return np.array([cv2.GaussianBlur(photo, (0, 0), 1.0) for photo in found])


def _level(stack: list[np.ndarray], share: np.ndarray, names: list[str], gains: dict[str, np.ndarray]) -> None:
    """Fill in the (3,) factors that bring the colours of photos to those of the others where they agree; photos that
    have one keep it."""
    size = share.shape[2], share.shape[1]
    tone = np.log([cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.float32) + 1 for image in stack])
    fixed = np.array([name in gains for name in names])
    gain = np.array([np.log(gains.get(name, np.ones(3))) for name in names])
    weight = share[..., None]
    for _ in range(4):
        level = (weight * (tone + gain[:, None, None])).sum(axis=0) / (weight.sum(axis=0) + 1e-6)
        apart = (weight * (level - tone)).sum(axis=(1, 2)) / (weight.sum(axis=(1, 2)) + 1.0)
        gain[~fixed] = apart[~fixed] - (0.0 if fixed.any() else apart.mean(axis=0))
    gains.update({name: np.exp(one).astype(np.float32) for name, one in zip(names, gain, strict=True)})
