"""Learned features, which tell how photos are turned where SIFT has too little: under another sun, from another height
(XFeat; Potje et al. 2024, "XFeat: Accelerated Features for Lightweight Image Matching", CVPR).

Network and weights are their authors' (Apache 2.0); ``tools/write_xfeat.py`` writes them as ONNX, and OpenCV runs it.
"""

from __future__ import annotations

from pathlib import Path
from threading import Lock

import cv2
import numpy as np

from ..core.networks import read_network
from .features import PhotoFeatures, clearest

#: Of descriptor distances, best to second best: neighbouring features are much alike.
RATIO = 0.9
#: Photos are reduced to this longer side, pixels: turns need no more, and seconds grow with the area.
MAX_PX = 1600
#: The network describes cells of so many pixels, and wants sides that are multiples of ``_SIDE_PX``, at
#: least twice it.
_CELL_PX, _SIDE_PX = 8, 32
#: A feature is the most likely of so many pixels each way, and at least so likely one.
_APART_PX, _MIN_LIKELY = 5, 0.05
#: Part of a unit that a component of a descriptor is stored in; each is stored twice, for a length of 512.
_STEPS = 512 / np.sqrt(2)
#: The network's file (:func:`treedgs_geo.core.networks.read_network`), with its licence.
WEIGHTS = Path(__file__).with_name("xfeat.json")
_ONE_AT_A_TIME = Lock()


def find(grey: np.ndarray, max_features: int, max_px: int = MAX_PX) -> PhotoFeatures:
    """Learned features of a grey photo (:data:`.features.Finder`); they have neither directions nor signs."""
    height, width = grey.shape
    factor = min(max_px, MAX_PX) / max(height, width)
    rows, columns = (max(round(min(factor, 1.0) * side / _SIDE_PX), 2) * _SIDE_PX for side in grey.shape)
    picture = cv2.resize(grey, (columns, rows), interpolation=cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR)
    described, likely, reliable = _seen(picture)
    y, x = np.nonzero((likely == cv2.dilate(likely, np.ones((_APART_PX, _APART_PX)))) & (likely > _MIN_LIKELY))
    xy = np.column_stack([x, y]) + 0.5
    xy = xy[clearest(xy, likely[y, x] * _at(reliable, xy)[:, 0], likely.shape, max_features)]
    own = _at(described, xy)
    own /= np.linalg.norm(own, axis=1, keepdims=True)
    stored = np.clip(np.round(own * _STEPS) + 128, 0, 255).astype(np.uint8)
    return PhotoFeatures(
        xy * np.array([width / columns, height / rows]),
        np.hstack([stored, stored]),
        np.full(len(xy), np.nan, np.float32),
        np.zeros(len(xy), bool),
    )


def _seen(picture: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What the network makes of a picture (H, W) uint8: (64, H / 8, W / 8) descriptors of unit length, (H, W) how
    likely a pixel is a feature, (1, H / 8, W / 8) how reliable."""
    rows, columns = (side // _CELL_PX for side in picture.shape)
    normal = picture.astype(np.float32)
    normal = (normal - normal.mean()) / np.sqrt(normal.var() + np.float32(1e-5))
    cells = normal.reshape(rows, _CELL_PX, columns, _CELL_PX).transpose(1, 3, 0, 2).reshape(-1, rows, columns)
    with _ONE_AT_A_TIME:  # OpenCV's networks are not for two threads at once, and take all cores themselves
        network = read_network(WEIGHTS)
        network.setInput(normal[None, None], "grey")
        network.setInput(cells[None], "cells")
        (described,), (odds,), (reliable,) = network.forward(["descriptors", "keypoints", "reliability"])
    # The pixels of a cell, and that none of them is a feature.
    share = np.exp(odds - odds.max(axis=0))
    share = (share / share.sum(axis=0))[:-1].reshape(_CELL_PX, _CELL_PX, rows, columns)
    likely = np.ascontiguousarray(share.transpose(2, 0, 3, 1)).reshape(picture.shape)
    return described / np.linalg.norm(described, axis=0), likely, reliable


def _at(maps: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """(K, C) bilinear values of maps (C, h, w), one value a cell, at pixels (K, 2)."""
    last = np.array([maps.shape[2] - 1, maps.shape[1] - 1])
    place = np.clip(xy / _CELL_PX - 0.5, 0, last)
    low = np.minimum(place.astype(int), np.maximum(last - 1, 0))
    (x, y), (u, v) = low.T, (place - low).T
    right, below = np.minimum(x + 1, last[0]), np.minimum(y + 1, last[1])
    upper = maps[:, y, x] * (1 - u) + maps[:, y, right] * u
    lower = maps[:, below, x] * (1 - u) + maps[:, below, right] * u
    return (upper * (1 - v) + lower * v).T
