"""Settings of stem segmentation in point clouds (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ....core.settings import param


def segmenter_option() -> Any:
    """Who tells stems from the rest of a cloud."""
    return param(
        "own",
        help="who finds the trees: own needs nothing; forestformer3d, segmentanytree and treex are programs that you "
        "installed yourself, model is a network in a file of yours (docs/analyst/measuring.md)",
        choices=("own", "forestformer3d", "segmentanytree", "treex", "model"),
    )


def segmenter_command_option() -> Any:
    """How a program that is not ours is started."""
    text = "command line of that program, with {input} and {output} for its folders"
    return param(None, help=text, code=True)


def segmenter_model_option() -> Any:
    """A network that is run in this process."""
    return param(
        None,
        kind="file",
        help="of --segmenter model: the network, TorchScript or ONNX; points (N, 3) in, tree numbers (N,) out",
        suffixes=(".pt", ".pth", ".ts", ".onnx"),
        code=True,
    )


@dataclass(frozen=True, kw_only=True)
class SegmentOptions:
    """How stems are found. ``source`` sets the noise and density that are expected.

    Of the library only: max_lean_deg: more lean is refused. low_m, high_m: of the band that is searched.
    min_arc_deg: least circumference seen, degrees, all rows together. min_rows: share of 25 cm rows of the band
    that must show bark. grow_m: height up to which stem points are followed, metres.
    """

    source: str = param("auto", help="what made the points", choices=("auto", "uls", "tls", "splat"))
    max_dbh_cm: float = param(100.0, help="thickest stem", unit="cm", minimum=5, maximum=500)
    max_lean_deg: float = 25.0
    low_m: float = 0.5
    high_m: float = 5.0
    min_arc_deg: float = 90.0
    min_rows: float = 0.4
    grow_m: float = 15.0

    @property
    def fitted_m(self) -> tuple[float, float]:
        """Heights between which cones are fitted to the points, metres."""
        return self.low_m - 0.1, min(self.high_m, 4.25)
