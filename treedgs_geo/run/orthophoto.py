"""The stage ``orthophoto``: the ground below the crowns as a picture, from the block's own photos."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from ..core import workspace as names
from ..core.progress import Reporter
from ..reconstruction.orthophoto import write_orthophoto
from .context import PhotoJob
from .ground_stage import circles
from .stage import Key, Stage

#: The ground is shown this far beside the plots, metres.
_BESIDE_M = 2.0


def _orthophoto(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    site, path = job.place, job.path(names.ORTHO)
    with suppress(OSError):  # one of another block must not be taken for this one's; a program may hold it
        path.unlink()
    return write_orthophoto(path, site.views, site.ground, site.frame, site.area.bounds(_BESIDE_M), reporter)


# After the layer is written: no trouble with a picture costs a tree.
ORTHOPHOTO = Stage(
    "orthophoto",
    0.02,
    _orthophoto,
    key=lambda job: Key({"plots": circles(job.place.area), "ground": job.space.output_hashes("ground")}),
    outputs=lambda job: [job.path(names.ORTHO)],
    wanted=lambda job: job.settings.orthophoto and job.site is not None and len(job.site.area.radii_m) > 0,
)
