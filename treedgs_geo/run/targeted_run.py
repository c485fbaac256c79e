"""``photos-to-dbh --at``: stems at given places, measured from a finished run in its workspace.

Cameras, ground and what the search learnt of the photos are kept there, so only the places themselves are looked at. A
stem that the run measured already is not measured a second time: one stem, one diameter.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import workspace as names
from ..core.errors import InputError
from ..core.field_stems import FieldStems, read_field_stems
from ..core.progress import Reporter
from ..core.shown import shown_cm
from ..core.workspace import Workspace, peak_memory_mb
from ..geotags.photos import list_photos
from ..inventory.tree_layer import check_output
from ..stems.photos.fit.photo_fit import PhotoFit
from ..stems.photos.fit_records import KeptFits, read_fits
from ..stems.photos.resumed_search import fits_again
from ..stems.photos.targeted_fit import GivenStems
from ..stems.photos.trees import trees_of_photo_fits
from ..stems.quality.tree import Tree
from .context import Run, Site
from .field_stems import local_places
from .heights import with_heights
from .layer_update import Change, Held, held_trees, merge_layers, write_given_page
from .measure import measure, placed, route_of, with_run_errors
from .routes import Found, measured_again, preset_of
from .settings_check import same_run
from .sheets import add_sheets
from .stages import Collector, Steps
from .stages_before_stems import Ready, prepare
from .targeted_store import KeptGiven, fits_by_id, read_given, with_given, write_given

if TYPE_CHECKING:
    from .settings import PhotosToDbhSettings

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
    assert settings.at is not None
    check_output(settings.output)
    photos = list_photos(settings.photos)
    settings = same_run(settings)
    with Workspace.held(settings.workspace) as space:
        steps = Steps(space, reporter, only_kept=True)
        run = Run(settings, preset_of(settings.preset, settings.stem_network), space, steps)
        if route_of(run) not in ("auto", "photos"):
            raise InputError(
                f"{settings.workspace}: its run measured with --fit {route_of(run)}, expected photos or auto; stems at "
                "given places are measured straight in the photos only."
            )
        ready = prepare(run, photos)
        if ready.site is None or ready.nothing:
            raise InputError(f"{settings.workspace}: its run could measure no stem: {ready.nothing}.")
        return _measure_at(run, ready, ready.site)


def _measure_at(run: Run, ready: Ready, site: Site) -> dict[str, Any]:
    settings, space = run.settings, run.space
    assert settings.at is not None and ready.aligned is not None
    reporter = Collector(run.steps.reporter)
    points = read_field_stems(settings.at, site.frame.crs)
    before = read_given(run)
    found = with_heights(run, site, ready.aligned, measure(run, site, ready.aligned))
    trees = placed(with_given(found, before), ready.flight.plots, run.steps.run_id)
    held = held_trees(run, trees)
    places = _Places(points)
    _sort(places, run, site, held, trees)
    used = {"at": str(settings.at), "points": len(points.xy)}
    with reporter.stage("given stems", 0.2, 0.9), space.running("given", "", used) as facts:
        new, kept = _measured(run, ready, site, places, held, trees, before, reporter)
        facts |= {"points": len(points.xy), **places.answers, "warnings": reporter.warnings}
    changed = [*places.changes(), *new]
    made = [change.tree for change in changed]
    if changed:
        # The workspace first: what it holds and the layer lacks comes back when it is asked for again.
        write_given(run, kept)
        merge_layers(run, changed, trees, site.frame.crs, reporter)
        add_sheets(run, site, made, reporter)
        write_given_page(run, ready, reporter)
    return _result(run, places, made, reporter)


def _sort(places: _Places, run: Run, site: Site, held: list[Held], trees: list[Tree]) -> None:
    """Which points are to be measured, which are trees that the run has measured already.

    Raises:
        InputError: none of the points can be measured.
    """
    points, settings = places.points, run.settings
    local = local_places(points.xy, site)
    outside = ~site.area.contains(local, run.preset.stems.margin_m)
    bare = ~outside & ~np.isfinite(site.ground(local[:, 0], local[:, 1]))
    _refuse_outside(places, run, outside, bare, _beyond(site, local))
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


def _refuse_outside(places: _Places, run: Run, outside: np.ndarray, bare: np.ndarray, beyond: np.ndarray) -> None:
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
        f"{run.settings.at}: {len(parts)} of {len(name)} points cannot be measured: {'; '.join(parts[:8])}"
        f"{'; …' if len(parts) > 8 else ''}; check their coordinates and CRS, or measure a plot that holds them."
    )
    if len(parts) == len(name):
        raise InputError(text)
    run.steps.reporter.warn(text)
    run.steps.warnings.append(text)


def _beyond(site: Site, local: np.ndarray) -> np.ndarray:
    """(K,) metres from each place to the rim of the measured area, negative inside."""
    away = np.linalg.norm(local[:, None] - site.area.centres[None], axis=2) - site.area.radii_m[None]
    return away.min(axis=1)


def _measured(
    run: Run,
    ready: Ready,
    site: Site,
    places: _Places,
    held: list[Held],
    trees: list[Tree],
    before: KeptGiven,
    reporter: Reporter,
) -> tuple[list[Change], KeptGiven]:
    """The trees at the points still to be measured, and all that is kept of such trees."""
    assert ready.aligned is not None
    if not places.todo:
        return [], before
    kept = read_fits(run.path(names.FITS))
    if not kept.looks:
        raise InputError(
            f"{run.path(names.FITS)}: was written by an earlier version, which did not keep what --at needs; delete "
            "the file and run photos-to-dbh once without --at."
        )
    known = _counting(run, held)
    given = GivenStems(local_places(places.points.xy[places.todo], site), run.settings.field_error_m)
    options = replace(run.preset.stems, bh_m=run.settings.bh_m)
    found = fits_again(site.views, site.ground, site.area, options, kept.looks, given, list(known.values()), reporter)
    there = {tree.tree_id for tree in held} | {tree.tree_id for tree in places.back.values()}
    gone = [tree for tree in trees if tree.tree_id not in there and tree.dbh_cm is not None]
    fits = _with_messages(places, site, held, gone, found)
    made = _as_trees(run, site, list(known.values()), [fit for _, fit in fits], reporter)
    new = with_run_errors(run, site, ready.aligned, made.trees)
    taken = {tree.tree_id for tree in trees} | {tree.tree_id for tree in held}
    fits_of, second, out = dict(before.fits), dict(before.second_cm), []
    for index, ((k, fit), tree) in enumerate(zip(fits, new, strict=True)):
        old = places.instead.get(k)
        if old is not None and tree.dbh_cm is None and not old.asked:
            places.say(k, "refused", f"tree {old.tree_id} stands there and stays without a DBH: {_verdict(tree)}.")
            continue
        # A row of the layer keeps its number, unless that is the number of another tree of the run.
        keeps = old is not None and (old.of_run or all(old.tree_id != tree.tree_id for tree in trees))
        own = old.tree_id if old is not None and keeps else max(taken, default=0) + 1
        taken.add(own)
        fits_of[own] = fit
        if index in made.kept.second_cm:
            second[own] = made.kept.second_cm[index]
        tree = placed([replace(tree, tree_id=own)], ready.flight.plots, run.steps.run_id)[0]
        out.append(Change(tree, None if old is None else old.tree_id))
        places.say(k, "measured" if tree.dbh_cm is not None else "refused", f"tree {own}: {_verdict(tree)}.")
    numbers = {change.tree.tree_id for change in out}
    stays = [tree for tree in before.trees if tree.tree_id not in numbers]
    return out, KeptGiven([*stays, *(change.tree for change in out)], fits_of, second)


def _counting(run: Run, held: list[Held]) -> dict[int, PhotoFit]:
    """Fits whose trees the layer holds and counts, by ``tree_id``: their edges are not another stem's."""
    counting = {tree.tree_id for tree in held if tree.of_run and not tree.set_aside}
    return {number: fit for number, fit in fits_by_id(run).fits.items() if number in counting}


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


