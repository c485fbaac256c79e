"""A flight as the files that drones and ground stations read: waypoints over the take-off, one photo each.

*Litchi*: CSV, at most 99 waypoints in a file. *QGroundControl*: ``.plan``, MAVLink mission items as JSON (file format
1, mission version 2). *DJI*: WPML, a ``.kmz`` with ``wpmz/template.kml`` (for editing) and ``wpmz/waylines.wpml`` (what
is flown); element names, order and values as DJI's Cloud API documentation defines them (chapter DJI WPML, version
1.0.2), both made from the template ``wpmz.xml``. The drone flies through the waypoints; where the gimbal turns it
stops.
"""

from __future__ import annotations

import datetime as dt
import zipfile
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.files import atomic_path, write_json
from .choose import JudgedFlight
from .drones import DroneCamera
from .safety import TRANSIT_M_S
from .settings import FlyingSettings
from .site import PlanSite


@dataclass(frozen=True)
class Mission:
    """photos: one row a waypoint, ``lon, lat`` (degrees WGS 84), ``over_m`` (height over the take-off), ``yaw_deg``
    (clockwise from true north, -180 to 180), ``pitch_deg, speed_m_s`` (from this waypoint to the next). home:
    longitude, latitude, height of the take-off in the terrain model's datum. safe_m: height over the take-off to climb
    to first. made: day."""

    made: dt.datetime
    camera: DroneCamera
    photos: pd.DataFrame
    home: tuple[float, float, float]
    safe_m: float
    seconds: float
    length_m: float


def mission_of(
    plan: JudgedFlight, site: PlanSite, camera: DroneCamera, limits: FlyingSettings, take_off: np.ndarray,
    made: dt.datetime,
) -> Mission:  # fmt: skip
    """take_off: (3,) planning frame, terrain model's datum."""
    flight, budget = plan.flight, plan.budget
    photos = pd.DataFrame(site.lonlat(flight.xy), columns=["lon", "lat"])
    photos["over_m"] = over = flight.xyz[:, 2] - take_off[2]
    photos["yaw_deg"] = (flight.yaw_deg + site.convergence_deg + 180) % 360 - 180
    photos["pitch_deg"] = flight.pitch_deg
    same = np.append(np.diff(flight.leg) == 0, False)
    photos["speed_m_s"] = np.where(same, budget.speed_m_s, min(TRANSIT_M_S, limits.speed_m_s))
    around = flight.xy[[0, -1]]
    ways = np.linspace(0, 1, 30)[:, None, None] * (around - take_off[:2]) + take_off[:2]
    top = site.canopy_top(ways.reshape(-1, 2))
    # Beyond the terrain model nothing is known of the way home: as high as the flight itself.
    safe = float(np.nanmax(top)) + limits.clearance_m - take_off[2]
    safe = float(np.clip(max(safe, over.min()), 20.0, max(over.max(), 20.0)))
    lon, lat = site.lonlat(take_off[:2])[0].tolist()
    return Mission(made, camera, photos, (lon, lat, float(take_off[2])), safe, 60 * budget.minutes, budget.length_m)


#: Waypoints that one Litchi mission holds.
MAX_WAYPOINTS = 99
_ACTIONS = 15
#: Columns as Litchi's Mission Hub exports them.
COLUMNS = (
    "latitude", "longitude", "altitude(m)", "heading(deg)", "curvesize(m)", "rotationdir", "gimbalmode",
    "gimbalpitchangle", *(f"action{what}{k}" for k in range(1, _ACTIONS + 1) for what in ("type", "param")),
    "altitudemode", "speed(m/s)", "poi_latitude", "poi_longitude", "poi_altitude(m)", "poi_altitudemode",
    "photo_timeinterval", "photo_distinterval",
)  # fmt: skip
#: Action 1 is a photo, -1 none; gimbal mode 2 takes the stated angle; heights over the take-off.
_PHOTO, _NOTHING, _STATED_PITCH, _OVER_TAKE_OFF = 1, -1, 2, 0


