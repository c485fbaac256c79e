"""Small networks that the package brings, run by OpenCV: no other library is needed."""

from __future__ import annotations

import base64
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .files import read_json


@lru_cache(maxsize=2)
def read_network(path: Path) -> Any:
    """The network of a JSON file with an ONNX file as base64 (the QGIS plugin repository takes no binaries)."""
    import cv2

    packed = "".join(read_json(path)["onnx_base64"])
    return cv2.dnn.readNetFromONNX(np.frombuffer(base64.b64decode(packed), np.uint8))
