"""What a real camera, flight and sky add to a synthetic plot; everything is off by default.

Like the troubles (:mod:`.trouble`), each part draws from a random stream of its own: the plot is otherwise the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from treedgs_geo.core.settings import param


def number(default: float | None, minimum: float, maximum: float, unit: str, help: str, dialog: bool = True) -> Any:
    """A number with its limits and unit; ``None``: as the preset says."""
    return param(default, help=help, minimum=minimum, maximum=maximum, unit=unit, dialog=dialog)


def count(default: int | None, minimum: int, maximum: int, help: str, unit: str = "", dialog: bool = True) -> Any:
    """A whole number with its limits; ``None``: as the preset says."""
    return param(default, help=help, minimum=minimum, maximum=maximum, unit=unit, dialog=dialog)


def flag(help: str) -> Any:
    """Something that is off unless asked for."""
    return param(False, help=help)


@dataclass(frozen=True, kw_only=True)
class SensorSettings:
    """How a photo is developed (keys of ``simulate-plot --camera``); ``None`` = as ``sensor`` says."""

    sensor: str = param(
        "clean",
        choices=("clean", "drone"),
        help="clean: noise and JPEG only; drone: Bayer mosaic, denoising, sharpening, tone curve, colour noise, "
        "vignetting, drifting exposure and white balance, JPEG 88",
    )
    vignetting_pct: float | None = number(None, 0, 80, "%", "light lost in the corners")
    chroma_noise_pct: float | None = number(None, 0, 10, "%", "colour noise, of full scale")
    denoise_pct: float | None = number(None, 0, 20, "%", "noise that the camera's software smooths away, of full scale")
    contrast: float | None = number(None, 0, 1, "", "strength of the S-shaped tone curve")
    sharpening: float | None = number(None, 0, 3, "", "strength of the camera's sharpening")
    jpeg_quality: int | None = count(None, 30, 100, "JPEG quality (colour at half resolution)")


@dataclass(frozen=True, kw_only=True)
class CameraSettings(SensorSettings):
    """Photo size, lens, shutter and motion of the camera: the keys of ``simulate-plot --camera``."""

    image_width: int | None = count(None, 320, 8192, "width of a photo", unit="px")
    image_height: int | None = count(None, 240, 8192, "height of a photo", unit="px")
    samples: int | None = count(None, 1, 16, "rays a pixel; of --world cycles two paths each")
    look: str = param(
        "standard", choices=("standard", "filmic"), help="tone curve of --world cycles, as Blender has it"
    )
    labels: bool = flag("write truth/labels: what every pixel of every photo shows")

    readout_ms: float = number(
        0.0, 0, 100, "ms", "rolling shutter: time from reading the first row of a photo to the last"
    )
    exposure_ms: float = number(0.0, 0, 100, "ms", "exposure time of a row: motion blur of a flying drone")
    flight_speed_m_s: float = number(0.0, 0, 25, "m/s", "speed of the drone at each photo; 0 = it hovers for a photo")
    gimbal_rate_deg_s: float = number(
        0.0, 0, 20, "deg/s", "residual turning of the camera during a photo, standard deviation about each axis"
    )
    k1: float = number(-0.02, -0.5, 0.5, "", "radial distortion, r^2")
    k2: float = number(0.01, -1, 1, "", "radial distortion, r^4")
    k3: float = number(0.0, -2, 2, "", "radial distortion, r^6")
    p1: float = number(0.0, -0.02, 0.02, "", "decentring of the lens, p1")
    p2: float = number(0.0, -0.02, 0.02, "", "decentring of the lens, p2")
    focal_drift: float = number(
        0.0, -0.02, 0.02, "", "relative change of the focal length from flight to flight (0.0006 = 0.06 %)"
    )


@dataclass(frozen=True, kw_only=True)
class GridSettings:
    """How a grid flight is flown: the keys of ``simulate-plot --grid``."""

    height_m: float = number(70.0, 20, 200, "m", "height of a grid flight")
    front_overlap_pct: float = number(80.0, 0, 95, "%", "overlap of a grid flight along its lines")
    side_overlap_pct: float = number(70.0, 0, 95, "%", "overlap between the lines of a grid flight")
    oblique_deg: float = number(
        35.0, 0, 50, "deg", "tilt from straight down of the oblique lines of a grid flight; 0 = nadir lines only"
    )
    terrain_following: bool = flag("a grid flight keeps its height above the ground, not above its start")
    plots: int = count(1, 1, 16, "plots that one grid flight covers")


@dataclass(frozen=True, kw_only=True)
class WeatherSettings:
    """Sky and wind: the keys of ``simulate-plot --weather``."""

    sky: str = param(
        "clear",
        choices=("clear", "overcast"),
        help="clear: sun with cast shadows; overcast: light from the whole sky, no cast shadows",
    )
    sun_elevation_deg: float | None = number(
        None, 5, 85, "deg", "height of the sun above the horizon; default: by date, time and place (about 40-50)"
    )
    shadow_samples: int = count(2, 2, 64, "rays to the sun's disc from each spot; 16 and more make smooth penumbrae")
    sun_shift_min: float = number(
        0.0, 0, 240, "min", "minutes by which the sun moves on between the flights; 0 = same shadows in both"
    )
    wind_sway_cm: float = number(
        0.0, 0, 300, "cm", "each tree sways from its foot in its own period: standard deviation of its top, 18 m up"
    )
    wind_flutter_cm: float = number(
        0.0,
        0,
        20,
        "cm",
        "twigs, leaves, shrubs and grass that move by themselves from photo to photo, standard deviation",
    )
