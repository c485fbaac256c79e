"""JPEG photos as a DJI drone writes them: EXIF, GPS and the drone-dji XMP packet."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

from treedgs_geo.reconstruction.cameras import Camera

from .flight import Station


def _dms(angle_deg: float) -> tuple[float, float, float]:
    minutes, degrees = (abs(angle_deg) % 1) * 60, float(int(abs(angle_deg)))
    return degrees, float(int(minutes)), round(minutes % 1 * 60, 5)


def exif_bytes(
    camera: Camera,
    plot: str,
    lon: float,
    lat: float,
    h: float,
    local_time: str,
    subsecond: str,
    exposure_s: float = 0.00125,
) -> bytes:
    """EXIF block with exposure, 35 mm focal length, local time and the single-point GPS position."""
    exif = Image.Exif()
    exif[270], exif[271], exif[272] = f"SYNTHETIC render {plot}", "DJI", "M3E"
    exif[274], exif[305], exif[306] = 1, "TreeDGS sim", local_time
    diagonal = np.hypot(camera.width, camera.height)
    exif[0x8769] = {
        33434: exposure_s,
        33437: 2.8,
        34855: 110,
        36867: local_time,
        36868: local_time,
        36881: "-05:00",
        37386: 12.29,
        37521: subsecond,
        40962: camera.width,
        40963: camera.height,
        41989: int(round(camera.fx * 43.2666 / diagonal)),
    }
    exif[0x8825] = {
        0: b"\x02\x03\x00\x00",
        1: "N" if lat >= 0 else "S",
        2: _dms(lat),
        3: "E" if lon >= 0 else "W",
        4: _dms(lon),
        5: b"\x00" if h >= 0 else b"\x01",
        6: round(abs(h), 3),
        18: "WGS-84",
    }
    return exif.tobytes()


def xmp_packet(
    station: Station,
    camera: Camera,
    lon: float,
    lat: float,
    h: float,
    relative_h: float,
    yaw_true: float,
    rng: np.random.Generator,
    rtk_flag: str = "16",
) -> bytes:
    """drone-dji XMP: gimbal angles (true north, noisy), nominal focal length, UTC at exposure."""
    yaw = (yaw_true + rng.normal(0, 0.5) + 180) % 360 - 180
    pitch, roll = station.pitch_deg + rng.normal(0, 0.1), station.roll_deg + rng.normal(0, 0.1)
    body = (yaw + rng.normal(0, 2) + 180) % 360 - 180
    fields = {
        "AltitudeType": "GpsFusionAlt",
        "GpsLatitude": f"{lat:+.8f}",
        "GpsLongitude": f"{lon:+.8f}",
        "AbsoluteAltitude": f"{h:+.3f}",
        "RelativeAltitude": f"{relative_h:+.3f}",
        "GimbalRollDegree": f"{roll:+.2f}",
        "GimbalYawDegree": f"{yaw:+.2f}",
        "GimbalPitchDegree": f"{pitch:+.2f}",
        "FlightRollDegree": f"{rng.normal(0, 2):+.2f}",
        "FlightYawDegree": f"{body:+.2f}",
        "FlightPitchDegree": f"{rng.normal(-3, 2):+.2f}",
        "RtkFlag": rtk_flag,
        "CalibratedFocalLength": f"{round(camera.fx * 0.99763):.6f}",
        "CalibratedOpticalCenterX": f"{camera.width / 2:.6f}",
        "CalibratedOpticalCenterY": f"{camera.height / 2:.6f}",
        "UTCAtExposure": f"{station.utc:%Y-%m-%dT%H:%M:%S.%f}",
    }
    if not rtk_flag:
        del fields["RtkFlag"]
    if station.velocity.any():
        # North, east, down; the drone writes decimetres a second.
        east, north, up = station.velocity
        fields |= {"FlightXSpeed": f"{north:+.1f}", "FlightYSpeed": f"{east:+.1f}", "FlightZSpeed": f"{-up:+.1f}"}
    body_text = "\n".join(f'   drone-dji:{name}="{value}"' for name, value in fields.items())
    text = (
        '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>\n<x:xmpmeta xmlns:x="adobe:ns:meta/">\n'
        ' <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">\n'
        '  <rdf:Description rdf:about="DJI Meta Data" xmlns:tiff="http://ns.adobe.com/tiff/1.0/" '
        'xmlns:drone-dji="http://www.dji.com/drone-dji/1.0/"\n   tiff:Make="DJI" tiff:Model="M3E"\n'
        f'{body_text}>\n  </rdf:Description>\n </rdf:RDF>\n</x:xmpmeta>\n<?xpacket end="w"?>'
    )
    return text.encode("utf-8")


def write_jpeg(path: Path, pixels: np.ndarray, exif: bytes, xmp: bytes, quality: int = 92) -> None:
    """(H, W, 3) uint8 -> JPEG (4:2:0) with the XMP packet as a second APP1 segment, right behind EXIF."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=quality, exif=exif)
    data = stream.getvalue()
    position = 2
    # Behind JFIF and EXIF, wherever the encoder put them.
    while data[position : position + 2] in (b"\xff\xe0", b"\xff\xe1"):
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    body = b"http://ns.adobe.com/xap/1.0/\x00" + xmp
    segment = b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body
    path.write_bytes(data[:position] + segment + data[position:])
