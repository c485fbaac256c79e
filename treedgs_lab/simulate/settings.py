"""What can be set about a synthetic plot, and the three sizes it comes in.

What is odd about a stand is off by default. Like the troubles (:mod:`.trouble`), each part draws from a random stream
of its own and only when it is asked for.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.settings import param, params_of

from .options import CameraSettings, GridSettings, WeatherSettings, count, flag, number
from .trouble import TroubleSettings


@dataclass(frozen=True, kw_only=True)
class StemLookSettings:
    """Bark, section and what grows on and about the stems (keys of ``simulate-plot --stand``)."""

    sweep_cm: float = number(0.0, 0, 100, "cm", "sideways bow of every in-plot stem over its lowest 4 m")
    butt_flare_m: float = number(
        0.0, 0, 3, "m", "height over which the butt flare falls to a third; 0 = 0.16 to 0.28 m, drawn"
    )
    ellipticity_pct: float = number(
        0.0, 0, 40, "%", "widest less narrowest width of every stem, of the mean; 0 = up to 6, drawn"
    )

    bark_variety: bool = flag(
        "each stem has one of five barks: furrowed plates, smooth grey, pale with dark lenticels, dark furrows, "
        "reddish flakes; off = furrowed plates"
    )
    bark_photos: Path | None = param(
        None,
        kind="folder",
        help="seamless photographs of bark, each about 1.3 m of a stem; with bark_variety each stem has "
        "one of them, else all have the first",
    )
    leaf_photos: Path | None = param(
        None, kind="folder", help="photographs of leaves, clear where none are: leaves have colours of theirs"
    )
    moss_pct: float = number(
        0.0, 0, 60, "%", "bark under moss, mean of the lowest 2 m; most at the foot and on the north side"
    )
    lichen_pct: float = number(0.0, 0, 60, "%", "bark under pale lichen, mean")
    ivy_stems: int = count(
        0, 0, 100, "in-plot stems under ivy from the ground to 1.5-5 m, its leaves 3-8 cm off the bark"
    )
    wrapped_stems: int = count(0, 0, 100, "in-plot stems with shrubs all round their lowest 1-2 m")
    flute_pct: float = number(
        0.0, 0, 40, "%", "depth of the hollows between 3 to 6 lobes all the way up every stem, of its radius"
    )
    buttress_m: float = number(
        0.0, 0, 3, "m", "height over which 3 to 6 root buttresses (a third of the radius at the ground) fall to a third"
    )
    snags: int = count(0, 0, 100, "in-plot dead stems of weathered wood, without twigs, broken off at 4-10 m")


@dataclass(frozen=True, kw_only=True)
class StandSettings(StemLookSettings):
    """The stand and its undergrowth: the keys of ``simulate-plot --stand``."""

    dbh_sd_cm: float = number(6.7, 0, 25, "cm", "standard deviation of the diameters")
    lean_max_deg: float = number(4.0, 0, 30, "deg", "largest lean of any stem")
    strong_leans: int = count(0, 0, 10, "in-plot stems that lean by 75-100 % of the largest lean")
    forks_below_bh: int = count(0, 0, 10, "in-plot trees forked below breast height")
    forks_above_bh: int = count(0, 0, 10, "in-plot trees forked above breast height")
    touching_saplings: int = count(0, 0, 10, "in-plot stems touched by a sapling")
    twins: int = count(0, 0, 10, "in-plot trees with a second full stem beside them")
    twin_gap_m: float = number(0.1, 0, 2, "m", "gap between the bark of twins at breast height")
    clearing_m: float = number(0.0, 0, 30, "m", "no tree stands within this distance of the plot's centre")
    leaf_area_m2: float = number(
        38.0, 0, 200, "m2", "one-sided needle area of a tree of mean DBH; what hides the stems"
    )
    shrubs_per_m2: float = number(0.13, 0, 2, "1/m2", "shrubs, up to shrub_height_m")
    saplings_per_m2: float = number(0.025, 0, 1, "1/m2", "saplings below 7.5 cm DBH")
    logs: int = count(5, 0, 50, "logs lying about")
    slope_pct: float = number(3.0, 0, 60, "%", "slope of the ground")

    hardwood_pct: float = number(0.0, 0, 100, "%", "trees that are hardwoods")
    leaf_off: bool = flag("hardwoods are bare, and so is a third of the shrubs of several kinds")
    spacing: str = param(
        "rows",
        choices=("rows", "natural"),
        help="rows: planted, jittered; natural: at random with a least distance, denser here and thinner there",
    )
    dbh_distribution: str = param(
        "normal",
        choices=("normal", "lognormal"),
        help="of the diameters, with the stated mean and standard deviation",
    )
    shrub_height_m: float = number(2.0, 0.3, 5, "m", "height of the tallest shrubs")
    shrub_variety: bool = flag("shrubs of several kinds: greens and browns, small and large leaves")
    undergrowth_per_m2: float = number(
        0.0, 0, 4, "1/m2", "young broadleaved plants 0.5-2.5 m high with leaves down to the ground"
    )


PLOT_PRESETS = ("demo", "test", "plot", "micro")


@dataclass(frozen=True, kw_only=True)
class PlotSettings:
    """What most who simulate a plot set. ``None`` means: as the preset says (:data:`SIZES`)."""

    output: Path = param(
        kind="output_folder",
        help="folder for the plot; made if missing, replaced if it is a simulated plot",
        known_by="truth/config.json",
    )
    preset: str = param(
        "demo",
        choices=PLOT_PRESETS,
        help="size of the job: micro (3-5 stems, for the stability suite), test (3-6 stems), "
        "demo (6-9 stems), plot (0.03 ha, 62 photos)",
    )
    seed: int = count(1, 0, 2**31, "random seed; the same seed gives the same plot")
    radius_m: float | None = number(None, 2, 15, "m", "radius of the plot")
    from_cloud: Path | None = param(
        None,
        help="a terrestrial scan (LAS, LAZ, E57 or text, metres) to photograph instead of a grown stand: its points as "
        "small patches, truth the rings measured in it; the plot holds it unless --radius-m says otherwise",
        suffixes=("laz", "las", "e57", "txt", "xyz", "csv"),
        dialog=False,
    )
    stems_per_ha: float = number(700.0, 100, 2500, "1/ha", "planting density")
    dbh_mean_cm: float = number(27.4, 8, 70, "cm", "mean diameter at breast height")
    photos: int | None = count(None, 8, 400, "number of photos, both flights together")
    gsd_cm: float = number(1.84, 0.3, 10, "cm", "ground sample distance straight down from 70 m; sets the focal length")
    flight: str = param(
        "rings",
        dialog=False,
        help="rings: nadir photos and rings aimed at the plot; grid: parallel nadir lines and a crosshatch of oblique "
        "ones over an area, not aimed at any plot; walk: level photos at eye level, round the plot and through it; "
        "low: two rings below the crowns; or a flight plan, plan.gpkg of plan-flight: its photos, camera and plots",
    )
    control_points: int = count(
        0, 0, 40, "surveyed plates on the ground, with their marks in the photos (gcp_list.txt)", dialog=False
    )
    lidar_density_m2: float | None = number(
        None, 0, 5000, "1/m2", "LiDAR pulses per square metre; 0 = no cloud", dialog=False
    )
    world: str = param(
        "own",
        choices=("own", "cycles"),
        dialog=False,
        help="what renders the photos: own; cycles: the path tracer of Blender (the program blender, 3.4 to 4.1, with "
        "its add-on Sapling), crowns, bark, ground and sky with it",
    )


@dataclass(frozen=True, kw_only=True)
class SimulateSettings(PlotSettings, StandSettings, CameraSettings, GridSettings, WeatherSettings, TroubleSettings):
    """All that can be set about a plot, as the simulator reads it. name: of the plot, in file names; ``None``: the
    folder's."""

    name: str | None = None


