"""The child process that runs pycolmap's long native calls: it can be killed, and its crash is not ours.

Called as ``python -m treedgs_geo.reconstruction.colmap_process JOB.json``.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

#: Mappers adjust, and sums over several threads come out differently each time (:func:`.adjustment.adjust`).
MAPPER_THREADS = 1


def _extract(job: dict[str, Any]) -> None:
    import pycolmap

    reader = pycolmap.ImageReaderOptions()
    reader.camera_model, reader.camera_params = "OPENCV", job["camera_params"]
    if not Path(job["database"]).exists():
        pycolmap.Database.open(job["database"]).close()
        # Numbers of photos in the order of their names, not in the order in which threads finish: pairs, and all
        # random draws over them, follow from the numbers.
        pycolmap.import_images(
            job["database"],
            job["photos"],
            camera_mode=pycolmap.CameraMode.SINGLE,
            image_names=job["names"],
            options=reader,
        )
    options = pycolmap.FeatureExtractionOptions()
    options.num_threads, options.use_gpu, options.max_image_size = job["threads"], False, job["max_image_size"]
    options.sift.first_octave, options.sift.max_num_features = job["first_octave"], job["max_features"]
    options.sift.peak_threshold = job["peak_threshold"]
    pycolmap.extract_features(
        job["database"],
        job["photos"],
        image_names=job["names"],
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=reader,
        extraction_options=options,
        device=pycolmap.Device.cpu,
    )


def _match(job: dict[str, Any]) -> None:
    import pycolmap

    options = pycolmap.FeatureMatchingOptions()
    options.num_threads, options.use_gpu = 1, False  # see :mod:`.matching`
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = job["pair_list"]
    pairing.block_size = 64
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = job["seed"]
    pycolmap.match_image_pairs(job["database"], options, pairing, verification, device=pycolmap.Device.cpu)


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


TASKS = {"extract": _extract, "match": _match, "map_global": _map_global, "map_incremental": _map_incremental}


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
