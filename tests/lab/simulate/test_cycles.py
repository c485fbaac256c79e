"""The second world: crowns by Sapling, photos by Cycles. What needs Blender is skipped without it."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from PIL import Image

from treedgs_geo.core.errors import InputError, MissingComponentError
from treedgs_geo.reconstruction.cameras import Camera
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.simulate import scene, terrain
from treedgs_lab.simulate.crowns import BARE_SHARE, TREE_M, Crowns
from treedgs_lab.simulate.cycles import check_cycles, through_lens, wide_frame
from treedgs_lab.simulate.settings import SIZES, SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot
from treedgs_lab.simulate.stem_mesh import mesh_stems
from treedgs_lab.simulate.wind import Sway

BARE = {
    "preset": "micro",
    "photos": 8,
    "lidar_density_m2": 0.0,
    "image_width": 320,
    "image_height": 240,
    "gsd_cm": 2.4,
    "samples": 1,
    "leaf_area_m2": 0.0,
    "shrubs_per_m2": 0.0,
    "saplings_per_m2": 0.0,
    "logs": 0,
    "sky": "overcast",
    "seed": 5,
    "world": "cycles",
}


def test_what_this_world_does_not_have_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"--control-points, --camera labels"):
        check_cycles(SimulateSettings(output=tmp_path, control_points=4, labels=True))
    with pytest.raises(MissingComponentError, match="blender, which was not found"):
        simulate_plot(SimulateSettings(output=tmp_path / "plot", **BARE))


def test_a_picture_goes_through_the_lens_as_the_camera_says():
    camera = Camera(320, 240, 900.0, 900.0, 165.3, 116.3, -0.3, 0.2, 0.004, -0.003, 0.1)
    width, height = wide_frame([camera])
    across, along = (np.arange(n) + 0.5 - n / 2 for n in (width, height))
    x, y = np.meshgrid(across / camera.fx, along / camera.fy)
    photo = through_lens(np.stack([x, y, x + y], axis=-1).astype(np.float32), camera)
    u, v = np.meshgrid(np.arange(320) + 0.5, np.arange(240) + 0.5)
    np.testing.assert_allclose(photo[..., :2], np.stack(camera.undistort(u, v), axis=-1), atol=1e-5)


def test_a_crown_stands_between_its_base_and_the_top_of_its_stem():
    ground = terrain.make_ground(np.random.default_rng(1), 10.0, 5.0)
    stem = scene.grow_stem(
        np.random.default_rng(2), ground, np.array([2.0, 1.0]), 0.3, 20.0, 0.1, 0.7,
        tree_id="T001", kind="normal", status="live", in_plot=True, detail=2, crown_base_m=10.0,
    )  # fmt: skip
    low, high = BARE_SHARE * TREE_M, TREE_M
    leaf = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
    leaves = np.array([leaf + [0, 0, low], leaf + [0, 0, high], leaf + [2, 0, 13], leaf + [-2, 0, 13]])
    grown = {f"{name}_{k}": value for k in range(3) for name, value in (
        ("leaves", leaves), ("wood", np.zeros((0, 3, 3))), ("height", np.array(TREE_M)))}  # fmt: skip
    crowns = Crowns(grown, 38.0, 0.3, False)
    crowns.grow(np.random.default_rng(3), stem, 0)
    faces = crowns.with_plants(crowns.plants)
    middles = faces.corners.reshape(4, 6, 3).mean(axis=1)
    ends, _, _ = scene.axis_at(stem, np.array([10.0, 20.0]))
    np.testing.assert_allclose(middles[:2], ends, atol=0.15)
    assert (faces.owner == 0).all()


def test_trees_sway_in_blender_as_in_our_own_world():
    pytest.importorskip("bpy")
    from mathutils import Vector

    from treedgs_lab.simulate import inside_blender

    ground = terrain.make_ground(np.random.default_rng(1), 10.0, 5.0)
    wanted = SimulateSettings(output=".", stems_per_ha=400.0)
    stems = scene.grow_stand(np.random.default_rng(1), wanted, SIZES["micro"], ground, 6.0, 8.0)
    trees, mesh = Sway(stems, 80.0, np.random.default_rng(0)), mesh_stems(np.random.default_rng(2), stems)
    top, owner = trees.tops(7.0), mesh.vertex_owner
    made = inside_blender.make_mesh("stems", mesh.vertices, mesh.triangles)
    stem = next(k for k, item in enumerate(stems) if item.kind == "normal")
    ends = scene.axis_at(stems[stem], np.array([8.0, stems[stem].height_m]))[0]
    share = trees.share(ends, np.array([stem, stem]))
    crown = inside_blender.put(made, inside_blender.ground_material())[0]
    matrix = np.diag([2.0, 2.0, 0.5, 1.0])
    inside_blender.sway(
        [(made, inside_blender.places(made), owner, trees.share(mesh.vertices, owner))],
        [(crown, matrix, stem, ends[:, 2], share)],
        top,
    )
    np.testing.assert_allclose(
        inside_blender.places(made), mesh.vertices + trees.shift(mesh.vertices, owner, top), atol=1e-4
    )
    own = np.linalg.solve(matrix[:3, :3], ends.T).T
    moved = np.array([crown.matrix_world @ Vector(point) for point in own])
    np.testing.assert_allclose(moved, ends + trees.shift(ends, np.array([stem, stem]), top), atol=1e-4)
    assert np.abs(moved - ends).max() > 0.05


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    if shutil.which("blender") is None:
        pytest.skip("needs Blender")
    folder = tmp_path_factory.mktemp("cycles") / "plot"
    simulate_plot(SimulateSettings(output=folder, **BARE))
    return TruePlot.load(folder)


def edge_px(profile: np.ndarray, expected: float) -> float:
    """Where brightness changes most within 5 px of a place, to a fraction of a pixel."""
    step = np.abs(np.gradient(profile))
    near = np.abs(np.arange(len(profile)) - expected) <= 5
    weight = np.where(near, step, 0) ** 4
    return float((weight * np.arange(len(profile))).sum() / weight.sum())


def test_stems_stand_in_the_photos_where_the_truth_says(bare):
    trees = bare.trees[bare.trees["in_plot"].astype(str) == "True"]
    points = bare.frame.to_local(trees[["E_bh", "N_bh", "h_bh"]].to_numpy(float))
    off = []
    for view in bare.views():
        if view.nadir_angle_deg < 20:
            continue
        grey = np.asarray(Image.open(view.path).convert("L"), float)
        for point, dbh_cm in zip(points, trees["dbh_cm"].to_numpy(float), strict=True):
            # Stems stand upright in these photos: rows of the lowest metres, one below the other.
            heights = point + np.linspace(-0.4, 0.4, 9)[:, None] * [0, 0, 1]
            pixels, depth = view.project(heights)
            if not view.contains(pixels, 30).all():
                continue
            half = view.camera.fx * dbh_cm / 200 / depth[4]
            reach = np.arange(-30, 31)
            rows = [np.interp(u - 0.5 + reach, np.arange(320), grey[int(v)]) for u, v in pixels]
            profile = np.mean(rows, axis=0)
            off.append([edge_px(profile, 30 - half) - (30 - half), edge_px(profile, 30 + half) - (30 + half)])
    off = np.array(off)
    assert len(off) >= 10
    assert np.abs(np.median(off, axis=0)).max() < 0.5 and np.median(np.abs(off)) < 1.0
