"""Settings that every verb which reconstructs photos has (standard library only)."""

from __future__ import annotations

from typing import Any

from ..core.settings import param


def gcp_option() -> Any:
    """Setting ``gcp``: ground control and check points."""
    return param(
        None,
        kind="file",
        help="Ground control and check points: gcp_list.txt of OpenDroneMap, or CSV with label, easting, northing, "
        "height (or lon, lat, height), photo, u, v; for drones without PPK, and to check any block.",
        suffixes=(".txt", ".csv"),
    )


def calibration_option() -> Any:
    """Setting ``calibration``: what an earlier reconstruction found about the camera."""
    return param(
        None,
        kind="file",
        help="camera.json of an earlier reconstruction with the same camera and photo size; without it the lens is "
        "taken from the photos' metadata.",
        suffixes=(".json",),
        advanced=True,
    )


def matcher_option() -> Any:
    """Setting ``matcher``: a learned matcher of the user's (:mod:`.matchers`)."""
    return param(
        None,
        kind="file",
        suffixes=(".py",),
        advanced=True,
        help="Python file with load(weights) that returns a matcher of two photos (TopicFM, LoFTR, LightGlue ...); its "
        "matches are used beside SIFT's.",
    )


def matcher_weights_option() -> Any:
    """Setting ``matcher_weights``: what the learned matcher loads."""
    return param(None, kind="file", advanced=True, help="Weights that the matcher loads; none come with TreeDGS.")
