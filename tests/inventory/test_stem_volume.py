"""Volume of stems to a top diameter from measured sections, against exact solids; its columns in the stand table."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from openpyxl import load_workbook
from shapely.geometry import Point

from treedgs_geo.cli import main
from treedgs_geo.inventory.stand.stem_volume import STUMP_M, stem_volume
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree

TIP = 20.0


def curve(top_m, power=1.0):
    h = np.arange(0.5, top_m + 0.01, 0.5)
    return h, 30 * ((TIP - h) / (TIP - 1.3)) ** power, np.full(len(h), 0.5)


def exact(top_cm, power=1.0):
    """Integral of the solid from the stump to the top diameter."""
    h = np.linspace(STUMP_M, TIP - (top_cm / 30) ** (1 / power) * (TIP - 1.3), 20_001)
    d = 30 * ((TIP - h) / (TIP - 1.3)) ** power
    return float(np.trapezoid(np.pi / 4e4 * d**2, h))


@pytest.mark.parametrize("power", [0.5, 0.75, 1.0])
@pytest.mark.parametrize("top_m", [19.5, 15.0, 11.0])
def test_exact_solids(power, top_m):
    """Cone, paraboloid and between: measured to the top diameter, or continued to a known tip within the error."""
    found, se = stem_volume(*curve(top_m, power), TIP, 7.0)
    assert abs(found - exact(7.0, power)) < (0.005 * found if top_m > 19 else 1.645 * se)
    assert 0.02 * found < se < 0.12 * found


def test_a_curve_that_is_too_short_gives_none():
    h, d, se = curve(9.0)
    for heights, tip in ((slice(None), TIP), (slice(None), np.nan), (slice(3, None), TIP)):
        assert np.isnan(stem_volume(h[heights], d[heights], se[heights], tip, 7.0)).all()
    h, d, se = curve(15.0)
    gap = (h < 4) | (h > 7)
    assert np.isnan(stem_volume(h[gap], d[gap], se[gap], TIP, 7.0)).all()
    assert np.isnan(stem_volume(h, d, se, np.nan, 7.0)).all()  # still 8 cm thick, and nobody knows the tip


def test_the_stand_table_has_the_volume_of_trees_whose_curve_is_theirs(tmp_path):
    trees, sections = [], []
    for k, dbh in enumerate((30.0, 30.0, 40.0)):  # the third was taped: its curve says 30 cm
        trees.append(Tree(k + 1, 500000.0 + 3 * k, 5.2e6, dbh_cm=dbh, dbh_se_cm=0.5, height_m=TIP, z_ground=100.0))
        for h, d, se in zip(*curve(15.0 if k else 4.0), strict=True):
            sections.append(
                {
                    "tree_id": k + 1,
                    "height_m": h,
                    "d_cm": d,
                    "d_se_cm": se,
                    "rms_cm": 1.0,
                    "n_pts": 50,
                    "arc_deg": 360.0,
                }
                | {"x": 500000.0, "y": 5.2e6}
            )
    write_trees(tmp_path / "trees.gpkg", trees, "EPSG:32632", sections)
    square = gpd.GeoDataFrame(geometry=[Point(500003.0, 5.2e6).buffer(20)], crs="EPSG:32632")
    square.to_file(tmp_path / "stand.gpkg", layer="stand")
    out = tmp_path / "out"
    given = ("--trees", tmp_path / "trees.gpkg", "--boundary", tmp_path / "stand.gpkg", "--output", out)
    assert main(["stand-table", *map(str, given)]) == 0
    listed = gpd.read_file(out / "stand.gpkg", layer="stand_trees").set_index("tree_id")
    assert listed.loc[["1", "3"], "stem_m3"].isna().all()
    assert listed.loc["2", "stem_m3"] == pytest.approx(exact(7.0), rel=0.03) and listed.loc["2", "stem_se_m3"] > 0
    cells = [str(cell.value) for sheet in load_workbook(out / "stand_table.xlsx") for row in sheet for cell in row]
    assert any("Stem by its curve" in cell for cell in cells)
