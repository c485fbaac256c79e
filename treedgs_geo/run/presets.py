"""How much of the scene each preset of the photo chain models."""

from __future__ import annotations

from dataclasses import dataclass

from ..reconstruction.options import ReconstructOptions
from ..stems.photos.options import PhotoStemOptions


@dataclass(frozen=True)
class Preset:
    """How much of the scene is modelled. sheets: trees that get an evidence sheet: ``all``, or those to ``check`` and
    not measured. heights: whether tree heights are measured in the photos."""

    reconstruct: ReconstructOptions
    stems: PhotoStemOptions
    sheets: str = "all"
    heights: bool = True


CHAIN_PRESETS = {
    "fast": Preset(
        ReconstructOptions(max_features=4000, neighbours=12),
        PhotoStemOptions(max_views=48, max_lean_deg=10.0, most_asked=0),
        sheets="check",
        heights=False,
    ),
    "balanced": Preset(ReconstructOptions(), PhotoStemOptions()),
    "best": Preset(ReconstructOptions(max_features=16000, neighbours=30), PhotoStemOptions(max_views=200)),
    "paper": Preset(ReconstructOptions(), PhotoStemOptions()),
}
