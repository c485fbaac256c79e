"""The blind test: seeds that nobody knows before the commit, every stem counted, a history that only grows."""

from __future__ import annotations

import json
import sys

import numpy as np
import pandas as pd
import pytest

from treedgs_lab.benchmarks import blind


def stems(*errors, flag="ok", inside=True):
    return pd.DataFrame(
        {
            "error_cm": np.array(errors, float),
            "qc_flag": flag,
            "inside_90": [inside if e == e else None for e in errors],
            "dbh_se_cm": 1.0,
            "clear_views": np.arange(len(errors)) + 2,
        }
    )


def test_seeds_come_from_the_commit():
    first = {blind.seed_of("abc1234", kind, k) for kind in blind.KINDS for k in range(blind.PLOTS)}
    assert len(first) == len(blind.KINDS) * blind.PLOTS
    assert first.isdisjoint(blind.seed_of("abc1235", kind, k) for kind in blind.KINDS for k in range(blind.PLOTS))
    assert blind.seed_of("abc1234", "open", 0) == blind.seed_of("abc1234", "open", 0) < 2**31


def test_stems_without_a_diameter_count_and_intervals_are_over_plots():
    alike = blind.figures([stems(0.5, -0.5, np.nan), stems(0.5, -0.5)])
    assert alike["stems"] == 5 and alike["measured"] == 4 and alike["rmse_cm"] == 0.5 == alike["rmse_cm_lo"]
    assert alike["bias_cm"] == 0 and alike["inside"] == 1.0 == alike["inside_half"]
    assert blind.figures([stems(0.5, 0.7)])["inside_half"] == 0.5
    # The first of each plot is seen in two photos only.
    assert (alike["clear"], alike["clear_measured"]) == (3, 2)
    # Errors that a whole plot shares: many stems of few plots say little.
    shared = blind.figures([stems(*[1.0] * 20), stems(*[-1.0] * 20)])
    assert shared["bias_cm"] == 0 and shared["bias_cm_lo"] == -1 and shared["bias_cm_hi"] == 1


def test_ok_alone_and_plots_that_were_refused():
    plots = [stems(0.2, flag="ok"), stems(3.0, flag="check", inside=False), stems(np.nan, np.nan, flag="refused")]
    assert blind.figures(plots)["measured"] == 2 and blind.figures(plots)["worst_cm"] == 3.0
    ok = blind.figures(plots, "ok")
    assert ok["measured"] == 1 and ok["worst_cm"] == 0.2 and ok["stems"] == 4
    none = blind.figures([stems(np.nan)], "ok")
    assert none["measured"] == 0 and none["rmse_cm"] is None


@pytest.mark.parametrize(("version", "said"), [("abc1234-changed", "commit first"), ("abc1234", "is run once")])
def test_a_changed_checkout_and_a_second_run_are_refused(version, said, tmp_path, monkeypatch):
    history = tmp_path / "blind.json"
    history.write_text(json.dumps({"rows": [{"commit": "abc1234"}]}))
    monkeypatch.setattr(blind, "HISTORY", history)
    monkeypatch.setattr(blind, "commit", lambda: version)
    monkeypatch.setattr(sys, "argv", ["blind", "--work", str(tmp_path)])
    with pytest.raises(SystemExit, match=said):
        blind.main()
    assert json.loads(history.read_text())["rows"] == [{"commit": "abc1234"}]


def test_a_run_is_appended(tmp_path, monkeypatch):
    history = tmp_path / "blind.json"
    history.write_text(json.dumps({"rows": [{"commit": "old"}]}))
    monkeypatch.setattr(blind, "HISTORY", history)
    monkeypatch.setattr(blind, "commit", lambda: "new1234")
    monkeypatch.setattr(blind, "simulate", lambda *_: None)
    monkeypatch.setattr(blind, "measured", lambda *_: {"stems": stems(0.4, np.nan), "false": 1, "refused": 0})
    monkeypatch.setattr(sys, "argv", ["blind", "--work", str(tmp_path)])
    assert blind.main() == 0
    old, new = json.loads(history.read_text())["rows"]
    count = blind.PLOTS * len(blind.KINDS)
    assert old == {"commit": "old"} and len(new["plots"]) == count
    assert new["photos"]["all"]["stems"] == 2 * count and new["photos"]["all"]["measured"] == count
    assert new["clouds"]["all"]["false"] == count and new["photos"]["ok"]["rmse_cm"] == 0.4


def test_a_run_that_was_stopped_is_no_refusal(tmp_path, monkeypatch):
    (tmp_path / "p" / "truth").mkdir(parents=True)
    (tmp_path / "p" / "truth" / "trees.csv").write_text(
        "tree_id,in_plot,dbh_cm,n_unoccluded_bh_views\na,True,20,4\nb,False,30,4\n"
    )
    for code, counted in ((2, 1), (130, None)):
        done = type("Done", (), {"returncode": code})
        monkeypatch.setattr(blind.subprocess, "run", lambda *_, done=done, **__: done)
        if counted is None:
            with pytest.raises(SystemExit, match="ended with 130"):
                blind.measured(tmp_path / "p", tmp_path, "photos")
        else:
            found = blind.measured(tmp_path / "p", tmp_path, "photos")
            assert len(found["stems"]) == counted and found["refused"] == 2
