"""What sets real stands apart, each as its option says; a plot without them is the plot it always was."""

from __future__ import annotations

import csv
import dataclasses

import numpy as np
import pytest
from bare_stem import CAMERA, stem_world
from PIL import Image
from scipy.spatial import cKDTree

from treedgs_geo.core.errors import InputError
from treedgs_geo.planning.stand import least_distance, natural
from treedgs_geo.reconstruction.cameras import View
from treedgs_lab.simulate import scene, spacing, stem_mesh, terrain, truth, vegetation
from treedgs_lab.simulate.barks import BARKS, WEATHERED, Barks, make_barks
from treedgs_lab.simulate.dress import IVY_M, SNAG_M, WRAP_M, dressed
from treedgs_lab.simulate.foliage import ROOTED, Faces, Material, in_colours, photographed_leaves
from treedgs_lab.simulate.render import MOSS, radiance
from treedgs_lab.simulate.settings import SIZES, SimulateSettings, StandSettings
from treedgs_lab.simulate.simulate import simulate_plot
from treedgs_lab.simulate.textures import read_photographs
from treedgs_lab.simulate.vegetation import IVY_OFF_M

PARTS = ("spacing", "snags", "hardwoods", "barks", "ivy", "wrap", "sections", "shrubs")


def streams():
    return {name: np.random.default_rng(50 + k) for k, name in enumerate(PARTS)}


def stand(**more):
    """Settings, ground, stems and mesh of a small stand."""
    wanted = SimulateSettings(
        output="x", preset="micro", seed=3, **{"stems_per_ha": 900.0, "leaf_area_m2": 2.0, **more}
    )
    ground = terrain.make_ground(np.random.default_rng(0), 30, 4.0, 0.1)
    own = streams()
    grown = scene.grow_stand(np.random.default_rng(1), wanted, SIZES["micro"], ground, 12.0, 18.0, own=own["spacing"])
    stems = dressed(own, wanted, grown)
    return wanted, ground, stems, stem_mesh.mesh_stems(np.random.default_rng(2), stems), own


def plants(**more):
    """Everything that grows in such a stand."""
    wanted, ground, stems, mesh, own = stand(**more)
    faces = vegetation.all_foliage(np.random.default_rng(3), wanted, ground, stems, 8.0, own)
    return stems, mesh, ground, vegetation.overgrown(faces, own, wanted, ground, stems, mesh, 8.0)


def diameters(stems, mesh):
    """What the tape reads at breast height on the in-plot stems, cm."""
    return np.array([100 * truth.section(mesh, k, s, 1.37).diameter for k, s in enumerate(stems) if s.in_plot])


def test_nothing_asked_for_draws_nothing_and_changes_nothing():
    names = {item.name for item in dataclasses.fields(StandSettings)}
    assert all(getattr(SimulateSettings(output="x"), name) == getattr(StandSettings(), name) for name in names)
    wanted, ground, stems, _, own = stand()
    fresh = streams()
    faces = vegetation.all_foliage(np.random.default_rng(3), wanted, ground, stems, 8.0, own)
    mesh = stem_mesh.mesh_stems(np.random.default_rng(2), stems)
    assert vegetation.overgrown(faces, own, wanted, ground, stems, mesh, 8.0) is faces
    barks = make_barks(np.random.default_rng(4), own["barks"], stems)
    assert len(barks.tiles) == 1 and not barks.tile.any() and not barks.cover.any()
    for name, rng in own.items():
        assert rng.bit_generator.state == fresh[name].bit_generator.state, name


def test_looks_do_not_move_the_trees():
    _, _, plain, mesh, _ = stand()
    more = dict(bark_variety=True, moss_pct=20.0, lichen_pct=10.0, ivy_stems=2, wrapped_stems=2)
    _, _, dressed_up, same, _ = stand(**more)
    assert np.array_equal(mesh.vertices, same.vertices)
    assert len({s.look for s in dressed_up}) > 5 and {s.look for s in plain} == {scene.StemLook()}


