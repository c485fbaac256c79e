"""DJI's WPML: a ``.kmz`` with ``wpmz/template.kml`` (for editing) and ``wpmz/waylines.wpml`` (what is flown).

Element names, order and values as DJI's Cloud API documentation defines them (chapter DJI WPML, version 1.0.2); both
files are made from the template ``wpmz.xml``. Heights are over the take-off (``relativeToStartPoint``). The drone flies
through the waypoints; where the gimbal turns it stops.
"""

from __future__ import annotations

import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd

from ...core.files import atomic_path
from .mission import Mission


def write_kmz(path: Path, mission: Mission) -> Path:
    """Write the mission of a camera that has WPML numbers."""
    import jinja2

    assert mission.camera.wpml is not None
    text = (files(__package__) / "wpmz.xml").read_text(encoding="utf-8")
    template = jinja2.Template(text, trim_blocks=True, autoescape=True, undefined=jinja2.StrictUndefined)
    names = ("lon", "lat", "over_m", "yaw_deg", "pitch_deg", "speed_m_s")
    points = pd.DataFrame({name: getattr(mission, name) for name in names})
    points["turns"] = points["pitch_deg"].diff() != 0
    points["stops"] = points["turns"] | (points.index == len(points) - 1)
    values = {
        "points": list(points.itertuples()),
        **{name: getattr(mission, name) for name in ("home", "safe_m", "length_m", "seconds")},
        **dict(zip(("drone", "kind", "payload", "position"), mission.camera.wpml, strict=True)),
        "stamp": int(mission.made.timestamp() * 1000),
        "slowest_m_s": mission.speed_m_s.min(),
        "transit_m_s": min(15.0, float(mission.speed_m_s.max())),
        "middle_m": np.median(mission.over_m),
    }
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("template.kml", "waylines.wpml"):
            # A fixed time: the same plan gives the same file.
            entry = zipfile.ZipInfo(f"wpmz/{name}", (2020, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, template.render(values, flown=name == "waylines.wpml"))
    return Path(path)
