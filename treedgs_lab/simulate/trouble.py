"""What goes wrong on real flights, each as one key with a unit; all off by default but the bursts of float.

Every part draws from a random stream of its own and only when it is asked for, so that the plot is otherwise the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from treedgs_geo.core.settings import param

from .options import count, number

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True, kw_only=True)
class TroubleSettings:
    """Troubles of a synthetic plot: the keys of ``simulate-plot --faults``."""

    shaken_pct: float = number(0.0, 0, 100, "%", "share of the photos with motion blur")
    shake_px: float = number(6.0, 0, 100, "px", "length of that motion blur")
    misexposed_pct: float = number(
        0.0, 0, 100, "%", "share of the photos exposed wrongly, half of them too dark, half too light"
    )
    misexposed_stops: float = number(2.0, 0, 8, "stops", "by how much")
    exposure_drift_stops: float = number(0.0, 0, 4, "stops", "exposure of each photo, standard deviation")
    white_drift_pct: float = number(0.0, 0, 50, "%", "white balance of each photo, standard deviation a channel")
    ppk_bias_m: float = number(
        0.0, 0, 100, "m", "constant shift of the whole PPK track in E, N and h (wrong base coordinates)"
    )
    float_epochs: int = count(3, 0, 20, "photos that fall into a burst of PPK float solutions (0.3 m error)")
    gnss: str = param(
        "ppk",
        choices=("ppk", "consumer"),
        help="ppk: MRK and .pos; consumer: nothing but the positions in the photos, metres off",
    )


@dataclass(frozen=True)
class PhotoTrouble:
    """One photo's lot: blur length (px) and direction (rad), factor on the exposure, (3,) factors on the channels."""

    shake_px: float
    angle_rad: float
    gain: float
    white: np.ndarray


def photo_troubles(settings: TroubleSettings, count: int, rng: np.random.Generator) -> list[PhotoTrouble]:
    """What befalls each of ``count`` photos. The shares are exact, rounded to whole photos."""
    import numpy as np

    shaken, dark = np.zeros(count), np.zeros(count)
    chosen = rng.permutation(count)[: round(settings.shaken_pct / 100 * count)]
    shaken[chosen] = settings.shake_px
    wrong = rng.permutation(count)[: round(settings.misexposed_pct / 100 * count)]
    dark[wrong] = settings.misexposed_stops * np.where(np.arange(len(wrong)) % 2 == 0, -1, 1)
    angle, drift = rng.uniform(0, np.pi, count), rng.standard_normal(count)
    white = 1 + settings.white_drift_pct / 100 * rng.standard_normal((count, 3))
    gain = 2.0 ** (dark + settings.exposure_drift_stops * drift)
    return [
        PhotoTrouble(float(shaken[k]), float(angle[k]), float(gain[k]), np.maximum(white[k], 0.1)) for k in range(count)
    ]


def shake(image: np.ndarray, length_px: float, angle_rad: float) -> np.ndarray:
    """(H, W, 3) linear image moved along a line of ``length_px`` while it was taken."""
    import cv2
    import numpy as np

    if length_px < 1:
        return image
    half = int(np.ceil(length_px / 2)) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    for t in np.linspace(-length_px / 2, length_px / 2, 8 * half + 1):
        x, y = half + t * np.cos(angle_rad), half + t * np.sin(angle_rad)
        c, r = int(np.floor(x)), int(np.floor(y))
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            kernel[r + i, c + j] += abs(1 - i - (y - r)) * abs(1 - j - (x - c))
    return cv2.filter2D(image, -1, (kernel / kernel.sum()).astype(np.float32), borderType=cv2.BORDER_REFLECT)


def disturb(pixels: np.ndarray, trouble: PhotoTrouble) -> np.ndarray:
    """A developed (H, W, 3) uint8 sRGB photo with its trouble, by way of linear light (what is blown out stays so)."""
    import numpy as np

    from .sensor import linear_light, srgb

    linear = linear_light(pixels.astype(np.float32) / 255)
    linear = np.clip(shake(linear, trouble.shake_px, trouble.angle_rad) * (trouble.gain * trouble.white), 0, 1)
    return (255 * srgb(linear) + 0.5).astype(np.uint8)
