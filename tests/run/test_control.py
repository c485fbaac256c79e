"""``--gcp`` and ``--calibration`` in the verbs: read before anything expensive, handed on, part of what is kept."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from small_flight import CRS, Flight, lines, write_photos

from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import PlainReporter
from treedgs_geo.reconstruction.model import FRAME, MODEL_FILES, REPORT
from treedgs_geo.run.photos import GEOTAG, RECONSTRUCT, held, job_of
from treedgs_geo.run.settings import PhotosToDbhSettings
from treedgs_geo.run.stage import check, run_stages
from treedgs_geo.verbs.reconstruct import ReconstructSettings, run

REPORTED = {
    "photos": 12,
    "registered": 12,
    "reprojection_rms_px": 0.5,
    "geotag_rms_e_n_u_m": [0.0, 0.0, 0.0],
    "focal_px": 1.0,
    "points": 1,
    "seconds": 1.0,
}


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    """photos/, gcp_list.txt with one control, one check and one lonely point, camera.json."""
    write_photos(Flight(lines(12)), tmp_path / "photos")
    places = {"P1": (425010, 3718000, 60), "P2_check": (425020, 3718008, 60), "P3": (425000, 3718000, 60)}
    marks = [("P1", 1), ("P1", 2), ("P2_check", 2), ("P2_check", 3), ("P3", 1)]
    rows = [f"{' '.join(map(str, places[p]))} {20 + n} 30 DJI_{n:04d}.JPG {p}" for p, n in marks]
    (tmp_path / "gcp_list.txt").write_text("\n".join([CRS, *rows]))
    lens = {"fx": 270, "fy": 270, "cx": 200, "cy": 150, "k1": 0, "k2": 0, "p1": 0, "p2": 0, "k3": 0}
    (tmp_path / "camera.json").write_text(json.dumps({"model": "M3E", "width": 400, "height": 300, **lens}))
    return tmp_path


@pytest.fixture
def handed(monkeypatch) -> list[dict]:
    """What ``reconstruct_photos`` was called with; it leaves empty files."""
    calls: list[dict] = []

    def reconstruct(stations, options, sfm, reporter=None, control=None, calibration_file=None) -> dict:
        calls.append({"control": control, "file": calibration_file})
        sfm.mkdir(exist_ok=True)
        for name in (*MODEL_FILES, FRAME, REPORT):
            (sfm / name).write_text(json.dumps(REPORTED))
        return REPORTED

    monkeypatch.setattr("treedgs_geo.run.reconstruct_stage.reconstruct_photos", reconstruct)
    monkeypatch.setattr("treedgs_geo.run.reconstruct_stage.load_views", lambda *_: (None, []))
    monkeypatch.setattr("treedgs_geo.run.reconstruct_stage.load_points", lambda _: np.zeros((0, 3)))
    return calls


def _chain(flight: Path, **more: Path) -> tuple[list[str], str]:
    """The first stages of ``photos-to-dbh``: the run's warnings, and what was said."""
    settings = PhotosToDbhSettings(
        photos=flight / "photos", crs=CRS, workspace=flight / "work", output=flight / "trees.gpkg", **more
    )
    said = io.StringIO()
    job = job_of(settings, PlainReporter(said))
    check(GEOTAG, job)
    with held(job, (GEOTAG, RECONSTRUCT)):
        run_stages((GEOTAG, RECONSTRUCT), job, job.steps)
    return job.steps.warnings, said.getvalue()


def _verb(flight: Path, **more: Path) -> tuple[list[str], str]:
    said = io.StringIO()
    run(ReconstructSettings(photos=flight / "photos", crs=CRS, workspace=flight / "work", **more), PlainReporter(said))
    return [], said.getvalue()


