"""``photos-to-dbh --at``: stems at given places, measured from a finished run in its workspace.

Cameras, ground and what the search learnt of the photos are kept there, so only the places themselves are looked at. A
stem that the run measured already is not measured a second time: one stem, one diameter.
"""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyproj

from ..core import workspace as names
from ..core.errors import InputError
from ..core.field_stems import FieldStems, read_field_stems
from ..core.progress import Reporter
from ..core.settings import to_json
from ..core.shown import shown_cm
from ..core.steps import Collector, NotKept
from ..core.workspace import read_record
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.fit_records import read_fits
from ..stems.photos.route import fits_again
from ..stems.photos.targeted_fit import GivenStems
from ..stems.photos.trees import trees_of_photo_fits
from ..stems.quality.tree import Tree
from .context import PhotoJob, Site
from .field_stems import local_places
from .given_store import KeptGiven, fits_by_id, read_given, with_given, write_given
from .layer_update import Change, Held, held_trees, merge_layers, write_given_page
from .photos import GEOTAG, TREES, held, job_of, placed, result_of, with_run_errors
from .published_plot import is_published
from .sheets import add_sheets
from .stage import check, run_stages

if TYPE_CHECKING:
    from .settings import PhotosToDbhSettings

#: Settings that may differ from the run's: they change no diameter.
_FREE = frozenset({"output", "workspace", "sheets", "dry_run", "at"})
#: Two stems overlap up to this share of the sum of their radii, and this far, m: they are one.
_SAME_SHARE, _SAME_M = 0.7, 0.05


@dataclass
class _Places:
    """What becomes of each point. todo: indices still to be measured. back: trees of the run that the layer lacks, by
    point. instead: trees of the layer without a diameter, by the point that stands at them. said: a sentence a
    point."""

    points: FieldStems
    todo: list[int] = field(default_factory=list)
    back: dict[int, Tree] = field(default_factory=dict)
    instead: dict[int, Held] = field(default_factory=dict)
    said: dict[int, str] = field(default_factory=dict)
    answers: Counter = field(default_factory=Counter)

    def bring_back(self, k: int, tree: Tree) -> None:
        """Point ``k`` is a tree that the run measured and the layer lacks."""
        self.back[k] = tree
        self.say(k, "back", f"tree {tree.tree_id} of the run is in the layer again: {_verdict(tree)}.")

    def changes(self) -> list[Change]:
        """Those trees for the layer, in place of what a person put there."""
        put = {k: old.tree_id for k, old in self.instead.items()}
        return [Change(tree, put.get(k)) for k, tree in self.back.items()]

    def say(self, k: int, answer: str, sentence: str) -> None:
        """What became of point ``k``."""
        self.answers[answer] += 1
        self.said[k] = f"point {self.name(k)}: {sentence}"

    def name(self, k: int) -> str:
        """As the file names point ``k``, on one line."""
        return " ".join(self.points.names[k].split())


