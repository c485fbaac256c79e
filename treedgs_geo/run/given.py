"""``photos-to-dbh --at``: stems at given places, measured from a finished run in its workspace.

Cameras, ground and what the search learnt of the photos are kept there, so only the places themselves are looked at.
One stem, one diameter: what the run measured already is not measured a second time, unless the point's name asks for
it (``again 12``, with the foot at this place; ``former 12`` takes that back).
"""

from __future__ import annotations

import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyproj

from ..core import workspace as names
from ..core.errors import InputError, OutputError
from ..core.field_stems import read_field_stems
from ..core.progress import Collector, Reporter
from ..core.settings import to_json
from ..core.shown import count_of, shown_cm
from ..core.workspace import read_record
from ..stems.photos.deduplicate import one_stem
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.fit_records import read_fits
from ..stems.photos.route import fits_again
from ..stems.photos.trees import trees_of_photo_fits
from ..stems.quality.tree import Tree
from .context import PhotoJob
from .field_stems import given_stems
from .given_store import KeptGiven, fits_by_id, read_given, with_given, write_given
from .heights import KEPT_HEIGHTS, find_heights
from .layer_update import Held, held_trees, merge_layers
from .measure_stage import placed, with_run_errors
from .outputs import write_page
from .photos import GEOTAG, TREES, held, job_of, result_of
from .published_plot import is_published
from .sheets import add_sheets
from .stage import NotKept, check, run_stages
from .stand_view import show_stand

if TYPE_CHECKING:
    from .settings import PhotosToDbhSettings

#: Settings that may differ from the run's: they change no diameter.
_FREE = frozenset({"output", "workspace", "sheets", "dry_run", "at"})
#: A point so named is for a tree that the run measured: again, with its foot here, or as it was before.
_NAMED = re.compile(r"(again|former) (\d+)")
#: What became of points that gave no diameter.
_WORDS = {
    "refused": "without a DBH, each with its reason",
    "held": "at a tree that the layer holds already",
    "outside": "outside the measured plots or the ground",
}


@dataclass
class _Point:
    """A place to measure at, project coordinates, and what becomes of it.

    answer: ``measured``, ``back`` (a tree of the run that the layer lacks) or a key of :data:`_WORDS`, empty while it
    is still to be measured; said: in words. row: the tree that the layer has there, without a diameter or named by the
    point. tree: for the layer, in place of ``row``; fit: what it was measured as. former: it is that of the run.
    """

    name: str
    xy: np.ndarray
    answer: str = ""
    said: str = ""
    row: Held | None = None
    tree: Tree | None = None
    fit: PhotoFit | None = None
    former: bool = False

    def say(self, answer: str, sentence: str) -> None:
        """What became of it."""
        self.answer, self.said = answer, f"point {self.name}: {sentence}"

    def bring_back(self, tree: Tree, gone: list[Tree]) -> None:
        """It is one of the trees that the run measured and the layer lacks (``gone``)."""
        self.tree = tree
        gone.remove(tree)
        self.say("back", f"tree {tree.tree_id} of the run is in the layer again: {_verdict(tree)}.")


