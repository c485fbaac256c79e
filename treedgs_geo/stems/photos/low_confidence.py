"""Stems of low confidence: the network (:mod:`.network.inference`) is asked about each of them alone.

Where edges and the ground's silhouettes leave it open how thick a stem is, the network's silhouettes are one more
witness. Only pieces of the photos about these stems are looked at, and about some places without a stem, which say how
much contrast chance reaches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from .deduplicate import known_rows, not_swallowed
from .fit.photo_fit import PhotoFit
from .images.axis_patches import StemAxis
from .images.vertical_rectification import PlumbGrid
from .network.inference import OddsMaps
from .network.pieces import About, Piece, of_all_photos, piece_odds, piece_of
from .propose.edge_voting import Seed
from .stem_fit import Fitter
from .tile_calibration import random_places, with_chance
from .tuned import FAINT, MIN_PLACES, MORE_PLACES, REACH_M, STEM_FREE_M, THERE_LLR

#: Reasons that another look at the same photos cannot settle.
HOPELESS = frozenset({"too_small", "too_large", "lean", "no_ground", "edge", "covered"})


def may_be_settled(fit: PhotoFit) -> bool:
    """Low confidence that another witness may settle."""
    stands_out = fit.evidence.contrast > FAINT or fit.evidence.llr > THERE_LLR
    return fit.flag != "ok" and stands_out and not HOPELESS & set(fit.reasons)


def settled_by_network(
    fits: list[PhotoFit],
    fitter: Fitter,
    plumbs: list[PlumbGrid],
    tile: Area,
    reporter: Reporter,
    known: Sequence[PhotoFit] = (),
) -> list[PhotoFit]:
    """The fits; those of low confidence fitted again with the network's silhouettes, ``most_asked`` of the options.

    fits, fitter: of one stack of photos, without maps of the network. plumbs: one a photo. tile: the piece of ground.
    known: other stems that stand there.
    """
    # To silhouettes two stems that touch are one: where that is the question they do not answer it.
    asked = [k for k, fit in enumerate(fits) if may_be_settled(fit) and "merged" not in fit.reasons]
    asked = sorted(asked, key=lambda k: -fits[k].evidence.llr)[: fitter.options.most_asked]
    if not asked or fitter.backdrop is None:
        return fits
    free = _free_places([*fits, *known], fitter, tile)
    if not free:
        return fits
    maps = _maps_of([*free, *(fits[k].axis for k in asked)], fitter, plumbs)
    chance = [
        with_chance(replace(fitter, shown=shown), axis.p[None]).chance
        for shown, axis in zip(maps[: len(free)], free, strict=True)
    ]
    fitter = replace(fitter, chance=float(np.median(chance)))
    out = list(fits)
    for done, (k, shown) in enumerate(zip(asked, maps[len(free) :], strict=True)):
        reporter.progress(done / len(asked))
        fit = fits[k]
        (x, y), (lx, ly) = fit.axis.p.tolist(), fit.axis.s.tolist()
        seed = Seed(x, y, lx, ly, fit.r0, fit.seed_score)
        beside = known_rows([*(other for other in out if other is not fit), *known])
        again = replace(fitter, shown=shown).fit(seed, beside)
        out[k] = again or fit
    certain = sum(out[k].flag == "ok" for k in asked)
    reporter.info(f"The network was asked about {len(asked)} stems of low confidence: {certain} are certain now.")
    return not_swallowed(out, fits)


def _free_places(fits: list[PhotoFit], fitter: Fitter, tile: Area) -> list[StemAxis]:
    """Upright axes at random places away from all stems."""
    places = random_places(tile, np.random.default_rng(fitter.options.seed), MORE_PLACES)
    gap = np.min([np.hypot(*(places - fit.axis.p).T) for fit in fits], axis=0)
    places = places[gap > STEM_FREE_M][:MIN_PLACES]
    ground_z = fitter.ground.at(places[:, 0], places[:, 1])
    upright, bh_m = np.zeros(2), fitter.options.bh_m
    return [StemAxis(place, upright, upright, float(z), bh_m) for place, z in zip(places, ground_z, strict=True)]


def _maps_of(axes: list[StemAxis], fitter: Fitter, plumbs: list[PlumbGrid]) -> list[OddsMaps]:
    """What the network sees about each axis, as high and as far aside as silhouettes are compared."""
    stack, about = fitter.stack, About(*fitter.bands.silhouette, REACH_M)
    found = [piece_of(k, v, axis, about, stack, plumbs) for k, axis in enumerate(axes) for v in range(len(stack))]
    pieces = [piece for piece in found if piece is not None]
    odds = piece_odds(pieces, stack, plumbs, ("stem",))
    own: list[list[tuple[Piece, np.ndarray]]] = [[] for _ in axes]
    for piece, (bark,) in zip(pieces, odds, strict=True):
        own[piece.place].append((piece, bark))
    return [of_all_photos([piece for piece, _ in each], [bark for _, bark in each], stack) for each in own]
