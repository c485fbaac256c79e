"""Barks of several kinds, moss and lichen on them, and the weathered wood of snags.

Tiles are periodic both ways, 5 mm a texel along the stem; one turn of a stem is half a tile's width.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from .scene import PlantedStem
from .sensor import linear_light
from .textures import bark, encode, read_photographs

#: The tiles, in their order; stems draw from all but the last, which is for snags.
BARKS = ("furrowed plates", "smooth grey", "pale with lenticels", "dark furrows", "reddish flakes", "weathered wood")
WEATHERED = len(BARKS) - 1
_SHAPE = (1024, 512)


@dataclass(frozen=True)
class Barks:
    """tiles: (T, h, w, 3) uint8 root code. tile: (S,) int32 of each stem. cover: (S, 2) float32 shares of a stem's bark
    under moss (mean of the lowest 2 m) and under lichen. masks: (2, h, w) uint8, at which share of 255 each texel is
    covered by moss and by lichen. photographed: the tiles are photographs, but the last."""

    tiles: np.ndarray
    tile: np.ndarray
    cover: np.ndarray
    masks: np.ndarray
    photographed: bool = False

    @staticmethod
    def plain(tile: np.ndarray, count: int) -> Barks:
        """One (h, w, 3) tile for ``count`` stems, nothing on it."""
        nothing = np.zeros((2, 1, 1), np.uint8)
        return Barks(tile[None], np.zeros(count, np.int32), np.zeros((count, 2), np.float32), nothing)


def _noise(rng: np.random.Generator, along: float, around: float) -> np.ndarray:
    """(h, w) periodic noise of unit spread; ``along``, ``around``: its smoothing in texels."""
    field = gaussian_filter(rng.standard_normal(_SHAPE, dtype=np.float32), (along, around), mode="wrap")
    return field / field.std()


def _smooth_grey(rng: np.random.Generator) -> np.ndarray:
    tone = 0.30 * np.exp(0.14 * _noise(rng, 24, 20) + 0.07 * _noise(rng, 1.5, 12) + 0.05 * _noise(rng, 0.8, 0.8))
    scar = np.clip(_noise(rng, 4, 6) - 2.6, 0, 1)
    return (tone * (1 - 0.8 * scar))[..., None] * np.array([1.0, 0.98, 0.92], np.float32)


def _pale_lenticels(rng: np.random.Generator) -> np.ndarray:
    colour = (0.58 * np.exp(0.10 * _noise(rng, 16, 12)))[..., None] * np.array([1.0, 0.97, 0.90], np.float32)
    dashes = np.clip(2.5 * (_noise(rng, 0.9, 7) - 1.5), 0, 1)
    patches = np.clip(2.0 * (_noise(rng, 12, 9) - 1.6), 0, 1)
    dark = np.maximum(0.75 * dashes, patches)[..., None]
    return colour + dark * (np.array([0.07, 0.06, 0.055], np.float32) - colour)


def _dark_furrows(rng: np.random.Generator) -> np.ndarray:
    relief = _noise(rng, 22, 2.6) + 0.6 * _noise(rng, 8, 1.6) + 0.25 * _noise(rng, 0.8, 0.7)
    tone = 0.095 * np.exp(0.75 * np.clip(relief / relief.std(), -2, 2))
    return tone[..., None] * np.array([1.0, 0.93, 0.83], np.float32)


def _reddish_flakes(rng: np.random.Generator) -> np.ndarray:
    plates = np.round(1.5 * _noise(rng, 9, 5)) / 1.5
    tone = 0.19 * np.exp(0.40 * plates + 0.15 * _noise(rng, 1.2, 0.9))
    grey = np.clip(_noise(rng, 30, 16), 0, 1.5)[..., None] / 3
    red, dull = np.array([1.35, 0.78, 0.47], np.float32), np.array([1.0, 0.88, 0.76], np.float32)
    return tone[..., None] * (red * (1 - grey) + dull * grey)


def _weathered_wood(rng: np.random.Generator) -> np.ndarray:
    tone = 0.34 * np.exp(0.22 * _noise(rng, 60, 1.5) + 0.14 * _noise(rng, 40, 30) + 0.06 * _noise(rng, 0.8, 0.7))
    cracks = np.clip(_noise(rng, 50, 1.0) - 1.9, 0, 1)
    return (tone * (1 - 0.7 * cracks))[..., None] * np.array([1.0, 0.96, 0.90], np.float32)


_MAKERS = (_smooth_grey, _pale_lenticels, _dark_furrows, _reddish_flakes, _weathered_wood)


def _mask(rng: np.random.Generator, size: float) -> np.ndarray:
    """(h, w) uint8: ranks of blotches of that size in texels, all equally frequent."""
    field = _noise(rng, size, size) + 0.5 * _noise(rng, 0.35 * size, 0.35 * size)
    rank = np.empty(field.size)
    rank[np.argsort(field, axis=None)] = np.arange(field.size) / field.size
    return (255 * rank).astype(np.uint8).reshape(_SHAPE)


def photographed(folder: Path) -> list[np.ndarray]:
    """Tiles of the photographs in a folder, each four times along and twice around.

    Raises:
        InputError: none is there.
    """
    photos = read_photographs(folder, "seamless ones of bark")
    size = (_SHAPE[1] // 2, _SHAPE[0] // 4)
    small = (cv2.resize(photo[..., :3], size, interpolation=cv2.INTER_AREA) for photo in photos)
    return [np.tile(encode(linear_light(photo / np.float32(255))), (4, 2, 1)) for photo in small]


def make_barks(
    rng: np.random.Generator, own: np.random.Generator, stems: list[PlantedStem], photos: Path | None = None
) -> Barks:
    """The bark of every stem. rng: of the furrowed plates, which every stand has; own: of everything else; photos: a
    folder for :func:`photographed`."""
    plain = Barks.plain(bark(rng, _SHAPE[1], _SHAPE[0]), len(stems))
    tile = np.array([stem.look.bark for stem in stems], np.int32)
    cover = np.array([(stem.look.moss, stem.look.lichen) for stem in stems], np.float32).reshape(-1, 2)
    if not tile.any() and not cover.any() and photos is None:
        return plain
    tiles = [plain.tiles[0], *(encode(maker(own)) for maker in _MAKERS)]
    if photos is not None:
        taken = photographed(photos)
        tile = np.where(tile == WEATHERED, len(taken), tile % len(taken)).astype(np.int32)
        tiles = [*taken, tiles[WEATHERED]]
    masks = np.stack([_mask(own, 7.0), _mask(own, 4.0)])
    return Barks(np.array(tiles), tile, cover, masks, photos is not None)
