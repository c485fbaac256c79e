"""DJI's WPML: a ``.kmz`` with ``wpmz/template.kml`` (for editing) and ``wpmz/waylines.wpml`` (what is flown).

Element names, order and values as DJI's Cloud API documentation defines them (chapter DJI WPML, version 1.0.2). Heights
are over the take-off (``relativeToStartPoint``). The drone flies through the waypoints; where the gimbal turns it
stops.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from ...core.errors import InputError
from ...core.files import atomic_path
from .mission import Mission

KML, WPML = "http://www.opengis.net/kml/2.2", "http://www.dji.com/wpmz/1.0.2"
#: Waypoints of one wayline, at most.
MAX_WAYPOINTS = 65535
_FLY_THROUGH, _STOP = "toPointAndPassWithContinuityCurvature", "toPointAndStopWithDiscontinuityCurvature"


def write_kmz(path: Path, mission: Mission) -> Path:
    """Write the mission.

    Raises:
        InputError: a drone that takes no such file.
    """
    if mission.camera.wpml is None:
        raise InputError(f"--camera: {mission.camera.name} takes no WPML file; use the .plan or the CSV.")
    for name, uri in (("", KML), ("wpml", WPML)):
        ET.register_namespace(name, uri)
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, root in (("template.kml", _template(mission)), ("waylines.wpml", _waylines(mission))):
            ET.indent(root)
            # A fixed time: the same plan gives the same file.
            entry = zipfile.ZipInfo(f"wpmz/{name}", (2020, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, ET.tostring(root, encoding="UTF-8", xml_declaration=True))
    return Path(path)


def _add(parent: ET.Element, name: str, value: object = None, space: str = WPML) -> ET.Element:
    made = ET.SubElement(parent, f"{{{space}}}{name}")
    if value is not None:
        made.text = str(value)
    return made


def _root() -> tuple[ET.Element, ET.Element]:
    root = ET.Element(f"{{{KML}}}kml")
    return root, _add(root, "Document", space=KML)


def _config(document: ET.Element, mission: Mission, with_reference: bool) -> None:
    config = _add(document, "missionConfig")
    _add(config, "flyToWaylineMode", "safely")
    _add(config, "finishAction", "goHome")
    _add(config, "exitOnRCLost", "executeLostAction")
    _add(config, "executeRCLostAction", "goBack")
    _add(config, "takeOffSecurityHeight", f"{mission.safe_m:.1f}")
    if with_reference:
        lon, lat, height = mission.home
        _add(config, "takeOffRefPoint", f"{lat:.8f},{lon:.8f},{height:.2f}")
        _add(config, "takeOffRefPointAGLHeight", 0)
    _add(config, "globalTransitionalSpeed", f"{min(15.0, float(mission.speed_m_s.max())):.1f}")
    _add(config, "globalRTHHeight", f"{mission.safe_m:.1f}")
    drone, kind, payload, position = mission.camera.wpml or (0, 0, 0, 0)
    info = _add(config, "droneInfo")
    _add(info, "droneEnumValue", drone)
    _add(info, "droneSubEnumValue", kind)
    info = _add(config, "payloadInfo")
    _add(info, "payloadEnumValue", payload)
    _add(info, "payloadSubEnumValue", 0)
    _add(info, "payloadPositionIndex", position)


def _template(mission: Mission) -> ET.Element:
    root, document = _root()
    _add(document, "author", "TreeDGS")
    stamp = int(mission.made.timestamp() * 1000)
    _add(document, "createTime", stamp)
    _add(document, "updateTime", stamp)
    _config(document, mission, True)
    folder = _add(document, "Folder", space=KML)
    _add(folder, "templateType", "waypoint")
    _add(folder, "templateId", 0)
    system = _add(folder, "waylineCoordinateSysParam")
    _add(system, "coordinateMode", "WGS84")
    _add(system, "heightMode", "relativeToStartPoint")
    _add(folder, "autoFlightSpeed", f"{mission.speed_m_s.min():.1f}")
    _add(folder, "globalHeight", f"{np.median(mission.over_m):.1f}")
    _add(folder, "caliFlightEnable", 0)
    _add(folder, "gimbalPitchMode", "usePointSetting")
    _heading(_add(folder, "globalWaypointHeadingParam"), 0.0)
    _add(folder, "globalWaypointTurnMode", _FLY_THROUGH)
    _add(folder, "globalUseStraightLine", 1)
    for number in range(len(mission)):
        mark = _placemark(folder, mission, number)
        _add(mark, "ellipsoidHeight", f"{mission.over_m[number]:.2f}")
        _add(mark, "height", f"{mission.over_m[number]:.2f}")
        for name in ("useGlobalHeight", "useGlobalSpeed", "useGlobalHeadingParam", "useGlobalTurnParam"):
            _add(mark, name, 0)
        _add(mark, "gimbalPitchAngle", f"{mission.pitch_deg[number]:.1f}")
        _common(mark, mission, number)
    return root


def _waylines(mission: Mission) -> ET.Element:
    if len(mission) > MAX_WAYPOINTS:
        raise InputError(
            f"--plots: {len(mission)} photos, expected at most {MAX_WAYPOINTS} in a file; plan fewer plots."
        )
    root, document = _root()
    _config(document, mission, False)
    folder = _add(document, "Folder", space=KML)
    _add(folder, "templateId", 0)
    _add(folder, "executeHeightMode", "relativeToStartPoint")
    _add(folder, "waylineId", 0)
    _add(folder, "distance", f"{mission.length_m:.1f}")
    _add(folder, "duration", f"{mission.seconds:.1f}")
    _add(folder, "autoFlightSpeed", f"{mission.speed_m_s.min():.1f}")
    for number in range(len(mission)):
        mark = _placemark(folder, mission, number)
        _add(mark, "executeHeight", f"{mission.over_m[number]:.2f}")
        _common(mark, mission, number)
    return root


def _placemark(folder: ET.Element, mission: Mission, number: int) -> ET.Element:
    mark = _add(folder, "Placemark", space=KML)
    point = _add(mark, "Point", space=KML)
    _add(point, "coordinates", f"{mission.lon[number]:.8f},{mission.lat[number]:.8f}", space=KML)
    _add(mark, "index", number)
    return mark


def _common(mark: ET.Element, mission: Mission, number: int) -> None:
    """Speed, heading, turn, gimbal and photo of one waypoint."""
    turns = number == 0 or mission.pitch_deg[number] != mission.pitch_deg[number - 1]
    ends = number in (0, len(mission) - 1) or turns
    _add(mark, "waypointSpeed", f"{mission.speed_m_s[number]:.1f}")
    _heading(_add(mark, "waypointHeadingParam"), float(mission.yaw_deg[number]))
    turn = _add(mark, "waypointTurnParam")
    _add(turn, "waypointTurnMode", _STOP if ends else _FLY_THROUGH)
    _add(turn, "waypointTurnDampingDist", "0" if ends else "0.2")
    _add(mark, "useStraightLine", 1)
    group = _add(mark, "actionGroup")
    _add(group, "actionGroupId", number)
    _add(group, "actionGroupStartIndex", number)
    _add(group, "actionGroupEndIndex", number)
    _add(group, "actionGroupMode", "sequence")
    _add(_add(group, "actionTrigger"), "actionTriggerType", "reachPoint")
    if turns:
        _gimbal(group, 0, float(mission.pitch_deg[number]), (mission.camera.wpml or (0, 0, 0, 0))[3])
    action = _add(group, "action")
    _add(action, "actionId", int(turns))
    _add(action, "actionActuatorFunc", "takePhoto")
    given = _add(action, "actionActuatorFuncParam")
    _add(given, "fileSuffix", f"p{number + 1:04d}")
    _add(given, "payloadPositionIndex", (mission.camera.wpml or (0, 0, 0, 0))[3])
    _add(given, "useGlobalPayloadLensIndex", 1)


def _heading(parent: ET.Element, yaw_deg: float) -> None:
    _add(parent, "waypointHeadingMode", "smoothTransition")
    _add(parent, "waypointHeadingAngle", round(yaw_deg))
    _add(parent, "waypointPoiPoint", "0.000000,0.000000,0.000000")
    _add(parent, "waypointHeadingPathMode", "followBadArc")


def _gimbal(group: ET.Element, number: int, pitch_deg: float, position: int) -> None:
    action = _add(group, "action")
    _add(action, "actionId", number)
    _add(action, "actionActuatorFunc", "gimbalRotate")
    given = _add(action, "actionActuatorFuncParam")
    _add(given, "gimbalHeadingYawBase", "north")
    _add(given, "gimbalRotateMode", "absoluteAngle")
    for axis, turns, angle in (("Pitch", 1, f"{pitch_deg:.1f}"), ("Roll", 0, "0"), ("Yaw", 0, "0")):
        _add(given, f"gimbal{axis}RotateEnable", turns)
        _add(given, f"gimbal{axis}RotateAngle", angle)
    _add(given, "gimbalRotateTimeEnable", 0)
    _add(given, "gimbalRotateTime", 0)
    _add(given, "payloadPositionIndex", position)