def test_every_stem_has_one_of_five_barks_and_a_second_leader_its_trees():
    _, _, stems, _, own = stand(bark_variety=True, forks_above_bh=2, moss_pct=20.0)
    kinds = {s.look.bark for s in stems}
    assert kinds == set(range(WEATHERED)) and WEATHERED == 5 == len(BARKS) - 1
    trees = {s.tree_id: s for s in stems if s.kind != "branch"}
    leaders = [s for s in stems if s.kind == "branch"]
    assert len(leaders) == 2 and all(s.look == trees[s.tree_id].look for s in leaders)
    barks = make_barks(np.random.default_rng(4), own["barks"], stems)
    assert barks.tiles.shape == (6, 1024, 512, 3) and barks.tile.tolist() == [s.look.bark for s in stems]
    light = [((tile / 255.0) ** 2).mean() for tile in barks.tiles]
    assert light[2] > 1.5 * light[1] > 3 * light[3]  # pale, smooth grey, dark furrows
    assert barks.cover[:, 0].mean() == pytest.approx(0.20, abs=0.03) and not barks.cover[:, 1].any()
    # A mask covers as much of the bark as it is asked to.
    assert (barks.masks[0] < 0.3 * 255).mean() == pytest.approx(0.3, abs=0.01)


def test_stems_have_the_photographs_of_a_folder(tmp_path):
    _, _, stems, _, own = stand(bark_variety=True, snags=2)
    with pytest.raises(InputError, match="holds no photograph"):
        make_barks(np.random.default_rng(4), own["barks"], stems, tmp_path)
    for name, colour in (("b.png", (200, 40, 40)), ("a.jpg", (40, 40, 200))):
        Image.new("RGB", (64, 64), colour).save(tmp_path / name)
    barks = make_barks(np.random.default_rng(4), own["barks"], stems, tmp_path)
    assert barks.photographed and barks.tiles.shape == (3, 1024, 512, 3)
    red = ((barks.tiles / 255.0) ** 2).mean(axis=(1, 2))
    assert red[0, 2] > 10 * red[0, 0] and red[1, 0] > 10 * red[1, 2]  # by name
    drawn = [2 if s.look.bark == WEATHERED else s.look.bark % 2 for s in stems]
    assert barks.tile.tolist() == drawn and {0, 1, 2} == set(drawn)


def test_leaves_have_the_colours_of_a_folders_photographs(tmp_path):
    stems, _, _, faces = plants()
    leafed = np.zeros((8, 8, 4), np.uint8)
    leafed[:4] = 40, 120, 20, 255  # the rest is clear
    Image.fromarray(leafed).save(tmp_path / "a.png")
    Image.new("RGB", (8, 8), (200, 150, 40)).save(tmp_path / "b.jpg", quality=100)
    photos = photographed_leaves(tmp_path)
    assert [len(colours) for colours in photos] == [32, 64]
    Image.new("L", (8, 8), 90).save(tmp_path / "c.png")  # a grey one is read, too
    assert [photo.shape[2] for photo in read_photographs(tmp_path, "")] == [4, 3, 3]
    coloured = in_colours(np.random.default_rng(5), faces, photos)
    leaves = np.isin(faces.kind, (Material.FOLIAGE, Material.SHRUB, Material.IVY))
    assert np.array_equal(coloured.albedo[~leaves], faces.albedo[~leaves])
    for number, colours in enumerate(photos):
        own = leaves & (faces.owner >= 0) & (faces.owner % 2 == number)
        assert own.any() and np.ptp(coloured.albedo[own], axis=0).max() < 0.01
        assert coloured.albedo[own][0] == pytest.approx(colours[0], abs=0.01)


def test_hardwoods_are_the_stated_share_and_bare_without_leaves():
    def leaf_area(**more):
        stems, _, _, faces = plants(hardwood_pct=50.0, **more)
        hard = np.array([s.look.hardwood for s in stems])
        leaves = (faces.kind == Material.FOLIAGE) & (faces.owner >= 0)
        side = faces.corners[:, 1:] - faces.corners[:, :1]
        area = 0.5 * np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1) * leaves
        of_trees = np.bincount(faces.owner[faces.owner >= 0], area[faces.owner >= 0], len(stems))
        return hard, of_trees

    hard, leafy = leaf_area()
    plain, oak = (stand(hardwood_pct=share) for share in (0.0, 50.0))
    assert np.array_equal(diameters(plain[2], plain[3]), diameters(oak[2], oak[3]))
    assert hard.mean() == pytest.approx(0.5, abs=0.02)
    assert leafy[hard].min() > 0
    again, bare = leaf_area(leaf_off=True)
    assert np.array_equal(hard, again)
    assert np.mean(bare[hard] == 0) > 0.6 and bare[hard].sum() < 0.15 * leafy[hard].sum()
    assert bare[~hard].sum() == pytest.approx(leafy[~hard].sum(), rel=0.05)


