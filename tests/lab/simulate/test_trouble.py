"""Troubles of the simulator: each does what its unit says, and a plot without them is the plot it always was."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from treedgs_lab.simulate import scene, stem_mesh, terrain, truth
from treedgs_lab.simulate.settings import SIZES, SimulateSettings
from treedgs_lab.simulate.trouble import TroubleSettings


def stand(**more):
    """Stems and their mesh; ground flat enough to ignore."""
    settings = SimulateSettings(output="x", preset="micro", seed=3, stems_per_ha=900.0, **more)
    sizes = SIZES["micro"]
    ground = terrain.make_ground(np.random.default_rng(0), 30, 0.0, 0.0)
    stems = scene.grow_stand(np.random.default_rng(1), settings, sizes, ground, 12.0, 18.0)
    return stems, stem_mesh.mesh_stems(np.random.default_rng(2), stems, settings.ellipticity_pct)


def test_nothing_asked_for_changes_nothing():
    """The troubles draw no random number of the stand unless they are on."""
    plain, _ = stand()
    names = {item.name for item in dataclasses.fields(TroubleSettings)}
    assert all(getattr(SimulateSettings(output="x"), name) == getattr(TroubleSettings(), name) for name in names)
    flared, _ = stand(butt_flare_m=1.0, sweep_cm=20.0)
    assert [s.tree_id for s in plain] == [s.tree_id for s in flared]
    for a, b in zip(plain, flared, strict=True):
        assert a.dbh_m == b.dbh_m and np.allclose(a.axis[0], b.axis[0])
        if not a.in_plot:
            assert np.array_equal(a.axis, b.axis) and np.array_equal(a.radii, b.radii)


def test_sweep_bows_the_lowest_four_metres():
    plain, _ = stand()
    bowed, _ = stand(sweep_cm=30.0)
    for a, b in zip(plain, bowed, strict=True):
        if a.in_plot:
            off = np.linalg.norm(a.axis[:, :2] - b.axis[:, :2], axis=1)
            assert off[:121].max() == pytest.approx(0.30, abs=0.005) and off[0] == 0
            assert np.argmax(off[:81]) == pytest.approx(40, abs=2)  # 2 m up, at 5 cm steps


def test_flare_reaches_breast_height_and_the_tape_reads_it():
    plain, thin = stand()
    wide, thick = stand(butt_flare_m=1.5)
    for k, (a, b) in enumerate(zip(plain, wide, strict=True)):
        if a.in_plot:
            ratio = truth.section(thick, k, b, 1.37).diameter / truth.section(thin, k, a, 1.37).diameter
            assert 1.05 < ratio < 1.2  # 20-40 % at the ground, times exp(-1.37 / 1.5) = 0.40


def test_ovals_have_the_stated_widths():
    stems, mesh = stand(ellipticity_pct=20.0)
    for k, stem in enumerate(stems):
        if stem.in_plot:
            cut = truth.section(mesh, k, stem, 1.37)
            assert (cut.wide - cut.narrow) / cut.diameter == pytest.approx(0.20, abs=0.06)  # bark relief on top


def test_twins_stand_at_their_gap():
    stems, _ = stand(twins=10, twin_gap_m=0.25)
    by_id = {s.tree_id: s for s in stems}
    twins = [s for s in stems if s.tree_id.endswith("t")]
    assert len(twins) == sum(s.in_plot and not s.tree_id.endswith("t") for s in stems)
    for twin in twins:
        other = by_id[twin.tree_id[:-1]]
        a, b = (scene.axis_at(s, np.array([1.37]))[0][0, :2] for s in (twin, other))
        gap = np.linalg.norm(a - b) - (twin.dbh_m + other.dbh_m) / 2
        assert gap == pytest.approx(0.25, abs=0.08)  # the twin's own sway of its axis


def test_a_clearing_is_empty():
    stems, _ = stand(clearing_m=6.0)
    assert stems and all(np.hypot(*s.axis[0, :2]) > 6.0 for s in stems if s.kind != "sapling")