def _as_trees(run: Run, site: Site, known: list[PhotoFit], fits: list[PhotoFit], reporter: Reporter) -> Found:
    """The fits as trees, measured a second time where the run does so. ``second_cm`` is by index of the given fits."""
    every = [*known, *fits]
    found = Found(trees_of_photo_fits(every, site.frame), KeptFits(every))
    asked = range(len(known), len(every))
    if route_of(run) == "auto":
        found = measured_again(found, asked, site, run.preset, run.settings.bh_m, run.settings.seed, reporter)
    second = {number - len(known): cm for number, cm in found.kept.second_cm.items()}
    return Found(found.trees[len(known) :], KeptFits(fits, second))


def _verdict(tree: Tree) -> str:
    """``31.2 ± 0.4 cm (ok)``, ``no DBH (not_found)``."""
    reasons = f": {tree.qc_reason.replace(',', ', ')}" if tree.qc_reason else ""
    if tree.dbh_cm is None:
        return f"no DBH ({tree.qc_flag}{reasons})"
    return f"{shown_cm(tree.dbh_cm)} ± {shown_cm(tree.dbh_se_cm or 0.0)} cm ({tree.qc_flag}{reasons})"


def _result(run: Run, places: _Places, trees: list[Tree], reporter: Reporter) -> dict[str, Any]:
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
    measured = [tree for tree in trees if tree.dbh_cm is not None]
    return {
        "output": str(run.settings.output),
        "report": str(run.path(names.REPORT)),
        "workspace": str(run.space.folder),
        "run": str(run.space.folder / "run.json"),
        "n_trees": len(trees),
        "n_measured": len(measured),
        "n_rejected": len(trees) - len(measured),
        "mean_dbh_cm": round(float(np.mean([tree.dbh_cm for tree in measured])), 2) if measured else None,
        "status": "; ".join(parts),
        "trees": [[tree.tree_id, tree.dbh_cm, tree.qc_flag, tree.qc_reason] for tree in trees],
        "warnings": [*run.steps.warnings, *getattr(reporter, "warnings", [])],
        "peak_memory_mb": peak_memory_mb(),
    }


#: What became of points that gave no diameter.
_WORDS = {
    "refused": "without a DBH, each with its reason",
    "held": "at a tree that the layer holds already",
    "outside": "outside the measured plots or the ground",
}
