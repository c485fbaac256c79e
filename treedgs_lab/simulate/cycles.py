"""A second world, by others: crowns that Blender's add-on Sapling grows, photos that its path tracer Cycles renders.

Stems, ground, flight and truth are those of our own world: the stems' meshes are the very ones that the truth is cut
from, so bark relief that a tape would span is in them, and Cycles' bark changes how they look, not where they end.
Blender is a program of its own (:mod:`.inside_blender` is run by it); nothing of it is imported.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numba
import numpy as np
from scipy.ndimage import map_coordinates

from treedgs_geo.core.children import find_program
from treedgs_geo.core.errors import InputError, MissingComponentError, OutputError
from treedgs_geo.reconstruction.cameras import Camera

from .crowns import Crowns, recipes
from .light import weather_of
from .sensor import linear_light
from .settings import SimulateSettings, Sizes
from .wind import Sway, Wind
from .world import World

if TYPE_CHECKING:
    from .photographs import Exposure

#: What makes our own radiance a photo of usual brightness; Blender's pictures have it already.
EXPOSURE = 3.9
#: Paths a pixel for each ray of ours, before the denoiser.
PATHS = 2
_SCRIPT = Path(__file__).with_name("inside_blender.py")


def check_cycles(settings: SimulateSettings) -> str:
    """The program; said before anything expensive starts.

    Raises:
        MissingComponentError: Blender is not there. InputError: a setting that this world does not have.
    """
    asked = {
        "--from-cloud": settings.from_cloud,
        "--control-points": settings.control_points,
        "--camera labels": settings.labels,
        "--weather wind_flutter_cm": settings.wind_flutter_cm,
    }
    unknown = [name for name, value in asked.items() if value]
    if unknown:
        raise InputError(f"--world cycles: has no {', '.join(unknown)}; leave it out, or choose --world own.")
    program = find_program("blender")
    if program is None:
        raise MissingComponentError(
            "--world cycles: needs the program blender, which was not found; install Blender 3.4 to 4.1 (Debian's "
            "package blender) and put it on the PATH."
        )
    return program


def _blender(settings: SimulateSettings, *arguments: Any) -> Iterator[str]:
    """What :mod:`.inside_blender` says, line by line.

    Raises:
        OutputError: it failed.
    """
    words = [check_cycles(settings), "-b", "-noaudio", "--factory-startup", "--python-exit-code", "3", "--python"]
    if arguments[0] == "render" and find_spec("bpy"):
        # Isolated: Blender's own module ``cycles`` is not this one.
        words = [sys.executable, "-I"]
    words += [str(_SCRIPT), "--", *map(str, arguments)]
    said: list[str] = []
    with subprocess.Popen(
        words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    ) as child:
        try:
            for line in child.stdout or ():
                said = [*said[-20:], line.strip()]
                yield line.strip()
        except BaseException:
            # Whoever reads has stopped: nobody wants the rest.
            child.kill()
            raise
    if child.returncode:
        last = " / ".join(line for line in said if line)[-400:]
        raise OutputError(f"blender: ended with exit code {child.returncode} ({last}); correct that and run again.")


def grown_crowns(settings: SimulateSettings, rng: np.random.Generator) -> Crowns:
    """Crowns by Sapling for a stand."""
    with tempfile.TemporaryDirectory(prefix="treedgs-crowns-") as folder:
        asked, made = Path(folder) / "crowns.json", Path(folder) / "crowns.npz"
        asked.write_text(json.dumps(recipes(rng, settings.hardwood_pct > 0)), encoding="utf-8")
        for _ in _blender(settings, "grow", asked, made):
            pass
        with np.load(made) as grown:
            return Crowns(dict(grown), settings.leaf_area_m2, settings.dbh_mean_cm / 100, settings.leaf_off)


def cycles_images(
    world: World,
    wind: Wind,
    settings: SimulateSettings,
    sizes: Sizes,
    exposures: list[Exposure],
    suns: list[np.ndarray],
) -> Iterator[np.ndarray]:
    """(H, W, 3) float32 linear radiance of each photo, as :func:`.render.radiance` gives it; suns: directions (3,)."""
    with tempfile.TemporaryDirectory(prefix="treedgs-cycles-") as folder:
        scene, job = Path(folder) / "scene.npz", Path(folder) / "photos.json"
        write_scene(scene, world, wind.trees)
        frame = wide_frame([taken.view.camera for taken in exposures])
        asked = photo_job(settings, sizes, exposures, suns, frame)
        if wind.blows:
            for photo, taken in zip(asked["photos"], exposures, strict=True):
                photo["tops"] = wind.trees.tops(taken.station.seconds).tolist()
        job.write_text(json.dumps(asked), encoding="utf-8")
        ready = (line for line in _blender(settings, "render", scene, job, folder) if line.startswith("photo ready"))
        weather = weather_of(settings)
        for taken, line in zip(exposures, ready, strict=True):
            picture = Path(folder) / line.split()[-1]
            code = np.asarray(cv2.imread(str(picture), cv2.IMREAD_UNCHANGED))[..., ::-1].astype(np.float32) / 65535
            picture.unlink()
            yield through_lens(linear_light(code), taken.view.camera) / (EXPOSURE * weather.exposure)


def write_scene(path: Path, world: World, trees: Sway) -> None:
    """Everything that :mod:`.inside_blender` renders, in one file. The world has crowns of Blender's."""
    crowns, mesh, barks = world.crowns, world.mesh, world.barks
    assert crowns is not None
    ground_vertices, ground_triangles = world.ground.mesh()
    owner, plant_owner = mesh.vertex_owner, np.repeat(crowns.plants.owner, 3)
    stem, ends = np.array(crowns.stem, int), np.reshape(crowns.ends, (-1, 2, 3))
    look = np.column_stack([world.bark_offset[:, 2], barks.cover, np.ones(len(barks.tile))])
    parts: dict[str, Any] = {
        "ground_vertices": ground_vertices,
        "ground_triangles": ground_triangles,
        "stem_vertices": mesh.vertices,
        "stem_triangles": mesh.triangles,
        "stem_owner": mesh.owner,
        "vertex_owner": owner,
        "vertex_share": trees.share(mesh.vertices, owner),
        "stem_bark": barks.tile,
        "stem_look": look[owner],
        "plant_corners": crowns.plants.corners,
        "plant_owner": plant_owner,
        "plant_share": trees.share(crowns.plants.corners.reshape(-1, 3), plant_owner),
        "plant_tone": np.column_stack([crowns.plants.albedo, crowns.plants.through]),
        "crown_kinds": len(crowns.kinds),
        "instance_kind": crowns.kind,
        "instance_matrix": crowns.matrix,
        "instance_owner": stem,
        "instance_height": ends[:, :, 2],
        "instance_share": np.column_stack([trees.share(ends[:, k], stem) for k in (0, 1)]),
    }
    if barks.photographed:
        # One turn is half a tile, 5 mm a texel along: as our own world has it.
        place = (mesh.uv + world.bark_offset[owner, :2] * [2.0, 1.0]) / [2.0, 0.005 * barks.tiles.shape[1]]
        parts |= {"bark_tiles": barks.tiles, "stem_place": place}
    for number, crown in enumerate(crowns.kinds):
        parts |= {f"leaves_{number}": crown.leaves, f"wood_{number}": crown.wood, f"tone_{number}": crown.tone}
    np.savez(path, **parts)


