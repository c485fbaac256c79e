"""Same input and seed, same result, whatever the threads are up to."""

from __future__ import annotations

import sqlite3

import cv2
import numpy as np
import pytest

from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.features import run_task, run_tasks
from treedgs_geo.reconstruction.matching import match_pairs


def photos(folder, count=12):
    """Photos of very different cost, so that threads finish out of order: the first is by far the slowest."""
    rng = np.random.default_rng(0)
    names = []
    for k in range(count):
        size = 900 if k == 0 else 160
        noise = rng.integers(0, 255, (size // 2, size // 2, 3), dtype=np.uint8)
        image = cv2.resize(noise, (900, 900), interpolation=cv2.INTER_NEAREST if k == 0 else cv2.INTER_CUBIC)
        names.append(f"{k:02d}.png")
        cv2.imwrite(str(folder / names[-1]), image)
    return names


def extract(folder, work, names):
    work.mkdir()
    job = {
        "database": str(work / "features.db"),
        "photos": str(folder),
        "names": names,
        "threads": 4,
        "camera_params": "900,900,450,450,0,0,0,0",
        "max_image_size": 1000,
        "max_features": 1500,
        "first_octave": 0,
        "peak_threshold": 0.0067,
    }
    run_task("extract", job, work, Reporter())


def match(work, names, threads):
    pairs = np.array([(i, j) for i in range(len(names)) for j in range(i + 1, len(names))])
    match_pairs(work / "features.db", work, names, pairs, threads, 1, Reporter())


def found(work):
    with sqlite3.connect(work / "features.db") as database:
        numbers = list(database.execute("select image_id, name from images order by image_id"))
        return numbers, [
            list(database.execute(f"select * from {table} order by 1"))
            for table in ("keypoints", "descriptors", "matches", "two_view_geometries")
        ]


def test_photos_are_numbered_by_name_and_matches_repeat_on_any_number_of_threads(tmp_path):
    names = photos(tmp_path)
    results = []
    for run, threads in enumerate((4, 4, 1)):
        work = tmp_path / str(run)
        extract(tmp_path, work, names)
        match(work, names, threads)
        results.append(found(work))
    numbers, tables = results[0]
    assert [name for _, name in numbers] == names  # not in the order in which threads finished
    assert len(tables[2]) == len(tables[3]) == len(names) * (len(names) - 1) // 2
    assert results[0] == results[1] == results[2]


def test_matching_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    names = photos(tmp_path)
    extract(tmp_path, tmp_path / "work", names)
    extract(tmp_path, tmp_path / "whole", names)
    match(tmp_path / "whole", names, 3)

    class Stopper(Reporter):
        """Cancels as soon as some pairs are matched."""

        def progress(self, fraction):
            if fraction > 0.1:
                raise KeyboardInterrupt

    work, pairs = tmp_path / "work", np.array([(i, j) for i in range(len(names)) for j in range(i + 1, len(names))])
    with pytest.raises(KeyboardInterrupt):
        match_pairs(work / "features.db", work, names, pairs, 3, 1, Stopper())
    kept = [part.stat().st_mtime_ns for part in sorted((work / "matching").glob("*.txt"))]
    assert len(kept) == 3 and found(work)[1][3] == []
    match(work, names, 3)
    assert found(work) == found(tmp_path / "whole") and not (work / "matching").exists()
    # What is there is not matched again.
    monkeypatch.setattr("treedgs_geo.reconstruction.matching.run_tasks", None)
    match(work, names, 3)


def test_a_crashed_process_is_reported_and_ends_the_others(tmp_path):
    names = photos(tmp_path, 4)
    extract(tmp_path, tmp_path / "work", names)
    jobs = [
        {"database": str(tmp_path / "no" / "such.db"), "pair_list": "none", "seed": 1},
        {"database": str(tmp_path / "work" / "features.db"), "pair_list": "none", "seed": 1},
    ]
    with pytest.raises(ReconstructionError, match="'match' of structure from motion stopped"):
        run_tasks("match", jobs, tmp_path, Reporter())
