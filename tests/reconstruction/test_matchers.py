"""A matcher plug-in: a real one (ORB with a file of settings as its weights), and plug-ins that misbehave."""

from __future__ import annotations

import cv2
import numpy as np
import pycolmap
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.features import FeatureStore
from treedgs_geo.reconstruction.matchers import Plugin, import_matches, load_matcher, match_photos, plugin_of

PLUGIN = """
import json
import cv2
import numpy as np

def load(weights):
    settings = json.load(open(weights))
    orb = cv2.ORB_create(settings["features"])
    def match(first, second):
        (a, da), (b, db) = (orb.detectAndCompute(cv2.cvtColor(x, cv2.COLOR_RGB2GRAY), None) for x in (first, second))
        found = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(da, db)
        one = np.array([a[m.queryIdx].pt for m in found]) + 0.5
        two = np.array([b[m.trainIdx].pt for m in found]) + 0.5
        return one, two, np.array([1 - m.distance / 256 for m in found])
    return match
"""


@pytest.fixture
def block(tmp_path):
    """Three photos of a textured wall from three places, a database that knows them, and a plug-in."""
    rng = np.random.default_rng(0)
    wall = cv2.GaussianBlur(rng.integers(0, 255, (900, 1200, 3), dtype=np.uint8), (0, 0), 1.5)
    wall = cv2.normalize(wall, None, 0, 255, cv2.NORM_MINMAX)
    photos = {
        f"{k}.png": wall[100:500, 100 + 60 * k : 600 + 60 * k].copy() for k in range(3)
    }  # a fronto-parallel shift
    database = pycolmap.Database.open(str(tmp_path / "d.db"))
    camera = pycolmap.Camera(camera_id=1, model="PINHOLE", width=500, height=400, params=[600, 600, 250, 200])
    camera_id = database.write_camera(camera)
    rig = pycolmap.Rig(rig_id=1)
    rig.add_ref_sensor(pycolmap.sensor_t(pycolmap.SensorType.CAMERA, camera_id))
    database.write_rig(rig)
    for name in photos:
        database.write_image(pycolmap.Image(name=name, camera_id=camera_id))
    database.close()
    (tmp_path / "orb.py").write_text(PLUGIN)
    (tmp_path / "orb.json").write_text('{"features": 800}')
    return tmp_path, photos


def test_matches_of_a_plugin_arrive_in_the_database(block):
    folder, photos = block
    matcher = load_matcher(Plugin(folder / "orb.py", folder / "orb.json"))
    pairs = [("0.png", "1.png"), ("1.png", "2.png"), ("0.png", "2.png")]
    report = import_matches(folder / "d.db", pairs, photos.__getitem__, matcher)
    assert report.pairs == report.verified == 3 and report.matches > 300
    database = pycolmap.Database.open(str(folder / "d.db"))
    ids = {image.name: image.image_id for image in database.read_all_images()}
    points = {name: database.read_keypoints(ids[name])[:, :2] for name in photos}
    geometry = database.read_two_view_geometry(ids["0.png"], ids["1.png"])
    database.close()
    shift = points["0.png"][geometry.inlier_matches[:, 0]] - points["1.png"][geometry.inlier_matches[:, 1]]
    np.testing.assert_allclose(np.median(shift, axis=0), [60, 0], atol=0.5)
    # The same corner in several pairs is one keypoint: fewer keypoints than match ends.
    assert report.keypoints < 2 * report.matches


