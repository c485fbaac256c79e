"""Real photos that we did not make: no diameter is known, but surveyed points have their place, where no tree stands
none may come out, and what is of one design should be alike.

    python -m treedgs_lab.benchmarks.photos.real_photos [SET ...] --data DIR --work DIR [--output FILE]

DIR holds the folders of the sets with their photos in ``images/`` (:data:`SETS` has their public repositories). Every
other control point of a list is held back as a check point.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pycolmap

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.files import read_json
from treedgs_geo.geotags.control import read_control_rows
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.reconstruction.poses import fit_similarity
from treedgs_lab.benchmarks.processes import words
from treedgs_lab.benchmarks.records import write_record

_MARKS, _THINGS, _FIELDS = (
    Path(__file__).with_name(f"{name}.csv") for name in ("south_building", "south_building_things", "seneca_plots")
)


@dataclass(frozen=True)
class RealSet:
    """Public photos. repository: on GitHub. crs: of the run. marks: control points, None for the positions in the
    photos. things: plots of what stands there, KIND or KIND_NUMBER, those of a kind of one design. options: of
    ``photos-to-dbh``. folder: of the photos, another one than the set's name; half: every other photo, from this one
    on. colmap: its block with its defaults stands beside ours."""

    repository: str
    crs: str | None = None
    marks: Path | None = None
    things: Path | None = None
    options: tuple[str, ...] = ()
    folder: str = ""
    half: int | None = None
    colmap: bool = False


# A court that was walked. Its points are those of a block by COLMAP, levelled by the plane of the cameras, with the
# cameras 1.6 m above the ground: the place is invented and the scale a guess, so that ratios alone mean anything.
# Things are measured above the hedge that hides the trunk's foot.
_COURT = RealSet(
    "sbradley374/gaussian-splat-test", "EPSG:32617", _MARKS, _THINGS, ("--max-dbh-cm", "130", "--bh-m", "2.5")
)
SETS = {
    "south_building": _COURT,
    "south_building_1_3_5": replace(_COURT, folder="south_building", half=0),
    "south_building_2_4_6": replace(_COURT, folder="south_building", half=1),
    "copr": RealSet("OpenDroneMap/odm_data_copr", "EPSG:32611", Path("gcp_list.txt"), colmap=True),
    "boruszyn_kap": RealSet("merkato/odm_boruszyn_kap", "EPSG:2180", Path("gcp_list.txt")),
    "ochota_kap": RealSet("merkato/odm_ochota_kap", "EPSG:2180", Path("gcp_list.txt")),
    "caliterra": RealSet("OpenDroneMap/odm_data_caliterra"),
    "seneca": RealSet("OpenDroneMap/odm_data_seneca", things=_FIELDS),  # 14 ha: an hour without plots
    "testerarm": RealSet("testerarm/images"),
}


def control(folder: Path, of: RealSet, target: Path) -> list[Any]:
    """``--gcp`` with a CSV of the set's marks, every other point a check point unless the list says which are; with the
    list itself where it cannot be read."""
    if of.marks is None:
        return []
    try:
        crs, rows = read_control_rows(folder / of.marks)
    except InputError:
        return ["--gcp", folder / of.marks]
    if rows["is_check"].isna().all():
        rows["is_check"] = pd.factorize(rows["label"])[0] % 2 == 1
    rows["kind"] = np.where(rows["is_check"].astype(bool), "check", "control")
    rows = rows.rename(columns={"x": "easting", "y": "northing", "z": "height", "sd_e": "sd_h_m", "sd_u": "sd_v_m"})
    kept = ["label", "easting", "northing", "height", "sd_h_m", "sd_v_m", "photo", "u", "v", "kind"]
    target.parent.mkdir(parents=True, exist_ok=True)
    rows[kept].dropna(axis=1).to_csv(target, index=False)
    return ["--gcp", target, "--crs", of.crs or crs]


def photos_of(folder: Path, half: int | None, target: Path) -> Path:
    """The photos, or a folder of links to every other one."""
    if half is None:
        return folder
    target.mkdir(parents=True, exist_ok=True)
    for photo in sorted(folder.iterdir())[half::2]:
        (target / photo.name).unlink(missing_ok=True)
        (target / photo.name).symlink_to(photo.resolve())
    return target


def colmap_block(photos: Path, control: Path, work: Path) -> dict[str, Any]:
    """COLMAP's block with its defaults: its largest model, turned and scaled to the control points as they lie in it,
    and how far off its check points are (root mean square E, N, U, m)."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    pycolmap.extract_features(work / "photos.db", photos, camera_mode=pycolmap.CameraMode.SINGLE)
    pycolmap.match_exhaustive(work / "photos.db")
    models = pycolmap.incremental_mapping(work / "photos.db", photos, work)
    model = max(models.values(), key=lambda made: made.num_reg_images())
    placed = {image.name: image for image in model.images.values() if image.has_pose}
    seen, points = pd.read_csv(control).query("photo in @placed"), []
    for _, marks in seen[seen.duplicated("label", keep=False)].groupby("label"):
        images = [placed[name] for name in marks["photo"]]
        poses, cameras = [image.cam_from_world() for image in images], [image.camera for image in images]
        if found := pycolmap.estimate_triangulation(marks[["u", "v"]].to_numpy(float), poses, cameras):
            place = marks[["easting", "northing", "height"]].iloc[0].to_list()
            points.append((found["xyz"], place, marks["kind"].iloc[0] == "check"))
    lies, surveyed, check = (np.array(part) for part in zip(*points, strict=True))
    # COLMAP's own similarity finds none where all points have one height.
    own = fit_similarity(lies[~check], surveyed[~check], np.ones((~check).sum()))
    off = own.apply(lies) - surveyed
    rms = np.sqrt((off[check] ** 2).mean(axis=0)).round(3).tolist()
    sizes = [made.num_reg_images() for made in models.values()]
    return {"registered": max(sizes), "models": sizes, "check_points": int(check.sum()), "check_rms_e_n_u_m": rms}


