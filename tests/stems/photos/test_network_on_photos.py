"""The network on simulated photos of a stand it was not trained on, through the files on disk."""

from __future__ import annotations

import numpy as np

from treedgs_geo.stems.photos.network.inference import class_odds, network_shares, normalised, read_network
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot
from treedgs_lab.training.scenes import maps_of


def test_stems_are_told_from_the_rest(tmp_path):
    simulate_plot(
        SimulateSettings(
            output=tmp_path / "plot",
            labels=True,
            preset="micro",
            photos=10,
            lidar_density_m2=0.0,
            leaf_area_m2=10.0,
            bark_variety=True,
            shrubs_per_m2=0.3,
            sensor="drone",
            seed=7,
        )
    )
    network, stem, rest = read_network(), [], []
    for colour, label in maps_of(tmp_path / "plot"):
        shares = network_shares(network, normalised(colour, label[..., 4] > 0))
        odds = class_odds(shares, "stem")
        assert odds.shape == colour.shape[:2] and np.isfinite(odds).all()
        stem.append(odds[label[..., 0] > 200])
        rest.append(odds[(label[..., 0] == 0) & (label[..., 4] > 0)])
    stem, rest = np.concatenate(stem), np.concatenate(rest)
    assert len(stem) > 2000
    # Most of what is stem is likelier stem than nearly all of the rest.
    assert np.median(stem) > np.quantile(rest, 0.97)
    assert np.median(rest) < -3