def test_ivy_stands_off_the_bark_and_the_tape_does_not_see_it():
    stems, mesh, _, faces = plants(ivy_stems=2)
    _, _, plain, bare, _ = stand()
    assert np.array_equal(diameters(stems, mesh), diameters(plain, bare))
    grown = [k for k, s in enumerate(stems) if s.look.ivy_m]
    assert len(grown) == 2 and all(stems[k].in_plot for k in grown)
    ivy = faces.kind == Material.IVY
    assert set(faces.owner[ivy]) == set(grown)
    for k in grown:
        assert IVY_M[0] <= stems[k].look.ivy_m <= IVY_M[1]
        leaves = faces.corners[ivy & (faces.owner == k)].mean(axis=1)
        s = scene.AXIS_STEP * np.arange(len(stems[k].axis))
        nearest = cKDTree(stems[k].axis).query(leaves)[1]
        assert 0.75 * stems[k].look.ivy_m < s[nearest].max() <= stems[k].look.ivy_m + 0.1
        high = s[nearest] > 0.5  # above the butt's lobes
        off = np.linalg.norm(leaves - stems[k].axis[nearest], axis=1) - stems[k].radii[nearest]
        assert (
            np.percentile(off[high], 5) > IVY_OFF_M[0] - 0.015 and np.percentile(off[high], 95) < IVY_OFF_M[1] + 0.015
        )
        # All round, and dense enough to hide the bark.
        low = leaves[s[nearest] < 1.2] - stems[k].axis[0]
        assert (np.histogram(np.arctan2(low[:, 1], low[:, 0]), 12, (-np.pi, np.pi))[0] > 5).all()


def test_shrubs_grow_all_round_wrapped_stems():
    stems, _, ground, faces = plants(wrapped_stems=2, shrubs_per_m2=0.0)
    wrapped = [s for s in stems if s.look.wrap_m]
    shrubs = faces.corners[faces.kind == Material.SHRUB].mean(axis=1)
    assert len(wrapped) == 2 and (faces.owner[faces.kind == Material.SHRUB] == ROOTED).all()
    for stem in wrapped:
        assert stem.in_plot and WRAP_M[0] <= stem.look.wrap_m <= WRAP_M[1]
        near = shrubs[np.hypot(*(shrubs - stem.axis[0])[:, :2].T) < 1.5]
        turn = np.arctan2(*(near - stem.axis[0])[:, 1::-1].T)
        assert (np.histogram(turn, 6, (-np.pi, np.pi))[0] > 10).all()
        tall = near[:, 2] - ground.height(near[:, :2])
        assert 0.5 * stem.look.wrap_m < np.percentile(tall, 95) < 1.3 * stem.look.wrap_m


@pytest.mark.parametrize("more", [dict(flute_pct=20.0), dict(buttress_m=1.0)])
def test_the_tape_spans_the_hollows(more):
    """The true DBH is the perimeter of the section's hull over pi, not its mean radius or its own outline."""
    _, _, plain, bare, _ = stand()
    _, _, stems, mesh, _ = stand(**more)
    for k, (a, b) in enumerate(zip(plain, stems, strict=True)):
        if not a.in_plot:
            continue
        lobes = b.look.lobes
        theta = np.radians(np.arange(360.0))
        share = 1 + lobes.share(theta, np.array([1.37]))[0]
        assert 3 <= lobes.number <= 6
        if "flute_pct" in more:
            assert share.max() - share.min() == pytest.approx(0.20, abs=0.002)
        else:
            assert share.max() - 1 == pytest.approx(0.35 / 3**1.37, abs=0.001) and share.min() >= 1
        outline = np.column_stack([np.cos(theta), np.sin(theta)]) * share[:, None]
        around = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum()
        hull = outline[truth.ConvexHull(outline).vertices]
        taped = np.linalg.norm(hull - np.roll(hull, 1, axis=0), axis=1).sum() / (2 * np.pi)
        assert around / (2 * np.pi) > taped - 1e-9
        ratio = truth.section(mesh, k, b, 1.37).diameter / truth.section(bare, k, a, 1.37).diameter
        assert ratio == pytest.approx(taped, abs=0.025)


