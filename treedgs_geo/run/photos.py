"""From photos to the tree layer: the stages, in their order. Each but the orthophoto stands in its own file,
with its checks and cost."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ..core import workspace as names
from ..core.errors import OutputError
from ..core.progress import Collector, Reporter
from ..core.settings import to_json
from ..core.workspace import Workspace, peak_memory_mb
from ..inventory.tree_layer import check_output
from ..reconstruction.orthophoto import write_orthophoto
from ..stems.quality.tops import heights_sentence
from ..stems.quality.tree import Tree
from .context import PhotoJob
from .geotag_stage import GEOTAG, stations_of
from .given_store import GIVEN
from .ground_stage import GROUND, circles
from .heights import HEIGHTS
from .measure_stage import MEASURE
from .outputs import WRITE
from .reconstruct_stage import RECONSTRUCT
from .settings import CHAIN_PRESETS, PhotosToDbhSettings
from .sheets import SHEETS
from .stage import Findings, Key, Stage, Steps, check, dry_run, run_stages
from .stand_view import VIEW

#: From photos to trees.
TREES = (GEOTAG, RECONSTRUCT, GROUND, MEASURE, HEIGHTS)
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


def job_of(settings: PhotosToDbhSettings, reporter: Reporter) -> PhotoJob:
    """A photo run that has not begun."""
    preset = CHAIN_PRESETS[settings.preset]
    of_stems = {name: getattr(settings, name) for name in ("bh_m", "max_dbh_cm", "stem_network")}
    preset = replace(preset, stems=replace(preset.stems, **of_stems))
    return PhotoJob(settings, preset, reporter, Steps(None, reporter, {}))


@contextmanager
def held(job: PhotoJob, stages: Sequence[Stage[PhotoJob]], only_kept: bool = False) -> Iterator[PhotoJob]:
    """The job in its workspace, for this process alone. stages: that will run. only_kept: see :class:`.stage.Steps`.

    Raises:
        InputError: another run works there. OutputError: the folder or the tree layer cannot be written.
    """
    check_output(job.settings.output)
    with Workspace.held(job.settings.workspace) as space:
        job.space = space
        job.steps = Steps(space, job.reporter, {stage.name: stage.share for stage in stages}, only_kept)
        yield job


def run_chain(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The whole chain; returns the result of ``photos-to-dbh``. Finished stages of the same inputs and settings are
    kept.

    Cheap checks come first, so that hours of work never end in a typing error.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    job = job_of(settings, reporter)
    check(GEOTAG, job)
    if not (settings.workspace / "run.json").exists():
        _check_ahead(job)
    with held(job, (*TREES, GIVEN, SHEETS, WRITE, ORTHOPHOTO, VIEW)):
        job.space.record["parameters"] = to_json(settings)
        # Paths that were given relative are relative to this folder.
        job.space.record["folder"] = os.getcwd()
        run_stages((*TREES, GIVEN), job, job.steps)
        try:
            run_stages((SHEETS,), job, job.steps)
        except OutputError as problem:  # the diameters are measured
            reporter.warn(f"No evidence sheets: {problem}")
            job.steps.warnings.append(f"No evidence sheets: {problem}")
        run_stages((WRITE,), job, job.steps)
        for picture, missing in ((ORTHOPHOTO, "No orthophoto"), (VIEW, "No 3D view")):
            try:
                run_stages((picture,), job, job.steps)
            except Exception as problem:  # the trees are written
                reporter.warn(f"{missing}: {problem}")
                job.steps.warnings.append(f"{missing}: {problem}")
    return _result(job)


def _check_ahead(job: PhotoJob) -> None:
    """What would end the run before its first photo is matched, while there is no workspace that it would leave."""
    ahead, heard = job_of(job.settings, Reporter()), Collector(Reporter(), held=True)
    for stage in TREES:
        check(stage, ahead)
        if stage is GEOTAG:
            ahead.stations = stations_of(job.settings, heard)
            job.read_ahead = ahead.stations, heard


def _result(job: PhotoJob) -> dict[str, Any]:
    result, status = result_of(job, job.trees), f"No stem is measurable: {job.nothing}."
    if result["n_measured"]:
        status = f"{result['n_measured']} of the {len(job.trees)} stems found were measured"
        if heights := heights_sentence(job.trees):
            job.reporter.info(f"{heights}.")
            status += f"; {heights[0].lower()}{heights[1:].partition(' (')[0]}"
    return {**result, "status": status, "warnings": job.steps.warnings}


def result_of(job: PhotoJob, trees: list[Tree]) -> dict[str, Any]:
    """What every run of the verb returns. trees: those that are new in the layer."""
    measured = [tree.dbh_cm for tree in trees if tree.dbh_cm is not None]
    return {
        "output": str(job.settings.output),
        "report": str(job.path(names.REPORT)),
        "workspace": str(job.settings.workspace),
        "run": str(job.path("run.json")),
        "n_trees": len(trees),
        "n_measured": len(measured),
        "n_rejected": len(trees) - len(measured),
        "mean_dbh_cm": round(float(np.mean(measured)), 2) if measured else None,
        "peak_memory_mb": peak_memory_mb(),
    }


def check_photos(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """The dry run: what the run would meet and need. Reads inputs, writes nothing.

    Raises:
        TreeDGSError: what would end the job: an input that cannot be used, an output that cannot be written, no disk.
    """
    findings = Findings(reporter)
    job = job_of(settings, findings)
    return dry_run(TREES, job, findings, settings.workspace)
