"""The judge: lies are called lies, refusals are no lies, kept cases are kept."""

from __future__ import annotations

import json

import numpy as np
import pytest

from treedgs_geo.core.errors import InputError, TreeDGSError
from treedgs_lab.benchmarks import records
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.stability.cases import Case, all_cases, photo_trees, run_cases
from treedgs_lab.benchmarks.stability.factors import CLOUD, Factor, factor
from treedgs_lab.benchmarks.stability.report import (
    ALL,
    UNTROUBLED,
    by_factor,
    by_level,
    holds,
    lies,
    tree_rows,
    verdict,
)
from treedgs_lab.benchmarks.stability.suite import StabilityChoice, write_stability


def row(tree, true, read, flag="ok", half=1.0, **more):
    return {
        "tree_id": tree,
        "kind": "normal",
        "true_cm": true,
        "read_cm": read,
        "se_cm": half / 1.645,
        "lo_cm": None if read is None else read - half,
        "hi_cm": None if read is None else read + half,
        "flag": flag,
        "reason": "",
        "clear": 5,
        **more,
    }


def record(key, level, rows, method="photos", seed=1):
    return {
        "version": "x",
        "code": "c",
        "factor": key,
        "level": level,
        "seed": seed,
        "stand": seed,
        "method": method,
        "seconds": 1.0,
        "refused": "",
        "rows": rows,
    }


GOOD = [row("a", 20.0, 20.5), row("b", 30.0, 30.2), row("c", 25.0, None, "reject")]
BAD = [
    row("a", 20.0, 25.1),
    row("b", 30.0, 36.0, "check"),
    row("c", 25.0, 24.0, half=0.5),
    row("#9", None, 18.0, kind="nothing", false=True),
]


def test_lies_are_accepted_trees_far_off_or_where_nothing_stands():
    table = tree_rows([record("lean", 0.0, GOOD), record("lean", 25.0, BAD)])
    found = lies(table)
    # a: 5 cm off; c: 1 cm, but more than three of its stated errors; b is not ok.
    assert set(found["tree_id"]) == {"a", "c", "#9"} and set(found["level"]) == {25.0}
    claim = verdict(table)["photos"]
    # ok: a, b of the base, a and c and the false tree of the level; 3 of 5 lie; of 4 with truth 2 lie inside.
    assert claim["ok"] == 5 and claim["lies"] == 3 and claim["lie_share"] == 0.6 and not claim["holds"]
    assert claim["ok_stems"] == 3  # of the four that are ok, a is there twice
    assert claim["coverage"] == 0.5 and not claim["coverage_holds"]
    assert claim["stems"] == 6 and claim["measured"] == 5


def test_the_untroubled_level_counts_once():
    table = tree_rows([record("lean", 0.0, GOOD), record("sweep", 0.0, GOOD), record("lean", 0.0, GOOD, seed=2)])
    assert verdict(table)["photos"]["stems"] == 6  # two seeds, three stems each
    levels = by_level(table)
    assert set(levels["factor"]) == {"lean", "sweep"} and levels["refused"].tolist() == [0.333, 0.333]


def test_a_method_that_refuses_everything_does_not_lie():
    gone = [row("a", 20.0, None, "reject"), row("b", 30.0, None, "absent")]
    claim = verdict(tree_rows([record("lean", 25.0, gone)]))["photos"]
    assert claim["lies"] == 0 and claim["ok"] == 0 and claim["lie_share"] is None and claim["coverage"] is None
    assert not claim["holds"]


def test_intervals_are_judged_factor_by_factor():
    half_inside = [row(f"s{k}", 20.0, 20.1 + (k % 2)) for k in range(40)]
    records = [record("lean", 0.0, BAD), record("lean", 10.0, GOOD), record("sweep", 15.0, half_inside)]
    found = by_factor(tree_rows(records)).set_index("factor")
    # The untroubled level is no factor's.
    assert found.loc["lean", ["ok", "ok_inside", "measured"]].tolist() == [2, 2, 2]
    assert found.loc["lean", "holds"] == "by chance"
    once = verdict(tree_rows(records))["photos"]
    strata = found.drop(index=ALL)
    assert strata["ok"].sum() == found.loc[ALL, "ok"] == once["bounded"] and strata["wrong"].sum() == once["lies"]
    assert found.loc[ALL, "stems"] == once["ok_stems"] and found.loc[UNTROUBLED, "measured"] == 3
    assert found.loc["sweep", "ok_inside"] == 20 and found.loc["sweep", "holds"] == "missed"
    assert holds(36, 40) == "holds" and holds(0, 0) == "" and holds(100, 100) == "missed"


