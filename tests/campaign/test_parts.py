"""Leases, records, costs, plots at once: the parts on their own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.campaign.coordinate import Capacity, Coordinator
from treedgs_geo.campaign.engine_process import explain
from treedgs_geo.campaign.inputs import input_files
from treedgs_geo.campaign.state import Campaign, Plan
from treedgs_geo.campaign.supervise import MAX_INTERRUPTIONS, RETRIES, Record
from treedgs_geo.core import folder_lock as leases
from treedgs_geo.core.costs import CostModel, fit, makespan
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.files import fingerprint
from treedgs_geo.core.folder_lock import Busy, Lease, Lost
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.resource_errors import is_full


def test_only_one_of_many_takes_a_lease(tmp_path):
    def take(_):
        try:
            return Lease.take(tmp_path)
        except Busy:
            return None

    with ThreadPoolExecutor(16) as pool:
        got = [lease for lease in pool.map(take, range(48)) if lease]
    assert len(got) == 1
    got[0].free()
    second = Lease.take(tmp_path)
    assert second.number == got[0].number + 1
    with pytest.raises(Lost):
        got[0].check()


def test_a_dead_process_of_this_host_holds_nothing(tmp_path):
    script = f"from treedgs_geo.core.folder_lock import Lease; Lease.take({str(tmp_path)!r}); import os; os._exit(1)"
    subprocess.run([sys.executable, "-c", script], check=False)
    assert leases.holder_of(tmp_path) is None
    lease = Lease.take(tmp_path)
    with pytest.raises(Busy, match=str(os.getpid())):
        Lease.take(tmp_path)
    lease.check()


def test_another_hosts_lease_holds_until_it_is_not_renewed(tmp_path):
    lease = Lease.take(tmp_path)
    file = next(tmp_path.glob("lease.*"))
    file.write_text(json.dumps({"host": "elsewhere", "pid": 1, "started": 0.0, "since": "now"}))
    with pytest.raises(Busy, match="elsewhere"):
        Lease.take(tmp_path)
    old = time.time() - leases.STALE_S - 5
    os.utime(file, (old, old))
    taken = Lease.take(tmp_path)
    # The sleeper wakes up and must notice.
    with pytest.raises(Lost):
        lease.check()
    lease.free()
    taken.check()


def test_a_clock_that_is_wrong_does_not_make_a_lease_stale(tmp_path, monkeypatch):
    Lease.take(tmp_path)
    file = next(tmp_path.glob("lease.*"))
    file.write_text(json.dumps({"host": "elsewhere", "pid": 1, "started": 0.0}))
    monkeypatch.setattr(time, "time", lambda: 4e9)
    with pytest.raises(Busy):
        Lease.take(tmp_path)


def attempt(outcome, key="s:k", series=1):
    return {"series": series, "key": key, "outcome": outcome}


def test_three_failures_end_it_and_deaths_of_workers_do_not(tmp_path):
    record = Record(tmp_path, attempts=[attempt("crash")] * RETRIES + [attempt(None), attempt("interrupted")])
    assert record.may_run("s:k", 1)
    record.attempts.append(attempt("crash"))
    assert not record.may_run("s:k", 1)
    assert record.may_run("s:other", 1) and record.may_run("s:k", 2)
    assert not Record(tmp_path, attempts=[attempt(None)] * (MAX_INTERRUPTIONS + 1)).may_run("s:k", 1)
    assert not Record(tmp_path, attempts=[attempt("input")]).may_run("s:k", 1)
    assert Record(tmp_path, attempts=[attempt("disk"), attempt("missing")] * 9).may_run("s:k", 1)


def test_a_broken_record_is_a_plot_that_never_ran(tmp_path):
    (tmp_path / "plot.json").write_text('{"key": "x", "sta')
    assert Record.read(tmp_path).status == "new"


def test_costs_are_recovered_and_never_negative():
    draw = np.random.default_rng(1)
    runs = [
        {
            "route": "photos",
            "photos": n,
            "megapixels": n * m,
            "seconds": (8 + 1.5 * n + 2 * n * m) * f,
            "memory_gb": 0.6 + 0.01 * n,
            "disk_gb": 0.01,
        }
        for n, m, f in zip(
            draw.integers(20, 300, 30), draw.uniform(0.4, 20, 30), draw.uniform(0.9, 1.1, 30), strict=True
        )
    ]
    entry = fit(runs, ("photos", "megapixels"))
    assert entry["seconds"][2] == pytest.approx(2, rel=0.1) and entry["spread"]["seconds"] < 1.25
    assert min(entry["seconds"] + entry["memory_gb"] + entry["disk_gb"]) >= 0
    model = CostModel.load().refit(runs)
    need = model.predict("photos", {"photos": 100, "megapixels": 500})
    assert need.seconds == pytest.approx(1158, rel=0.15) and not need.outside
    assert 1.6 * 1.25 < need.memory_gb < 1.6 * 1.4
    assert model.predict("photos", {"photos": 4000, "megapixels": 90000}).outside


def test_a_cost_file_that_is_none_is_refused(tmp_path):
    (tmp_path / "c.json").write_text('{"routes": {"photos": {"seconds": [1, "x"]}}}')
    with pytest.raises(InputError, match="no cost model"):
        CostModel.load(tmp_path / "c.json")


@pytest.mark.parametrize("memory_gb, at_once", [(8.0, 2), (16.0, 4), (100.0, 6)])
def test_memory_limits_plots_at_once(tmp_path, memory_gb, at_once):
    """The longest first; each beside the others only where its memory fits."""
    entries = [
        {
            "row": {"plot_id": f"p{n}", "line": n, "route": "cloud"},
            "inputs": {"stamp": ""},
            "settings": "s",
            "seconds": float(n),
            "memory_gb": 4.0,
            "disk_gb": 0.0,
        }
        for n in range(6)
    ]
    campaign, order, running, most = Campaign(tmp_path), [], set(), []

    def measure(job, stop, started):
        order.append(job["plot_id"])
        running.add(job["plot_id"])
        most.append(len(running))
        time.sleep(0.2)
        running.remove(job["plot_id"])
        done = {"series": 0, "outcome": "done", "began": time.time()}
        result = {"n_trees": 2, "n_measured": 1, "seconds": 0.1, "peak_gb": 0.1}
        Record(Path(job["folder"]), "s:k", "", "done", [done], result).save()
        return {"outcome": "done"}

    capacity = Capacity(6, memory_gb)
    tally = Coordinator(Plan(entries), campaign, capacity, Reporter(), function=measure).run()
    assert max(most) == at_once and order[0] == "p5" and sorted(order) == [f"p{n}" for n in range(6)]
    assert (tally.done, tally.trees, tally.measured) == (6, 12, 6)


def test_makespan_of_list_scheduling():
    assert makespan(np.array([3.0, 3, 2, 2, 2]), 2) == 7
    assert makespan(np.array([5.0]), 100) == 5


def test_exits_are_put_into_words(tmp_path):
    assert explain(-9, "")[0] == "memory" and explain(-11, "")[1].startswith("the engine crashed (SIGSEGV)")
    assert explain(2, "x is missing.") == ("input", "x is missing.") and explain(1, "")[0] == "defect"
    assert is_full("[Errno 28] No space left on device") and not is_full("a spaceless line")
    assert not list(Path(tmp_path).iterdir())


def test_geotags_in_subfolders_and_beside_the_photos_count_as_inputs(tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "ppk" / "rover").mkdir(parents=True)
    for name in ("photos/a.jpg", "photos/flight_Timestamp.MRK", "ppk/rover/flight.pos", "ppk/notes.pdf"):
        (tmp_path / name).write_text(name)
    for given in ("ppk", "ppk/rover/flight.pos"):
        found = input_files("photos", {"photos": str(tmp_path / "photos"), "geotags": str(tmp_path / given)}, "", "")
        assert {str(path.relative_to(tmp_path)) for path in found} == {
            "photos/a.jpg",
            "photos/flight_Timestamp.MRK",
            "ppk/rover/flight.pos",
        }


def test_control_points_and_calibration_count_as_inputs(tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    values = {"photos": str(photos)}
    for name, text in (("gcp", "EPSG:32615"), ("calibration", "{}")):
        (tmp_path / name).write_text(text)
        values[name] = str(tmp_path / name)
    found = input_files("photos", values, "", "")
    assert found == [tmp_path / "gcp", tmp_path / "calibration"]
    before = fingerprint(found)
    (tmp_path / "gcp").write_text("EPSG:32616")
    assert fingerprint(found) != before
