"""The planner's models on their own: who sees which stem, what views give, what is safe, what it takes."""

import itertools
import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from PIL import Image

from treedgs_geo.core.costs import CostModel
from treedgs_geo.core.errors import InputError
from treedgs_geo.planning.choose import judged, stems_of
from treedgs_geo.planning.curves import Curves, outcome, view_odds
from treedgs_geo.planning.drones import camera_of, known_cameras
from treedgs_geo.planning.missions import PlanFlight, Target, grid, orbits, sees
from treedgs_geo.planning.safety import Unsafe, budget_of, lowest_clearance, made_safe, needed_height, speed_of
from treedgs_geo.planning.settings import FlyingSettings
from treedgs_geo.planning.stand import CELL_M, Scene, StandNumbers, about_plot, drawn_stand, dressed_trees, make_scene
from treedgs_geo.planning.sun import sun_day
from treedgs_geo.planning.views import ViewModel, framed_views, shown_share
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_lab.benchmarks.records import RESULTS

NUMBERS = StandNumbers(700, 27, 6, 20, 10, 2.5)
MODEL = ViewModel(0.6, 1.0, 2.0, 0.0)


def level(xy):
    return np.zeros(np.asarray(xy).shape[:-1])


def bare_scene(stems, depth=0.0):
    """Stems (x, y, radius, height, ground) on level ground; leaves of one density between 10 and 15 m."""
    leaves = np.zeros((160, 160, 60), np.float32)
    leaves[:, :, 22:32] = depth
    return Scene(np.array([-40.0, -40.0, -1.0]), leaves, np.array(stems, float), np.zeros((160, 160), np.float32))


def seen(scene, cameras, model=MODEL):
    cameras = np.atleast_2d(np.asarray(cameras, float))
    return shown_share(scene, np.array([0]), cameras, np.ones((1, len(cameras)), bool), model)[0]


def test_leaves_hide_by_the_length_of_the_ray_in_them():
    """5 m of leaves of 0.1 a metre, seen 60 degrees up: 5 / sin(60) m of ray."""
    shown = seen(bare_scene([(0, 0, 0.15, 20, 0)], 0.1), [0, 40 / math.tan(math.radians(60)), 41.4])
    assert shown[0] == pytest.approx(math.exp(-0.6 * 0.1 * 5 / math.sin(math.radians(60))), rel=0.06)
    assert seen(bare_scene([(0, 0, 0.15, 20, 0)]), [10, 20, 50])[0] == pytest.approx(1.0)


def test_a_stem_in_the_way_hides_and_one_behind_or_too_low_does_not():
    mine, camera = (0, 0, 0.15, 20, 0), [0, 30, 45]
    assert seen(bare_scene([mine, (0, 3, 0.6, 20, 0)]), camera)[0] == 0.0
    assert seen(bare_scene([mine, (0, -3, 0.6, 20, 0)]), camera)[0] == pytest.approx(1.0)
    assert seen(bare_scene([mine, (0, 5, 0.6, 4, 0)]), camera)[0] == pytest.approx(1.0), "the ray passes over it"
    half = seen(bare_scene([mine, (0.2, 3, 0.2, 20, 0)]), camera)[0]
    assert 0.2 < half < 0.9


def test_the_chance_of_a_clear_view_grows_with_what_shows():
    chance = ViewModel.load().clear_chance(np.linspace(0, 1, 50))
    assert chance[0] == 0 and chance[-1] > 0.98 and (np.diff(chance) >= 0).all()


def test_framed_views_agree_with_the_views_of_the_chain():
    rng = np.random.default_rng(2)
    flight = orbits([Target("a", np.zeros(2), 10.0)], level, (60.0,), 35.0, 18, 20.0)
    camera = Camera(1280, 960, 3804.0, 3804.0, 640.0, 480.0)
    feet = np.column_stack([rng.uniform(-12, 12, (40, 2)), np.zeros(40)])
    framed, depth = framed_views(
        feet, np.full(40, 0.01), flight.xyz, flight.rotations, np.full(len(flight), 3804.0), np.array([1280.0, 960.0])
    )
    for p, (rotation, centre) in enumerate(zip(flight.rotations, flight.xyz, strict=True)):
        view = View("", "", camera, rotation, -rotation @ centre)
        inside = np.ones(40, bool)
        for height in (1.0, 1.8):
            pixels, z = view.project(feet + [0, 0, height])
            inside &= view.contains(pixels, 1.0)
        steep = flight.pitch_deg[p] < -85
        assert not (framed[:, p] & steep).any(), "straight down shows no stem"
        if not steep:
            assert (framed[:, p] == inside).mean() > 0.95
            assert depth[:, p] == pytest.approx(z, abs=0.8)


def test_odds_of_views_are_exact():
    chance = np.array([[0.1, 0.5, 0.9, 0.3], [0.0, 1.0, 0.0, 0.2]])
    odds = view_odds(chance)
    for row, found in zip(chance, odds, strict=True):
        exact = np.zeros(5)
        for seen_ in itertools.product((0, 1), repeat=4):
            exact[sum(seen_)] += np.prod(np.where(seen_, row, 1 - row))
        assert found[:5] == pytest.approx(exact)
    assert view_odds(np.full((1, 200), 0.9)).sum() == pytest.approx(1)


