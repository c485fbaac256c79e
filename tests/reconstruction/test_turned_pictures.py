"""Pictures that are stored turned by 180 degrees against their gimbal's angles, as nothing in their tags says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.reconstruction.guided_matching import match_guided
from treedgs_geo.reconstruction.matching_strategy import Work, _as_stored, _guide
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.pairs import select_pairs
from treedgs_geo.reconstruction.prior_knowledge import survey_of
from treedgs_geo.reconstruction.sift import FeatureStore, extract


@pytest.mark.parametrize(("every", "rolled"), [(1, True), (2, True), (4, False)], ids=["all", "half", "not rolled"])
def test_pictures_stored_turned_are_found_by_their_matches(
    simulated_plot: Path, tmp_path: Path, every: int, rolled: bool
) -> None:
    stations = read_stations(simulated_plot / "images", simulated_plot, "EPSG:6344", check_photos=False)
    right = survey_of(stations, None, None)
    over = np.where(np.arange(len(stations)) % every == 0, 180.0, 0.0)
    said = replace(stations, roll_deg=stations.roll_deg + over)
    work = Work(said if rolled else stations, ReconstructOptions(), survey_of(said, None, None), tmp_path / "sfm")
    store = FeatureStore(extract(stations.paths, 2000, 3000, 2, tmp_path, Reporter()))
    pairs = select_pairs(right.known.xyz, right.rotations, right.ground, 0.1, 6)
    match_guided(store, pairs, _guide(right), 0, 2, Reporter())
    matched, many = set(store.matches), sum(map(len, store.matches.values()))
    match_guided(store, pairs, _guide(work.survey), 0, 2, Reporter())
    # Where they are looked for as if the tags were right, they are not.
    assert sum(map(len, store.matches.values())) < (0.6 if rolled else 0.95) * many
    guide = _as_stored(store, pairs, _guide(work.survey), work, Reporter())
    np.testing.assert_allclose(guide.rotations, right.rotations, atol=1e-6)
    assert len(matched & set(store.matches)) > 0.95 * len(matched)
    # And where the tags are right, they are believed.
    match_guided(store, pairs, _guide(right), 0, 2, Reporter())
    guide = _guide(right)
    assert _as_stored(store, pairs, guide, work, Reporter()) is guide and set(store.matches) == matched