def test_matches_are_added_to_those_that_are_there(block):
    folder, photos = block
    plugin = Plugin(folder / "orb.py", folder / "orb.json")
    matcher = load_matcher(plugin)
    # What is there: one pair, in the other order than it is asked for below.
    import_matches(folder / "d.db", [("1.png", "0.png")], photos.__getitem__, matcher)
    before = FeatureStore.read(folder / "d.db", list(photos))
    target = folder / "learned.db"
    report = match_photos(
        folder / "d.db", target, [("0.png", "1.png"), ("1.png", "2.png")], photos.__getitem__, matcher, plugin
    )
    after = FeatureStore.read(target, list(photos))
    assert report.pairs == report.verified == 2 and report.added > 300
    assert set(before.matches) == {(0, 1)} and set(after.matches) == {(0, 1), (1, 2)}
    for old, new, described in zip(before.keypoints, after.keypoints, after.descriptors, strict=True):
        np.testing.assert_array_equal(new[: len(old)], old)
        assert len(described) == len(new)
    one, two = after.matches[0, 1].T
    shift = after.keypoints[0][one] - after.keypoints[1][two]
    np.testing.assert_allclose(np.median(shift, axis=0), [60, 0], atol=0.5)
    assert len(after.matches[0, 1]) > len(before.matches[0, 1])
    # A matcher that finds nothing is no help, and leaves no database that a later run would take for a whole one.
    empty = np.empty((0, 2))
    with pytest.raises(InputError, match="found no match in any of 1 pairs"):
        match_photos(
            folder / "d.db",
            folder / "none.db",
            [("0.png", "1.png")],
            photos.__getitem__,
            lambda a, b: (empty, empty, np.empty(0)),
            plugin,
        )
    assert not (folder / "none.db").exists()


def test_matches_against_a_known_geometry_stay_out(block):
    folder, photos = block
    plugin = Plugin(folder / "orb.py", folder / "orb.json")
    import_matches(folder / "d.db", [("0.png", "1.png")], photos.__getitem__, load_matcher(plugin))
    before = FeatureStore.read(folder / "d.db", list(photos))
    rng = np.random.default_rng(1)

    def wrong(first, second):
        """Confident, and some 30 pixels off the epipolar lines."""
        one = rng.uniform([150, 90], [400, 310], (200, 2))
        return one, one - (60, 0) + rng.normal(0, 30, (200, 2)), np.ones(200)

    target = folder / "wrong.db"
    match_photos(folder / "d.db", target, [("0.png", "1.png"), ("1.png", "2.png")], photos.__getitem__, wrong, plugin)
    after = FeatureStore.read(target, list(photos))
    added = len(after.matches[0, 1]) - len(before.matches[0, 1])
    assert added < 20  # of 200, those that lie near the lines by chance
    assert set(after.matches) == {(0, 1)}  # and a pair that only they connect is not one


def test_both_files_are_wanted_and_loaded_first(block):
    folder, _ = block
    assert plugin_of(None, None) is None
    assert plugin_of(folder / "orb.py", folder / "orb.json") == Plugin(folder / "orb.py", folder / "orb.json")
    with pytest.raises(InputError, match="--matcher is given without --matcher-weights"):
        plugin_of(folder / "orb.py", None)
    with pytest.raises(InputError, match="--matcher-weights is given without --matcher:"):
        plugin_of(None, folder / "orb.json")
    with pytest.raises(InputError, match="not found"):
        plugin_of(folder / "orb.py", folder / "no.pt")


def test_misbehaving_plugins_are_refused_in_one_sentence(block):
    folder, photos = block
    pair = [("0.png", "1.png")]

    def some(one, two, confidence):
        return import_matches(folder / "d.db", pair, photos.__getitem__, lambda a, b: (one, two, confidence))

    with pytest.raises(InputError, match="as many of each"):
        some(np.zeros((3, 2)), np.zeros((2, 2)), np.zeros(3))
    bad = np.array([[np.nan, 1], [-5, 2], [900, 3]])
    assert some(bad, bad, np.ones(3)).keypoints == 0
    with pytest.raises(InputError, match="does not hold the photo"):
        import_matches(folder / "d.db", [("0.png", "9.png")], photos.__getitem__, lambda a, b: None)
    with pytest.raises(InputError, match="failed on 0.png"):
        import_matches(folder / "d.db", pair, photos.__getitem__, lambda a, b: 1 / 0)
    for text, message in (
        ("x = 1", "cannot be loaded"),
        ("def load(w): return 3", "expected a function"),
        ("def load(w): raise OSError('torn')", "cannot load it"),
        ("def", "cannot be loaded"),
    ):
        (folder / "bad.py").write_text(text)
        with pytest.raises(InputError, match=message):
            load_matcher(Plugin(folder / "bad.py", folder / "orb.json"))
    with pytest.raises(InputError, match="not found"):
        load_matcher(Plugin(folder / "orb.py", folder / "none.pt"))