def test_snags_are_broken_grey_and_without_twigs():
    stems, mesh, _, faces = plants(snags=2, bark_variety=True)
    snags = [k for k, s in enumerate(stems) if s.kind == "snag"]
    assert len(snags) == 2
    for k in snags:
        stem = stems[k]
        assert stem.in_plot and stem.status == "dead" and stem.look == scene.StemLook(bark=WEATHERED)
        assert SNAG_M[0] - 0.1 <= stem.height_m <= SNAG_M[1] and not (faces.owner == k).any()
        top = mesh.vertices[np.unique(mesh.triangles[mesh.owner == k])][:, 2].max() - stem.axis[0, 2]
        assert top == pytest.approx(stem.height_m, abs=0.2)
        assert 100 * truth.section(mesh, k, stem, 1.37).diameter == pytest.approx(100 * stem.dbh_m, rel=0.06)
    rows, profiles, _ = truth.stem_table(mesh, stems, 9.0, np.zeros((1, 2)))
    assert {row["tree_id"] for row in rows if row["kind"] == "snag"} == {stems[k].tree_id for k in snags}
    assert all(np.isfinite(row["taper_cm_m"]) for row in rows)


def test_shrubs_as_high_as_stated_with_small_and_large_leaves():
    def tall(faces, ground):
        shrubs = faces.corners[faces.kind == Material.SHRUB].mean(axis=1)
        return np.percentile(shrubs[:, 2] - ground.height(shrubs[:, :2]), 99.5)

    few = dict(stems_per_ha=100.0, saplings_per_m2=0.0, shrubs_per_m2=1.0)
    _, _, ground, low = plants(**few, shrub_height_m=0.6)
    _, _, _, usual = plants(**few)
    _, _, _, varied = plants(**few, shrub_height_m=3.0, shrub_variety=True)
    assert tall(low, ground) < 0.65 < 1.2 < tall(usual, ground) < 2.1 < tall(varied, ground) < 3.6
    size = [f.corners[f.kind == Material.SHRUB] for f in (usual, varied)]
    size = [np.percentile(np.linalg.norm(c[:, 2] - c[:, :2].mean(axis=1), axis=1), (1, 99)) for c in size]
    assert size[0][0] > 0.049 and size[1][0] < 0.030 and size[1][1] > 1.1 * size[0][1]
    _, _, _, young = plants(**few, undergrowth_per_m2=1.0)
    assert (young.kind == Material.SHRUB).sum() > 1.3 * (usual.kind == Material.SHRUB).sum()


@pytest.mark.parametrize("stems_per_ha", [300.0, 1500.0])
def test_natural_trees_keep_their_distance_and_stand_in_no_rows(stems_per_ha):
    xy = natural(np.random.default_rng(8), stems_per_ha, 40.0)
    least = least_distance(stems_per_ha)
    gap = cKDTree(xy).query(xy, 2)[0][:, 1]
    assert least <= gap.min() < 1.1 * least and least <= 1.2
    assert len(xy) == pytest.approx(stems_per_ha / 1e4 * np.pi * 40**2, rel=0.02)
    # Rows: hardly a neighbour much nearer than the mean; natural: many.
    planted = spacing.rows(np.random.default_rng(8), stems_per_ha, 40.0)
    even = cKDTree(planted).query(planted, 2)[0][:, 1]
    assert gap.std() / gap.mean() > 1.2 * even.std() / even.mean()
    inside = spacing.plant(np.random.default_rng(9), stems_per_ha, 10.0, 40.0, draw=natural)
    count = (np.hypot(*inside.T) < 10).sum()
    assert count == pytest.approx(stems_per_ha * 0.0314, abs=max(1.0, 0.15 * stems_per_ha * 0.0314) + 0.5)


def test_lognormal_diameters_have_the_stated_moments_and_a_tail():
    more = dict(stems_per_ha=2500.0, dbh_sd_cm=9.0, spacing="natural", saplings_per_m2=0.0)

    def sizes(**other):
        return np.array([100 * s.dbh_m for s in stand(**more, **other)[2]])

    long, even = sizes(dbh_distribution="lognormal"), sizes()
    assert long.mean() == pytest.approx(27.4, abs=1.5) and long.std() == pytest.approx(9.0, abs=1.5)
    skew = [((d - d.mean()) ** 3).mean() / d.std() ** 3 for d in (long, even)]
    assert skew[0] > 0.5 > abs(skew[1])


