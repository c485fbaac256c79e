"""Where plots run: Dask workers on this machine, behind a scheduler that runs already, or from a batch queue."""

from __future__ import annotations

import logging
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.children import isolate_workers
from ..core.errors import InputError, MissingComponentError, OutputError, TreeDGSError
from ..core.progress import Reporter
from .certificates import own_security, private_folder, security_of
from .task import RESOURCE

QUEUES = {"slurm": "SLURMCluster", "pbs": "PBSCluster"}
#: Share of the free memory that plots may declare; the rest is for the coordinator, the page cache and QGIS.
MEMORY_SHARE = 0.8
#: Seconds that a worker of this machine may be away before it is replaced.
HEAL_S = 20.0
#: Dask's pages: on this machine only, at a free port.
LOOPBACK = "127.0.0.1:0"
#: Options of a queue: ``--queue-options`` name -> dask-jobqueue's name.
_QUEUE_OPTIONS = (
    "queue",
    "account",
    "project",
    "walltime",
    "cores",
    "memory",
    "jobs",
    "interface",
    "job_extra",
    "prologue",
)


@dataclass(frozen=True)
class Shape:
    """A local cluster. processes: Dask workers; slots: plots at once in each; memory_gb: for the plots of each."""

    processes: int
    slots: int
    memory_gb: float


