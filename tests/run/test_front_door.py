"""``import treedgs_geo as tg``: every name loads, is typed, and its example runs."""

from __future__ import annotations

import doctest
import shutil
import subprocess
import sys

import pytest

import treedgs_geo as tg


@pytest.mark.parametrize("name", tg.__all__)
def test_the_example_of_every_name_runs(name, simulated_plot, tmp_path, request):
    given = {"plot": simulated_plot, "work": tmp_path}
    if name == "measure_photos":  # goes on in a finished workspace
        shutil.copytree(request.getfixturevalue("finished") / "work", tmp_path, dirs_exist_ok=True)
    tests = doctest.DocTestFinder(recurse=False).find(getattr(tg, name), name, globs=given)
    assert sum(len(test.examples) for test in tests) >= 2, f"{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for test in tests:
        runner.run(test)
    assert runner.failures == 0


def test_names_are_listed_and_others_are_an_attribute_error():
    assert set(tg.__all__) <= set(dir(tg))
    with pytest.raises(AttributeError, match="no attribute 'measure_photo'"):
        tg.measure_photo  # noqa: B018


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, treedgs_geo; print([m for m in ('numpy', 'torch', 'pyproj', 'numba') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_files_that_would_not_be_written_are_refused(tmp_path):
    with pytest.raises(tg.TreeDGSError, match="measure_cloud: writes no file, so that report would not be"):
        tg.measure_cloud(tmp_path / "no.laz", report=tmp_path / "r.html")
