"""Memory or disk that runs out ends with one sentence and leaves nothing half-written."""

from __future__ import annotations

import resource
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from pointcloud.odd_clouds import stand, write_las

from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError, MemoryShortage, OutputError
from treedgs_geo.core.files import atomic_path
from treedgs_geo.core.machine import free_memory, require_memory
from treedgs_geo.core.resource_errors import shortage_of


@contextmanager
def largest_file(size):
    """Writes beyond ``size`` bytes fail, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def plot(tmp_path_factory):
    path = tmp_path_factory.mktemp("plot") / "plot.laz"
    write_las(path, np.vstack([stand(), np.random.default_rng(1).uniform([0, 0, 8], [12, 12, 20], (40_000, 3))]))
    return path


@pytest.mark.parametrize(
    ("verb", "name", "more", "size"),
    [
        ("pointcloud-to-dbh", "t.gpkg", [], 60_000),
        ("terrain", "t.tif", ["--resolution-m", "0.05"], 30_000),
        ("segment-stems", "t.laz", ["--keep-all"], 50_000),
        ("segment-stems", "t.las", ["--keep-all"], 50_000),
    ],
)
def test_a_full_disk_is_said_and_leaves_nothing(tmp_path, capsys, plot, verb, name, more, size):
    target = tmp_path / "out" / name
    arguments = [verb, "--input", str(plot), "--output", str(target), "--crs", "local", "--log-format", "plain", *more]
    assert main(arguments) == 0 and target.stat().st_size > size
    for path in target.parent.iterdir():
        path.unlink()
    capsys.readouterr()
    with largest_file(size):
        assert main(arguments) == 2
    reported = capsys.readouterr().err
    assert "the disk is full" in reported and str(target) in reported and "Traceback" not in reported
    assert not list(tmp_path.glob("out/*")) and not list(tmp_path.glob("out/.*"))


def test_other_problems_keep_their_own_sentence(tmp_path):
    with pytest.raises(ZeroDivisionError), atomic_path(tmp_path / "a.txt"):
        raise ZeroDivisionError
    with largest_file(1000), pytest.raises(InputError, match="mine"), atomic_path(tmp_path / "a.txt") as temporary:
        temporary.write_bytes(b"0" * 1000)
        raise InputError("mine")
    assert not list(tmp_path.iterdir())


def test_what_libraries_say_is_understood():
    with pytest.raises(MemoryError) as memory:
        np.empty(10**16)
    assert isinstance(shortage_of(memory.value), MemoryShortage)
    with pytest.raises(OSError) as disk, open("/dev/full", "w") as stream:
        stream.write("0" * 100_000)
        stream.flush()
    assert isinstance(shortage_of(disk.value), OutputError)
    try:
        try:
            raise MemoryError
        except MemoryError as first:
            raise ValueError("while fitting") from first
    except ValueError as second:
        assert isinstance(shortage_of(second), MemoryShortage)
    for text in ("std::bad_alloc", "vector::_M_default_append: length_error", "LLVM: out of memory"):
        assert isinstance(shortage_of(RuntimeError(text)), MemoryShortage)
    assert shortage_of(ValueError("12 trees")) is None


def test_memory_is_asked_for_before_a_library_aborts(tmp_path):
    """A cloth of a hundred million particles in two gigabytes of address space: it would end the process."""
    rng = np.random.default_rng(0)
    xy = rng.uniform(0, 5000, (60_000, 2))
    write_las(tmp_path / "wide.laz", np.column_stack([xy, 0.02 * xy[:, 0] + rng.normal(0, 0.05, len(xy))]))
    code = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (2 * 10**9,) * 2); "
        "from treedgs_geo.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            code,
            "terrain",
            "--input",
            str(tmp_path / "wide.laz"),
            "--output",
            str(tmp_path / "out" / "d.tif"),
            "--resolution-m",
            "5",
            "--crs",
            "local",
            "--log-format",
            "plain",
        ],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 4 and "GB of memory" in done.stderr and "a cloth over" in done.stderr
    assert not (tmp_path / "out").exists()
    assert free_memory() > 0
    with pytest.raises(MemoryShortage, match="a thing needs about 1000000.0 GB"):
        require_memory(1e15, "a thing", "take less")