def _keys(record: type, help: str) -> Any:
    return param(None, kind="record", record=record, dialog=False, help=help)


@dataclass(frozen=True, kw_only=True)
class SimulateOptions(PlotSettings):
    """Options of ``simulate-plot``: what is rarely set is a key of one of five."""

    stand: StandSettings | None = _keys(StandSettings, "leans, forks, barks, undergrowth, ground")
    camera: CameraSettings | None = _keys(CameraSettings, "size, rays, lens, shutter, motion and developing of photos")
    grid: GridSettings | None = _keys(GridSettings, "of --flight grid: height, overlaps, number of plots")
    weather: WeatherSettings | None = _keys(WeatherSettings, "sky, sun, wind")
    faults: TroubleSettings | None = _keys(TroubleSettings, "blurred and badly exposed photos, errors of the receiver")

    def whole(self) -> SimulateSettings:
        """Every setting by its own name."""
        values: dict[str, Any] = {}
        for name, spec, _ in params_of(SimulateOptions):
            given = getattr(self, name)
            values |= vars(given or spec.record()) if spec.record else {name: given}
        return SimulateSettings(**values)


def command_words(given: dict[str, Any]) -> list[str]:
    """Options of ``simulate-plot`` for settings by their own names."""
    words = []
    for name, spec, _ in params_of(SimulateOptions):
        keys = [key for key, _, _ in params_of(spec.record) if key in given] if spec.record else []
        if keys:
            words.append(f"--{name}=" + ",".join(f"{key}={given[key]}" for key in keys))
        elif name in given:
            words.append(f"--{name.replace('_', '-')}={given[name]}")
    return words


