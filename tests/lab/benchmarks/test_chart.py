"""Pareto front, recommendations and pictures from records whose answer is known; the verb's refusals."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.report.html import write_html
from treedgs_geo.run.settings import CHAIN_PRESETS
from treedgs_lab.benchmarks.records import markdown
from treedgs_lab.benchmarks.speed import configurations as chart
from treedgs_lab.benchmarks.speed import cost, pictures
from treedgs_lab.benchmarks.speed.configurations import CONFIGS, SFM
from treedgs_lab.benchmarks.speed.cost import PAPER, fit_power, predict, split_reducing
from treedgs_lab.benchmarks.speed.jobs import run_stems_cost
from treedgs_lab.verbs.benchmark import BenchmarkSettings, run

FACTS = {
    "machine": {"cores": 2, "processor": "test", "version": "0"},
    "plots_text": "p: 10 visible stems",
    "left_out": [],
}


def run_record(key, seconds, errors, refused=0, clear=5, **more):
    rows = [
        {
            "tree_id": f"t{k}",
            "true_cm": 25.0,
            "read_cm": 25.0 + e,
            "lo_cm": 24.0 + e,
            "hi_cm": 26.0 + e,
            "flag": "ok",
            "clear": clear,
        }
        for k, e in enumerate(errors)
    ]
    rows += [
        {
            "tree_id": f"r{k}",
            "true_cm": 25.0,
            "read_cm": None,
            "lo_cm": None,
            "hi_cm": None,
            "flag": "reject",
            "clear": clear,
        }
        for k in range(refused)
    ]
    return {
        "config": key,
        "plot": "p",
        "seconds": seconds,
        "sfm_s": seconds / 2,
        "stage_s": seconds / 2,
        "peak_memory_mb": 500,
        "rows": rows,
        "modelled": {"photos": 12},
        **more,
    }


@pytest.fixture
def table():
    flat = [0.5, -0.5] * 5
    return chart.summarise(
        [
            run_record("balanced", 60.0, flat),
            run_record("sfm-16000", 120.0, [0.6, -0.3] * 5),
            run_record("fast", 20.0, [0.9, -0.9] * 5),
            run_record("views-12", 90.0, [2.0, -2.0] * 5),
            run_record("views-24", 5.0, [0.1, -0.1], refused=8),  # measures only the easy ones
            run_record("lidar", 4.0, [1.2] * 10),
            {"config": "paper", "plot": "p", "error": "exit code 1: no"},
        ]
    )


def test_front_and_recommendation(table):
    front = set(table.loc[table["front"], "key"])
    # LiDAR has a front of its own. Not the one that refuses 8 of 10, not the dominated one.
    assert front == {"lidar", "fast", "balanced", "sfm-16000"}
    assert chart.knees(table) == {"best": "sfm-16000", "balanced": "balanced", "fast": "fast"}
    assert "paper" not in set(table["key"])
    row = table.set_index("key").loc["balanced"]
    assert row["rmse_cm"] == pytest.approx(0.5) and row["me_cm"] == pytest.approx(0) and row["success"] == 1
    assert row["coverage"] == 1 and row["ok_off_5cm"] == 0 and row["seconds"] == 60
    assert table.set_index("key").loc["views-24", "success"] == pytest.approx(0.2)


def test_repeats_are_no_more_stems():
    errors = np.random.default_rng(0).normal(0, 0.5, 12).tolist()
    once = chart.summarise([run_record("fast", 10.0, errors, refused=2)]).iloc[0]
    thrice = chart.summarise([run_record("fast", s, errors, refused=2, repeat=k) for k, s in enumerate((9, 10, 12))])
    for name in ("stems", "success", "rmse_cm", "rmse_lo", "rmse_hi"):
        assert thrice.iloc[0][name] == pytest.approx(once[name]), name
    assert once["stems"] == 14 and thrice.iloc[0]["runs"] == 3 and thrice.iloc[0]["seconds_hi"] == 12


def test_stems_that_no_photo_shows_do_not_count_against_success():
    hidden = run_record("fast", 1.0, [0.1] * 4, refused=4, clear=5)
    for row in hidden["rows"][4:]:
        row["clear"] = 0
    row = chart.summarise([hidden]).iloc[0]
    assert row["success"] == 1 and row["of_all"] < 1


def test_a_configuration_that_measures_nothing_is_reported_and_not_recommended():
    table = chart.summarise([run_record("fast", 5.0, [], refused=3), run_record("balanced", 50.0, [0.2, 0.1, 0.3])])
    assert not table.set_index("key").loc["fast", "front"]
    assert set(chart.knees(table).values()) == {"balanced"}
    pictures.draw_chart(table, FACTS)
    assert "–" in markdown(pictures.report_blocks(table, FACTS, {}, {}))


def test_pictures_and_page(table, tmp_path):
    figure = pictures.draw_chart(table, FACTS)
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert any("12 photos 10/10" in label for label in labels)
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[k + 1 :])
    document = pictures.document(table, FACTS, chart.knees(table))
    page = write_html(tmp_path / "chart.html", document).read_text(encoding="utf-8")
    assert "{{" not in page and "src=" not in page and "<link" not in page
    data = json.loads(page.split('id="d">')[1].split("</script>")[0])
    assert {row["key"] for row in data} == set(table["key"])
    chart.write_records(tmp_path, [run_record("fast", 1.0, [0.1])], table, FACTS)
    assert (tmp_path / "trees.csv").read_text().startswith("config,plot,tree_id")


def test_plots_stand_side_by_side(table):
    each = {"sim": table, "real": table[table["key"] != "fast"]}
    text = markdown(pictures.report_blocks(table, FACTS, {}, each))
    assert "| balanced | 0.50 (+0.00), 10 of 10 | 0.50 (+0.00), 10 of 10 |" in text
    assert "| fast | 0.90 (+0.00), 10 of 10 | – |" in text.splitlines()
    assert "plot by plot" not in markdown(pictures.report_blocks(table, FACTS, {}, {"sim": table}))
    assert "| photos used | 12 photos | +30 | +1.50 | +0 | worse |" in text and "8 fewer stems measured" in text


def test_presets_of_the_chain_are_on_the_chart():
    """Each preset's point is measured with the preset's own settings."""
    by_preset = {config.preset: config for config in CONFIGS if config.preset}
    assert set(by_preset) == set(CHAIN_PRESETS)
    for name, config in by_preset.items():
        sfm = CHAIN_PRESETS[name].reconstruct
        assert all(getattr(sfm, key) == value for key, value in SFM[config.sfm].items()), name
        assert SFM[config.sfm] or sfm == type(sfm)(), name
        kind = {"paper": "published"}.get(name, "photos")
        assert config.kind == kind, name
        assert kind != "photos" or not config.params, name  # the job takes them from the preset itself
    assert len({config.key for config in CONFIGS}) == len(CONFIGS)
    assert {config.group for config in CONFIGS} <= set(pictures.LOOKS)


def test_power_law_is_recovered_and_bounded():
    size = np.array([10.0, 20, 40, 80])
    fit = fit_power(size, 0.5 * size**1.1, (0.8, 1.2))
    assert fit["b"] == pytest.approx(1.1) and fit["a"] == pytest.approx(0.5) and fit["spread"] == 1.0
    assert fit_power(size, size**3, (0.8, 2.0))["b"] == 2.0
    assert fit_power(np.array([5.0]), np.array([2.0]), (0.8, 1.2))["b"] == 1.0
    case = predict(
        {"features": fit, "stems": {"a": 1e-3, "b": 1.0, "to": 1e4}},
        {"base_mb": 600.0, "mb_per_crop_megapixel": 3.0, "second_base_mb": 500.0, "second_mb_per_stem_photo": 0.1},
        PAPER,
    )
    assert case["total_s"] == pytest.approx(sum(case["stages_s"].values()))
    assert 1000 < case["peak_memory_mb"] < 8192 and case["times_beyond_measured"]["features"] > 10
    laws = {"features": fit, "heights": {"a": 1e-2, "b": 1.0, "to": 1e4}}
    large = predict(
        laws,
        {
            "base_mb": 1,
            "mb_per_crop_megapixel": 0,
            "second_base_mb": 1,
            "second_mb_per_stem_photo": 0,
            "features_mb": [[4, 500], [12, 900], [50, 1280]],
        },
        PAPER,
    )
    assert large["peak_memory_mb"] == 980  # 20 of 12 to 50 megapixels
    assert large["stages_s"]["heights"] == pytest.approx(1e-2 * np.pi * PAPER["radius_m"] ** 2 * 80, rel=1e-3)


def test_what_large_photos_take_longer_is_a_stage_of_its_own():
    rows = [
        {"stage": "features", "photos": 6, "megapixels": mp, "size": 6 * mp, "seconds": 0.4 * 6 * mp}
        for mp in (1.2, 4.0, 12.0)
    ]
    rows.append(
        {"stage": "features", "photos": 4, "megapixels": 50.0, "size": 200.0, "seconds": 0.4 * 4 * 12 + 0.1 * 4 * 38}
    )
    table = split_reducing(pd.DataFrame(rows))
    more = table[table["stage"] == "reducing"].iloc[0]
    assert (table["stage"] == "features").sum() == 3
    assert more["size"] == pytest.approx(152) and more["seconds"] == pytest.approx(15.2)
    assert set(split_reducing(pd.DataFrame(rows[:3]))["stage"]) == {"features"}
    no_longer = [*rows[:3], {**rows[3], "seconds": 0.4 * 4 * 12}]
    assert set(split_reducing(pd.DataFrame(no_longer))["stage"]) == {"features"}
    assert split_reducing(pd.DataFrame(rows[3:])).empty  # nothing to take off: no law from it


@pytest.mark.slow
def test_what_stems_cost_is_predicted_by_its_law(simulated_plot):
    measured = run_stems_cost({"plot": str(simulated_plot), "radius": 0.5, "views": 8})
    assert measured["stages"]["stems"] > 0 and measured["sizes"]["stems"] > 0 and measured["facts"]["photos"] == 8
    law, memory = {"a": 1e-3, "b": 1.0, "to": 1e4}, {"base_mb": 1, "mb_per_crop_megapixel": 0}
    assert predict({"stems": law}, memory, PAPER)["total_s"] == pytest.approx(1e-3 * np.pi * 16.05**2 * 96, abs=0.1)
    assert set(measured["stages"]) <= set(cost.GROWTH)


def test_another_level_of_reconstruction_is_no_point_of_the_guided_law(simulated_plot, tmp_path, monkeypatch):
    def measured(job, kept):
        photos = int(100 * job.get("share", 1.0))
        level = "full" if photos == 60 else "guided"
        facts = {"photos": photos, "level": level} if job["kind"] == "subset_sfm" else {}
        return {"stages": {"matching": 2.0}, "sizes": {"matching": photos}, "peak_memory_mb": 1, "facts": facts}

    said = []
    reporter = Reporter()
    monkeypatch.setattr(reporter, "warn", said.append)
    monkeypatch.setattr(cost, "run_job", measured)
    points = cost._measure(simulated_plot, [simulated_plot.with_name("flight")], tmp_path, reporter)
    assert {point["photos"] for point in points if point["run"].startswith("sfm")} == {35, 50, 100}
    assert sum(point["run"] == "sfm-flight" for point in points) == 1
    assert len(said) == 1 and "sfm-0.6-1" in said[0] and "level full" in said[0]


@pytest.mark.parametrize(
    "values, word",
    [
        (dict(suite="stability", seeds="1,x"), "--seeds"),
        (dict(suite="stability", seeds=","), "--seeds"),
        (dict(suite="stability", only="moon"), "moon"),
        (dict(only="nothing"), "nothing"),
    ],
)
def test_refusals(tmp_path, values, word):
    with pytest.raises(InputError, match=word):
        run(BenchmarkSettings(output=tmp_path / "out", **values), Reporter())


def test_a_folder_without_plots_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no simulated plot"):
        run(BenchmarkSettings(output=tmp_path / "out", plots=tmp_path), Reporter())