def write_litchi(folder: Path, name: str, mission: Mission) -> list[Path]:
    """``name_1.csv`` and so on, in the order of the flight."""
    made = []
    actions = [_PHOTO, 0] + [_NOTHING, 0] * (_ACTIONS - 1)
    for part, start in enumerate(range(0, len(mission.photos), MAX_WAYPOINTS), start=1):
        rows = [
            [
                f"{at.lat:.8f}", f"{at.lon:.8f}", f"{at.over_m:.1f}", f"{at.yaw_deg % 360:.0f}", "0.2", "0",
                _STATED_PITCH, f"{at.pitch_deg:.0f}", *actions, _OVER_TAKE_OFF, f"{at.speed_m_s:.1f}", "0", "0", "0",
                "0", "-1", "-1",
            ]
            for at in mission.photos.iloc[start : start + MAX_WAYPOINTS].itertuples()
        ]  # fmt: skip
        path = folder / f"{name}_{part}.csv"
        with atomic_path(path) as temporary:
            text = "".join(",".join(map(str, row)) + "\n" for row in [COLUMNS, *rows])
            temporary.write_text(text, encoding="utf-8", newline="\n")
        made.append(path)
    return made


#: MAVLink commands (common message set).
WAYPOINT, RETURN, TAKE_OFF, SPEED, GIMBAL, PHOTO = 16, 20, 22, 178, 205, 2000
#: MAV_FRAME: heights over home, and none.
_OVER_HOME, _NO_FRAME = 3, 2


def write_plan(path: Path, mission: Mission) -> Path:
    """Write the mission; heights are over the take-off."""
    lon, lat, height = mission.home
    items: list[dict[str, Any]] = []

    def add(command: int, params: list[float | int | None], frame: int = _NO_FRAME) -> None:
        item: dict[str, Any] = {"autoContinue": True, "command": command, "doJumpId": len(items) + 1, "frame": frame}
        if frame == _OVER_HOME:
            item |= {"AMSLAltAboveTerrain": None, "Altitude": params[6], "AltitudeMode": 1}
        items.append({**item, "params": params, "type": "SimpleItem"})

    add(TAKE_OFF, [0, 0, 0, None, round(lat, 8), round(lon, 8), round(mission.safe_m, 2)], _OVER_HOME)
    speed = pitch = None
    for number, at in enumerate(mission.photos.itertuples(), start=1):
        # The camera turns and the speed changes on the way to the waypoint where they count.
        if at.pitch_deg != pitch:
            pitch = at.pitch_deg
            add(GIMBAL, [round(pitch, 1), 0, 0, 0, 0, 0, 2])
        place = [round(at.lat, 8), round(at.lon, 8), round(at.over_m, 2)]
        add(WAYPOINT, [0, 0, 0, round(at.yaw_deg % 360, 1), *place], _OVER_HOME)
        add(PHOTO, [0, 0, 1, number, 0, 0, 0])
        if at.speed_m_s != speed:
            speed = at.speed_m_s
            add(SPEED, [1, round(speed, 1), -1, 0, 0, 0, 0])
    add(RETURN, [0, 0, 0, 0, 0, 0, 0])
    cruise = round(float(mission.photos["speed_m_s"].median()), 1)
    write_json(
        Path(path),
        {
            "fileType": "Plan",
            "geoFence": {"circles": [], "polygons": [], "version": 2},
            "groundStation": "QGroundControl",
            "mission": {
                "cruiseSpeed": cruise,
                "firmwareType": 12,
                "globalPlanAltitudeMode": 1,
                "hoverSpeed": cruise,
                "items": items,
                "plannedHomePosition": [round(lat, 8), round(lon, 8), round(height, 2)],
                "vehicleType": 2,
                "version": 2,
            },
            "rallyPoints": {"points": [], "version": 2},
            "version": 1,
        },
    )
    return Path(path)


def write_kmz(path: Path, mission: Mission) -> Path:
    """Write the mission of a camera that has WPML numbers."""
    import jinja2

    assert mission.camera.wpml is not None
    text = (files(__package__) / "wpmz.xml").read_text(encoding="utf-8")
    template = jinja2.Template(text, trim_blocks=True, autoescape=True, undefined=jinja2.StrictUndefined)
    points = mission.photos.copy()
    points["turns"] = points["pitch_deg"].diff() != 0
    points["stops"] = points["turns"] | (points.index == len(points) - 1)
    values = {
        "points": list(points.itertuples()),
        **{name: getattr(mission, name) for name in ("home", "safe_m", "length_m", "seconds")},
        **dict(zip(("drone", "kind", "payload", "position"), mission.camera.wpml, strict=True)),
        "stamp": int(mission.made.timestamp() * 1000),
        "slowest_m_s": points["speed_m_s"].min(),
        "transit_m_s": min(15.0, points["speed_m_s"].max()),
        "middle_m": points["over_m"].median(),
    }
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("template.kml", "waylines.wpml"):
            # A fixed time: the same plan gives the same file.
            entry = zipfile.ZipInfo(f"wpmz/{name}", (2020, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, template.render(values, flown=name == "waylines.wpml"))
    return Path(path)