#: Photos from among the stems (:func:`.flight.level_shots`), and their focal length in widths of a photo.
LEVEL_FLIGHTS, LEVEL_FOCAL = ("walk", "low"), 0.7


@dataclass(frozen=True)
class Sizes:
    """Lengths and counts that a preset fixes and the settings may override.

    rings: (height m, pitch deg, share of the ring photos, flight). samples: rays a pixel. name: of the plot, for files.
    """

    radius_m: float
    image_width: int
    image_height: int
    photos: int
    nadir: int
    nadir_step_m: float
    rings: tuple[tuple[float, float, float, int], ...]
    target_off_m: float
    samples: int
    lidar_density_m2: float
    lidar_half_m: float
    stand_radius_m: float
    name: str = "plot"


#: The presets.
SIZES = {
    "micro": Sizes(
        3.6, 560, 440, 26, 1, 3.0, ((70.0, -57.0, 0.6, 0), (90.0, -53.0, 0.4, 1)), 0.8, 2, 1400.0, 5.0, 24.0
    ),
    "test": Sizes(
        4.6, 720, 540, 28, 4, 3.0, ((70.0, -57.0, 0.67, 0), (90.0, -53.0, 0.33, 1)), 1.0, 4, 200.0, 7.0, 36.0
    ),
    "demo": Sizes(
        6.0,
        1024,
        768,
        40,
        4,
        5.0,
        ((70.0, -75.0, 0.11, 0), (70.0, -57.0, 0.48, 0), (90.0, -53.0, 0.41, 1)),
        2.0,
        4,
        600.0,
        9.0,
        42.0,
    ),
    "plot": Sizes(
        10.0,
        1280,
        960,
        62,
        9,
        7.5,
        ((70.0, -75.0, 0.17, 0), (70.0, -57.0, 0.38, 0), (90.0, -53.0, 0.45, 1)),
        3.0,
        5,
        1400.0,
        12.0,
        46.0,
    ),
}


