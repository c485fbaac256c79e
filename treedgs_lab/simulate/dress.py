"""What sets the stems of a real stand apart: their bark, sections, crowns, what grows on them, and which are dead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from .barks import WEATHERED
from .hardwoods import LOWEST_LIMB
from .scene import AXIS_STEP, Lobes, PlantedStem, StemLook
from .settings import SimulateSettings

#: Heights, m: where snags are broken off, how far up ivy and the shrubs about a stem reach.
SNAG_M, IVY_M, WRAP_M = (4.0, 10.0), (1.5, 5.0), (1.0, 2.0)
#: Buttresses at the ground, share of the radius.
BUTTRESS = 0.35
Streams = dict[str, np.random.Generator]


def dressed(own: Streams, settings: SimulateSettings, stems: list[PlantedStem]) -> list[PlantedStem]:
    """The stems with the looks that the settings ask for; as they are with the defaults. own: a stream a part."""
    if settings.snags:
        stems = _broken(own["snags"], settings.snags, stems)
    # A second leader looks like the tree that it is part of.
    trees = {stem.tree_id: stem for stem in stems if stem.kind != "branch"}
    looks = {tree_id: stem.look for tree_id, stem in trees.items()}

    def change(ids: list[str], name: str, draw: Callable[[], Any]) -> None:
        for tree_id in ids:
            looks[tree_id] = replace(looks[tree_id], **{name: draw()})

    alive = [tree_id for tree_id, stem in trees.items() if stem.kind != "snag"]
    inside = [tree_id for tree_id in alive if trees[tree_id].in_plot]
    if settings.hardwood_pct:
        change(_share(own["hardwoods"], alive, settings.hardwood_pct / 100), "hardwood", lambda: True)
    rng = own["barks"]
    if settings.bark_variety:
        change(alive, "bark", lambda: int(rng.integers(WEATHERED)))
    for name, share in (("moss", settings.moss_pct / 100), ("lichen", settings.lichen_pct / 100)):
        if share:
            change(alive, name, partial(rng.uniform, 0.3 * share, 1.7 * share))
    for name, count, heights in (("ivy", settings.ivy_stems, IVY_M), ("wrap", settings.wrapped_stems, WRAP_M)):
        if count:
            chosen = [inside[k] for k in own[name].permutation(len(inside))[:count]]
            change(chosen, f"{name}_m", partial(own[name].uniform, *heights))
    if settings.flute_pct or settings.buttress_m:
        change(list(trees), "lobes", lambda: _lobes(own["sections"], settings))
    stems = [replace(stem, look=looks[stem.tree_id]) for stem in stems]
    return [replace(stem, radii=_dissolved(stem)) if stem.look.hardwood else stem for stem in stems]


def _dissolved(stem: PlantedStem) -> np.ndarray:
    """(K,) radii of a hardwood's stem, which gives its wood to the limbs from the crown base up."""
    s = AXIS_STEP * np.arange(len(stem.axis))
    base = LOWEST_LIMB * stem.crown_base_m
    left = 1 - 0.92 * np.clip((s - base) / (0.8 * stem.height_m - base), 0, 1)
    return np.maximum(stem.radii * left, 0.004)


def _share(rng: np.random.Generator, ids: list[str], share: float) -> list[str]:
    """That share of the trees, evenly from the plot outwards, so that small plots have their part."""
    steps = np.floor(rng.random() + share * np.arange(len(ids) + 1))
    return [tree_id for tree_id, more in zip(ids, np.diff(steps), strict=True) if more]


def _lobes(rng: np.random.Generator, settings: SimulateSettings) -> Lobes:
    number, phase = int(rng.integers(3, 7)), float(rng.uniform(0, 2 * np.pi))
    if not settings.buttress_m:
        return Lobes(number, phase, settings.flute_pct / 100)
    return Lobes(number, phase, settings.flute_pct / 100, BUTTRESS, settings.buttress_m)


def _broken(rng: np.random.Generator, count: int, stems: list[PlantedStem]) -> list[PlantedStem]:
    """``count`` ordinary in-plot trees as snags: broken off, grey, without bark."""
    usual = [k for k, stem in enumerate(stems) if stem.in_plot and stem.kind == "normal"]
    stems = list(stems)
    for k in rng.permutation(usual)[:count]:
        stem = stems[k]
        left = min(int(rng.uniform(*SNAG_M) / AXIS_STEP) + 1, len(stem.axis))
        radii = stem.radii[:left].copy()
        radii[-1] = 0.004
        height = AXIS_STEP * (left - 1)
        stems[k] = replace(
            stem,
            kind="snag",
            status="dead",
            axis=stem.axis[:left],
            radii=radii,
            height_m=height,
            crown_base_m=height,
            look=StemLook(bark=WEATHERED),
        )
    return stems