def measure_given(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Measure at the places in ``settings.at``; returns the result of ``photos-to-dbh``.

    The trees go into ``settings.output`` if that is the run's layer already; else the layer is written there as the run
    left it in its workspace, with the new trees. What a person wrote or decided stays.

    Raises:
        TreeDGSError: no finished run with these settings in the workspace, no point that can be measured, a layer of
            another run.
    """
    at = settings.at
    assert at is not None
    had = _run_settings(settings.workspace)
    if settings.crs is None or _same_crs(settings.crs, had.get("crs")):
        # Written as the run had it, so that its stages are known again.
        settings = replace(settings, crs=had.get("crs"))
    job = job_of(settings, reporter)
    check(GEOTAG, job)
    with held(job, TREES, only_kept=True):
        if is_published(job.settings):
            raise InputError(
                f"{settings.workspace}: its run measured with --fit gaussians (--preset paper), expected photos or "
                "auto; stems at given places are measured straight in the photos only."
            )
        try:
            run_stages(TREES, job, job.steps)
        except NotKept:
            _refuse_other_settings(settings, had)
            raise
        job.run_id = job.steps.run_id
        if job.site is None or job.nothing:
            raise InputError(f"{settings.workspace}: its run could measure no stem: {job.nothing}.")
        return _measure_at(job, job.site, at)


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


def _same_crs(one: str, other: object) -> bool:
    with suppress(pyproj.exceptions.CRSError):
        return bool(pyproj.CRS.from_user_input(one) == pyproj.CRS.from_user_input(other))
    return False


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


def _measure_at(job: PhotoJob, site: Site, at: Path) -> dict[str, Any]:
    reporter = Collector(job.reporter)
    points = read_field_stems(at, site.frame.crs)
    before = read_given(job)
    trees = placed(with_given(job.trees, before), job)
    rows = held_trees(job, trees)
    places = _Places(points)
    _sort(places, job, site, rows, trees)
    used = {"at": str(at), "points": len(points.xy)}
    with reporter.stage("given stems", 0.2, 0.9), job.space.running("given", "", used) as facts:
        new, kept = _measured(job, site, places, rows, trees, before, reporter)
        facts |= {"points": len(points.xy), **places.answers, "warnings": reporter.warnings}
    changed = [*places.changes(), *new]
    made = [change.tree for change in changed]
    if changed:
        # The workspace first: what it holds and the layer lacks comes back when it is asked for again.
        write_given(job, kept)
        merge_layers(job, changed, trees, reporter)
        add_sheets(job, made, reporter)
        write_given_page(job, reporter)
    return _result(job, places, made, reporter)


def _sort(places: _Places, job: PhotoJob, site: Site, held: list[Held], trees: list[Tree]) -> None:
    """Which points are to be measured, which are trees that the run has measured already.

    Raises:
        InputError: none of the points can be measured.
    """
    points, settings = places.points, job.settings
    local = local_places(points.xy, site)
    outside = ~site.area.contains(local, job.preset.stems.margin_m)
    bare = ~outside & ~np.isfinite(site.ground(local[:, 0], local[:, 1]))
    _refuse_outside(places, job, outside, bare, _beyond(site, local))
    there = {tree.tree_id for tree in held}
    for k in np.flatnonzero(~outside & ~bare):
        xy = points.xy[k]
        tree = min((t for t in held if t.away(xy) <= t.beside_m), key=lambda t: t.away(xy), default=None)
        if tree is not None and not tree.open:
            places.say(int(k), "held", f"{tree.sentence(xy)}; nothing is measured there.")
            continue
        gone = [t for t in trees if t.tree_id not in there and t.dbh_cm is not None]
        lost = min(
            (t for t in gone if np.hypot(t.x - xy[0], t.y - xy[1]) <= settings.field_error_m),
            key=lambda t: float(np.hypot(t.x - xy[0], t.y - xy[1])),
            default=None,
        )
        if tree is not None:
            places.instead[int(k)] = tree
        if lost is not None and (tree is None or tree.asked):
            there.add(lost.tree_id)
            places.bring_back(int(k), lost)
        else:
            places.todo.append(int(k))


def _refuse_outside(places: _Places, job: PhotoJob, outside: np.ndarray, bare: np.ndarray, beyond: np.ndarray) -> None:
    """One sentence about all points that lie where nothing was measured.

    Raises:
        InputError: all of them do.
    """
    parts, name = [], [places.name(k) for k in range(len(places.points.names))]
    for k in np.flatnonzero(outside):
        parts.append(f"{name[k]} lies {beyond[k]:,.0f} m outside the measured plots")
        places.answers["outside"] += 1
    for k in np.flatnonzero(bare):
        parts.append(f"{name[k]} has no known ground under it")
        places.answers["outside"] += 1
    if not parts:
        return
    text = (
        f"{job.settings.at}: {len(parts)} of {len(name)} points cannot be measured: {'; '.join(parts[:8])}"
        f"{'; …' if len(parts) > 8 else ''}; check their coordinates and CRS, or measure a plot that holds them."
    )
    if len(parts) == len(name):
        raise InputError(text)
    job.reporter.warn(text)
    job.steps.warnings.append(text)


def _beyond(site: Site, local: np.ndarray) -> np.ndarray:
    """(K,) metres from each place to the rim of the measured area, negative inside."""
    away = np.linalg.norm(local[:, None] - site.area.centres[None], axis=2) - site.area.radii_m[None]
    return away.min(axis=1)


def _measured(
    job: PhotoJob,
    site: Site,
    places: _Places,
    held: list[Held],
    trees: list[Tree],
    before: KeptGiven,
    reporter: Reporter,
) -> tuple[list[Change], KeptGiven]:
    """The trees at the points still to be measured, and all that is kept of such trees."""
    if not places.todo:
        return [], before
    kept = read_fits(job.path(names.FITS))
    if not kept.looks:
        raise InputError(
            f"{job.path(names.FITS)}: was written by an earlier version, which did not keep what --at needs; delete "
            "the file and run photos-to-dbh once without --at."
        )
    known = _counting(job, held)
    given = GivenStems(local_places(places.points.xy[places.todo], site), job.settings.field_error_m)
    options = replace(job.preset.stems, bh_m=job.settings.bh_m)
    found = fits_again(site.views, site.ground, site.area, options, kept.looks, given, list(known.values()), reporter)
    there = {tree.tree_id for tree in held} | {tree.tree_id for tree in places.back.values()}
    gone = [tree for tree in trees if tree.tree_id not in there and tree.dbh_cm is not None]
    fits = _with_messages(places, site, held, gone, found)
    new = with_run_errors(job, trees_of_photo_fits([fit for _, fit in fits], site.frame))
    taken = {tree.tree_id for tree in trees} | {tree.tree_id for tree in held}
    fits_of, out = dict(before.fits), []
    for (k, fit), tree in zip(fits, new, strict=True):
        old = places.instead.get(k)
        if old is not None and tree.dbh_cm is None and not old.asked:
            places.say(k, "refused", f"tree {old.tree_id} stands there and stays without a DBH: {_verdict(tree)}.")
            continue
        # A row of the layer keeps its number, unless that is the number of another tree of the run.
        keeps = old is not None and (old.of_run or all(old.tree_id != tree.tree_id for tree in trees))
        own = old.tree_id if old is not None and keeps else max(taken, default=0) + 1
        taken.add(own)
        fits_of[own] = fit
        tree = placed([replace(tree, tree_id=own)], job)[0]
        out.append(Change(tree, None if old is None else old.tree_id))
        places.say(k, "measured" if tree.dbh_cm is not None else "refused", f"tree {own}: {_verdict(tree)}.")
    numbers = {change.tree.tree_id for change in out}
    stays = [tree for tree in before.trees if tree.tree_id not in numbers]
    return out, KeptGiven([*stays, *(change.tree for change in out)], fits_of)


def _counting(job: PhotoJob, held: list[Held]) -> dict[int, PhotoFit]:
    """Fits whose trees the layer holds and counts, by ``tree_id``: their edges are not another stem's."""
    counting = {tree.tree_id for tree in held if tree.of_run and not tree.set_aside}
    return {number: fit for number, fit in fits_by_id(job).fits.items() if number in counting}


def _with_messages(
    places: _Places, site: Site, held: list[Held], gone: list[Tree], found: list[PhotoFit | None]
) -> list[tuple[int, PhotoFit]]:
    """The points with a fit of their own. A fit that lies on a tree of the layer, or on another point's, is said; one
    on a tree that the run measured and the layer lacks (``gone``) is that tree."""
    out: list[tuple[int, PhotoFit]] = []
    for k, fit in zip(places.todo, found, strict=True):
        if fit is None:
            places.say(k, "refused", "too few photos see this piece of ground; nothing can be measured there.")
            continue
        xy = site.frame.to_project(np.array([[*fit.axis.p, fit.axis.ground_z]]))[0, :2]
        own = places.instead.get(k)
        tree = next((t for t in held if t is not own and t.dbh_cm and t.away(xy) < _same(t.dbh_cm / 200, fit.r0)), None)
        if fit.measured and tree is not None:
            places.say(k, "held", f"the stem found there is {tree.sentence(places.points.xy[k])}.")
            continue
        lost = next(
            (t for t in gone if np.hypot(t.x - xy[0], t.y - xy[1]) < _same((t.dbh_cm or 0.0) / 200, fit.r0)), None
        )
        if fit.measured and lost is not None:
            places.bring_back(k, lost)
            gone = [t for t in gone if t is not lost]
            continue
        twin = next((j for j, other in out if np.hypot(*(other.axis.p - fit.axis.p)) < _same(other.r0, fit.r0)), None)
        if twin is not None:
            places.say(k, "held", f"is the same stem as point {places.name(twin)}.")
            continue
        out.append((k, fit))
    return out


def _same(one_m: float, other_m: float) -> float:
    return _SAME_SHARE * (one_m + other_m) + _SAME_M


def _verdict(tree: Tree) -> str:
    """``31.2 ± 0.4 cm (ok)``, ``no DBH (not_found)``."""
    reasons = f": {tree.qc_reason.replace(',', ', ')}" if tree.qc_reason else ""
    if tree.dbh_cm is None:
        return f"no DBH ({tree.qc_flag}{reasons})"
    return f"{shown_cm(tree.dbh_cm)} ± {shown_cm(tree.dbh_se_cm or 0.0)} cm ({tree.qc_flag}{reasons})"


def _result(job: PhotoJob, places: _Places, trees: list[Tree], reporter: Collector) -> dict[str, Any]:
    """Say what became of each point; the verb's result."""
    for k in sorted(places.said):
        reporter.info(places.said[k])
    counts, n = places.answers, len(places.points.xy)
    added = counts["measured"] + counts["back"]
    parts = [
        f"{added} of {n} point{'s' if n > 1 else ''} measured"
        + (f" ({counts['back']} by the run)" * bool(counts["back"])),
        *(f"{counts[word]} {text}" for word, text in _WORDS.items() if counts[word]),
    ]
    return {
        **result_of(job, trees),
        "status": "; ".join(parts),
        "trees": [[tree.tree_id, tree.dbh_cm, tree.qc_flag, tree.qc_reason] for tree in trees],
        "warnings": [*job.steps.warnings, *reporter.warnings],
    }


#: What became of points that gave no diameter.
_WORDS = {
    "refused": "without a DBH, each with its reason",
    "held": "at a tree that the layer holds already",
    "outside": "outside the measured plots or the ground",
}