def resolve(settings: SimulateSettings) -> tuple[SimulateSettings, Sizes]:
    """Fill what was left to the preset; returns complete settings (for the record) and the sizes to work with.

    Raises:
        InputError: an unknown preset, photos too small for the plot, or too few.
    """
    if settings.preset not in SIZES:
        raise InputError(f"--preset: found {settings.preset!r}, expected one of {', '.join(PLOT_PRESETS)}.")
    name = settings.name or Path(settings.output).resolve().name
    name = "".join(c if c.isalnum() or c in "_-" else "_" for c in name)[:40] or "plot"
    fields = ("radius_m", "image_width", "image_height", "photos", "samples", "lidar_density_m2")
    given = {field: value for field in fields if (value := getattr(settings, field)) is not None}
    sizes = dataclasses.replace(SIZES[settings.preset], name=name, **given)
    if settings.flight not in ("rings", "grid", *LEVEL_FLIGHTS):
        return _planned(settings, sizes, name, given)
    if settings.flight != "grid" and (settings.plots > 1 or settings.terrain_following):
        raise InputError("--grid: plots and terrain_following are for grid flights; give --flight grid.")
    if settings.flight in LEVEL_FLIGHTS:
        settings = dataclasses.replace(settings, gsd_cm=7000 / (LEVEL_FOCAL * sizes.image_width))
    if settings.flight != "rings":
        if settings.photos is not None:
            raise InputError(f"--photos: {settings.flight} has as many as its way asks for; leave it out.")
        # The record names no number that the flight does not have.
        return dataclasses.replace(
            settings, name=name, **{f: getattr(sizes, f) for f in fields if f != "photos"}
        ), sizes
    _check_rings(settings, sizes)
    return dataclasses.replace(settings, name=name, **{field: getattr(sizes, field) for field in fields}), sizes


def _planned(
    settings: SimulateSettings, sizes: Sizes, name: str, given: dict[str, float]
) -> tuple[SimulateSettings, Sizes]:
    """Settings for a planned flight: its plots, and its camera with as many pixels as asked for."""
    path = Path(settings.flight)
    if path.suffix.lower() != ".gpkg" or not path.is_file():
        raise InputError(
            f"--flight: found {settings.flight!r}, expected rings, grid, walk, low, or a flight plan that exists "
            "(plan.gpkg)."
        )
    if settings.photos is not None or settings.plots > 1:
        raise InputError("--photos, --grid plots: are those of the flight plan; leave them out.")
    from .planned_flight import read_flight

    plan = read_flight(path)
    width = int(given.get("image_width", plan.width_px))
    height = int(given.get("image_height", round(width * plan.height_px / plan.width_px)))
    radius = float(given.get("radius_m", plan.radius_m))
    sizes = dataclasses.replace(sizes, image_width=width, image_height=height, radius_m=radius, photos=len(plan.photos))
    gsd_cm = 7000 / (plan.focal_px * width / plan.width_px)
    fields = {
        field: getattr(sizes, field)
        for field in ("image_width", "image_height", "radius_m", "samples", "lidar_density_m2")
    }
    return dataclasses.replace(settings, name=name, gsd_cm=gsd_cm, plots=len(plan.centres), **fields), sizes


def _check_rings(settings: SimulateSettings, sizes: Sizes) -> None:
    """Photos of the rings hold the plot, and there are enough of them."""
    short_m = sizes.image_height * settings.gsd_cm / 100
    if short_m < 1.2 * sizes.radius_m:
        raise InputError(
            f"--camera image_height: a photo covers {short_m:.1f} m of ground, expected at least 1.2 times the plot "
            f"radius ({sizes.radius_m:g} m); give larger photos, a coarser --gsd-cm or a smaller --radius-m."
        )
    if sizes.photos < sizes.nadir + 6:
        raise InputError(
            f"--photos: found {sizes.photos}, expected at least {sizes.nadir + 6} for this preset "
            f"({sizes.nadir} nadir photos and the rings)."
        )
