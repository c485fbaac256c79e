"""What DJI's WPML and QGroundControl's plan files have to hold, as their published documentation defines them.

WPML: DJI Cloud API, chapters "waylines.wpml", "template.kml" and "Common elements". Plan: QGroundControl developer
guide, "Plan file format", and the MAVLink common message set.
"""

import re
import zipfile
from xml.etree import ElementTree as ET

KML, WPML = "{http://www.opengis.net/kml/2.2}", "{http://www.dji.com/wpmz/1.0.2}"

#: Element -> (lowest, highest) of a number, or the words that are allowed.
CONFIG = {
    "flyToWaylineMode": ("safely", "pointToPoint"),
    "finishAction": ("goHome", "noAction", "autoLand", "gotoFirstWaypoint"),
    "exitOnRCLost": ("goContinue", "executeLostAction"),
    "executeRCLostAction": ("goBack", "landing", "hover"),
    "takeOffSecurityHeight": (1.2, 1500.0),
    "globalTransitionalSpeed": (0.1, 15.0),
    "globalRTHHeight": (2.0, 1500.0),
}
TURNS = (
    "coordinateTurn",
    "toPointAndStopWithDiscontinuityCurvature",
    "toPointAndStopWithContinuityCurvature",
    "toPointAndPassWithContinuityCurvature",
)
HEADINGS = ("followWayline", "manually", "fixed", "smoothTransition", "towardPOI")
PATHS = ("clockwise", "counterClockwise", "followBadArc")
ACTIONS = {
    "takePhoto": ("fileSuffix", "payloadPositionIndex"),
    "gimbalRotate": (
        *("gimbalRotateMode", "gimbalPitchRotateEnable", "gimbalPitchRotateAngle", "gimbalRollRotateEnable"),
        *("gimbalRollRotateAngle", "gimbalYawRotateEnable", "gimbalYawRotateAngle", "gimbalRotateTimeEnable"),
        *("gimbalRotateTime", "payloadPositionIndex"),
    ),
}
#: Drone type -> sub-types and payloads that belong to it.
DRONES = {77: ({0, 1, 2}, {66, 67, 68}), 89: ({0}, {42, 43, 50, 61, 82, 83}), 99: ({0, 1}, {88, 89})}


def text(parent, name):
    """The text of a required child."""
    found = parent.find(WPML + name)
    assert found is not None and (found.text or "").strip(), f"{parent.tag}: {name} is missing"
    return found.text.strip()


def check(parent, name, allowed):
    """The value lies in its limits, or is one of the words."""
    value = text(parent, name)
    if isinstance(allowed[0], str):
        assert value in allowed, f"{name}: {value}"
    else:
        assert allowed[0] <= float(value) <= allowed[1], f"{name}: {value}"
    return value


def validate_kmz(path):
    """Check the whole archive; returns the waypoints of what is flown: lon, lat, height, heading, speed, pitch,
    photos."""
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert {"wpmz/template.kml", "wpmz/waylines.wpml"} <= set(archive.namelist())
        template, flown = (ET.fromstring(archive.read(f"wpmz/{name}")) for name in ("template.kml", "waylines.wpml"))
    for root in (template, flown):
        assert root.tag == KML + "kml"
        _config(root.find(f"{KML}Document/{WPML}missionConfig"))
    document = template.find(KML + "Document")
    assert document is not None
    assert int(text(document, "createTime")) > 1e12
    reference = text(document.find(WPML + "missionConfig"), "takeOffRefPoint").split(",")
    assert len(reference) == 3 and -90 <= float(reference[0]) <= 90 and -180 <= float(reference[1]) <= 180
    _template(document.find(KML + "Folder"))
    return _waylines(flown.findall(f"{KML}Document/{KML}Folder"))


def _config(config):
    for name, allowed in CONFIG.items():
        check(config, name, allowed)
    drone, payload = config.find(WPML + "droneInfo"), config.find(WPML + "payloadInfo")
    kinds, payloads = DRONES[int(text(drone, "droneEnumValue"))]
    assert int(text(drone, "droneSubEnumValue")) in kinds
    assert int(text(payload, "payloadEnumValue")) in payloads
    assert int(text(payload, "payloadPositionIndex")) in (0, 1, 2)


def _template(folder):
    check(folder, "templateType", ("waypoint", "mapping2d", "mapping3d", "mappingStrip"))
    check(folder, "templateId", (0, 65535))
    system = folder.find(WPML + "waylineCoordinateSysParam")
    check(system, "coordinateMode", ("WGS84",))
    check(system, "heightMode", ("EGM96", "relativeToStartPoint", "aboveGroundLevel", "realTimeFollowSurface"))
    check(folder, "autoFlightSpeed", (0.1, 15))
    check(folder, "gimbalPitchMode", ("manual", "usePointSetting"))
    check(folder, "globalWaypointTurnMode", TURNS)
    check(folder, "globalUseStraightLine", (0, 1))
    _heading(folder.find(WPML + "globalWaypointHeadingParam"))
    marks = folder.findall(KML + "Placemark")
    assert marks
    for number, mark in enumerate(marks):
        _mark(mark, number)
        for name in ("useGlobalHeight", "useGlobalSpeed", "useGlobalHeadingParam", "useGlobalTurnParam"):
            check(mark, name, (0, 1))
        for name in ("height", "ellipsoidHeight"):
            float(text(mark, name))
        check(mark, "gimbalPitchAngle", (-130, 60))