def measure_given(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Measure at the places in ``settings.at``; returns the result of ``photos-to-dbh``.

    The trees go into ``settings.output`` if that is the run's layer already; else the layer is written there as the run
    left it in its workspace, with the new trees. What a person wrote or decided stays.

    Raises:
        TreeDGSError: no finished run with these settings in the workspace, no point that can be measured, a layer of
            another run.
    """
    had = _run_settings(settings.workspace)
    crs, read = had.get("crs"), pyproj.CRS.from_user_input
    with suppress(pyproj.exceptions.CRSError):
        if settings.crs is None or read(settings.crs) == read(crs):
            # Written as the run had it, so that its stages are known again.
            settings = replace(settings, crs=crs)
    job = job_of(settings, reporter)
    check(GEOTAG, job)
    with held(job, TREES, only_kept=True):
        if is_published(settings):
            raise InputError(
                f"{settings.workspace}: its run measured with --fit gaussians (--preset paper), expected photos or "
                "auto; stems at given places are measured straight in the photos only."
            )
        try:
            run_stages(TREES, job, job.steps)
        except NotKept:
            _refuse_other_settings(settings, had)
            raise
        if job.site is None or job.nothing:
            raise InputError(f"{settings.workspace}: its run could measure no stem: {job.nothing}.")
        return _measure_at(job, Collector(reporter))


def _run_settings(folder: Path) -> dict[str, Any]:
    """The settings of the finished run that a workspace holds.

    Raises:
        InputError: there is none.
    """
    record = read_record(folder) or {"stages": {}}
    had = record.get("parameters")
    if not isinstance(had, dict) or record["stages"].get("measure", {}).get("status") != "done":
        raise InputError(
            f"{folder}: holds no finished run of photos-to-dbh, which --at measures from; run it once without --at, "
            "or give the workspace of that run."
        )
    return had


def _refuse_other_settings(settings: PhotosToDbhSettings, had: dict[str, Any]) -> None:
    """A stage is not that of the run: which setting differs.

    Raises:
        InputError: one does, with both values.
    """
    now = to_json(settings)
    # Paths last: a stage knows files by their content.
    for name in sorted(now, key=lambda name: isinstance(getattr(settings, name), Path)):
        if name not in _FREE and name in had and now[name] != had[name]:
            before, value = ("not given" if one is None else one for one in (had[name], now[name]))
            raise InputError(
                f"{settings.workspace}: its run had --{name.replace('_', '-')} {before}, now it is {value}; give the "
                "settings of the run, or run photos-to-dbh once with the new ones and without --at."
            )


def _measure_at(job: PhotoJob, reporter: Collector) -> dict[str, Any]:
    """Look each point up in the layer and among the run's trees, measure at the others, write."""
    before = read_given(job.space)
    trees = placed(with_given(job.trees, before), job)
    rows = held_trees(job, trees)
    there = {row.tree_id for row in rows}
    gone = [tree for tree in trees if tree.dbh_cm is not None and tree.tree_id not in there]
    points = _points(job)
    for point in points:
        if not point.answer and not _named(point, rows, job):
            _look_up(point, rows, gone, job.settings.field_error_m)
    used = {"at": str(job.settings.at), "points": len(points)}
    with reporter.stage("given stems", 0.2, 0.9), job.space.running("given", "", used) as facts:
        if open_ := [point for point in points if not point.answer]:
            _fit(open_, job, rows, gone, reporter)
            _as_trees([point for point in open_ if point.fit is not None], job, rows, trees)
            _add_heights([point for point in open_ if point.tree is not None], job, reporter)
        answers = Counter(point.answer for point in points)
        facts |= {"points": len(points), **answers, "warnings": reporter.warnings}
    changed = [(point.tree, point.row) for point in points if point.tree is not None]
    made = [tree for tree, _ in changed]
    if changed or not job.settings.output.exists():
        # The workspace first: what it holds and the layer lacks comes back when it is asked for again.
        write_given(job, _with_points(before, points))
        merge_layers(job, changed, trees, reporter)
        add_sheets(job, made, reporter)
        try:
            write_page(job, read_given(job.space).trees, reporter)
        except (OutputError, InputError) as problem:  # the trees are written
            reporter.warn(str(problem))
        try:
            show_stand(job, read_given(job.space).trees, reporter)
        except Exception as problem:  # the trees are written
            reporter.warn(f"No 3D view: {problem}")
    for point in points:
        if point.said:
            reporter.info(point.said)
    added = answers["measured"] + answers["back"]
    by_run = f" ({answers['back']} by the run)" if answers["back"] else ""
    parts = [f"{added} of {count_of(len(points), 'point')} measured{by_run}"]
    parts += [f"{answers[word]} {text}" for word, text in _WORDS.items() if answers[word]]
    return {
        **result_of(job, made),
        "status": "; ".join(parts),
        "trees": [[tree.tree_id, tree.dbh_cm, tree.qc_flag, tree.qc_reason] for tree in made],
        "warnings": [*job.steps.warnings, *reporter.warnings],
    }


def _points(job: PhotoJob) -> list[_Point]:
    """The places asked for; those where nothing was measured have that answer.

    Raises:
        InputError: all of them have.
    """
    at, site = job.settings.at, job.place
    assert at is not None
    found = read_field_stems(at, site.frame.crs)
    points = [_Point(" ".join(name.split()), xy) for name, xy in zip(found.names, found.xy, strict=True)]
    local = given_stems(found.xy, site, 0.0).xy
    inside, ground = site.area.contains(local, job.preset.stems.margin_m), site.ground(*local.T)
    beyond = np.linalg.norm(local[:, None] - site.area.centres, axis=2) - site.area.radii_m
    parts = []
    for k, point in enumerate(points):
        if not inside[k]:
            parts.append(f"{point.name} lies {beyond[k].min():,.0f} m outside the measured plots")
        elif not np.isfinite(ground[k]):
            parts.append(f"{point.name} has no known ground under it")
        else:
            continue
        point.answer = "outside"
    if parts:
        text = (
            f"{at}: {len(parts)} of {len(points)} points cannot be measured: {'; '.join(parts[:8])}"
            f"{'; …' if len(parts) > 8 else ''}; check their coordinates and CRS, or measure a plot that holds them."
        )
        if len(parts) == len(points):
            raise InputError(text)
        job.reporter.warn(text)
        job.steps.warnings.append(text)
    return points


def _named(point: _Point, rows: list[Held], job: PhotoJob) -> bool:
    """Does the point name a tree of the run, to be measured again or taken back to what the run measured?"""
    asked = _NAMED.fullmatch(point.name)
    if asked is None:
        return False
    number = int(asked[2])
    point.row = next((row for row in rows if row.tree_id == number and row.of_run), None)
    former = next((tree for tree in job.trees if tree.tree_id == number), None)
    if point.row is None or former is None:
        point.say("refused", f"tree {number} is none that this run measured and the layer holds; nothing is changed.")
    elif (away := point.row.away(point.xy)) > job.settings.field_error_m + point.row.beside_m:
        point.say("refused", f"tree {number} stands {away:.1f} m away, too far for its foot; nothing is changed.")
    elif asked[1] == "former":
        point.tree, point.former = former, True
        point.say("back", f"tree {number} is as the run measured it: {_verdict(former)}.")
    return True


def _look_up(point: _Point, rows: list[Held], gone: list[Tree], error_m: float) -> None:
    """Nothing is measured at a tree with a diameter, of the layer or of the run."""
    near = [row for row in rows if row.away(point.xy) <= row.beside_m]
    row = min(near, key=lambda row: row.away(point.xy), default=None)
    if row is not None and not row.open:
        point.say("held", f"{row.sentence(point.xy)}; nothing is measured there.")
        return
    point.row = row
    lost = min(gone, key=lambda tree: _away(tree, point.xy), default=None)
    if lost is not None and _away(lost, point.xy) <= error_m and (row is None or row.asked):
        point.bring_back(lost, gone)


def _fit(points: list[_Point], job: PhotoJob, rows: list[Held], gone: list[Tree], reporter: Reporter) -> None:
    """Fit the stems at points. A fit that lies on a tree of the layer, or on another point's, is said; one on a tree of
    the run that the layer lacks is that tree."""
    site, kept = job.place, read_fits(job.path(names.FITS))
    if not kept.looks:
        raise InputError(
            f"{job.path(names.FITS)}: was written by an earlier version, which did not keep what --at needs; delete "
            "the file and run photos-to-dbh once without --at."
        )
    given = given_stems(np.array([point.xy for point in points]), site, job.settings.field_error_m)
    options = job.preset.stems
    # The edges of stems whose trees the layer holds and counts are not another stem's.
    asked = [point.row for point in points]
    counting = {
        row.tree_id for row in rows if row.of_run and not row.set_aside and all(row is not own for own in asked)
    }
    known = [fit for number, fit in fits_by_id(job.space).fits.items() if number in counting]
    found = fits_again(site.views, site.ground, site.area, options, kept.looks, given, known, reporter)
    for point, fit in zip(points, found, strict=True):
        if fit is None:
            point.say("refused", "too few photos see this piece of ground; nothing can be measured there.")
            continue
        xy = site.frame.to_project(np.array([[*fit.axis.p, fit.axis.ground_z]]))[0, :2]
        others = [row for row in rows if row is not point.row and row.dbh_cm]
        on = [row for row in others if one_stem(row.away(xy), (row.dbh_cm or 0.0) / 200, fit.r0)]
        lost = [tree for tree in gone if one_stem(_away(tree, xy), (tree.dbh_cm or 0.0) / 200, fit.r0)]
        fitted = [(other, other.fit) for other in points if other.fit is not None]
        twins = [o for o, f in fitted if one_stem(float(np.hypot(*(f.axis.p - fit.axis.p))), f.r0, fit.r0)]
        if fit.measured and on:
            point.say("held", f"the stem found there is {on[0].sentence(point.xy)}.")
        elif fit.measured and lost:
            point.bring_back(lost[0], gone)
        elif twins:
            point.say("held", f"is the same stem as point {twins[0].name}.")
        else:
            point.fit = fit


def _as_trees(points: list[_Point], job: PhotoJob, rows: list[Held], trees: list[Tree]) -> None:
    """Trees of the points' fits, with numbers of their own."""
    taken = {tree.tree_id for tree in trees} | {row.tree_id for row in rows}
    fits = [point.fit for point in points if point.fit is not None]
    new = with_run_errors(job, trees_of_photo_fits(fits, job.place.frame))
    for point, tree in zip(points, new, strict=True):
        row = point.row
        if row is not None and tree.dbh_cm is None and not row.asked:
            stays = "without a DBH" if row.dbh_cm is None else "as it is"
            point.say("refused", f"tree {row.tree_id} stands there and stays {stays}: {_verdict(tree)}.")
            continue
        # A row of the layer keeps its number, unless that is the number of another tree of the run.
        keeps = row is not None and (row.of_run or all(row.tree_id != tree.tree_id for tree in trees))
        own = row.tree_id if row is not None and keeps else max(taken, default=0) + 1
        taken.add(own)
        # Its height is the former one: the top of a tree of the run was looked for.
        height = {k: getattr(t, k) for t in job.trees if t.tree_id == own for k in ("height_m", "height_se_m")}
        point.tree = placed([replace(tree, tree_id=own, **height)], job)[0]
        before = f", before {shown_cm(row.dbh_cm)} cm" if row is not None and row.dbh_cm is not None else ""
        point.say("measured" if tree.dbh_cm is not None else "refused", f"tree {own}: {_verdict(tree)}{before}.")


def _add_heights(points: list[_Point], job: PhotoJob, reporter: Reporter) -> None:
    """Heights of new trees, sought with those of the run's on the same piece of ground, where the run sought any."""
    new = {point.tree.tree_id: point for point in points if point.tree is not None and point.tree.height_m is None}
    if not new or not job.path(KEPT_HEIGHTS).exists():
        return
    fits = fits_by_id(job.space).fits | {number: point.fit for number, point in new.items() if point.fit is not None}
    trees = [tree for tree in job.trees if tree.tree_id not in new]
    trees += [point.tree for point in new.values() if point.tree is not None]
    found = find_heights(job.place, job.block.points, trees, fits, job.settings.bh_m, None, reporter, set(new))
    for number, point in new.items():
        if point.tree is not None:
            point.tree = replace(point.tree, **found.get(str(number), {}))


def _with_points(before: KeptGiven, points: list[_Point]) -> KeptGiven:
    """What is kept of stems at given places, with those of the points that were measured now."""
    new = {point.tree.tree_id: point for point in points if point.tree is not None and point.fit is not None}
    former = {point.tree.tree_id for point in points if point.tree is not None and point.former}
    trees = [tree for tree in before.trees if tree.tree_id not in new and tree.tree_id not in former]
    return KeptGiven(
        [*trees, *(point.tree for point in new.values() if point.tree is not None)],
        {number: fit for number, fit in before.fits.items() if number not in former}
        | {number: point.fit for number, point in new.items() if point.fit is not None},
    )


def _away(tree: Tree, xy: np.ndarray) -> float:
    return float(np.hypot(tree.x - xy[0], tree.y - xy[1]))


def _verdict(tree: Tree) -> str:
    """``31.2 ± 0.4 cm (ok)``, ``no DBH (not_found)``."""
    reasons = f": {tree.qc_reason.replace(',', ', ')}" if tree.qc_reason else ""
    if tree.dbh_cm is None:
        return f"no DBH ({tree.qc_flag}{reasons})"
    return f"{shown_cm(tree.dbh_cm)} ± {shown_cm(tree.dbh_se_cm or 0.0)} cm ({tree.qc_flag}{reasons})"