def like_things(layer: pd.DataFrame) -> list[dict[str, Any]]:
    """One row a kind of things: in how many places one is measured, their mean and standard deviation."""
    inside = layer[layer["plot_id"].fillna("") != ""]
    kinds = inside.assign(kind=inside["plot_id"].str.split("_").str[0], is_ok=inside["qc_flag"] == "ok").groupby("kind")
    found = kinds.agg(
        trees=("tree_id", "size"), with_dbh=("dbh_cm", "count"), ok=("is_ok", "sum"),
        mean_cm=("dbh_cm", "mean"), sd_cm=("dbh_cm", "std"), se_cm=("dbh_se_cm", "mean"),
    )  # fmt: skip
    return found.round(2).reset_index().astype(object).where(lambda table: table.notna(), None).to_dict("records")


def measure(name: str, data: Path, work: Path) -> dict[str, Any]:
    """One set through ``photos-to-dbh``: its block, its trees, and its like things beside each other."""
    of, trees = SETS[name], work / name / "trees.gpkg"
    folder = data / (of.folder or name)
    photos = photos_of(folder / "images", of.half, work / f"{name}_photos")
    inputs = ["--photos", photos, *control(folder, of, work / f"{name}.csv")]
    inputs += [] if of.things is None else ["--plots", of.things]
    more = [*of.options, "--heights", "none", "--orthophoto", "false", "--log-format", "plain", "--overwrite"]
    ran = subprocess.run(
        words("photos-to-dbh", *inputs, "--workspace", work / name, "--output", trees, *more),
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    found: dict[str, Any] = {"set": name, "repository": of.repository, "exit_code": ran.returncode}
    if (work / name / "sfm" / "report.json").exists():
        report = read_json(work / name / "sfm" / "report.json")
        kept = ("photos", "registered", "reprojection_rms_px", "control_rms_e_n_u_m", "check_rms_e_n_u_m")
        found |= {key: report[key] for key in kept if key in report}
    if of.colmap:
        found["colmap"] = colmap_block(photos, work / f"{name}.csv", work / f"{name}_colmap")
    if ran.returncode:
        said = [line for line in ran.stderr.strip().splitlines() if line.strip()]
        return found | {"said": said[-1] if said else ""}
    layer = read_trees(trees)
    columns = ["tree_id", "plot_id", "dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "qc_flag", "qc_reason"]
    if of.things is not None:
        found["things"] = like_things(layer)
    rows = layer[columns].assign(e=layer.geometry.x.round(2), n=layer.geometry.y.round(2))
    found |= {"trees": len(rows), "with_dbh": int(rows["dbh_cm"].notna().sum())}
    found["ok"] = int(((rows["qc_flag"] == "ok") & rows["dbh_cm"].notna()).sum())
    found["stems"] = rows.round(2).astype(object).where(rows.notna(), None).to_dict("records")
    return found


def main() -> None:
    """Run the sets, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="*", default=list(SETS), help="all, or some of " + ", ".join(SETS))
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    known = parser.parse_args()
    runs: list[dict[str, Any]] = []
    for name in known.sets:
        runs.append(measure(name, known.data, known.work))
        # A set takes minutes: what is there is kept.
        write_record(known.output, {"runs": runs}, seeds=[0])
    print(pd.DataFrame(runs).drop(columns=["stems", "things"], errors="ignore").to_string(index=False))


if __name__ == "__main__":
    main()
