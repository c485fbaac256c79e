"""What a real camera, flight, sky and receiver add to a synthetic plot; everything is off by default.

Like the troubles (:mod:`.trouble`), each part draws from a random stream of its own: the plot is otherwise the same.
"""

from __future__ import annotations

from dataclasses import dataclass

from treedgs_geo.core.settings import param


@dataclass(frozen=True, kw_only=True)
class CameraSettings:
    """Lens, shutter and motion of the camera (part of the settings of ``simulate-plot``)."""

    readout_ms: float = param(
        0.0,
        kind="number",
        unit="ms",
        minimum=0,
        maximum=100,
        dialog=False,
        help="rolling shutter: time from reading the first row of a photo to the last",
    )
    exposure_ms: float = param(
        0.0,
        kind="number",
        unit="ms",
        minimum=0,
        maximum=100,
        dialog=False,
        help="exposure time of a row: motion blur of a flying drone",
    )
    flight_speed_m_s: float = param(
        0.0,
        kind="number",
        unit="m/s",
        minimum=0,
        maximum=25,
        dialog=False,
        help="speed of the drone at each photo; 0 = it hovers for a photo",
    )
    gimbal_rate_deg_s: float = param(
        0.0,
        kind="number",
        unit="deg/s",
        minimum=0,
        maximum=20,
        dialog=False,
        help="residual turning of the camera during a photo, standard deviation about each axis",
    )
    k1: float = param(-0.02, kind="number", minimum=-0.5, maximum=0.5, dialog=False, help="radial distortion, r^2")
    k2: float = param(0.01, kind="number", minimum=-1, maximum=1, dialog=False, help="radial distortion, r^4")
    k3: float = param(0.0, kind="number", minimum=-2, maximum=2, dialog=False, help="radial distortion, r^6")
    p1: float = param(0.0, kind="number", minimum=-0.02, maximum=0.02, dialog=False, help="decentring of the lens, p1")
    p2: float = param(0.0, kind="number", minimum=-0.02, maximum=0.02, dialog=False, help="decentring of the lens, p2")
    focal_drift: float = param(
        0.0,
        kind="number",
        minimum=-0.02,
        maximum=0.02,
        dialog=False,
        help="relative change of the focal length from flight to flight (0.0006 = 0.06 %)",
    )


@dataclass(frozen=True, kw_only=True)
class SensorSettings:
    """How a photo is developed (part of the settings of ``simulate-plot``); ``None`` = as ``sensor`` says."""

    sensor: str = param(
        "clean",
        kind="choice",
        choices=("clean", "drone"),
        dialog=False,
        help="clean: noise and JPEG only; drone: Bayer mosaic, denoising, sharpening, tone curve, colour noise, "
        "vignetting, drifting exposure and white balance, JPEG 88",
    )
    vignetting_pct: float | None = param(
        None, kind="number", unit="%", minimum=0, maximum=80, dialog=False, help="light lost in the corners"
    )
    chroma_noise_pct: float | None = param(
        None, kind="number", unit="%", minimum=0, maximum=10, dialog=False, help="colour noise, of full scale"
    )
    denoise_pct: float | None = param(
        None,
        kind="number",
        unit="%",
        minimum=0,
        maximum=20,
        dialog=False,
        help="noise that the camera's software smooths away, of full scale",
    )
    contrast: float | None = param(
        None, kind="number", minimum=0, maximum=1, dialog=False, help="strength of the S-shaped tone curve"
    )
    sharpening: float | None = param(
        None, kind="number", minimum=0, maximum=3, dialog=False, help="strength of the camera's sharpening"
    )
    jpeg_quality: int | None = param(
        None, kind="integer", minimum=30, maximum=100, dialog=False, help="JPEG quality (colour at half resolution)"
    )


@dataclass(frozen=True, kw_only=True)
class FlightSettings:
    """How the drone is flown (part of the settings of ``simulate-plot``)."""

    flight: str = param(
        "rings",
        kind="text",
        dialog=False,
        help="rings: nadir photos and rings aimed at the plot; grid: parallel nadir lines and a crosshatch of oblique "
        "ones over an area, not aimed at any plot; or a flight plan, plan.gpkg of plan-flight: its photos, camera and "
        "plots",
    )
    height_m: float = param(
        70.0, kind="number", unit="m", minimum=20, maximum=200, dialog=False, help="height of a grid flight"
    )
    front_overlap_pct: float = param(
        80.0,
        kind="number",
        unit="%",
        minimum=0,
        maximum=95,
        dialog=False,
        help="overlap of a grid flight along its lines",
    )
    side_overlap_pct: float = param(
        70.0,
        kind="number",
        unit="%",
        minimum=0,
        maximum=95,
        dialog=False,
        help="overlap between the lines of a grid flight",
    )
    oblique_deg: float = param(
        35.0,
        kind="number",
        unit="deg",
        minimum=0,
        maximum=50,
        dialog=False,
        help="tilt from straight down of the oblique lines of a grid flight; 0 = nadir lines only",
    )
    terrain_following: bool = param(
        False, kind="flag", dialog=False, help="a grid flight keeps its height above the ground, not above its start"
    )
    plots: int = param(1, kind="integer", minimum=1, maximum=16, dialog=False, help="plots that one grid flight covers")


@dataclass(frozen=True, kw_only=True)
class WeatherSettings:
    """Sky and wind (part of the settings of ``simulate-plot``)."""

    sky: str = param(
        "clear",
        kind="choice",
        choices=("clear", "overcast"),
        dialog=False,
        help="clear: sun with cast shadows; overcast: light from the whole sky, no cast shadows",
    )
    sun_elevation_deg: float | None = param(
        None,
        kind="number",
        unit="deg",
        minimum=5,
        maximum=85,
        dialog=False,
        help="height of the sun above the horizon; default: by date, time and place (about 40-50)",
    )
    shadow_samples: int = param(
        2,
        kind="integer",
        minimum=2,
        maximum=64,
        dialog=False,
        help="rays to the sun's disc from each spot; 16 and more make smooth penumbrae",
    )
    wind_smooth: bool = param(
        False,
        kind="flag",
        dialog=False,
        help="each photo has its own moment of the wind: every tree sways from its foot in its own period, its top by "
        "--wind-sway-cm; off = three positions in turn",
    )
    wind_flutter_cm: float = param(
        0.0,
        kind="number",
        unit="cm",
        minimum=0,
        maximum=20,
        dialog=False,
        help="twigs, leaves, shrubs and grass that move by themselves from photo to photo, standard deviation",
    )


@dataclass(frozen=True, kw_only=True)
class ControlSettings:
    """Receiver and ground control (part of the settings of ``simulate-plot``)."""

    gnss: str = param(
        "ppk",
        kind="choice",
        choices=("ppk", "consumer"),
        dialog=False,
        help="ppk: MRK and .pos; consumer: nothing but the positions in the photos, metres off",
    )
    control_points: int = param(
        0,
        kind="integer",
        minimum=0,
        maximum=40,
        dialog=False,
        help="surveyed plates on the ground, with their marks in the photos (gcp_list.txt)",
    )
