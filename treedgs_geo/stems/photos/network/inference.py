"""What each pixel of a photo shows, by a small network: stem, foliage, other wood, ivy on a stem or ground.

The network sees photos as plumb maps (:mod:`.images.vertical_rectification`): every vertical line is a column, so
that a stem stands upright wherever the camera was. It was trained on simulated photos only; how, and what it brings,
is in ``docs/evidence/stem-network.md``. OpenCV runs it: no other library is needed.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange
from scipy.special import expit

from ....core.files import read_json
from ....core.machine import FAST, ahead, release_memory
from ..images.crops import PhotoArrays, PhotoStack
from ..images.vertical_rectification import PlumbGrid, row_knots
from ..tuned import COLUMN_M, GROUND_RATIO, RAREST_STEM

#: Classes of the network, in the order of its outputs.
CLASSES = ("ground", "stem", "foliage", "wood", "ivy")
STEM = CLASSES.index("stem")
#: Rows and columns of a map are multiples of this for the network.
MULTIPLE = 16
#: The network's file: JSON with the ONNX file as base64, because the QGIS plugin repository takes no binaries.
WEIGHTS = Path(__file__).with_name("stem_net.json")
#: Log odds are kept within this: the network knows no more.
MAX_ODDS = 5.0
#: Log odds are stored in this part of a unit, and this for a place outside of the photo.
STEPS, OUTSIDE = 127 // MAX_ODDS, np.iinfo(np.int8).min


class OddsMaps(NamedTuple):
    """Log odds, or log likelihood ratios, of what a pixel shows, for V photos as plumb maps; the compiled kernels take
    it as it is.

    odds: (N,) int8, all maps one after the other, row-major, in units of 1 / :data:`STEPS`; :data:`OUTSIDE` where the
    photo shows nothing. start: (V,) int64 first entry. shape: (V, 2) int64 rows and columns. grid: (V, 4) float64
    azimuth of column 0, column width, nadir angle of row 0, row height, rad. centre: (V, 3) cameras.
    """

    odds: np.ndarray
    start: np.ndarray
    shape: np.ndarray
    grid: np.ndarray
    centre: np.ndarray


@njit(parallel=True, **FAST)
def _resample(photos, view, azimuth0, step_a, nadir0, step_n, high, wide, colour, good):
    cam, corner, shape = photos.camera[view], photos.corner[view], photos.shape[view]
    pixels, start, centre = photos.pixels, photos.start[view], photos.centre[view]
    rows, columns = shape[0], shape[1]
    n_rows, n_cols = good.shape
    for i in prange(n_rows):
        total, seen = np.zeros((n_cols, 3)), np.zeros(n_cols, np.int64)
        for part in range(high):
            angle = nadir0 + (i * high + part) * step_n
            ku, kv = row_knots(cam, corner, centre, angle, azimuth0, step_a, n_cols * wide)
            for m in range(n_cols * wide):
                k = m // 16
                t = (m - k * 16) / 16.0
                u = ku[k] + t * (ku[k + 1] - ku[k])
                v = kv[k] + t * (kv[k + 1] - kv[k])
                if u < 0 or v < 0 or u > columns - 1 or v > rows - 1:
                    continue
                j = m // wide
                seen[j] += 1
                top, left = min(int(v), rows - 2), min(int(u), columns - 2)
                down, across = v - top, u - left
                at = start + (top * columns + left) * 3
                below = at + columns * 3
                for channel in range(3):
                    total[j, channel] += (pixels[at + channel] * (1 - across) + pixels[at + 3 + channel] * across) * (
                        1 - down
                    ) + (pixels[below + channel] * (1 - across) + pixels[below + 3 + channel] * across) * down
        for j in range(n_cols):
            if seen[j] == high * wide:
                good[i, j] = True
                for channel in range(3):
                    colour[i, j, 2 - channel] = np.uint8(total[j, channel] / seen[j] + 0.5)


def network_grid(plumb: PlumbGrid) -> tuple[PlumbGrid, tuple[int, int]]:
    """The grid on which the network sees a photo, and how many rows and columns of ``plumb`` are one of its own:
    columns of about :data:`.tuned.COLUMN_M` where the stems stand, and rows twice as high, because stems are long."""
    wide = max(round(COLUMN_M / (plumb.step_a * plumb.middle_m)), 1)
    cell = 2 * wide, wide
    rows, columns = (-(-n // (each * MULTIPLE)) * MULTIPLE for n, each in zip(plumb.shape, cell, strict=True))
    grid = plumb._replace(
        azimuth0=plumb.azimuth0 + 0.5 * (cell[1] - 1) * plumb.step_a,
        step_a=cell[1] * plumb.step_a,
        nadir0=plumb.nadir0 + 0.5 * (cell[0] - 1) * plumb.step_n,
        step_n=cell[0] * plumb.step_n,
        shape=(rows, columns),
    )
    return grid, cell


def plumb_colours(photos: PhotoArrays, view: int, plumb: PlumbGrid) -> tuple[np.ndarray, np.ndarray]:
    """(rows, columns, 3) uint8 RGB of one photo on the network's grid (:func:`network_grid`), and (rows, columns) bool:
    inside it. plumb: of the photo."""
    grid, cell = network_grid(plumb)
    colour, good = np.zeros((*grid.shape, 3), np.uint8), np.zeros(grid.shape, np.bool_)
    _resample(photos, view, plumb.azimuth0, plumb.step_a, plumb.nadir0, plumb.step_n, *cell, colour, good)
    return colour, good


@njit(**FAST)
def _tone(colour, good):
    """Mean of each channel over a photo, 0..1, and the spread of the brightness; from whole numbers, so exact."""
    sums, square, count = np.zeros(4, np.int64), np.int64(0), 0
    for i in range(good.shape[0]):
        for j in range(good.shape[1]):
            if good[i, j]:
                both = np.int64(0)
                for channel in range(3):
                    value = np.int64(colour[i, j, channel])
                    sums[channel] += value
                    both += value
                sums[3] += both
                square += both * both
                count += 1
    mean = sums[3] / max(count, 1)
    spread = np.sqrt(max(square / max(count, 1) - mean * mean, 0.0)) / (3 * 255)
    return sums[:3] / (255 * max(count, 1)), spread


def normalised(colour: np.ndarray, good: np.ndarray) -> np.ndarray:
    """(rows, columns, 3) uint8 -> (3, rows, columns) float32 that exposure and white balance hardly change: each
    channel about its mean, over the spread of the brightness; 0 outside."""
    mean, spread = _tone(colour, good)
    image = (colour.astype(np.float32) / 255 - mean.astype(np.float32)) / np.float32(max(float(spread), 0.02))
    image[~good] = 0
    return np.ascontiguousarray(image.transpose(2, 0, 1))


def read_network(path: Path = WEIGHTS) -> Any:
    """The network of a file, for :func:`network_shares`; once run it holds 100 MB."""
    import cv2

    packed = "".join(read_json(path)["onnx_base64"])
    return cv2.dnn.readNetFromONNX(np.frombuffer(base64.b64decode(packed), np.uint8))


def network_shares(network: Any, image: np.ndarray) -> np.ndarray:
    """(3, rows, columns) float32 of :func:`normalised` -> (5, rows, columns) probabilities of the classes. network: of
    :func:`read_network`."""
    network.setInput(image[None])
    scores = network.forward()[0]
    share = np.exp(scores - scores.max(axis=0))
    return share / share.sum(axis=0)


def class_odds(shares: np.ndarray, *wanted: str) -> np.ndarray:
    """(5, rows, columns) probabilities of the classes -> (rows, columns) log odds of the wanted ones against all
    others."""
    yes = np.sum([shares[CLASSES.index(name)] for name in wanted], axis=0).clip(1e-6, 1 - 1e-6)
    return np.log(yes / (1 - yes)).clip(-MAX_ODDS, MAX_ODDS)


class NetworkMaps(NamedTuple):
    """What the network sees in V photos."""

    #: Log odds of bark, and of bark or ivy.
    bark: OddsMaps
    either: OddsMaps
    #: Log likelihood ratio of a stem, ivy on it or not, in the line of sight (:func:`stem_ratios`).
    stem: OddsMaps


def network_maps(stack: PhotoStack, plumbs: list[PlumbGrid]) -> NetworkMaps:
    """What the network sees in the photos of a stack. plumbs: their grids."""

    def seen() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        network = read_network()
        for view, plumb in enumerate(plumbs):
            colour, good = plumb_colours(stack.arrays, view, plumb)
            yield network_shares(network, normalised(colour, good)), good

    grids = [network_grid(plumb)[0] for plumb in plumbs]
    shape = np.array([grid.shape for grid in grids], np.int64).reshape(-1, 2)
    ends = np.cumsum(shape.prod(axis=1))
    start = ends - shape.prod(axis=1)
    wanted = ("stem",), ("stem", "ivy"), ("ground",)
    odds = np.empty((len(wanted), ends[-1]), np.int8)
    for view, (shares, good) in enumerate(ahead(seen())):
        for row, classes in zip(odds, wanted, strict=True):
            row[start[view] : ends[view]] = quantised(class_odds(shares, *classes), good).ravel()
    either, ground = (np.split(row, start[1:]) for row in odds[1:])
    odds[2] = np.concatenate(stem_ratios(either, ground))
    release_memory()
    grid = np.array([grid[:4] for grid in grids], float)
    return NetworkMaps(*(OddsMaps(row, start, shape, grid, stack.centre) for row in odds))


def stem_ratios(either: list[np.ndarray], ground: list[np.ndarray]) -> list[np.ndarray]:
    """Log likelihood ratio of a stem in the line of sight of each pixel, by the log odds of bark or ivy and of ground:
    V maps each, int8 of :func:`quantised`.

    Ground speaks against a stem, and what may stand in front of one (leaves, other wood) says nothing: a stem is hidden
    as often as such things are seen at all, and where it is not, it is seen.
    """

    def both(view: int) -> np.ndarray:
        return either[view].view(np.uint8) * np.uint16(256) + ground[view].view(np.uint8)

    count = np.sum([np.bincount(both(view).ravel(), minlength=1 << 16) for view in range(len(either))], axis=0)
    value = np.arange(256, dtype=np.uint8).view(np.int8)
    outside = (value == OUTSIDE)[:, None] | (value == OUTSIDE)
    inside = np.where(outside, 0, count.reshape(256, 256))
    stem, behind = expit(value / STEPS)[:, None], expit(value / STEPS)
    before = np.maximum(1 - stem - behind, 0.0)
    often_stem, often_before = ((inside * part).sum() / max(inside.sum(), 1) for part in (stem, before))
    ratio = (1 - often_before) / max(often_stem, RAREST_STEM) * stem + before + GROUND_RATIO * behind
    table = quantised(np.clip(np.log(ratio), -MAX_ODDS, MAX_ODDS), ~outside).ravel()
    return [table[both(view)] for view in range(len(either))]


def quantised(odds: np.ndarray, good: np.ndarray) -> np.ndarray:
    """(rows, columns) log odds, and where the photo shows something -> int8 as :class:`OddsMaps` keeps them."""
    return np.where(good, np.round(STEPS * odds).astype(np.int8), np.int8(OUTSIDE))