def _waylines(folders):
    points, groups = [], []
    for folder in folders:
        check(folder, "templateId", (0, 65535))
        check(folder, "waylineId", (0, 65535))
        check(folder, "autoFlightSpeed", (0.1, 15))
        assert check(folder, "executeHeightMode", ("WGS84", "relativeToStartPoint", "realTimeFollowSurface"))
        pitch = None
        for number, mark in enumerate(folder.findall(KML + "Placemark")):
            lon, lat = _mark(mark, number)
            height = float(text(mark, "executeHeight"))
            for group in mark.findall(WPML + "actionGroup"):
                groups.append(int(text(group, "actionGroupId")))
                made = _group(group, number)
                pitch = next((angle for what, angle in made if what == "gimbalRotate"), pitch)
                photos = sum(what == "takePhoto" for what, _ in made)
            heading = int(text(mark.find(WPML + "waypointHeadingParam"), "waypointHeadingAngle"))
            points.append((lon, lat, height, heading, float(text(mark, "waypointSpeed")), pitch, photos))
    assert groups == list(range(len(groups))), "group ids count up from 0"
    return points


def _mark(mark, number):
    assert int(text(mark, "index")) == number
    lon, lat = map(float, mark.find(KML + "Point").find(KML + "coordinates").text.strip().split(","))
    assert -180 <= lon <= 180 and -90 <= lat <= 90
    check(mark, "waypointSpeed", (0.1, 15))
    _heading(mark.find(WPML + "waypointHeadingParam"))
    turn = mark.find(WPML + "waypointTurnParam")
    mode, damping = check(turn, "waypointTurnMode", TURNS), float(text(turn, "waypointTurnDampingDist"))
    if mode in (TURNS[0], TURNS[3]):
        assert damping > 0
    return lon, lat


def _heading(param):
    if check(param, "waypointHeadingMode", HEADINGS) == "smoothTransition":
        assert re.fullmatch(r"-?\d+", text(param, "waypointHeadingAngle"))
        check(param, "waypointHeadingAngle", (-180, 180))
    check(param, "waypointHeadingPathMode", PATHS)


def _group(group, number):
    start, end = int(text(group, "actionGroupStartIndex")), int(text(group, "actionGroupEndIndex"))
    assert start == number <= end
    check(group, "actionGroupMode", ("sequence",))
    trigger = group.find(WPML + "actionTrigger")
    check(trigger, "actionTriggerType", ("reachPoint", "betweenAdjacentPoints", "multipleTiming", "multipleDistance"))
    made = []
    for place, action in enumerate(group.findall(WPML + "action")):
        assert int(text(action, "actionId")) == place
        what = check(action, "actionActuatorFunc", tuple(ACTIONS))
        given = action.find(WPML + "actionActuatorFuncParam")
        for name in ACTIONS[what]:
            text(given, name)
        made.append((what, float(text(given, "gimbalPitchRotateAngle")) if what == "gimbalRotate" else None))
    assert made
    return made


def validate_plan(plan):
    """Check a loaded ``.plan``; returns its waypoints: lat, lon, height, heading."""
    assert plan["fileType"] == "Plan" and plan["version"] == 1 and isinstance(plan["groundStation"], str)
    assert plan["geoFence"] == {"circles": [], "polygons": [], "version": 2}
    assert plan["rallyPoints"] == {"points": [], "version": 2}
    mission = plan["mission"]
    assert mission["version"] == 2 and mission["vehicleType"] == 2 and mission["firmwareType"] in (3, 12)
    assert (
        mission["globalPlanAltitudeMode"] in (0, 1, 2, 3) and mission["cruiseSpeed"] > 0 and mission["hoverSpeed"] > 0
    )
    home = mission["plannedHomePosition"]
    assert len(home) == 3 and -90 <= home[0] <= 90 and -180 <= home[1] <= 180
    points = []
    for number, item in enumerate(mission["items"], start=1):
        assert item["type"] == "SimpleItem" and item["autoContinue"] is True and item["doJumpId"] == number
        assert item["command"] in (16, 20, 22, 178, 205, 2000) and len(item["params"]) == 7
        assert all(value is None or isinstance(value, (int, float)) for value in item["params"])
        if item["command"] in (16, 22):
            assert item["frame"] == 3 and item["AltitudeMode"] == 1
            assert item["Altitude"] == item["params"][6] and item["AMSLAltAboveTerrain"] is None
        else:
            assert item["frame"] == 2
        if item["command"] == 16:
            points.append((item["params"][4], item["params"][5], item["params"][6], item["params"][3]))
    assert mission["items"][0]["command"] == 22 and mission["items"][-1]["command"] == 20
    return points
