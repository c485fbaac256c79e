"""``segment-stems``: which points belong to which stem."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.command import Command, run_by
from ..core.settings import CLOUD_OUTPUTS, TREE_LAYERS, param
from ..run.settings import CloudSettings
from ..stems.cloud.propose.options import SegmentOptions


@dataclass(frozen=True, kw_only=True)
class SegmentStemsSettings(SegmentOptions, CloudSettings):
    """Options of ``segment-stems``."""

    output: Path = param(kind="output_file", help="stem points with tree_id", suffixes=CLOUD_OUTPUTS)
    keep_all: bool = param(False, help="write every point (tree_id 0 = no stem), not only stem points")
    field_stems: Path | None = param(
        None,
        help="positions of known stems (point layer, or CSV with x, y, "
        "tree_id): they are looked for harder, and name what is found",
        suffixes=TREE_LAYERS,
    )
    segmenter: str = param(
        "own",
        help="who finds the trees: own needs nothing; forestformer3d, segmentanytree and treex are programs that you "
        "installed yourself (docs/analyst/measuring.md)",
        choices=("own", "forestformer3d", "segmentanytree", "treex"),
    )
    segmenter_command: str | None = param(
        None, help="command line of that program, with {input} and {output} for its folders", code=True
    )


COMMAND = Command(
    name="segment-stems",
    title="Find stems in a point cloud",
    group="5 Steps and research",
    summary="Find stems in a point cloud and give each point the id of its tree.",
    help=(
        "Looks in the band from 0.5 to 5 m above ground for rings (or discs, for surface points of splats) that "
        "repeat over the height, fits a leaning, tapering cone to each, keeps what is empty inside, clean outside and "
        "continuous, and follows the axis upwards. No trained weights. The output carries tree_id (0 = no stem), "
        "height_m, stem_class (0 other, 1 ground, 2 stem) and ground_se_m (how sure the ground "
        "under the tree is, 99 = not seen at all). --segmenter runs a program that you installed instead "
        "and checks that its labels belong to the points it was given. --field-stems gives known positions: near them "
        "weaker evidence is looked at, and the stems found carry the field's tree_id: pairs are one to one, as near as "
        "the positions are exact, 1 m at most. OUTPUT_field.csv answers for each: found, unsure (the stem near it may "
        "be another's), refused or missing, with the reason."
    ),
    settings=SegmentStemsSettings,
    run=run_by("run.cloud_steps", "run_segment_stems"),
    main=("input", "dtm", "crs", "output", "keep_all", "field_stems"),
    example="treedgs segment-stems --input flight/lidar/flight_uls.laz --dtm dtm.tif --output stems.laz",
    outputs={
        "output": "stem points with tree_id and height_m",
        "n_stems": "stems found",
        "n_stem_points": "points on stems",
        "field_table": "what was found of each field stem",
        "source": "settings used: uls, tls, splat, or the segmenter",
    },
)
