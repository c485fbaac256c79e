"""Features and matches: run in a child process, kept in a database that a stopped run resumes from."""

from __future__ import annotations

import sqlite3
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.children import python_command, was_killed
from ..core.errors import ReconstructionError
from ..core.files import write_json
from ..core.progress import Reporter
from .sift import PhotoFeatures


def run_task(
    task: str, job: dict[str, Any], cache: Path, reporter: Reporter, fraction: Callable[[], float] | None = None
) -> None:
    """Run one task of :mod:`.colmap_process` to its end; see :func:`run_tasks`."""
    run_tasks(task, [job], cache, reporter, fraction)


def run_tasks(
    task: str, jobs: list[dict[str, Any]], cache: Path, reporter: Reporter, fraction: Callable[[], float] | None = None
) -> None:
    """Run a task of :mod:`.colmap_process` on several jobs at once, each in a child; cancelling this process ends them
    at once.

    Raises:
        MemoryError: a child was killed by the system. ReconstructionError: one crashed (the log file is named).
    """
    children, logs = [], []
    try:
        for number, job in enumerate(jobs):
            stem = task if len(jobs) == 1 else f"{task}-{number}"
            job_file = cache / f"{stem}.json"
            logs.append(cache / f"{stem}.log")
            write_json(job_file, {"task": task, **job})
            with open(logs[-1], "wb") as log:
                children.append(
                    subprocess.Popen(
                        python_command("treedgs_geo.reconstruction.colmap_process", job_file),
                        stdin=subprocess.DEVNULL,
                        stdout=log,
                        stderr=log,
                    )
                )
        while any(child.poll() is None for child in children) and not any(child.returncode for child in children):
            time.sleep(0.1)
            if fraction is not None:
                reporter.progress(fraction())
    finally:
        failed = [(child.returncode, log) for child, log in zip(children, logs, strict=False) if child.returncode]
        for child in children:
            if child.poll() is None:
                child.kill()
                child.wait()
    for code, log_file in failed:
        if was_killed(code):
            raise MemoryError
        tail = log_file.read_text(errors="replace").strip().splitlines()[-1:] or ["no message"]
        raise ReconstructionError(
            f"{log_file}: the step {task!r} of structure from motion stopped with code {code} "
            f"({tail[0][:200]}); run again, and report it if it stays."
        )


def count_rows(database: Path, table: str, total: int) -> Callable[[], float]:
    """Progress of a running child: rows of a table over the total expected."""

    def fraction() -> float:
        try:
            connection = sqlite3.connect(f"file:{database}?mode=ro", uri=True, timeout=0.05)
            try:
                return connection.execute(f"SELECT COUNT(*) FROM {table}").fetchone()[0] / max(total, 1)
            finally:
                connection.close()
        except sqlite3.Error:
            return 0.0

    return fraction


class FeatureStore:
    """Keypoints, descriptors and verified matches of N photos.

    keypoints: per photo (K, 2) float64 pixels. descriptors: per photo (K, 128) uint8. matches: (i, j) with i < j -> (M,
    2) numbers of their keypoints. image_ids: numbers of the photos in the database that they were read from, -1 where
    it has none. own: the photos' features as they were found, with direction and sign, where they are our own.
    """

    def __init__(
        self, keypoints: list[np.ndarray], descriptors: list[np.ndarray], own: list[PhotoFeatures] | None = None
    ) -> None:
        self.keypoints, self.descriptors, self.own = keypoints, descriptors, own or []
        self.image_ids = [-1] * len(keypoints)
        self.matches: dict[tuple[int, int], np.ndarray] = {}

    @classmethod
    def of(cls, own: list[PhotoFeatures]) -> FeatureStore:
        """Our own features, not matched yet."""
        return cls([each.keypoints for each in own], [each.described for each in own], own)

    @classmethod
    def read(cls, database: Path, names: list[str]) -> FeatureStore:
        """What a database holds of the photos ``names``."""
        import pycolmap

        source = pycolmap.Database.open(str(database))
        try:
            ids = {image.name: image.image_id for image in source.read_all_images()}
            image_ids = [ids.get(name, -1) for name in names]
            keypoints, descriptors = [], []
            for key in image_ids:
                points = source.read_keypoints(key) if key >= 0 else np.empty((0, 4))
                data = source.read_descriptors(key) if key >= 0 else np.empty((0, 128), np.uint8)
                data = np.asarray(getattr(data, "data", data))
                keypoints.append(np.asarray(points, float).reshape(len(points), -1 if len(points) else 2)[:, :2])
                descriptors.append(np.ascontiguousarray(data, np.uint8).reshape(-1, 128))
            store = cls(keypoints, descriptors)
            store.image_ids = image_ids
            place = {key: i for i, key in enumerate(image_ids) if key >= 0}
            pair_ids, geometries = source.read_two_view_geometries()
            for pair_id, geometry in zip(pair_ids, geometries, strict=True):
                first, second = pycolmap.pair_id_to_image_pair(pair_id)
                if first in place and second in place and len(geometry.inlier_matches):
                    i, j = place[first], place[second]
                    matches = np.asarray(geometry.inlier_matches, np.int64)
                    store.matches[(i, j) if i < j else (j, i)] = matches if i < j else matches[:, ::-1]
        finally:
            source.close()
        return store
