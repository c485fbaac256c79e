"""For the tests of campaigns: layers compared, two hosts on one machine."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from treedgs_geo.inventory.tree_reading import read_trees

#: Columns that name a run, not a tree.
_NAMES = {"tree_id", "plot_id", "run_id", "camp_plot", "plot_tree", "geometry"}


def trees_by_plot(layer: Path, plot_id: str | None = None) -> dict[str, list[tuple]]:
    """Every value of every tree, by plot; of a single plot's layer when ``plot_id`` is given."""
    table = read_trees(layer)
    table["_plot"] = plot_id if plot_id else table["camp_plot"]
    table["_tree"] = table["tree_id"] if plot_id else table["plot_tree"]
    table["_point"] = table.geometry.to_wkt(rounding_precision=6)
    columns = ["_tree", "_point", *sorted(set(table.columns) - _NAMES - {"_plot", "_tree", "_point"})]
    found: dict[str, list[tuple]] = {}
    for plot, part in table.groupby("_plot", sort=False):
        rows = part[columns].sort_values("_tree").itertuples(index=False, name=None)
        found[str(plot)] = [tuple(None if pd.isna(v) else v for v in row) for row in rows]
    return found


def differences(layer: Path, other: Path | dict[str, Path]) -> list[str]:
    """What differs between a campaign's layer and another one, or single plots' layers; empty = the same trees, each
    plot once, ids unique."""
    here = trees_by_plot(layer)
    there: dict[str, list[tuple]] = {}
    if isinstance(other, dict):
        for name, path in other.items():
            there.update(trees_by_plot(path, name))
    else:
        there = trees_by_plot(other)
    found = [f"{name}: only in one of them" for name in sorted(set(here) ^ set(there))]
    for name in sorted(set(here) & set(there)):
        if len(here[name]) != len(there[name]):
            found.append(f"{name}: {len(here[name])} trees against {len(there[name])}")
        elif here[name] != there[name]:
            pairs = zip(here[name], there[name], strict=True)
            found.append(f"{name}: {next((one, two) for one, two in pairs if one != two)}")
    ids = read_trees(layer)["tree_id"]
    if not ids.is_unique:
        found.append("tree ids are not unique")
    return found


def may_make_hosts() -> bool:
    """Whether network namespaces are permitted here."""
    with contextlib.suppress(OSError):
        if _ip("netns", "add", "treedgs-probe", check=False).returncode == 0:
            _ip("netns", "del", "treedgs-probe", check=False)
            return True
    return False


@contextlib.contextmanager
def two_hosts(logs: Path, memory_gb: float = 4.0) -> Iterator[str]:
    """A scheduler here and one worker in each of two network namespaces that reach it through a bridge only; yields
    the scheduler's address. Needs the right to make namespaces."""
    logs.mkdir(parents=True, exist_ok=True)
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker"]
    net, names = "10.213.77", ("tdg-host-a", "tdg-host-b")
    running: list[subprocess.Popen] = []
    with contextlib.ExitStack() as stack:

        def undo(*words: str) -> None:
            stack.callback(lambda: _ip(*words, check=False))

        _ip("link", "add", "tdg-br", "type", "bridge")
        undo("link", "del", "tdg-br")
        _ip("addr", "add", f"{net}.1/24", "dev", "tdg-br")
        _ip("link", "set", "tdg-br", "up")
        for number, name in enumerate(names, start=2):
            _ip("netns", "add", name)
            undo("netns", "del", name)
            _ip("link", "add", f"tdg-v{number}", "type", "veth", "peer", "name", "eth0", "netns", name)
            _ip("link", "set", f"tdg-v{number}", "master", "tdg-br", "up")
            _ip("-n", name, "addr", "add", f"{net}.{number}/24", "dev", "eth0")
            _ip("-n", name, "link", "set", "eth0", "up")
            _ip("-n", name, "link", "set", "lo", "up")

        def start(title: str, command: list[str], **more: str) -> None:
            log = stack.enter_context(open(logs / f"{title}.log", "w", encoding="utf-8"))
            running.append(
                subprocess.Popen(
                    command, stdout=log, stderr=log, cwd=logs, start_new_session=True, env={**os.environ, **more}
                )
            )

        stack.callback(_end_all, running)
        address = f"tcp://{net}.1:8797"
        start("scheduler", [*dask, "--host", f"{net}.1", "--port", "8797", "--no-dashboard"])
        for name in names:
            start(
                name,
                [
                    "ip",
                    "netns",
                    "exec",
                    name,
                    *worker,
                    address,
                    "--nthreads",
                    "1",
                    "--memory-limit",
                    "0",
                    "--resources",
                    f"memory_gb={memory_gb}",
                    "--no-dashboard",
                    "--name",
                    name,
                ],
                TREEDGS_HOST=name,
            )
        _wait_for(address, len(names))
        yield address


def _wait_for(address: str, workers: int) -> None:
    from distributed import Client

    until = time.monotonic() + 60
    while time.monotonic() < until:
        with contextlib.suppress(OSError, TimeoutError), Client(address, timeout=2, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=30)
            return
    raise RuntimeError(f"no scheduler at {address}")


def _end_all(running: list[subprocess.Popen]) -> None:
    if sys.platform == "win32":
        raise OSError("two hosts on one machine are made on Linux alone")
    for process in running:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _ip(*words: str, check: bool = True) -> subprocess.CompletedProcess:
    return subprocess.run(["ip", *words], check=check, capture_output=True, text=True)