def shape_of(workers: int, threads: int, memory_gb: float, largest_gb: float, cores: int) -> Shape:
    """As many plots at once as cores and memory carry.

    workers: plots at once asked for, 0 = all that fit. memory_gb: for all plots together. largest_gb: what the largest
    plot (that fits at all) declares; every process can take it. Dask then lets into a process only plots whose
    declared memory fits beside those that run there.
    """
    at_once = workers or max(1, cores // threads)
    processes = max(1, min(at_once, int(memory_gb / max(largest_gb, 1e-6))))
    return Shape(processes, -(-at_once // processes), memory_gb / processes)


def memory_for_plots() -> float:
    """Memory of this machine that plots may use, GB; a control group's limit counts."""
    import psutil

    memory = psutil.virtual_memory()
    free = float(memory.available)
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):
            with open(file, encoding="ascii") as stream:
                limit = int(stream.read())
            if limit < memory.total:
                free = min(free, limit - float(memory.total - memory.available))
    return max(MEMORY_SHARE * free / 1e9, 0.3)


class Crew:
    """A connection to workers. ``local``: the workers are this process's children."""

    def __init__(self, client: Any, address: str, reporter: Reporter, cluster: Any = None, processes: int = 0) -> None:
        self.client, self.address, self.reporter = client, address, reporter
        self.local, self._cluster, self._processes = cluster is not None, cluster, processes
        self._short_since: float | None = None
        self._reported = False
        self._seen = (0.0, 0, 0.0, False)
        self._security = client.security

    @property
    def dashboard(self) -> str:
        """Address of Dask's live view, or ''."""
        with suppress(Exception):
            return str(self.client.dashboard_link or "")
        return ""

    def alive(self) -> bool:
        """Whether the scheduler answers."""
        return bool(self.client.status == "running")

    def capacity(self) -> tuple[int, float, bool]:
        """``(plots at once, memory of the largest worker in GB, whether workers declare memory)``."""
        now = time.monotonic()
        if now - self._seen[0] > 1:
            workers = self._workers()
            declared = [w for w in workers if w.get("resources", {}).get(RESOURCE)]
            used = declared or workers
            largest = max((float(w["resources"][RESOURCE]) for w in declared), default=float("inf"))
            self._seen = (now, sum(int(w["nthreads"]) for w in used), largest, bool(declared))
            if workers and not declared and not self._reported:
                self._reported = True
                self.reporter.warn(
                    f"The workers at {self.address} declare no {RESOURCE}: each runs as many plots as it has threads, "
                    f'whatever memory they need; start them with --resources "{RESOURCE}=12" (GB for plots).'
                )
        return self._seen[1:]

    def heal(self) -> None:
        """Replace workers of this machine that stay away: Dask restarts one that dies, but not one that is killed
        while it is being restarted."""
        if not self.local:
            return
        names = {str(worker.get("name")) for worker in self._workers()}
        now = time.monotonic()
        if len(names) >= self._processes or self._short_since is None:
            self._short_since = None if len(names) >= self._processes else now
            return
        if now - self._short_since < HEAL_S:
            return
        self._short_since = now
        for name in [name for name in self._cluster.worker_spec if str(name) not in names]:
            self._cluster.worker_spec.pop(name, None)
            lost = self._cluster.workers.pop(name, None)
            if lost is not None:
                self._cluster.loop.add_callback(lost.close)
        self._cluster.scale(self._processes)

    def _workers(self) -> list[dict[str, Any]]:
        try:
            found = self.client.scheduler_info(n_workers=-1)
        except TypeError:  # older releases know no limit
            found = self.client.scheduler_info()
        except Exception:
            return []
        return list(found.get("workers", {}).values())

    def submit(self, function: Any, job: dict[str, Any]) -> Any:
        """A future of ``function(job)``; with the plot's memory where workers declare theirs."""
        needs = {RESOURCE: job["need_gb"]} if self.capacity()[2] else None
        # One name for all: Dask keeps statistics for every name it has seen.
        return self.client.submit(function, job, key=f"plot-{job['turn']}", pure=False, resources=needs)

    def reconnect(self, seconds: float) -> bool:
        """Find a scheduler at the same address again."""
        if self.local:
            return False
        from distributed import Client

        until = time.monotonic() + seconds
        with suppress(Exception):
            self.client.close(timeout=1)
        while time.monotonic() < until:
            try:
                self.client = Client(self.address, timeout=3, set_as_default=False, security=self._security)
                self._seen = (0.0, 0, 0.0, False)
                return True
            except (OSError, TimeoutError):
                time.sleep(1)
        return False


@contextmanager
def open_crew(
    scheduler: str, shape: Shape, threads: int, dashboard: str, options: str, workspace: Path, reporter: Reporter
) -> Iterator[Crew]:
    """Workers for a campaign; those that were started here are ended with the block, and speak only to each other.

    Raises:
        InputError: an unknown scheduler or one that does not answer. MissingComponentError: no dask-jobqueue.
    """
    isolate_workers()  # before Dask, which starts a process when it is imported
    import dask

    quiet()
    # What the scheduler remembers for its pages must not grow with the campaign.
    with dask.config.set(
        {
            "distributed.admin.low-level-log-length": 200,
            "distributed.admin.log-length": 200,
            "distributed.scheduler.events-log-length": 500,
            "distributed.scheduler.transition-log-length": 500,
            "distributed.scheduler.dashboard.tasks.task-stream-length": 500,
            "distributed.scheduler.dashboard.status.task-stream-length": 500,
            "distributed.scheduler.allowed-failures": 20,
            "distributed.scheduler.worker-saturation": 1.0,
            "distributed.worker.profile.enabled": False,
            "distributed.comm.timeouts.connect": "10s",
            "distributed.scheduler.work-stealing": True,
        }
    ):
        if scheduler == "local":
            yield from _local(shape, dashboard, reporter)
        elif scheduler in QUEUES:
            with private_folder(workspace) as folder:
                yield from _queue(scheduler, shape, threads, dashboard, options, folder, reporter)
        else:
            yield from _remote(scheduler, reporter)


def _local(shape: Shape, dashboard: str, reporter: Reporter) -> Iterator[Crew]:
    from distributed import Client

    cluster = _start_local(shape, dashboard)
    try:
        with Client(cluster, set_as_default=False, timeout=30) as client:
            crew = Crew(client, "this machine", reporter, cluster, shape.processes)
            try:
                yield crew
            except BaseException:
                _end_children()
                raise
    finally:
        with suppress(Exception):
            cluster.close(timeout=5)


def _start_local(shape: Shape, dashboard: str) -> Any:
    """Workers on this machine; one that is killed while they start (memory, a person) is no reason to give up.

    Raises:
        OutputError: they do not start three times.
    """
    from distributed import LocalCluster

    security = own_security()
    problem: Exception | None = None
    for _ in range(3):
        try:
            # Memory is watched per plot (its own process), so Dask's watch over the thin workers is off.
            return LocalCluster(
                n_workers=shape.processes,
                threads_per_worker=shape.slots,
                processes=True,
                memory_limit=0,
                resources={RESOURCE: shape.memory_gb},
                dashboard_address=_dashboard(dashboard),
                silence_logs=logging.CRITICAL,
                host="127.0.0.1",
                security=security,
            )
        except (OSError, RuntimeError, TimeoutError) as trouble:
            problem = trouble
            _end_children()
    raise OutputError(
        f"The workers do not start on this machine ({problem}); run 'treedgs doctor', or give fewer --workers."
    )


def _remote(address: str, reporter: Reporter) -> Iterator[Crew]:
    from distributed import Client

    security = security_of(address, reporter)
    try:
        client = Client(address, timeout=10, set_as_default=False, security=security)
    except (OSError, TimeoutError) as problem:
        raise InputError(
            f"--scheduler: nothing answers at {address} ({problem}); start 'dask scheduler' there, or use local."
        ) from None
    crew = Crew(client, address, reporter)
    try:
        yield crew
    finally:
        with suppress(Exception):
            crew.client.close(timeout=5)


def _queue(
    scheduler: str, shape: Shape, threads: int, dashboard: str, options: str, folder: Path, reporter: Reporter
) -> Iterator[Crew]:
    from distributed import Client

    chosen, jobs = queue_arguments(shape, threads, options, folder)
    try:
        import dask_jobqueue
    except ModuleNotFoundError:
        raise MissingComponentError(
            f"--scheduler {scheduler}: dask-jobqueue is not installed; run pip install 'dask-jobqueue>=0.9'."
        ) from None
    cluster = getattr(dask_jobqueue, QUEUES[scheduler])(
        **chosen,
        security=own_security(),
        shared_temp_directory=str(folder),
        # Without a live view there is still a page about the scheduler's health: not for the network either.
        scheduler_options={"dashboard": dashboard != "off", "dashboard_address": _dashboard(dashboard) or LOOPBACK},
    )
    try:
        cluster.scale(jobs=jobs)
        reporter.info(f"{jobs} jobs of {shape.memory_gb:.1f} GB were handed to {scheduler}.")
        with Client(cluster, set_as_default=False, timeout=30) as client:
            yield Crew(client, scheduler, reporter)
    except TreeDGSError:
        raise
    except (OSError, RuntimeError) as problem:
        raise InputError(
            f"--scheduler {scheduler}: the queue refused the jobs ({problem}); check --queue-options."
        ) from None
    finally:
        with suppress(Exception):
            cluster.close()


def queue_arguments(shape: Shape, threads: int, options: str, folder: Path) -> tuple[dict[str, Any], int]:
    """``(arguments of the dask-jobqueue cluster, number of jobs)``.

    options: ``queue=short,walltime=08:00:00,account=forest,jobs=20,memory=16GB,cores=4,interface=ib0``; further lines
    of the job script as ``job_extra=--constraint=avx2;--nice=100``, shell lines before it as ``prologue=…;…``. What
    is not given comes from dask-jobqueue's own configuration (``~/.config/dask/jobqueue.yaml``). folder: where the jobs
    start: Python looks for modules there first, so it is one that holds nothing of others.

    Raises:
        InputError: an unknown option.
    """
    given: dict[str, str] = {}
    for part in filter(None, (word.strip() for word in options.split(","))):
        name, equals, value = part.partition("=")
        if not equals or name.strip() not in _QUEUE_OPTIONS:
            raise InputError(f"--queue-options: found {part!r}, expected name=value with {', '.join(_QUEUE_OPTIONS)}.")
        given[name.strip()] = value.strip()
    jobs = int(given.pop("jobs", shape.processes))
    cores_each = int(given.pop("cores", shape.slots * threads))
    memory = given.pop("memory", f"{max(shape.memory_gb + 0.5, 1):.1f}GB")
    from dask.utils import parse_bytes

    for_plots = max(parse_bytes(memory) / 1e9 - 0.5, 0.3)
    account = given.pop("account", given.pop("project", None))
    chosen: dict[str, Any] = {
        "cores": cores_each,
        "processes": 1,
        "memory": memory,
        "python": sys.executable,
        "name": "treedgs",
        "nanny": True,
        "worker_extra_args": [
            "--nthreads",
            str(max(1, cores_each // threads)),
            "--memory-limit",
            "0",
            "--no-dashboard",
            "--dashboard-address",
            LOOPBACK,
            "--resources",
            f"{RESOURCE}={for_plots:.2f}",
        ],
        "job_extra_directives": [line for line in given.pop("job_extra", "").split(";") if line],
        "job_script_prologue": [line for line in given.pop("prologue", "").split(";") if line]
        + [f"cd {shlex.quote(str(folder))} || exit 1"],
    }
    if account:
        chosen["account"] = account
    return chosen | given, jobs


def _dashboard(text: str) -> str | None:
    if text == "off":
        return None
    if text == "auto":
        return LOOPBACK
    host, _, port = text.rpartition(":")
    if not port.isdigit():
        raise InputError(f"--dashboard: found {text!r}, expected auto, off, or an address like :8787.")
    # Dask takes an empty host for every network the machine is on.
    return f"{host or '127.0.0.1'}:{port}"


def quiet() -> None:
    """Dask's log lines are for its developers; what matters is said in a sentence of ours."""
    for name in (
        "distributed",
        "distributed.nanny",
        "distributed.worker",
        "distributed.scheduler",
        "bokeh",
        "tornado",
        "asyncio",
    ):
        logging.getLogger(name).setLevel(logging.CRITICAL)


def _end_children() -> None:
    """End the workers at once; each plot's supervisor notices, ends its engine and keeps what was finished."""
    import psutil

    for child in psutil.Process().children():
        with suppress(psutil.Error):
            child.kill()
