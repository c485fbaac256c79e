"""Matching of photo pairs in processes of one thread each.

COLMAP's matcher looks descriptors up in indices that its threads share, and then finds a few other matches in one run
out of three (4,000 and more features a photo); with one thread it repeats to the bit, whatever the order of the pairs.
"""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from ..core.files import read_json, write_json
from ..core.progress import Reporter
from .features import count_rows, run_tasks

#: Fewer pairs than this are not worth a process of their own; and each process copies the features that it needs.
MIN_PAIRS, MAX_PROCESSES = 20, 16
#: What matching writes; all else is its input.
_RESULTS = ("matches", "two_view_geometries")


def match_pairs(
    database: Path, cache: Path, names: list[str], pairs: np.ndarray, threads: int, seed: int, reporter: Reporter
) -> None:
    """Match photos and verify the matches, into ``database``; pairs that it holds are not matched again.

    pairs: (K, 2) numbers of photos in ``names``. cache: holds the work of unfinished processes, which a later call
    with as many threads goes on from.

    Raises:
        MemoryError, ReconstructionError: as :func:`.features.run_tasks`.
    """
    done = _matched(database)
    todo = [(names[i], names[j]) for i, j in pairs if frozenset((names[i], names[j])) not in done]
    if not todo:
        return
    count = int(np.clip(len(todo) // MIN_PAIRS, 1, np.clip(threads, 1, MAX_PROCESSES)))
    folder = cache / "matching"
    layout = {"pairs": todo, "processes": count, "seed": seed}
    if folder.exists() and not _is_same(folder / "layout.json", layout):
        shutil.rmtree(folder)
    folder.mkdir(exist_ok=True)
    write_json(folder / "layout.json", layout)
    jobs, counts = [], []
    # Neighbours in the list share photos: each process gets a run of it, and only its photos.
    for number, own in enumerate(np.array_split(np.arange(len(todo)), count)):
        part, listing = folder / f"{number}.db", folder / f"{number}.txt"
        chosen = [todo[k] for k in own]
        if not part.exists():
            _copy_photos(database, part, sorted({name for pair in chosen for name in pair}))
        listing.write_text("".join(f"{one} {two}\n" for one, two in chosen), encoding="utf-8")
        jobs.append({"database": str(part), "pair_list": str(listing), "seed": seed})
        counts.append(count_rows(part, _RESULTS[1], len(todo)))
    run_tasks("match", jobs, cache, reporter, lambda: sum(rows() for rows in counts))
    with closing(sqlite3.connect(database)) as whole:
        for job in jobs:
            whole.execute("ATTACH ? AS part", (job["database"],))
            for table in _RESULTS:
                whole.execute(f"INSERT OR REPLACE INTO main.{table} SELECT * FROM part.{table}")
            whole.commit()
            whole.execute("DETACH part")
    shutil.rmtree(folder)


def _is_same(path: Path, layout: dict) -> bool:
    try:
        kept = read_json(path)
    except (OSError, ValueError):
        return False
    return kept == {**layout, "pairs": [list(pair) for pair in layout["pairs"]]}


def _matched(database: Path) -> set[frozenset[str]]:
    """Pairs of names that the database holds the verified matches of, be they none."""
    import pycolmap

    with closing(sqlite3.connect(database)) as whole:
        name = dict(whole.execute("SELECT image_id, name FROM images"))
        rows = whole.execute(f"SELECT pair_id FROM {_RESULTS[1]}").fetchall()
    pairs = [pycolmap.pair_id_to_image_pair(pair) for (pair,) in rows]
    return {frozenset((name[one], name[two])) for one, two in pairs}


def _copy_photos(database: Path, target: Path, names: list[str]) -> None:
    """A database with the features of some photos and no matches; it appears when it is whole."""
    import pycolmap

    unfinished = target.with_suffix(".part")
    unfinished.unlink(missing_ok=True)
    pycolmap.Database.open(str(unfinished)).close()
    with closing(sqlite3.connect(unfinished)) as part:
        part.execute("ATTACH ? AS whole", (str(database),))
        part.execute("CREATE TEMP TABLE wanted (name TEXT)")
        part.executemany("INSERT INTO wanted VALUES (?)", [(name,) for name in names])
        tables = part.execute(
            "SELECT name FROM whole.sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
        ).fetchall()
        for (table,) in tables:
            if table in _RESULTS:
                continue
            some = ""
            if table in ("keypoints", "descriptors"):
                some = " WHERE image_id IN (SELECT image_id FROM whole.images JOIN wanted USING (name))"
            part.execute(f"INSERT OR REPLACE INTO main.{table} SELECT * FROM whole.{table}{some}")
        part.commit()
        part.execute("DETACH whole")
    unfinished.replace(target)
