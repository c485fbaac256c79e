"""Same input and seed, same result, whatever the threads are up to."""

from __future__ import annotations

import sqlite3

import cv2
import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.features import run_task


def photos(folder, count=8):
    """Photos of very different cost, so that threads finish out of order: the first is by far the slowest."""
    rng = np.random.default_rng(0)
    names = []
    for k in range(count):
        size = 900 if k == 0 else 160
        noise = rng.integers(0, 255, (size // 2, size // 2, 3), dtype=np.uint8)
        image = cv2.resize(noise, (900, 900), interpolation=cv2.INTER_NEAREST if k == 0 else cv2.INTER_CUBIC)
        names.append(f"{k}.png")
        cv2.imwrite(str(folder / names[-1]), image)
    return names


def extract(folder, work, names):
    work.mkdir()
    job = {"database": str(work / "features.db"), "photos": str(folder), "names": names, "threads": 4,
           "camera_params": "900,900,450,450,0,0,0,0", "max_image_size": 1000, "max_features": 1500,
           "first_octave": 0, "peak_threshold": 0.0067}
    run_task("extract", job, work, Reporter())
    pairs = work / "pairs.txt"
    pairs.write_text("".join(f"{a} {b}\n" for k, a in enumerate(names) for b in names[k + 1:]), encoding="utf-8")
    run_task("match", {"database": job["database"], "pair_list": str(pairs), "threads": 4, "seed": 1}, work, Reporter())
    with sqlite3.connect(job["database"]) as database:
        numbers = list(database.execute("select image_id, name from images order by image_id"))
        found = [list(database.execute(f"select * from {table} order by 1")) for table in
                 ("keypoints", "descriptors", "matches", "two_view_geometries")]
    return numbers, found


def test_photos_are_numbered_by_name_and_matches_repeat(tmp_path):
    names = photos(tmp_path)
    first = extract(tmp_path, tmp_path / "a", names)
    second = extract(tmp_path, tmp_path / "b", names)
    assert [name for _, name in first[0]] == names  # not in the order in which threads finished
    assert first == second