def wide_frame(cameras: list[Camera]) -> tuple[int, int]:
    """Width and height of a picture without distortion that holds every photo, its principal point in the middle."""
    half = np.zeros(2)
    for camera in cameras:
        x, y = camera.undistort(*np.meshgrid(np.linspace(0, camera.width, 33), np.linspace(0, camera.height, 33)))
        half = np.maximum(half, [np.abs(camera.fx * x).max(), np.abs(camera.fy * y).max()])
    # Two pixels more for the interpolation.
    width, height = (2 * np.ceil(half + 2)).astype(int)
    return int(width), int(height)


def photo_job(
    settings: SimulateSettings,
    sizes: Sizes,
    exposures: list[Exposure],
    suns: list[np.ndarray],
    frame: tuple[int, int],
) -> dict[str, Any]:
    """What :mod:`.inside_blender` needs to know of the photos. Times of the shutter: from the first row to the last of
    the wide frame and one row's exposure; travel and turn: of half that time."""
    width, height = frame
    weather = weather_of(settings)
    photos = []
    first: dict[int, np.ndarray] = {}
    for number, (taken, sun) in enumerate(zip(exposures, suns, strict=True)):
        camera, motion = taken.view.camera, taken.motion
        sun = first.setdefault(taken.station.flight if settings.sun_shift_min > 0 else 0, sun)
        readout_ms = settings.readout_ms * height / camera.height
        shutter_ms = readout_ms + settings.exposure_ms
        # Both are the same motion, seen for other times.
        known_ms, known = (settings.readout_ms, motion[:2]) if readout_ms else (settings.exposure_ms, motion[2:])
        travel, turn = (shutter_ms / known_ms * part if known_ms else np.zeros(3) for part in known)
        moving = travel.any() or turn.any()
        right, down, forward = taken.view.rotation
        photos.append(
            {
                "file": f"{number:04d}.tif",
                "seed": settings.seed * 7919 + number & 0x7FFFFFFF,
                "focal_px": camera.fx,
                "centre": taken.view.centre.tolist(),
                "axes": np.column_stack([right, -down, -forward]).tolist(),
                "sun": sun.tolist(),
                "gain": weather.exposure,
                "shutter": float(shutter_ms if moving else 0.0),
                "open_share": settings.exposure_ms / shutter_ms if moving else 0.0,
                "travel": travel.tolist(),
                # Blender's camera looks along -z, y up.
                "turn": (turn * [1, -1, -1]).tolist(),
            }
        )
    return {
        "width": width,
        "height": height,
        "samples": PATHS * sizes.samples,
        "look": settings.look.capitalize(),
        "overcast": settings.sky == "overcast",
        "threads": numba.get_num_threads(),
        "photos": photos,
    }


def through_lens(picture: np.ndarray, camera: Camera) -> np.ndarray:
    """(h, w, 3) picture without distortion, principal point in the middle -> (H, W, 3) through the camera's lens."""
    height, width = picture.shape[:2]
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    x, y = camera.undistort(u, v)
    # An array's first pixel has its middle at 0, not at 0.5.
    place = np.stack([camera.fy * y + height / 2 - 0.5, camera.fx * x + width / 2 - 0.5])
    # Splines, as they move no edge; OpenCV's cubic interpolation does, by some hundredths of a pixel.
    return np.stack([map_coordinates(channel, place, mode="nearest") for channel in np.moveaxis(picture, 2, 0)], axis=2)
