"""Litchi's CSV: waypoints over the take-off with one photo each, at most 99 in a file."""

from __future__ import annotations

from pathlib import Path

from ...core.files import atomic_path
from .mission import Mission

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
_PHOTO, _NOTHING, _STATED_PITCH, _OVER_HOME = 1, -1, 2, 0


def write_litchi(folder: Path, name: str, mission: Mission) -> list[Path]:
    """``name_1.csv`` and so on, in the order of the flight."""
    made = []
    for part, start in enumerate(range(0, len(mission), MAX_WAYPOINTS), start=1):
        path = folder / f"{name}_{part}.csv"
        lines = [",".join(COLUMNS)]
        for k in range(start, min(start + MAX_WAYPOINTS, len(mission))):
            actions = [_PHOTO, 0] + [_NOTHING, 0] * (_ACTIONS - 1)
            row = [
                f"{mission.lat[k]:.8f}", f"{mission.lon[k]:.8f}", f"{mission.over_m[k]:.1f}",
                f"{mission.yaw_deg[k] % 360:.0f}", "0.2", "0", _STATED_PITCH, f"{mission.pitch_deg[k]:.0f}", *actions,
                _OVER_HOME, f"{mission.speed_m_s[k]:.1f}", "0", "0", "0", "0", "-1", "-1",
            ]  # fmt: skip
            lines.append(",".join(map(str, row)))
        with atomic_path(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
        made.append(path)
    return made
