"""``import treedgs_geo as tg``: every name loads, is typed, and its example runs."""

from __future__ import annotations

import doctest
import inspect
import re
import shutil
import subprocess
import sys
import warnings
from dataclasses import MISSING

import numpy as np
import pyproj
import pytest
from synthetic_cloud import plot_cloud

import treedgs_geo as tg
from treedgs_geo.core.settings import params_of
from treedgs_geo.verbs import MODULES, get_command


@pytest.mark.parametrize("name", tg._HOMES)
def test_the_example_of_every_name_runs(name, simulated_plot, tmp_path, request):
    given = {"plot": simulated_plot, "work": tmp_path}
    if name in ("measure_photos", "FinishedRun", "open"):  # goes on in a finished workspace
        shutil.copytree(request.getfixturevalue("finished") / "work", tmp_path, dirs_exist_ok=True)
    tests = doctest.DocTestFinder(recurse=False).find(getattr(tg, name), name, globs=given)
    assert sum(len(test.examples) for test in tests) >= 2, f"{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for test in tests:
        runner.run(test)
    assert runner.failures == 0


def test_names_are_listed_and_others_are_an_attribute_error():
    assert set(dir(tg)) == {"__version__", *tg.__all__}
    with pytest.raises(AttributeError, match="no attribute 'measure_photo'"):
        tg.measure_photo  # noqa: B018


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, treedgs_geo; print([m for m in ('numpy', 'torch', 'pyproj', 'numba') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_files_that_would_not_be_written_are_refused(tmp_path):
    with pytest.raises(tg.TreeDGSError, match="measure_cloud: writes no file, so that report would not be"):
        tg.measure_cloud(tmp_path / "no.laz", report=tmp_path / "r.html")


def test_every_verb_is_a_function_with_its_parameters():
    own = {"measure_photos": "photos-to-dbh", "measure_cloud": "pointcloud-to-dbh"}
    assert set(tg._VERBS.values()) | set(own.values()) == set(MODULES)
    for name, verb in tg._VERBS.items():
        found, params = inspect.signature(getattr(tg, name)).parameters, params_of(get_command(verb).settings)
        assert set(found) == {"reporter", *(key for key, _, _ in params)}
        for key, spec, default in params:
            needed = default is MISSING and not spec.kind.startswith("output_")
            assert (found[key].default is inspect.Parameter.empty) == needed
        assert all(f"    {key}: " in getattr(tg, name).__doc__ for key, _, _ in params)
        assert not re.search(r"--[a-z]|(?<!/)stand-table|tape-sample", getattr(tg, name).__doc__), (
            "words of the command line"
        )
    assert "With ``taped`` (``tape_sample``)" in tg.stand_table.__doc__


def test_verbs_in_a_row_write_only_what_is_asked_for(tmp_path):
    stems = [(3.0, 3.0, 28.0), (8.0, 4.0, 36.0), (5.5, 8.5, 24.0)]
    xyz = plot_cloud(np.random.default_rng(3), stems) + [500000.0, 3450000.0, 100.0]
    trees = tg.measure_cloud(tg.PointCloud(xyz, pyproj.CRS.from_epsg(32617)))
    path = tmp_path / "trees.gpkg"
    trees.to_file(path, layer="trees")
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,radius_m\nA,500005.5,3450005.5,8\n")
    stand = tg.stand_table(trees=path, plots=tmp_path / "plots.csv")
    area_ha = np.pi * 8**2 / 1e4
    assert stand.n_trees == 3 and stand.trees_ha == pytest.approx(3 / area_ha, rel=0.01)
    assert stand.read("layers", layer="stand_trees")["tree_id"].nunique() == 3
    kept = stand.report
    drawn = tg.tape_sample(trees=path, plots=tmp_path / "plots.csv", n=2, output=tmp_path / "tapes")
    assert drawn.n == 2 and drawn.read("layer")["tree_id"].nunique() == 2 and drawn.layer.parent == tmp_path / "tapes"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["plots.csv", "tapes", "trees.gpkg"]
    assert kept.exists()
    del stand
    assert not kept.exists()
    with pytest.raises(tg.TreeDGSError, match="tree: is no file of this result; its files are"):
        drawn.read("tree")
    with pytest.raises(AttributeError, match="has no 'n_tree', it has output"):
        drawn.n_tree  # noqa: B018
    with pytest.raises(tg.TreeDGSError, match="'tree' is unknown; did you mean 'trees'"):
        tg.stand_table(tree=path)
    with pytest.raises(tg.TreeDGSError, match="^Give 'plots', or 'boundary' to count"):
        tg.stand_table(trees=path)
    with pytest.warns(tg.TreeDGSWarning, match=r"500 tapes asked for \('n'\), 3 trees are there") as heard:
        tg.tape_sample(trees=path, n=500)
    assert {warning.filename for warning in heard if warning.category is tg.TreeDGSWarning} == {__file__}
    with warnings.catch_warnings():
        warnings.simplefilter("error", tg.TreeDGSWarning)
        tg.tape_sample(trees=path, n=500, reporter=tg.Reporter())


def test_a_dry_run_measures_nothing_and_names_that_are_wrong_are_said(simulated_plot, tmp_path):
    given = {"geotags": simulated_plot, "crs": "EPSG:6344", "plots": simulated_plot / "plots.csv"}
    found = tg.measure_photos(simulated_plot / "images", tmp_path / "work", dry_run=True, **given)
    assert found.n_photos and found.predicted_s and not (tmp_path / "work").exists()
    with pytest.raises(tg.TreeDGSError, match="'nonsense' is no reason"):
        tg.explain("nonsense")
    with pytest.raises(tg.TreeDGSError, match="wrok: not found"):
        tg.open(tmp_path / "wrok")
    with pytest.raises(tg.TreeDGSError, match="has no column x"):
        tg.read_trees(simulated_plot / "plots.csv")
