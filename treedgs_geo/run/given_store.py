"""Stems measured at given places after a run (``--at``), kept in its workspace: a resumed run has them too."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from ..core import workspace as names
from ..core.errors import InputError
from ..core.files import read_json, write_json
from ..core.progress import Reporter
from ..core.workspace import Workspace
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.fit_records import fit_of_record, fit_record, read_fits
from ..stems.quality.tree import Tree
from .context import PhotoJob
from .measure_stage import placed
from .stage import Stage


@dataclass(frozen=True)
class KeptGiven:
    """trees: numbered on from those of the run. fits: by ``tree_id``."""

    trees: list[Tree] = field(default_factory=list)
    fits: dict[int, PhotoFit] = field(default_factory=dict)


def write_given(job: PhotoJob, given: KeptGiven) -> None:
    """Keep them, as of this run's measurement."""
    rows = [{"tree": asdict(tree), "fit": fit_record(given.fits[tree.tree_id])} for tree in given.trees]
    write_json(job.path(names.GIVEN), {"of": job.space.output_hashes("measure"), "stems": rows})


def read_given(space: Workspace, reporter: Reporter | None = None) -> KeptGiven:
    """What was kept; nothing where it belongs to another measurement, which the reporter then hears.

    Raises:
        InputError: not readable, or of another version.
    """
    path = space.path(names.GIVEN)
    if not path.exists():
        return KeptGiven()
    kept = read_json(path)
    try:
        if kept["of"] != space.output_hashes("measure"):
            if reporter is not None and kept["stems"]:
                reporter.warn(
                    f"{path}: {len(kept['stems'])} stems that were measured at given places belong to an earlier "
                    "measurement and are left out; give their points again with --at."
                )
            return KeptGiven()
        trees = [Tree(**row["tree"]) for row in kept["stems"]]
        return KeptGiven(trees, {row["tree"]["tree_id"]: fit_of_record(row["fit"]) for row in kept["stems"]})
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        raise InputError(
            f"{path}: holds no stems of this version ({problem}); delete it and give their points again with --at."
        ) from None


def with_given(trees: list[Tree], given: KeptGiven) -> list[Tree]:
    """The trees of a run and those at given places, which take the place of a refused one of the same number."""
    numbers = {tree.tree_id for tree in given.trees}
    return sorted([*(t for t in trees if t.tree_id not in numbers), *given.trees], key=lambda tree: tree.tree_id)


def fits_by_id(space: Workspace) -> KeptGiven:
    """All fits of a workspace by ``tree_id``, those at given places with them."""
    kept, given = read_fits(space.path(names.FITS)), read_given(space)
    return KeptGiven(given.trees, dict(enumerate(kept.fits, start=1)) | given.fits)


def _join(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    given = read_given(job.space, reporter)
    job.trees = placed(with_given(job.trees, given), job)
    return {"points": len(given.trees)}


#: Trees measured at given places after an earlier run join those of this one.
GIVEN = Stage("given", 0.0, _join, wanted=lambda job: not job.nothing and job.path(names.GIVEN).exists(), always=True)