@pytest.mark.parametrize("work", [_chain, _verb])
def test_control_and_calibration_reach_the_reconstruction_and_decide_what_is_kept(flight, handed, work) -> None:
    gcp, camera = flight / "gcp_list.txt", flight / "camera.json"
    work(flight)
    assert handed == [{"control": None, "file": None}]
    warnings, said = work(flight, gcp=gcp, calibration=camera)
    control = handed[-1]["control"]
    assert control.labels == ["P1", "P2_check"] and control.is_check.tolist() == [False, True]
    assert handed[-1]["file"] == camera and "left out: P3" in said
    assert work is _verb or any("P3" in warning for warning in warnings)
    warnings, said = work(flight, gcp=gcp, calibration=camera)
    assert len(handed) == 2 and "reconstruct: unchanged since the last run, kept" in said
    assert work is _verb or any("P3" in warning for warning in warnings), "a resumed run reports it, too"
    # one pixel of one mark; a line that changes nothing; the camera
    gcp.write_text(gcp.read_text().replace(" 22 30 ", " 23 30 ", 1))
    work(flight, gcp=gcp, calibration=camera)
    assert len(handed) == 3
    gcp.write_text(gcp.read_text() + "\n# surveyed by hand\n")
    work(flight, gcp=gcp, calibration=camera)
    assert len(handed) == 3
    camera.write_text(camera.read_text().replace("270", "271"))
    work(flight, gcp=gcp, calibration=camera)
    assert len(handed) == 4


@pytest.mark.parametrize("work", [_chain, _verb])
def test_a_bad_file_ends_the_job_before_anything_is_matched(flight, handed, work) -> None:
    (flight / "gcp_list.txt").write_text(f"{CRS}\n1 2 3 4 5 DJI_0001.JPG\n1 2 3 4 5 DJI_0002.JPG\n")
    with pytest.raises(InputError, match="km from the nearest photo"):
        work(flight, gcp=flight / "gcp_list.txt")
    assert not handed


def test_photos_without_positions_go_on_with_their_control_in_its_crs(flight, handed, capsys) -> None:
    shutil.rmtree(flight / "photos")
    write_photos(Flight(lines(12), gps=False), flight / "photos")
    places = [(425010, 3718000, 60), (425020, 3718008, 60), (425030, 3718000, 61)]
    rows = [f"{x} {y} {z} {20 + n} 30 DJI_{n:04d}.JPG" for x, y, z in places for n in (1, 2)]
    (flight / "gcp_list.txt").write_text("\n".join([CRS, *rows]))
    plots = flight / "plots.csv"
    plots.write_text("plot_id,easting,northing,radius_m\n1,425015,3718004,8\n")
    words = ["photos-to-dbh", "--photos", flight / "photos", "--plots", plots, "--workspace", flight / "work"]
    words += ["--output", flight / "out.gpkg", "--gcp", flight / "gcp_list.txt"]
    assert main([*map(str, words), "--dry-run"]) == 0 and "12 none" in "".join(capsys.readouterr())
    settings = ReconstructSettings(photos=flight / "photos", workspace=flight / "work", gcp=flight / "gcp_list.txt")
    assert run(settings, PlainReporter(io.StringIO()))["check_rms_e_n_u_m"] is None
    assert len(handed[-1]["control"]) == 3
    plots.write_text("plot_id,easting,northing,radius_m\n1,435015,3718004,8\n")
    main([*map(str, words), "--dry-run"])
    assert "plot '1' lies 9985 m from the nearest photo" in "".join(capsys.readouterr())


def test_the_dry_run_names_what_is_wrong_with_both(flight, capsys) -> None:
    (flight / "gcp_list.txt").write_text(f"{CRS}\n1 2 3 4 5 DJI_0001.JPG\n")
    camera = flight / "camera.json"
    camera.write_text(camera.read_text().replace("M3E", "P1"))
    words = ["photos-to-dbh", "--dry-run", "--photos", flight / "photos", "--crs", CRS, "--workspace", flight / "work"]
    words += ["--output", flight / "out.gpkg", "--gcp", flight / "gcp_list.txt", "--calibration", camera]
    main([str(word) for word in words])
    said = "".join(capsys.readouterr())
    assert "km from the nearest photo" in said and "is of the camera 'P1'" in said
