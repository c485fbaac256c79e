"""QGroundControl's ``.plan``: MAVLink mission items as JSON (file format 1, mission version 2)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import write_json
from .mission import Mission

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
    for k in range(len(mission)):
        place = [round(float(mission.lat[k]), 8), round(float(mission.lon[k]), 8), round(float(mission.over_m[k]), 2)]
        # The camera turns and the speed changes on the way to the waypoint where they count.
        if mission.pitch_deg[k] != pitch:
            pitch = float(mission.pitch_deg[k])
            add(GIMBAL, [round(pitch, 1), 0, 0, 0, 0, 0, 2])
        add(WAYPOINT, [0, 0, 0, round(float(mission.yaw_deg[k]) % 360, 1), *place], _OVER_HOME)
        add(PHOTO, [0, 0, 1, k + 1, 0, 0, 0])
        if mission.speed_m_s[k] != speed:
            speed = float(mission.speed_m_s[k])
            add(SPEED, [1, round(speed, 1), -1, 0, 0, 0, 0])
    add(RETURN, [0, 0, 0, 0, 0, 0, 0])
    cruise = round(float(np.median(mission.speed_m_s)), 1)
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
