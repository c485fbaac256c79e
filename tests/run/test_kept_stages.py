"""What an earlier run left is kept only while it is what it was, and while the same files would be read."""

from __future__ import annotations

import io
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.core.progress import PlainReporter
from treedgs_geo.core.workspace import Workspace
from treedgs_geo.geotags.photos import list_photos
from treedgs_geo.geotags.stations import Stations
from treedgs_geo.run.photos import GEOTAG, held, job_of
from treedgs_geo.run.settings import PhotosToDbhSettings
from treedgs_geo.run.stage import Stage, Steps, check, run_stages

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def flight(simulated_plot, tmp_path):
    """photos/ with the MRK beside, ppk/rover/ with the solution: as flight apps and PPK programs leave them."""
    folder = tmp_path / "flight"
    shutil.copytree(simulated_plot / "images", folder / "photos")
    (folder / "ppk" / "rover").mkdir(parents=True)
    shutil.copy(next(simulated_plot.glob("*.MRK")), folder / "photos")
    shutil.copy(simulated_plot / "test_ppk.pos", folder / "ppk" / "rover")
    return folder


def geotag(flight: Path, geotags: Path) -> tuple[Stations, str]:
    """The first stage of a run in ``flight/work``: its stations and what it said."""
    settings = PhotosToDbhSettings(
        photos=flight / "photos",
        geotags=geotags,
        crs="EPSG:6344",
        workspace=flight / "work",
        output=flight / "trees.gpkg",
    )
    said = io.StringIO()
    job = job_of(settings, PlainReporter(said))
    check(GEOTAG, job)
    with held(job, (GEOTAG,)):
        run_stages((GEOTAG,), job, job.steps)
    return job.stations, said.getvalue()


def raise_heights(pos: Path, metres: float, rows: slice) -> None:
    """Change the heights of a part of the epochs in place: the size stays."""
    lines = pos.read_text().splitlines(keepends=True)
    body = [i for i, line in enumerate(lines) if not line.startswith("%")][rows]
    for i in body:
        lines[i] = re.sub(
            r"^(\S+ +\S+ +\S+ +\S+ +)(\S+)",
            lambda found: f"{found[1]}{float(found[2]) + metres:.4f}",
            lines[i],
            count=1,
        )
    pos.write_text("".join(lines))


@pytest.mark.parametrize("given", ["ppk", "ppk/rover/test_ppk.pos"])
def test_every_geotag_file_that_is_read_counts(flight, given):
    before, _ = geotag(flight, flight / given)
    same, said = geotag(flight, flight / given)
    assert "geotag: unchanged since the last run, kept" in said and same.digest() == before.digest()
    # Five metres in the solution, in a sub-folder.
    raise_heights(flight / "ppk" / "rover" / "test_ppk.pos", 5.0, slice(None))
    higher, said = geotag(flight, flight / given)
    assert "unchanged" not in said and np.nanmedian(higher.xyz[:, 2] - before.xyz[:, 2]) == pytest.approx(5, abs=0.01)
    # The MRK beside the photos: another exposure's time.
    mrk = next((flight / "photos").glob("*.MRK"))
    rows = mrk.read_text().splitlines(keepends=True)
    mrk.write_text("".join(rows[:-1]))
    fewer, said = geotag(flight, flight / given)
    assert "unchanged" not in said and fewer.is_placed.sum() == higher.is_placed.sum() - 1
    # A photo that was copied again but is the same.
    photo = list_photos(flight / "photos")[0]
    shutil.copy(photo, photo.with_suffix(".new"))
    photo.with_suffix(".new").replace(photo)
    assert "unchanged" in geotag(flight, flight / given)[1]


def test_photos_that_were_moved_are_the_same_photos(flight):
    before, _ = geotag(flight, flight / "ppk")
    moved = flight.with_name("a disk elsewhere")
    flight.rename(moved)
    (moved / "ppk").rename(moved / "a_solution")  # sorts before the photos now
    again, said = geotag(moved, moved / "a_solution")
    assert "geotag: unchanged since the last run, kept" in said
    assert again.digest() == before.digest() and all(path.is_file() for path in again.paths)
    # But not one that was changed.
    photo = list_photos(moved / "photos")[0]
    photo.write_bytes(photo.read_bytes() + b"\0")
    assert "unchanged" not in geotag(moved, moved / "a_solution")[1]