def test_the_shipped_curves_are_those_of_the_results():
    fitted = json.loads((RESULTS / "planning_curves.json").read_text())["curves"]
    error = {name: fitted["error"][name] for name in "cab"}
    assert asdict(Curves.load()) == {**fitted["measured"], **error}


def test_more_and_nearer_views_give_more():
    curves, dbh = Curves.load(), np.full(5, 0.25)
    few = outcome(curves, np.full((5, 6), 0.5), np.full((5, 6), 2.0), dbh)
    many = outcome(curves, np.full((5, 18), 0.5), np.full((5, 18), 2.0), dbh)
    coarse = outcome(curves, np.full((5, 18), 0.5), np.full((5, 18), 3.5), dbh)
    assert few.share < many.share and few.error_cm > many.error_cm
    assert coarse.share < many.share and coarse.error_cm > many.error_cm
    assert few.views == pytest.approx(3) and many.views == pytest.approx(9)
    none = outcome(curves, np.zeros((5, 6)), np.full((5, 6), 2.0), dbh)
    assert none.share < 0.02


def test_a_drawn_stand_has_its_numbers():
    trees = drawn_stand(np.random.default_rng(1), NUMBERS, 40.0)
    assert len(trees) == pytest.approx(700 * math.pi * 40**2 / 1e4, rel=0.15)
    assert 100 * trees.dbh_m.mean() == pytest.approx(27, abs=1.5) and trees.height_m.mean() == pytest.approx(20, abs=1)
    assert trees.leaf_m2.sum() / (math.pi * 40**2) == pytest.approx(2.5, rel=0.2)
    n = int(80 / CELL_M)
    scene = make_scene(trees, np.zeros(len(trees)), 40.0, np.zeros((n, n)))
    inside = scene.leaves[20:-20, 20:-20].sum() * CELL_M**3
    assert inside / 60**2 == pytest.approx(0.5 * 2.5, rel=0.25), "half of the leaf area is its shadow"


def test_mapped_trees_stay_and_the_rest_is_drawn():
    xy = np.array([[0.0, 0.0], [3.0, 1.0], [-2.0, 4.0]])
    mapped = dressed_trees(xy, np.array([0.2, 0.3, 0.4]), NUMBERS)
    made = about_plot(np.random.default_rng(0), mapped, NUMBERS, np.zeros(2), 8.0)
    assert made.known.sum() == 3 and (np.hypot(*made.xy[~made.known].T) > 8.0).all() and len(made) > 100