def test_joined_faces_keep_their_material():
    one = Faces.of(Material.IVY, np.zeros((2, 3, 3)), np.zeros((2, 3)), 0.1)
    two = Faces.of(Material.WOOD, np.zeros((1, 3, 3)), np.zeros((1, 3)), 0.0)
    assert Faces.join([one, two, Faces.none()]).kind.tolist() == [Material.IVY, Material.IVY, Material.WOOD]


def test_a_stem_is_shaded_by_its_own_tile_and_under_its_moss():
    world, light, axis = stem_world()
    light = dataclasses.replace(light, stems=np.ones_like(light.stems))
    # Looking west at the stem from 25 m, level, 1 m and 3.5 m up; then the same from the north, looking south.
    tiles = np.stack([np.full((8, 8, 3), code, np.uint8) for code in (51, 204)])
    masks = np.full((2, 8, 8), 128, np.uint8)

    def colour(tile, moss, azimuth_deg, up_m):
        barks = Barks(tiles, np.array([tile], np.int32), np.array([[moss, 0.0]], np.float32), masks)
        turn = np.radians(azimuth_deg)
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        rotation = np.stack([np.cross(-out, [0, 0, 1.0]), [0, 0, -1.0], -out])
        centre = np.array([*axis[0, :2], axis[0, 2] + up_m]) + 25 * out
        view = View("v", None, CAMERA, rotation, -rotation @ centre)
        image = radiance(dataclasses.replace(world, barks=barks), light, view, 1, 1, haze=0.0)
        return image[195:198, 162:165].mean(axis=(0, 1))

    dark, pale = colour(0, 0.0, 0, 1.0), colour(1, 0.0, 0, 1.0)
    assert pale / dark == pytest.approx(16.0, rel=1e-4)  # root codes
    mossy, high = colour(1, 0.4, 90, 0.4), colour(1, 0.4, 90, 3.5)
    bright = pale.mean() / (204 / 255) ** 2
    assert mossy[1] / bright == pytest.approx(0.9 * MOSS[1] + 0.1 * 0.64, rel=0.05)
    assert high == pytest.approx(pale, rel=1e-4)  # none 3.5 m up
    south, north = colour(1, 0.28, -90, 0.4), colour(1, 0.28, 90, 0.4)
    assert north[0] < 0.5 * south[0]


def test_a_plot_of_everything(tmp_path):
    """Photos, truth and looks of a wild stand that is made in seconds; one without says nothing about looks."""
    few = dict(preset="micro", seed=5, photos=9, image_width=320, image_height=240, radius_m=3.5, samples=1)
    few.update(lidar_density_m2=0.0, leaf_area_m2=5.0)
    wild = dict(bark_variety=True, moss_pct=10.0, lichen_pct=10.0, ivy_stems=1, wrapped_stems=1, flute_pct=10.0)
    wild.update(buttress_m=0.5, snags=1, hardwood_pct=50.0, leaf_off=True, spacing="natural", stems_per_ha=1300.0)
    wild.update(dbh_distribution="lognormal", shrub_variety=True, shrub_height_m=2.5, undergrowth_per_m2=0.2)
    simulate_plot(SimulateSettings(output=tmp_path / "wild", **few, **wild))
    simulate_plot(SimulateSettings(output=tmp_path / "plain", **few))
    assert not (tmp_path / "plain" / "truth" / "looks.csv").exists()
    with (tmp_path / "wild" / "truth" / "looks.csv").open() as file:
        looks = list(csv.DictReader(file))
    with (tmp_path / "wild" / "truth" / "trees.csv").open() as file:
        trees = {row["tree_id"]: row for row in csv.DictReader(file)}
    assert set(trees) <= {row["tree_id"] for row in looks} and {row["bark"] for row in looks} == set(BARKS)
    inside = [row for row in looks if row["in_plot"] == "True"]
    assert sum(float(row["ivy_m"]) > 0 for row in looks) == sum(float(row["ivy_m"]) > 0 for row in inside) == 1
    assert [row["kind"] for row in inside].count("snag") == 1 == sum(t["kind"] == "snag" for t in trees.values())
    assert all(3 <= int(row["lobes"]) <= 6 and row["flute_pct"] == "10.0" for row in looks)
