"""Settings that every verb which reconstructs photos has (standard library only)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..core.settings import param

#: A block is sure where at least this share of its placed photos is confirmed (:func:`.resection.confirmed`).
CONFIRMED_SHARE = 0.5


@dataclass(frozen=True, kw_only=True)
class ReconstructOptions:
    """How to reconstruct; the defaults suit drone photos of 1 to 60 MP."""

    #: Most features per photo.
    max_features: int = 8000
    #: Photos are reduced to this longer side for the features, px.
    max_image_size: int = 4000
    #: Photos that each photo is matched with.
    neighbours: int = 20
    #: Processor threads; 0 = all.
    threads: int = 0
    seed: int = 1


def project_crs_option() -> Any:
    """``crs`` of the verbs that read photos."""
    return param(
        None,
        kind="crs",
        help="Project CRS, projected and in metres, for example EPSG:6344, or with a height datum, EPSG:6344+5703; "
        "default: the one that is usual where the photos lie; the log names it and says why",
    )


def geotags_crs_option() -> Any:
    """Setting ``geotags_crs``: the frame of the geotags, where it is not the project's."""
    return param(
        None,
        kind="crs",
        help="Reference frame of the geotags (geographic), for example EPSG:7912 for ITRF2014; default: the project's.",
    )
