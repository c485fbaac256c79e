"""The child process that runs pycolmap's long native calls: it can be killed, and its crash is not ours.

Called as ``python -m treedgs_geo.reconstruction.colmap_process JOB.json``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

from ..core.children import python_command, was_killed
from ..core.errors import ReconstructionError
from ..core.files import write_json

#: Mappers adjust, and sums over several threads come out differently each time (:func:`.adjustment.adjust`).
MAPPER_THREADS = 1


def _map_global(job: dict[str, Any]) -> None:
    import pycolmap

    options = pycolmap.GlobalPipelineOptions()
    options.num_threads, options.random_seed = MAPPER_THREADS, job["seed"]
    options.image_names = job["names"]
    mapper = options.mapper
    mapper.random_seed = mapper.rotation_averaging.random_seed = job["seed"]
    mapper.global_positioning.random_seed = mapper.retriangulation.random_seed = job["seed"]
    mapper.bundle_adjustment.refine_focal_length = job["free_focal"]
    mapper.bundle_adjustment.refine_extra_params = job["free_focal"]
    pycolmap.global_mapping(job["database"], job["photos"], job["output"], options)


def _map_incremental(job: dict[str, Any]) -> None:
    import pycolmap

    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads, options.random_seed = MAPPER_THREADS, job["seed"]
    options.image_names = job["names"]
    options.ba_refine_focal_length = options.ba_refine_extra_params = job["free_focal"]
    options.mapper.abs_pose_refine_focal_length = job["free_focal"]
    options.mapper.abs_pose_refine_extra_params = job["free_focal"]
    options.min_model_size = 3
    pycolmap.incremental_mapping(job["database"], job["photos"], job["output"], options)


TASKS = {"map_global": _map_global, "map_incremental": _map_incremental}


def run_task(task: str, job: dict[str, Any], cache: Path) -> None:
    """Run one of ``TASKS`` in a child to its end; cancelling this process ends it at once.

    Raises:
        MemoryError: the child was killed by the system. ReconstructionError: it crashed (the log file is named).
    """
    job_file, log_file = cache / f"{task}.json", cache / f"{task}.log"
    write_json(job_file, {"task": task, **job})
    command = python_command("treedgs_geo.reconstruction.colmap_process", job_file)
    with open(log_file, "wb") as log:
        code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, check=False).returncode
    if was_killed(code):
        raise MemoryError
    if code:
        tail = log_file.read_text(errors="replace").strip().splitlines()[-1:] or ["no message"]
        raise ReconstructionError(
            f"{log_file}: the step {task!r} of structure from motion stopped with code {code} "
            f"({tail[0][:200]}); run again, and report it if it stays."
        )


def _watch_parent(parent: int) -> None:
    """End when the engine is gone, whatever native code is busy with."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(130)


def main() -> int:
    """Run one task."""
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    threading.Thread(target=_watch_parent, args=(os.getppid(),), daemon=True).start()
    import pycolmap

    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    TASKS[job["task"]](job)
    return 0


if __name__ == "__main__":
    sys.exit(main())
