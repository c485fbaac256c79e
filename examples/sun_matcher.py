"""A matcher plug-in on torch: photos of the same ground under another sun.

    treedgs reconstruct ... --matcher examples/sun_matcher.py --matcher-weights sun_matcher.pt

``load(weights)`` returns ``match(first, second)``, the contract of ``--matcher`` (docs/analyst/reconstruction.md). The
weights come from ``python -m training.matcher``. A small network describes every eighth pixel by what is around it
(some 150 pixels wide, the slow brightness taken out, so that a shadow is an edge and not a patch); cells that are each
other's most alike are matched, the second photo turned by several angles, and what does not lie on one plane of the
ground is dropped.
"""

from __future__ import annotations

import zlib
from collections import OrderedDict

import cv2
import numpy as np
import torch
from torch import nn

#: Pixels between described places, and numbers of a description.
STRIDE, WIDTH = 8, 64
#: Slow brightness is what a Gaussian of this many pixels leaves.
SLOW_PX = 12.0
#: Angles by which the second photo is turned, degrees; a description bears 30.
TURNS_DEG = (0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0)
#: Least likeness of two places, how far from the plane they may lie, and how many must agree on it.
LEAST_ALIKE, PLANE_PX, LEAST_MATCHES = 0.5, 12.0, 40
#: Descriptions that are kept, bytes: some 15 photos of a megapixel with all their turns.
KEPT_BYTES = 500_000_000


class Descriptor(nn.Module):
    """Grey photos (B, 1, H, W), as :func:`flattened`, -> unit descriptions (B, WIDTH, H / 8, W / 8)."""

    def __init__(self) -> None:
        super().__init__()

        def block(inputs: int, outputs: int, stride: int = 1, spread: int = 1) -> list[nn.Module]:
            conv = nn.Conv2d(inputs, outputs, 3, stride, spread, spread, bias=False)
            return [conv, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)]

        self.layers = nn.Sequential(
            *block(1, 16, 2),
            *block(16, 32, 2),
            *block(32, 32),
            *block(32, 64, 2),
            *block(64, 64, 1, 2),
            *block(64, 64, 1, 4),
            nn.Conv2d(64, WIDTH, 1),
        )

    def forward(self, grey: torch.Tensor) -> torch.Tensor:
        """As the class says."""
        return nn.functional.normalize(self.layers(grey), dim=1)


def flattened(grey: np.ndarray) -> np.ndarray:
    """(H, W) float32 without slow brightness, of local contrast 1, cut at 3."""
    grey = grey.astype(np.float32)
    fast = grey - cv2.GaussianBlur(grey, (0, 0), SLOW_PX)
    spread = np.sqrt(cv2.GaussianBlur(fast * fast, (0, 0), SLOW_PX)) + 2.0
    return np.clip(fast / spread, -3, 3)


def load(weights: str):
    """The matcher with these weights."""
    network = Descriptor()
    network.load_state_dict(torch.load(weights, map_location="cpu", weights_only=True))
    return Matcher(network.eval()).match


class Matcher:
    """Matches photos; the last descriptions are kept, :data:`KEPT_BYTES` of them."""

    def __init__(self, network: Descriptor) -> None:
        self.network = network
        self._kept: OrderedDict[tuple, tuple[np.ndarray, np.ndarray]] = OrderedDict()
        self._bytes = 0

    def match(self, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Two photos (H, W, 3) uint8 -> (K, 2) and (K, 2) pixels, (K,) how alike they are."""
        places, described = self.described(first, 0.0)
        coarse = (places[:, 0] // STRIDE % 2 == 0) & (places[:, 1] // STRIDE % 2 == 0)
        places, described = places[coarse], described[coarse]
        best: tuple[int, float] = (0, 0.0)
        for turn in TURNS_DEG:
            _, others = self.described(second, turn)
            alike = described[::2] @ others[::4].T
            agreeing = _mutual(alike)
            score = int((alike[agreeing[:, 0], agreeing[:, 1]] > LEAST_ALIKE).sum())
            if score > best[0]:
                best = score, turn
        there, others = self.described(second, best[1])
        alike = described @ others.T
        rows = _mutual(alike)
        value = alike[rows[:, 0], rows[:, 1]]
        rows, value = rows[value > LEAST_ALIKE], value[value > LEAST_ALIKE]
        return _on_one_plane(places[rows[:, 0]], there[rows[:, 1]], value)

    def described(self, photo: np.ndarray, turn_deg: float) -> tuple[np.ndarray, np.ndarray]:
        """(K, 2) pixels of a photo and (K, WIDTH) float32 descriptions of the photo turned about its middle."""
        key = (zlib.crc32(photo[::16, ::16].tobytes()), photo.shape, turn_deg)
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        grey = cv2.cvtColor(photo, cv2.COLOR_RGB2GRAY)
        height, width = grey.shape
        side = int(np.ceil(np.hypot(height, width)))
        size = (width, height) if turn_deg == 0 else (side, side)
        around = cv2.getRotationMatrix2D((width / 2, height / 2), turn_deg, 1.0)
        around[:, 2] += [(size[0] - width) / 2, (size[1] - height) / 2]
        turned = cv2.warpAffine(flattened(grey), around, size)
        with torch.inference_mode():
            found = self.network(torch.from_numpy(turned)[None, None])[0].numpy()
        rows, columns = np.mgrid[: found.shape[1], : found.shape[2]]
        at = np.column_stack([columns.ravel(), rows.ravel()]) * STRIDE + 0.5
        back = cv2.invertAffineTransform(around)
        places = at @ back[:, :2].T + back[:, 2]
        inside = (places >= 0).all(axis=1) & (places < [width, height]).all(axis=1)
        kept = places[inside], np.ascontiguousarray(found.reshape(WIDTH, -1).T[inside])
        self._kept[key] = kept
        self._bytes += sum(part.nbytes for part in kept)
        while self._bytes > KEPT_BYTES and len(self._kept) > 1:
            _, old = self._kept.popitem(last=False)
            self._bytes -= sum(part.nbytes for part in old)
        return kept


def _mutual(alike: np.ndarray) -> np.ndarray:
    """(K, 2) rows and columns that are each other's most alike."""
    forward, backward = alike.argmax(axis=1), alike.argmax(axis=0)
    rows = np.flatnonzero(backward[forward] == np.arange(len(forward)))
    return np.column_stack([rows, forward[rows]])


def _on_one_plane(one: np.ndarray, two: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    nothing = np.empty((0, 2)), np.empty((0, 2)), np.empty(0)
    if len(one) < LEAST_MATCHES:
        return nothing
    cv2.setRNGSeed(0)
    _, near = cv2.findHomography(one, two, cv2.RANSAC, PLANE_PX, maxIters=3000, confidence=0.999)
    if near is None or near.sum() < LEAST_MATCHES:
        return nothing
    near = near.ravel().astype(bool)
    return one[near], two[near], np.clip(value[near], 0, 1)
