"""Field stems as seeds: they name what is found, find what is faint, and are refused where they do not fit."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_cloud import plot_cloud

from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.field_stems import read_field_stems
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.stems.cloud.propose.field_stems import FIELD_MATCH_M, answer_stems, named
from treedgs_geo.stems.cloud.propose.segment import find_stems
from treedgs_geo.terrain.ground import dtm_from_cloud

STEMS = [(2.0, 2.5, 14.0), (6.0, 3.0, 30.0), (9.5, 8.0, 22.0), (4.0, 9.0, 45.0)]


def table(path, rows, header="tree_id,x,y"):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


def test_stems_carry_the_fields_ids(tmp_path):
    xyz = plot_cloud(np.random.default_rng(0), STEMS)
    cloud, dtm = PointCloud(xyz), dtm_from_cloud(xyz)
    # Field positions are half a metre off; one stem is not in the tally, one tallied stem does not exist.
    rows = [(70, 2.4, 2.7), (12, 6.1, 2.6), (31, 4.2, 8.7), (5, 11.0, 1.0)]
    field = read_field_stems(table(tmp_path / "f.csv", rows))
    stems = find_stems(cloud, dtm, seeds_xy=field.xy)
    assert len(stems.stems) == len(STEMS)
    answers = answer_stems(stems, field)
    ids, missing = named(stems, field, answers), [one.name for one in answers if one.answer == "missing"]
    assert missing == ["5"] and ids[0] == 0 and len(set(ids.tolist())) == len(ids)
    feet = np.array([stem.cone.centre(1.37) for stem in stems.stems]) + stems.origin
    for (x, y, _), wanted in zip(STEMS, (70, 12, None, 31), strict=True):
        got = ids[1 + int(np.hypot(*(feet - (x, y)).T).argmin())]
        assert got == wanted if wanted else got > 70


def test_the_nearer_of_two_field_stems_names_a_stem(tmp_path):
    xyz = plot_cloud(np.random.default_rng(1), STEMS[:1])
    stems = find_stems(PointCloud(xyz), dtm_from_cloud(xyz))
    field = read_field_stems(table(tmp_path / "f.csv", [("far", 2.9, 2.5), ("near", 2.1, 2.5)]))
    answers = answer_stems(stems, field)
    assert field.counted and named(stems, field, answers).tolist() == [0, 2]
    assert [one.name for one in answers if one.answer == "missing"] == ["far"]
    beyond = read_field_stems(table(tmp_path / "g.csv", [(1, 2.0 + FIELD_MATCH_M + 0.1, 2.5)]))
    assert named(stems, beyond, answer_stems(stems, beyond)).tolist() == [0, 2]


def test_seeds_find_faint_stems_and_invent_none(tmp_path):
    """Stems with few points: at least as many with seeds; where no stem stands, a seed brings none."""
    bare, seeded = 0, 0
    places = [(2.0, 2.5), (6.0, 3.0), (9.5, 8.0), (4.0, 9.0)]
    empty = [(2.0, 6.0), (7.0, 7.0), (10.0, 2.0)]
    for seed in range(6):
        xyz = plot_cloud(np.random.default_rng(seed), [(x, y, 16.0) for x, y in places], bark=42, shrubs=900)
        cloud, dtm = PointCloud(xyz), dtm_from_cloud(xyz)
        bare += len(find_stems(cloud, dtm).stems)
        found = find_stems(cloud, dtm, seeds_xy=np.array(places + empty))
        seeded += len(found.stems)
        for stem in found.stems:
            foot = stem.cone.centre(1.37) + found.origin
            assert np.hypot(*(np.array(places) - foot).T).min() < 0.1
    assert seeded > bare


def test_exact_places_get_an_answer_each_and_no_neighbour_is_named(tmp_path, capsys):
    """Positions exact to centimetres: a stem 0.9 m from a field stem's place is another one."""
    rng = np.random.default_rng(4)
    xyz = plot_cloud(rng, STEMS)
    # Bark of half a quarter of a stem, and twigs without a stem.
    sliver = np.column_stack(
        [8 + 0.15 * np.cos(t := rng.uniform(0, 0.7, 150)), 2 + 0.15 * np.sin(t), 100.5 + rng.uniform(0.3, 4.5, 150)]
    )
    twigs = np.column_stack([rng.normal((1.2, 6), 0.2, (300, 2)), 100.4 + rng.uniform(0.3, 4, 300)])
    cloud, dtm = PointCloud(np.vstack([xyz, sliver, twigs])), dtm_from_cloud(xyz)
    rows = [(70, 2.02, 2.51), (12, 6.01, 2.98), (31, 9.48, 8.03), (5, 4.0, 9.9), (6, 8.15, 2.05), (7, 1.2, 6.0)]
    field = read_field_stems(table(tmp_path / "f.csv", rows))
    stems = find_stems(cloud, dtm, seeds_xy=field.xy)
    answers = answer_stems(stems, field)
    assert [one.answer for one in answers][:4] == ["found", "found", "found", "missing"]
    assert answers[3].reason == "few_points" and answers[3].gap_m == pytest.approx(0.9, abs=0.05)
    assert all(
        one.answer in ("missing", "refused") and one.reason in ("short_arc", "occluded", "few_points")
        for one in answers[4:]
    )
    assert 5 not in named(stems, field, answers) and answers[3].answer != "found"
    # The same through the command, with the table beside the output.
    write_cloud(tmp_path / "c.laz", cloud)
    words = ["segment-stems", "--input", str(tmp_path / "c.laz"), "--crs", "local", "--output"]
    assert main([*words, str(tmp_path / "s.laz"), "--field-stems", str(tmp_path / "f.csv")]) == 0
    assert "3 of 6 field stems found" in "".join(capsys.readouterr())
    import pandas as pd

    answered = pd.read_csv(tmp_path / "s_field.csv").set_index("tree_id")
    assert answered.loc[5, "answer"] == "missing" and "too few stem points" in answered.loc[5, "why"]
    assert not {5, 6, 7} & set(np.unique(read_cloud(tmp_path / "s.laz", crs="local").attributes["tree_id"]))


