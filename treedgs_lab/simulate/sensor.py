"""From light on the sensor to an 8-bit photo: mosaic, noise, denoising, tone curve, sharpening."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import cv2
import numpy as np

from .options import SensorSettings

#: Gains of the white balance on raw red, green and blue (daylight on a usual sensor).
RAW_GAINS = np.array([1.9, 1.0, 1.6], np.float32)
#: Electrons at white, and read noise as a share of white.
FULL_WELL, READ_NOISE = 7000.0, 0.0015
LENS_BLUR_PX = 0.55


@dataclass(frozen=True)
class Sensor:
    """How a photo is developed. mosaic: one colour a pixel (RGGB), the others interpolated along edges.

    vignetting_pct: light lost in the corners. exposure_drift, white_drift: standard deviations a photo, relative.
    chroma_noise_pct: blotches of colour, of full scale. denoise_pct: brightness steps that are smoothed away, of full
    scale. contrast: 0..1, of the S-shaped tone curve. sharpening: share of the detail below 1 px that is added.
    """

    mosaic: bool = False
    vignetting_pct: float = 0.0
    exposure_drift: float = 0.0
    white_drift: float = 0.0
    chroma_noise_pct: float = 0.0
    denoise_pct: float = 0.0
    contrast: float = 0.0
    sharpening: float = 0.0
    jpeg_quality: int = 92


#: What ``--camera sensor`` stands for.
SENSORS = {
    "clean": Sensor(),
    "drone": Sensor(
        mosaic=True,
        vignetting_pct=22.0,
        exposure_drift=0.04,
        white_drift=0.012,
        chroma_noise_pct=0.5,
        denoise_pct=1.0,
        contrast=0.25,
        sharpening=0.3,
        jpeg_quality=88,
    ),
}


def sensor_of(settings: SensorSettings) -> Sensor:
    """The preset with the single values that are given."""
    names = {item.name for item in fields(Sensor)} & {item.name for item in fields(SensorSettings)}
    given = {name: value for name in names if (value := getattr(settings, name)) is not None}
    return replace(SENSORS[settings.sensor], **given)


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear light 0..1 -> sRGB code 0..1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def linear_light(code: np.ndarray) -> np.ndarray:
    """sRGB code 0..1 -> linear light 0..1, float32."""
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).astype(np.float32)


def develop(
    image: np.ndarray,
    exposure: float,
    white: np.ndarray,
    rng: np.random.Generator,
    sensor: Sensor = SENSORS["clean"],
    own: np.random.Generator | None = None,
) -> np.ndarray:
    """Linear radiance -> (H, W, 3) uint8 sRGB: lens blur, exposure and white balance, shot and read noise, and what
    the sensor and its software do.

    rng: of the noise. own: of everything that a clean sensor does not have.
    """
    own = own or np.random.default_rng(0)
    light: np.ndarray = cv2.GaussianBlur(image, (0, 0), LENS_BLUR_PX) * (exposure * np.asarray(white, np.float32))
    drift = own.standard_normal(4)
    if sensor.exposure_drift or sensor.white_drift:
        change = np.exp(sensor.exposure_drift * drift[0]) * (1 + sensor.white_drift * drift[1:])
        light = light * change.astype(np.float32)
    if sensor.vignetting_pct:
        light = light * _vignette(light.shape, sensor.vignetting_pct)[..., None]
    noise = rng.standard_normal(light.shape, dtype=np.float32)
    linear = _demosaic(_raw(light, noise)) if sensor.mosaic else np.clip(light + noise * _noise_sd(light), 0, 1)
    coded = srgb(linear)
    if sensor.chroma_noise_pct:
        coded = coded + _blotches(coded.shape, sensor.chroma_noise_pct, own)
    if sensor.denoise_pct:
        step = 2.5 * sensor.denoise_pct / 100
        coded = cv2.bilateralFilter(np.clip(coded, 0, 1).astype(np.float32), 5, step, 1.2)
    if sensor.contrast:
        coded = np.clip(coded, 0, 1)
        coded = coded + sensor.contrast * coded * (1 - coded) * (2 * coded - 1)
    if sensor.sharpening:
        grey = coded.mean(axis=2, dtype=np.float32)
        coded = coded + sensor.sharpening * (grey - cv2.GaussianBlur(grey, (0, 0), 1.0))[..., None]
    return (255 * np.clip(coded, 0, 1) + 0.5).astype(np.uint8)


def _noise_sd(light: np.ndarray) -> np.ndarray:
    """Shot and read noise of light as a share of white."""
    return np.sqrt(np.maximum(light, 0) / FULL_WELL + READ_NOISE**2, dtype=np.float32)


def _vignette(shape: tuple[int, ...], lost_pct: float) -> np.ndarray:
    """(H, W) share of the light that arrives, 1 in the middle."""
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) for n in shape[:2])
    return 1 - lost_pct / 100 * (y[:, None] ** 2 + x[None] ** 2) / 2


def _raw(light: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """(H, W) RGGB mosaic before the white balance, with noise, clipped at white."""
    raw = light / RAW_GAINS
    raw = np.clip(raw + noise * _noise_sd(raw), 0, 1)
    mosaic = np.ascontiguousarray(raw[..., 1])
    mosaic[::2, ::2], mosaic[1::2, 1::2] = raw[::2, ::2, 0], raw[1::2, 1::2, 2]
    return mosaic


def _demosaic(mosaic: np.ndarray) -> np.ndarray:
    """(H, W) RGGB -> (H, W, 3) linear, white balanced, 0..1. OpenCV names a mosaic by its second row and column."""
    colour = cv2.cvtColor((65535 * mosaic + 0.5).astype(np.uint16), cv2.COLOR_BayerBG2RGB_EA)
    return np.clip(colour.astype(np.float32) / 65535 * RAW_GAINS, 0, 1)


def _blotches(shape: tuple[int, ...], noise_pct: float, rng: np.random.Generator) -> np.ndarray:
    """Coloured noise of some pixels' width that leaves the brightness alone."""
    field = cv2.GaussianBlur(rng.standard_normal(shape, dtype=np.float32), (0, 0), 1.5)
    field -= field.mean(axis=2, keepdims=True)
    return field * (noise_pct / 100 / field.std())
