"""The network asked about single stems: pieces are parts of the whole maps; only what is unsure is fitted anew."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from clear_fit import clear_photo_fit, with_changes

from treedgs_geo.core.progress import Reporter
from treedgs_geo.stems.photos.fit.null_model import BREAST
from treedgs_geo.stems.photos.low_confidence import HOPELESS, may_be_settled, settled_by_network
from treedgs_geo.stems.photos.network.inference import network_maps
from treedgs_geo.stems.photos.network.pieces import About, of_all_photos, piece_odds, piece_of
from treedgs_geo.stems.photos.network.silhouettes import cut_bark
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.search_steps import TileSearch, grids_of, photos_of, seen_in_sample
from treedgs_geo.stems.photos.tiles import split
from treedgs_geo.stems.photos.tuned import SAMPLED
from treedgs_lab.benchmarks.plot import site_of
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    plot = tmp_path_factory.mktemp("stand") / "plot"
    simulate_plot(SimulateSettings(output=plot, preset="micro", lidar_density_m2=0.0, bark_variety=True, seed=14))
    site = site_of(plot)
    views, ground, area = site.views, site.ground, site.area
    options = PhotoStemOptions(most_asked=0, stem_network="low-confidence")
    searched = search_photos(views, ground, area, options)
    tile, _ = split(area, options.margin_m)[0]
    grid, stack = photos_of(views, ground, tile, options, Reporter())
    fitter = searched.looks[0].fitter(stack, grid, tile, PhotoStemOptions())
    return SimpleNamespace(
        site=site,
        fits=searched.fits,
        fitter=fitter,
        stack=stack,
        plumbs=grids_of(stack, grid, tile, options),
        tile=tile,
    )


def settled(scene, fits, **options):
    fitter = replace(scene.fitter, options=replace(scene.fitter.options, **options))
    return settled_by_network(fits, fitter, scene.plumbs, scene.tile, Reporter())


@pytest.mark.slow
def test_the_pieces_of_a_stem_say_what_the_whole_maps_say(scene):
    axis = next(fit.axis for fit in scene.fits if fit.flag == "ok")
    about = About(*scene.fitter.bands.silhouette, 0.75)
    found = [piece_of(0, view, axis, about, scene.stack, scene.plumbs) for view in range(len(scene.stack))]
    pieces = [piece for piece in found if piece is not None]
    assert len(pieces) > 5 and all(piece.size % 64 == 0 for piece in pieces)
    bark = [bark for (bark,) in piece_odds(pieces, scene.stack, scene.plumbs, ("stem",))]
    part = cut_bark(of_all_photos(pieces, bark, scene.stack), axis, BREAST.silhouette)
    whole = cut_bark(network_maps(scene.stack, scene.plumbs, range(len(scene.stack)), {})[0], axis, BREAST.silhouette)
    shown = ~part.blind & ~whole.blind
    assert shown.sum() > 5 and part.total.shape == whole.total.shape
    # A photo without a piece shows nothing.
    assert part.blind[[view for view, piece in enumerate(found) if piece is None]].all()
    width = float(np.ptp(whole.total[shown], axis=2).max())
    assert width > 20
    # The network sees less around a piece: its word hardly changes.
    assert np.abs(part.total[shown] - whole.total[shown]).mean() < 0.02 * width
    shape = np.array([0.0, 0.0, 0.0, 0.0, next(fit.r0 for fit in scene.fits if fit.axis is axis)])
    assert part.contrast(shape) == pytest.approx(whole.contrast(shape), rel=0.05)


@pytest.mark.slow
def test_a_sample_of_the_photos_shows_the_network_what_edges_missed(scene):
    options = PhotoStemOptions()
    tile, box = split(scene.site.area, options.margin_m)[0]
    search = TileSearch(scene.site.views, scene.site.ground, scene.site.area, tile, box, options, Reporter())
    search.stack, search.grid, search.plumbs = scene.stack, scene.fitter.ground, scene.plumbs
    search.fits = scene.fits
    missed, seen, known = seen_in_sample(search)
    assert len(search.shown) == min(SAMPLED, len(scene.stack))
    found = [fit for fit in scene.fits if fit.flag == "ok"]
    search.fits = [fit for fit in scene.fits if fit is not found[0]]
    assert seen_in_sample(search) == (missed + 1, seen - 1, known - 1)
    # What is too thin to be measured is not missed.
    search.fits.append(with_changes(found[0], flag="reject", reasons=("too_small",)))
    assert seen_in_sample(search) == (missed, seen, known)


@pytest.mark.slow
def test_a_stem_of_low_confidence_is_fitted_anew_and_no_other(scene):
    good = next(k for k, fit in enumerate(scene.fits) if fit.flag == "ok")
    fit = scene.fits[good]
    wrong = with_changes(
        fit,
        axis=replace(fit.axis, p=fit.axis.p + [0.04, -0.03]),
        r0=1.3 * fit.r0,
        dbh_cm=1.3 * fit.dbh_cm,
        flag="check",
        reasons=("ambiguous",),
    )
    others = [with_changes(other, flag="ok") for other in scene.fits]
    fits = [*others[:good], wrong, *others[good + 1 :]]
    after = settled(scene, fits)
    assert after[good].dbh_cm == pytest.approx(fit.dbh_cm, abs=1.0) and after[good].flag == "ok"
    assert all(a is b for k, (a, b) in enumerate(zip(after, fits, strict=True)) if k != good)
    assert settled(scene, fits, most_asked=0) is fits and settled(scene, others) is others
    # To silhouettes two stems that touch are one.
    touched = [*others[:good], with_changes(wrong, flag="check", reasons=("ambiguous", "merged")), *others[good + 1 :]]
    assert settled(scene, touched) is touched
    # The same stem twice, of which one may be asked about: the clearer one.
    two = [*fits, with_changes(wrong, axis=replace(wrong.axis, p=fit.axis.p + [3.0, 0.0]), llr=wrong.evidence.llr - 1)]
    assert settled(scene, two, most_asked=1)[-1] is two[-1]


def test_what_no_look_at_the_same_photos_can_settle_is_left_alone():
    unsure = clear_photo_fit(0.0, 30.0, flag="check", reasons=("ambiguous",))
    assert may_be_settled(unsure) and may_be_settled(with_changes(unsure, flag="reject"))
    assert not may_be_settled(clear_photo_fit(0.0, 30.0))
    for reason in sorted(HOPELESS):
        assert not may_be_settled(with_changes(unsure, flag="reject", reasons=(reason,)))
    faint = with_changes(unsure, llr=39.0, contrast=0.6)
    assert not may_be_settled(faint) and may_be_settled(with_changes(faint, contrast=0.8))
    assert not may_be_settled(with_changes(faint, contrast=np.nan)) and may_be_settled(with_changes(faint, llr=41.0))