def test_photos_that_were_renamed_are_the_same_photos(flight):
    before, _ = geotag(flight, flight / "ppk")
    photos = list_photos(flight / "photos")
    pictures = [path.read_bytes() for path in photos]
    (flight / "photos" / "second half").mkdir()
    for k, path in enumerate(photos):  # in another order, and half of them in a sub-folder
        folder = path.parent / "second half" if k % 2 else path.parent
        path.rename(folder / f"plot 7 {len(photos) - k:03d}.JPG")
    again, said = geotag(flight, flight / "ppk")
    assert "geotag: unchanged since the last run, kept" in said
    assert f"{len(photos)} of {len(photos)} photos have other names" in said
    assert again.names == before.names and again.digest() == before.digest()
    assert [path.read_bytes() for path in again.paths] == pictures
    # One that is missing, or another picture under an old name: other photos.
    again.paths[3].write_bytes(pictures[3] + b"\0")
    other, said = geotag(flight, flight / "ppk")
    assert "unchanged" not in said and other.names != before.names


def test_a_ruined_stations_layer_is_made_again_and_an_edited_one_is_taken(flight):
    before, _ = geotag(flight, flight / "ppk")
    layer = flight / "work" / "geotags.gpkg"
    whole = layer.read_bytes()
    for ruin in (whole[:5000], whole[: len(whole) // 2], b"", whole.replace(b"sd_e_m", b"sd_x_m")):
        layer.write_bytes(ruin)
        again, said = geotag(flight, flight / "ppk")
        assert str(layer) in said and "the stage geotag is done again" in said, said
        assert again.digest() == before.digest()
    assert len(list(layer.parent.glob("geotags.damaged*.gpkg"))) == 4
    import geopandas

    table = geopandas.read_file(layer, layer="stations", engine="pyogrio")
    table["sd_u_m"] = 0.5
    table.to_file(layer, layer="stations", driver="GPKG", engine="pyogrio")
    edited, said = geotag(flight, flight / "ppk")
    # Kept as the person left it; what follows sees other stations and is done again.
    assert "unchanged" in said and edited.digest() != before.digest() and (edited.sd[:, 2] == 0.5).all()


def test_a_second_chain_in_a_workspace_is_refused_and_a_killed_one_gives_way(flight):
    words = [
        sys.executable,
        "-m",
        "treedgs_geo",
        "photos-to-dbh",
        "--photos",
        str(flight / "photos"),
        "--geotags",
        str(flight / "ppk"),
        "--crs",
        "EPSG:6344",
        "--workspace",
        str(flight / "work"),
        "--output",
        str(flight / "trees.gpkg"),
        "--log-format",
        "plain",
    ]
    first = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        for line in first.stdout:  # it works there
            if "[features]" in line or "[reconstruct]" in line:
                break
        while '"reconstruct"' not in (flight / "work" / "run.json").read_text():
            time.sleep(0.05)
        record = (flight / "work" / "run.json").read_bytes()
        second = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        assert second.returncode == 2 and first.poll() is None, second.stderr
        assert "another run works in this workspace" in second.stderr and f"process {first.pid}" in second.stderr
        assert (flight / "work" / "run.json").read_bytes() == record
        dry = subprocess.run([*words, "--dry-run"], cwd=ROOT, capture_output=True, text=True, check=False)
        assert dry.returncode == 2 and "another run works in this workspace" in dry.stderr
    finally:
        first.send_signal(signal.SIGKILL)
        first.communicate()
    (flight / "work" / ".sfm.leftover").mkdir()  # not ours: stays
    third = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        said = ""
        for line in third.stdout:
            said += line
            if "[reconstruct]" in line:
                break
        assert "geotag: unchanged" in said and "Ended early in the earlier run" in said
    finally:
        third.terminate()
        third.communicate()
    assert third.returncode == 130
    assert not list((flight / "work").glob("lease.000??[0-9]"))


def test_a_harmed_output_is_named_made_again_and_what_follows_only_if_it_came_out_otherwise(tmp_path):
    def run(ground: str) -> tuple[list[str], str, str]:
        done, said = [], io.StringIO()

        def stage(name: str, content: str) -> Stage:
            def work(_, reporter) -> dict:
                done.append(name)
                (tmp_path / f"{name}.bin").write_text(content)
                return {}

            return Stage(name, 1.0, work, outputs=lambda _: [tmp_path / f"{name}.bin"])

        with Workspace.held(tmp_path) as space:
            steps = Steps(space, PlainReporter(said), dict.fromkeys(("reconstruct", "ground", "measure"), 1.0))
            for name, content in (("reconstruct", "r"), ("ground", ground), ("measure", "m")):
                steps.run(stage(name, content), None)
            return done, said.getvalue(), steps.run_ids["measure"]

    first, _, run_id = run("g")
    assert first == ["reconstruct", "ground", "measure"] and run("g")[0] == []
    (tmp_path / "ground.bin").write_text("harmed")
    again, said, same = run("g")
    assert again == ["ground"] and same == run_id
    assert f"{tmp_path / 'ground.bin'}: is not as the run left it (damaged or changed); the stage ground" in said
    (tmp_path / "ground.bin").unlink()
    again, said, same = run("otherwise")
    assert again == ["ground", "measure"] and same == run_id and "ground.bin: is missing" in said
    assert run("otherwise")[0] == []