def test_a_far_pair_between_two_stems_is_unsure(tmp_path):
    """Positions half a metre off: a place as near to one stem as to the next names neither."""
    xyz = plot_cloud(np.random.default_rng(6), [*STEMS, (6.0, 4.2, 24.0)])
    rows = [(1, 2.5, 2.5), (2, 9.5, 8.5), (3, 4.0, 9.45), (4, 6.0, 3.6)]
    field = read_field_stems(table(tmp_path / "f.csv", rows))
    answers = answer_stems(find_stems(PointCloud(xyz), dtm_from_cloud(xyz)), field)
    assert [one.answer for one in answers] == ["found", "found", "found", "unsure"]


def test_seeds_end_to_end(tmp_path, capsys):
    xyz = plot_cloud(np.random.default_rng(3), STEMS) + (500_000.0, 4_000_000.0, 0.0)
    write_cloud(tmp_path / "c.laz", PointCloud(xyz))
    rows = [("T9", 500_002.2, 4_000_002.4), ("T4", 500_009.4, 4_000_008.3), ("T7", 500_001.0, 4_000_011.0)]
    field = table(tmp_path / "f.csv", rows, "Tree_ID,Easting,Northing")
    out = tmp_path / "s.laz"
    words = ["segment-stems", "--input", str(tmp_path / "c.laz"), "--crs", "EPSG:32615", "--output", str(out)]
    assert main([*words, "--field-stems", str(field)]) == 0
    said = capsys.readouterr()
    assert "2 of 3 field stems found" in said.err + said.out and "T7" in said.err + said.out
    labelled = read_cloud(out, crs="EPSG:32615")
    tree_id = labelled.attributes["tree_id"]
    assert set(np.unique(tree_id)) == {1, 2, 4, 5}
    assert np.hypot(*(labelled.xyz[tree_id == 1, :2].mean(axis=0) - (500_002, 4_000_002.5))) < 0.3
    assert np.hypot(*(labelled.xyz[tree_id == 2, :2].mean(axis=0) - (500_009.5, 4_000_008))) < 0.3
    # The same as a layer in another CRS.
    import geopandas as gpd

    points = gpd.points_from_xy([row[1] for row in rows], [row[2] for row in rows], crs="EPSG:32615")
    layer = gpd.GeoDataFrame({"tree_id": [9, 4, 7]}, geometry=points).to_crs("EPSG:4326")
    layer.to_file(tmp_path / "f.gpkg")
    assert main([*words, "--field-stems", str(tmp_path / "f.gpkg")]) == 0
    assert set(np.unique(read_cloud(out, crs="EPSG:32615").attributes["tree_id"])) == {9, 4, 10, 11}
    # Elsewhere: refused, and the file from before is left alone.
    before = out.read_bytes()
    away = table(tmp_path / "a.csv", [(1, 10.0, 20.0)])
    assert main([*words, "--field-stems", str(away)]) != 0
    assert "none of its 1 stems stands in the cloud" in capsys.readouterr().err and out.read_bytes() == before


@pytest.mark.parametrize(
    "rows, header, sentence",
    [
        ([(1, 2)], "tree_id,azimuth", "lacks the easting"),
        ([], "tree_id,x,y", "holds no row"),
        ([(1, 2, "?")], "tree_id,x,y", "line 2: y is '\\?'"),
        ([(1, 2, 3), (1, 5, 6)], "tree_id,x,y", "more than once"),
    ],
)
def test_bad_field_stems_are_refused(tmp_path, rows, header, sentence):
    with pytest.raises(InputError, match=sentence):
        read_field_stems(table(tmp_path / "f.csv", rows, header))


def test_a_file_that_is_no_layer_is_refused(tmp_path):
    (tmp_path / "f.gpkg").write_bytes(b"no layer")
    with pytest.raises(InputError, match="cannot be read"):
        read_field_stems(tmp_path / "f.gpkg")


def test_field_stems_get_an_answer_in_a_cloud_without_stems_and_beside_a_taken_one(tmp_path):
    field = read_field_stems(table(tmp_path / "f.csv", [(1, 5.0, 5.0), (2, 100.0, 5.0)]))
    xyz = plot_cloud(np.random.default_rng(0), [], shrubs=10)
    answers = answer_stems(find_stems(PointCloud(xyz), dtm_from_cloud(xyz), seeds_xy=field.xy), field)
    assert [(one.answer, one.reason) for one in answers] == [("missing", "few_points")] * 2
    xyz = plot_cloud(np.random.default_rng(0), STEMS)
    field = read_field_stems(
        table(tmp_path / "g.csv", [(k, x, y) for k, (x, y, _) in enumerate(STEMS, 1)] + [(9, 6.2, 3.2)])
    )
    answers = answer_stems(find_stems(PointCloud(xyz), dtm_from_cloud(xyz), seeds_xy=field.xy), field)
    assert [one.answer for one in answers] == ["found"] * 4 + ["missing"] and answers[4].reason == "merged"
