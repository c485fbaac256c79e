"""Where stems stand: positions read from a table or a point layer, in the project CRS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj

from ...core.columns import columns, places, require
from ...core.crs import LocalFrame
from ...core.errors import CRSError, InputError, MissingComponentError
from ...core.tables import read_table


def read_seeds(path: Path, frame: LocalFrame) -> np.ndarray:
    """(K, 2) stem positions in the local frame.

    path: CSV with columns x, y (or easting, northing) in the frame's CRS, or a point layer (GeoPackage, Shapefile,
    GeoJSON), which is transformed from its own CRS.

    Raises:
        InputError: missing, unreadable, empty, without coordinates or not points. CRSError: a layer without a CRS.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: not found; give a CSV with x, y or a point layer of stem positions.")
    found = _from_csv(path, frame.crs) if path.suffix.lower() in (".csv", ".txt") else _from_layer(path, frame.crs)
    if len(found) == 0:
        raise InputError(f"{path}: holds no stem position; give at least one point.")
    if not np.isfinite(found).all():
        raise InputError(f"{path}: holds positions that are not numbers; remove those rows.")
    local = frame.to_local(np.column_stack([found, np.zeros(len(found))]))[:, :2]
    if np.abs(local).max() > 5000:
        raise InputError(
            f"{path}: stem positions lie {np.abs(local).max() / 1000:.0f} km from the photos; give them in "
            f"{frame.crs.to_string()}."
        )
    return local


def _from_csv(path: Path, crs: pyproj.CRS) -> np.ndarray:
    table = read_table(path)
    require(path, table, columns(table, "easting", "northing", "lon", "lat"), (("easting", "lon"), ("northing", "lat")))
    return places(path, table, crs)


def _from_layer(path: Path, crs: pyproj.CRS) -> np.ndarray:
    import geopandas

    try:
        layer = geopandas.read_file(path)
    except Exception as problem:  # pyogrio raises its own types
        raise InputError(
            f"{path}: cannot be read as a vector layer ({problem}); give a point layer or a CSV."
        ) from None
    if layer.crs is None:
        raise CRSError(f"{path}: has no coordinate reference system; set one in QGIS and save the layer again.")
    if len(layer) and not (layer.geom_type == "Point").all():
        raise InputError(
            f"{path}: holds {', '.join(sorted(set(map(str, layer.geom_type))))}, expected points; give stem positions."
        )
    layer = layer.to_crs(crs)
    return np.column_stack([layer.geometry.x, layer.geometry.y])


def read_dense(path: Path, frame: LocalFrame) -> tuple[np.ndarray, np.ndarray | None]:
    """Points to start Gaussians from: (M, 3) local, and (M, 3) colours 0..1 or None.

    path: LAS/LAZ in the project CRS, or a PLY in the reconstruction's own local frame, as OpenMVS writes it
    (``scene_dense.ply``, made from the workspace's ``sfm/``).

    Raises:
        InputError: missing, unreadable, empty, or not where the photos are. MissingComponentError: open3d, for a PLY.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: not found; give a LAS/LAZ cloud or OpenMVS's scene_dense.ply.")
    colours = None
    if path.suffix.lower() == ".ply":
        try:
            import open3d
        except ImportError:
            raise MissingComponentError(
                f"{path}: reading a PLY needs the package open3d, which is not installed; run 'pip install open3d' in "
                "the engine's environment, or give the points as LAZ in the project CRS."
            ) from None

        with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
            cloud = open3d.io.read_point_cloud(path)
        xyz = np.asarray(cloud.points, float)
        colours = np.asarray(cloud.colors, float) if cloud.has_colors() else None
    else:
        from ...pointcloud.files import read_cloud

        xyz = frame.to_local(read_cloud(path, attributes=()).xyz)
    if len(xyz) == 0 or not np.isfinite(xyz).all():
        raise InputError(f"{path}: holds no readable points; write it again.")
    if np.abs(np.median(xyz, axis=0)).max() > 5000:
        raise InputError(
            f"{path}: lies {np.abs(np.median(xyz, axis=0)).max() / 1000:.0f} km from the photos; a PLY must be "
            "in the local frame of sfm/, a LAZ in the project CRS."
        )
    return xyz, colours