def test_orbits_look_at_the_middle_and_grids_cover_every_plot():
    targets = [Target("a", np.array([0.0, 0.0]), 8.0), Target("b", np.array([45.0, 10.0]), 8.0)]
    camera = camera_of("m3e")
    flown = orbits(targets, level, (70.0, 90.0), 30.0, 24, 10.0)
    assert len(np.unique(flown.leg)) == 6, "two rings and a cross of nadir photos each"
    for pattern in ("crosshatch", "nadir-oblique"):
        flight = grid(targets, level, camera, pattern, (70.0,), 35.0, (85, 72), 30.0)
        shown = sees(flight, targets, level, camera)
        assert shown.any(axis=1).all(), "photos that show no plot are left out"
        oblique = flight.pitch_deg > -80
        for k in range(2):
            sides = set((flight.yaw_deg[shown[:, k] & oblique] // 90).astype(int))
            assert sides == {0, 1, 2, 3}, "from four sides"


def test_clearance_is_a_sphere_that_rests_on_the_canopy():
    def slope(xy):
        return 20 - 1.0 * xy[..., 0]

    assert needed_height(lambda xy: np.full(len(xy), 20.0), np.zeros((1, 2)), 15.0)[0] == pytest.approx(35)
    # A sphere of 15 m on a slope of 45 degrees: its middle is 15 sqrt(2) above it.
    found = needed_height(slope, np.zeros((1, 2)), 15.0)[0]
    assert 20 + 15 * 1.3 < found <= 20 + 15 * math.sqrt(2) + 0.01


def made_flight(above, ground=0.0, pitch=-60.0, step=10.0):
    n = len(above)
    xy = np.column_stack([step * np.arange(n), np.zeros(n)])
    zero = np.zeros(n)
    return PlanFlight(
        xy, np.array(above, float), zero + ground, zero, zero + pitch, zero.astype(int), "orbits", (50.0,), 30.0, "x"
    )


def test_a_flight_is_raised_over_a_hill_between_its_photos_or_refused():
    def hill(xy):
        return 20 + 22.0 * np.exp(-(((xy[..., 0] - 15) / 6) ** 2))

    camera, limits = camera_of("m3e"), FlyingSettings(highest_m=110, exposure_ms=1)
    safe = made_safe(made_flight([45.0] * 6), hill, camera, limits)
    assert lowest_clearance(safe, hill, 15) >= 14.95 and safe.above_m[-1] == pytest.approx(45)
    with pytest.raises(Unsafe, match="takes .* over the ground here"):
        made_safe(made_flight([45.0] * 6), hill, camera, FlyingSettings(highest_m=50, exposure_ms=1))
    with pytest.raises(Unsafe, match="gimbal turns from -90 to 35"):
        made_safe(made_flight([80.0] * 3, pitch=-95.0), hill, camera, limits)
    with pytest.raises(Unsafe, match="does not cover 4 of 4"):
        made_safe(made_flight([80.0] * 4, ground=np.nan), hill, camera, limits)


@pytest.mark.parametrize(
    ("key", "exposure", "readout", "speed", "why"),
    [
        ("m3e", 0.5, None, 8.0, "the most that was allowed"),
        ("p4rtk", 1.0, None, 4.0, "one photo every 2.5 s"),
        ("m3e", 8.0, None, 0.5 * 50 / 3751 / 0.008, "blur below 0.5 px at 1/125 s"),
        ("m3e", 1.0, 50.0, 3 * 50 / 3751 / 0.05, "rolling shutter of 50 ms"),
    ],
)
def test_what_limits_the_speed(key, exposure, readout, speed, why):
    limits = FlyingSettings(highest_m=110, exposure_ms=exposure)
    camera = camera_of(key) if readout is None else replace(camera_of(key), readout_ms=readout)
    found = speed_of(made_flight([50.0] * 4), camera, limits)
    assert found[0] == pytest.approx(speed, rel=0.01) and found[1] == why


def test_the_budget_counts_batteries_with_their_trips():
    camera, costs = camera_of("p4rtk"), CostModel.load()
    short = budget_of(made_flight([50.0] * 10), camera, (4.0, ""), np.zeros(3), costs)
    long = budget_of(made_flight([50.0] * 900), camera, (4.0, ""), np.zeros(3), costs)
    assert short.batteries == 1 and long.batteries >= 2 and long.minutes > 900 * 2.5 / 60
    assert short.gigabytes == pytest.approx(10 * camera.photo_mb / 1000)
    assert long.outside and long.processing_s > short.processing_s > 0


def test_every_camera_of_the_table_names_its_source():
    for key, camera in known_cameras().items():
        assert camera.source.startswith("https://"), key
        assert 15 < math.degrees(2 * math.atan(camera.width_px / 2 / camera.focal_px)) < 90, key
        assert camera.gimbal_deg[0] <= -90 and camera.interval_s > 0 and camera.usable_min < camera.flight_min
    assert camera_of("4000, 3000, 2800").focal_px == 2800


def test_a_photo_says_which_camera_took_it(tmp_path):
    row = known_cameras()["m3m"]
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "DJI", "M3M"
    exif.get_ifd(0x8769).update({0x920A: 12.29, 0xA405: 24})
    Image.new("L", (row.width_px, row.height_px)).save(tmp_path / "a.JPG", exif=exif)
    assert camera_of(str(tmp_path / "a.JPG")) == row, "of two cameras with the same photos the one that it names"
    Image.new("L", (1000, 750)).save(tmp_path / "b.JPG", exif=exif)
    own = camera_of(str(tmp_path / "b.JPG"))
    assert own.key == "own" and own.width_px == 1000 and own.focal_px == pytest.approx(24 / 36 * 1000, rel=0.06)
    Image.new("L", (1000, 750)).save(tmp_path / "c.JPG")
    with pytest.raises(InputError, match="--camera: "):
        camera_of(str(tmp_path / "c.JPG"))


def test_the_sun_of_a_known_day():
    """Solstice at 33.6 N: 79.8 degrees at noon; no window in the polar night."""
    import datetime as dt

    june = sun_day(dt.date(2026, 6, 21), -91.8, 33.6)
    assert june.elevation_deg.max() == pytest.approx(79.8, abs=0.2) and len(june.windows) == 1
    assert abs((june.azimuth_deg[june.noon] - 180 + 180) % 360 - 180) < 8
    assert sun_day(dt.date(2026, 12, 21), 25.0, 69.0).windows == []


def test_stems_are_judged_the_same_from_any_frame():
    """A site far from the origin and a tilted ground give what they would at the origin."""

    class Place:
        numbers, mapped, mapped_area, canopy = NUMBERS, None, None, None

        def __init__(self, shift):
            self.shift = shift
            self.targets = [Target("a", np.array([shift, 0.0]), 8.0)]

        def ground(self, xy):
            return 100.0 + 0.1 * (np.asarray(xy)[..., 0] - self.shift)

    views = []
    for shift in (0.0, 5000.0):
        place = Place(shift)
        stems = stems_of(place, 3)
        flight = orbits(place.targets, place.ground, (70.0,), 30.0, 18, 0.0)
        clear, gsd = judged(flight, stems, camera_of("m3e"), ViewModel.load())
        views.append((clear.sum(), gsd.mean(), sum(len(one.rows) for one in stems)))
    assert views[0] == pytest.approx(views[1], rel=1e-3)
