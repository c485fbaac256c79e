"""Factors about camera and flight: simulated, then run through ``photos-to-dbh`` with nothing true."""

from __future__ import annotations

from typing import Any

from .factor_type import CHAIN, Factor, each, rendered

#: A drone that does not stop for its photos.
_FLYING: dict[str, Any] = {"flight_speed_m_s": 4.0, "gimbal_rate_deg_s": 0.4}
#: A crosshatch over four plots: photos large enough for a flight of some hundred.
_GRID: dict[str, Any] = {
    "flight": "grid",
    "plots": 4,
    "image_width": 1440,
    "image_height": 1080,
    "samples": 2,
    "front_overlap_pct": 70.0,
    "side_overlap_pct": 60.0,
    "lidar_density_m2": 0.0,
}


def _lens(times: float) -> dict[str, float]:
    """A drone's lens, its decentring and third radial term that many times as large."""
    return {"k1": -0.11, "k2": 0.12, "p1": 0.0009 * times, "p2": -0.0007 * times, "k3": -0.3 * times}


FLIGHT_FACTORS: tuple[Factor, ...] = (
    rendered(
        "readout",
        "readout of a rolling shutter, drone at 4 m/s",
        "ms",
        "Rows of a photo are read one after the other while the drone flies on and its gimbal turns.",
        {0.0: {}, **each("readout_ms", (10.0, 20.0, 30.0), **_FLYING)},
        (CHAIN,),
    ),
    rendered(
        "sun",
        "minutes between the flights by the sun",
        "min",
        "Shadows move between the two flights, so that they share fewer features.",
        each("sun_shift_min", (0.0, 20.0, 60.0)),
        (CHAIN,),
    ),
    rendered(
        "gusts",
        "sway of the crowns in smooth wind",
        "cm",
        "Every tree sways in its own period, twigs and shrubs move by themselves: the photos have to be tied in it.",
        {0.0: {}, **each("wind_sway_cm", (10.0, 30.0, 80.0), wind_smooth=True, wind_flutter_cm=1.5)},
        (CHAIN,),
    ),
    rendered(
        "lens",
        "decentring and k3 of the lens, times a drone's",
        "times",
        "Brown's lens with p1, p2 and k3, k1 and k2 of a drone.",
        {0.0: {}, 1.0: _lens(1.0), 2.0: _lens(2.0)},
        (CHAIN,),
    ),
    rendered(
        "focal_drift",
        "change of the focal length between the flights",
        "%",
        "The lens warms up: each flight has a focal length of its own.",
        {0.0: {}, **{pct: {"focal_drift": pct / 100} for pct in (0.06, 0.3, 1.0)}},
        (CHAIN,),
    ),
    rendered(
        "sensor",
        "how the camera develops its photos",
        "step",
        "Bayer mosaic, denoising, sharpening, tone curve, colour noise, vignetting, drifting exposure, JPEG.",
        {
            0.0: {},
            1.0: {"sensor": "drone"},
            2.0: {"sensor": "drone", "denoise_pct": 6.0, "sharpening": 2.0, "jpeg_quality": 50},
        },
        (CHAIN,),
        {0.0: "clean", 1.0: "drone", 2.0: "hard"},
    ),
    rendered(
        "blur",
        "exposure time, drone at 4 m/s",
        "ms",
        "Motion blur of all photos: 0.2 px a millisecond.",
        {0.0: {}, **each("exposure_ms", (2.0, 10.0, 25.0), **_FLYING)},
        (CHAIN,),
    ),
    rendered(
        "ppk_bias",
        "wrong base coordinates",
        "m",
        "The whole PPK track lies this far off in east, north and "
        "height alike. Trees and ground move together: places are wrong by that much and nothing but ground "
        "control can show, diameters should not change.",
        each("ppk_bias_m", (0.0, 0.1, 1.0)),
        (CHAIN,),
    ),
    rendered(
        "float",
        "photos with float positions",
        "count",
        "Bursts of 2-3 s in which the geotags are some decimetres off, about this many photos.",
        each("float_epochs", (0, 4, 12)),
        (CHAIN,),
    ),
    rendered(
        "consumer",
        "control points of a drone without PPK",
        "points",
        "Positions metres off, held by surveyed plates or by nothing; PPK positions first.",
        {9.0: {}, **{n: {"gnss": "consumer", "control_points": int(n)} for n in (5.0, 3.0, 0.0)}},
        (CHAIN,),
        {9.0: "PPK"},
    ),
    rendered(
        "photo_count",
        "photos of both flights",
        "photos",
        "Fewer photos a ring: less overlap to tie them by, fewer views of a stem.",
        {28.0: {}, **{n: {"photos": int(n)} for n in (20.0, 14.0, 10.0)}},
        (CHAIN,),
    ),
    rendered(
        "grid",
        "height of a grid flight over four plots",
        "m",
        "Nadir lines and an oblique crosshatch, not aimed at any plot; one reconstruction, every plot scored.",
        {0.0: {}, 70.0: {**_GRID, "height_m": 70.0}, 120.0: {**_GRID, "height_m": 120.0}},
        (CHAIN,),
        {0.0: "rings"},
    ),
)