def test_files_are_written_and_name_the_lie(tmp_path):
    records = [record("lean", 0.0, GOOD), record("lean", 25.0, BAD), record("lean", 25.0, GOOD, "lidar")]
    result = write_stability(tmp_path, records, 5)
    text = (tmp_path / "stability.md").read_text()
    assert result["n_lies"] == 3 and "| photos | lean | 25 deg | 1 | a (normal) | 20.0 | 25.1 | 5 |" in text
    assert "nothing stands there" in text and "only 3 of 5 cases" in text
    page = (tmp_path / "stability.html").read_text()
    assert "<svg" in page and 'src="http' not in page and "<link" not in page
    assert json.loads((tmp_path / "stability.json").read_text())["verdict"]["lidar"]["lies"] == 0
    for name in ("stability-curves.svg", "stability-curves.png", "stability.csv", "stability-trees.csv"):
        assert (tmp_path / name).stat().st_size > 100
    assert "| lean | photos | 2 | 3 | 0 | 2 | 1 to 2 | 0 | missed | 0 | 3 |" in text
    with pytest.raises(TreeDGSError, match="No case"):
        write_stability(tmp_path, [], 5)


def test_cases_are_kept_and_resumed(tmp_path):
    few = {
        "photos": 8,
        "image_width": 320,
        "image_height": 260,
        "samples": 1,
        "lidar_density_m2": 700.0,
        "stems_per_ha": 800.0,
        "shrubs_per_m2": 0.0,
    }
    tiny = Factor(
        "empty",
        "small",
        "x",
        (0.0, 1.0, 2.0),
        "Test.",
        {1.0: few, 2.0: few},
        "",
        (CLOUD,),
    )
    cases = [Case(tiny, level, 4, "lidar") for level in (1.0, 2.0)]
    assert list(run_cases(cases, tmp_path, seconds=-1)) == []
    first = list(run_cases(cases[:1], tmp_path))
    kept = tmp_path / "cases" / f"{cases[0].name}.json"
    stamp = kept.stat().st_mtime_ns
    assert list(run_cases(cases[::-1], tmp_path, seconds=-1)) == first  # out of time: what is kept is said
    both = list(run_cases(cases, tmp_path))
    assert kept.stat().st_mtime_ns == stamp and both[0] == first[0] and len(both) == 2
    assert len(list((tmp_path / "plots").iterdir())) == 1
    stems = [r for r in both[0]["rows"] if not r.get("false")]
    assert stems and all(abs(r["read_cm"] - r["true_cm"]) < 5 for r in stems if r["flag"] == "ok")
    # Broken records are measured again; what other code measured is kept, and says so.
    kept.write_text("{")
    assert list(run_cases(cases[:1], tmp_path))[0]["rows"] == first[0]["rows"]
    old = json.loads(kept.read_text()) | {"code": "other"}
    kept.write_text(json.dumps(old))
    assert list(run_cases(cases[:1], tmp_path))[0]["code"] == "other"


def test_the_digest_reads_rooms_that_exist():
    assert all(list((records.ROOT / "treedgs_geo" / room).rglob("*.py")) for room in records.ROOMS)


def test_intervals_know_what_the_chain_would_know(simulated_plot):
    plot = TruePlot.load(simulated_plot)
    plain, high, large = (
        photo_trees(Case(factor(key), level, 1, "photos"), plot, np.random.default_rng(1))[0]
        for key, level in (("dtm", 0), ("dtm", 1.0), ("scale", 2.0))
    )
    errors = [np.median([tree.dbh_se_cm for tree in trees if tree.dbh_cm]) for trees in (plain, high, large)]
    assert errors[1] > errors[0] + 0.2 and errors[2] > errors[0] + 0.1


def test_selection():
    assert {case.factor.key for case in all_cases([1], ["lean"])} == {"lean"}
    assert {case.method for case in all_cases([1], ["poses"])} == {"photos"}
    assert {case.method for case in all_cases([1], ["lean"])} == {"photos", "lidar"}
    assert {case.method for case in all_cases([1], ["arc"])} == {"lidar"}
    chosen = StabilityChoice([1], ["poses", "lean", "photos"])
    assert {case.method for case in chosen.cases()} == {"photos"} and len(chosen.cases()) == 8
    for only, match in ((["grd"], "grd"), (["photo"], "photo"), (["arc", "photos"], "does not read")):
        with pytest.raises(InputError, match=match):
            StabilityChoice([1], only).cases()
    assert [case.seed for case in all_cases([3, 5], ["poses"], ["photos"])] == [3] * 4 + [5] * 4


def test_each_factor_has_a_stand_of_its_own():
    lean, sweep = Case(factor("lean"), 0.0, 1, "photos"), Case(factor("sweep"), 0.0, 1, "photos")
    assert lean.is_base and lean.plot_settings["seed"] != sweep.plot_settings["seed"]
    assert Case(factor("lean"), 25.0, 1, "photos").stand == lean.stand != Case(factor("lean"), 0.0, 2, "photos").stand
    stands = [case.stand for case in all_cases([1], methods=["photos", "lidar"]) if case.is_base]
    assert len(set(stands)) == len({case.factor.key for case in all_cases([1], methods=["photos", "lidar"])})
