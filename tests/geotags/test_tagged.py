"""Tagged copies: the new position is in them, the originals stay as they were."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from shared_data import needs_shared

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.tagged import _QUIETLY, check_target
from treedgs_geo.verbs.geotag import GeotagSettings, run


def test_copies_carry_the_corrected_position(tmp_path: Path) -> None:
    if shutil.which("exiftool") is None:
        pytest.skip("ExifTool is not installed")
    folder = needs_shared("plot_a")
    photos = tmp_path / "photos"
    (photos / "sub").mkdir(parents=True)
    for number, path in enumerate(sorted((folder / "images").iterdir())[:8]):
        shutil.copy(path, photos / ("sub" if number > 4 else ".") / path.name)
    before = {p: hashlib.sha256(p.read_bytes()).hexdigest() for p in photos.rglob("*.JPG")}
    target = tmp_path / "tagged photos ü"
    result = run(
        GeotagSettings(
            photos=photos,
            geotags=folder,
            crs="EPSG:6344",
            output=tmp_path / "s.gpkg",
            tagged_photos=target,
        ),
        Reporter(),
    )
    assert result["n_tagged"] == 8
    assert {p: hashlib.sha256(p.read_bytes()).hexdigest() for p in photos.rglob("*.JPG")} == before
    wanted = read_stations(photos, folder, "EPSG:6344", check_photos=False)
    # the copies, read like any photos without other geotags, stand where the PPK stations are
    found = read_stations(target, None, "EPSG:6344", check_photos=False)
    assert found.names == wanted.names
    np.testing.assert_allclose(found.xyz, wanted.xyz, atol=0.001)
    assert found.quality == wanted.quality
    np.testing.assert_allclose(found.sd, wanted.sd, atol=1e-4)
    np.testing.assert_allclose(found.yaw_deg, wanted.yaw_deg)


def test_originals_are_out_of_reach(tmp_path: Path) -> None:
    photos = tmp_path / "flight" / "photos"
    photos.mkdir(parents=True)
    for target in (photos, photos / "tagged", tmp_path / "flight"):
        with pytest.raises(InputError):
            check_target(photos, target)
    check_target(photos, tmp_path / "flight" / "tagged")


@pytest.mark.parametrize("words, executed", [(("-@", "-"), True), (_QUIETLY, False)])
def test_no_configuration_of_the_current_folder_is_executed(tmp_path: Path, words, executed) -> None:
    """ExifTool's configuration is a program, and without HOME it is looked for in the current folder."""
    if shutil.which("exiftool") is None:
        pytest.skip("ExifTool is not installed")
    (tmp_path / ".ExifTool_config").write_text("open(my $f, '>', 'executed'); 1;")
    nowhere = {"PATH": os.environ["PATH"]}
    subprocess.run(
        ["exiftool", *words], input="-ver\n-execute\n", text=True, cwd=tmp_path, env=nowhere, capture_output=True
    )
    assert (tmp_path / "executed").exists() == executed
