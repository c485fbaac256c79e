"""What is known about the lens before matching: a file of an earlier flight, the factory's figures, nominal ones."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from shared_data import needs_shared

from treedgs_geo.core.errors import InputError
from treedgs_geo.geotags.photos import Photo
from treedgs_geo.reconstruction.calibration import PARAMETERS, Calibration, calibration_of

LENS = {"fx": 3657.0, "fy": 3650.5, "cx": 2731.9, "cy": 1847.2, "k1": -0.267, "k2": 0.112, "p1": 9e-4, "p2": 9e-5}
FOUND = {"model": "FC6310R", "width": 5472, "height": 3648, **LENS, "k3": -0.033}
SURE = {
    f"{name}_sd": sd for name, sd in zip(PARAMETERS, (0.5, 0.6, 0.7, 0.8, 1e-4, 2e-4, 1e-5, 2e-5, 3e-4), strict=True)
}


def _photo(**more) -> Photo:
    nan = float("nan")
    known = {"name": "a.jpg", "path": Path("a.jpg"), "width": 5472, "height": 3648, "model": "FC6310R", "sequence": -1}
    empty = dict.fromkeys(
        ("local_time", "utc", "lon_deg", "lat_deg", "height_m", "rtk_flag", "yaw_deg", "pitch_deg", "roll_deg",
         "relative_altitude_m", "focal_mm", "focal_35mm"), nan
    )  # fmt: skip
    return Photo(**{**known, **empty, "sd": np.full(3, nan), "dji": {}, **more})


def _file(folder: Path, found: object) -> Path:
    (folder / "camera.json").write_text(json.dumps(found))
    return folder / "camera.json"


def _matrix(calibration: Calibration) -> dict[str, float]:
    return {name: getattr(calibration.camera, name) for name in PARAMETERS}


def test_factory_calibration_of_a_real_packet_has_its_third_radial_term() -> None:
    text = (needs_shared("xmp_samples") / "p4rtk_100_0005_0018.xmp").read_text()
    dewarp = text.split('DewarpData="')[1].split('"')[0]
    found = calibration_of([_photo(dji={"DewarpData": dewarp})])
    assert found.source == "dewarp" and found.camera.k3 == -0.0331614
    assert (found.camera.k1, found.camera.p2) == (-0.267098, 8.82056e-05) and found.camera.cx == 2736 - 4.03
    assert found.sd["fx"] == pytest.approx(0.005 * 3657.02) and found.sd["cy"] == pytest.approx(10.9, abs=0.1)
    # a nominal focal length is of the design: wider in everything
    nominal = calibration_of([_photo(dji={"CalibratedFocalLength": "3666.666504"})])
    assert nominal.source == "xmp" and set(nominal.sd) == set(found.sd) == set(PARAMETERS)
    assert all(nominal.sd[name] > 2 * found.sd[name] for name in PARAMETERS)
    # and this real lens lies well inside of that
    assert all(abs(getattr(found.camera, n) - getattr(nominal.camera, n)) < 2 * nominal.sd[n] for n in PARAMETERS)


def test_a_file_goes_before_the_metadata(tmp_path: Path) -> None:
    photo = _photo(dji={"CalibratedFocalLength": "3666.666504"})
    found = calibration_of([photo], _file(tmp_path, {**FOUND, **SURE, "readout_s": 0.012, "readout_s_sd": 0.001}))
    assert found.source == "file" and _matrix(found) == {name: FOUND[name] for name in PARAMETERS}
    # what it knows, and what a lens changes from flight to flight
    assert found.sd["fx"] == pytest.approx(np.hypot(0.5, 3.657)) and found.sd["k3"] == pytest.approx(0.01, rel=0.01)
    assert (found.readout_s, found.readout_sd_s) == (0.012, 0.001)
    assert found.tolerance == 0.02
    # no metadata is needed then; what a file gives no accuracy for may itself be from metadata
    bare = calibration_of([_photo()], _file(tmp_path, FOUND))
    assert bare.sd["fx"] == pytest.approx(0.03 * 3657) and np.isnan(bare.readout_s)
    assert bare.tolerance == pytest.approx(0.09)


@pytest.mark.parametrize(
    ("found", "says"),
    [
        ({**FOUND, "width": 2736, "height": 1824}, "is of photos of 2736 x 1824 px, these have 5472 x 3648 px"),
        ({**FOUND, "model": "M3E"}, "is of the camera 'M3E', these photos are of 'FC6310R'"),
        ({k: v for k, v in FOUND.items() if k != "model"}, "is of the camera 'unknown'"),
        ({k: v for k, v in FOUND.items() if k not in ("k3", "cx")}, "has no cx, k3; expected camera.json"),
        ({**FOUND, "fy": float("nan")}, "has no fy"),
        ({**FOUND, "k1": "-0.267"}, "has no k1"),
        ({**FOUND, "fx": 12.3, "fy": 12.3}, "focal length 12.3, 12.3 px cannot be"),
        ([FOUND], "has no width"),
    ],
)
def test_files_of_another_camera_or_of_none(tmp_path: Path, found: object, says: str) -> None:
    with pytest.raises(InputError) as refused:
        calibration_of([_photo()], _file(tmp_path, found))
    assert says in str(refused.value) and "camera.json" in str(refused.value)


def test_files_that_are_no_json(tmp_path: Path) -> None:
    for content in (b"", b"fx = 3657", b"\xff\xfe\x00{"):
        (tmp_path / "camera.json").write_bytes(content)
        with pytest.raises(InputError, match=r"camera\.json: cannot be read"):
            calibration_of([_photo()], tmp_path / "camera.json")
    with pytest.raises(InputError, match="cannot be read"):
        calibration_of([_photo()], tmp_path / "none.json")


def test_what_is_given_goes_before_the_usual_accuracy() -> None:
    camera = calibration_of([_photo(dji={"CalibratedFocalLength": "3666.666504"})]).camera
    assert Calibration(camera, "xmp", 0.04, {"fx": 1.5}).sd["fx"] == 1.5
