"""A campaign's scheduler runs what it is sent: only the campaign's own processes may send."""

from __future__ import annotations

import os
import socket
import stat
from pathlib import Path

import psutil
import pytest

from treedgs_geo.campaign.certificates import FOLDER, private_folder, security_of
from treedgs_geo.campaign.clusters import Shape, open_crew
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter

pytest.importorskip("cryptography")


class Said(Reporter):
    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


def listening() -> list[tuple[str, int]]:
    """Addresses where this process and its children wait for connections."""
    here = psutil.Process()
    found = []
    for process in (here, *here.children(recursive=True)):
        found += [(c.laddr.ip, c.laddr.port) for c in process.net_connections("inet") if c.status == psutil.CONN_LISTEN]
    return found


@pytest.mark.parametrize("dashboard", ["off", "auto", ":0"])
def test_a_stranger_on_this_machine_can_do_nothing(tmp_path, dashboard):
    from distributed import Client
    from distributed.security import Security

    marker = tmp_path / "a stranger was here"
    before = set(listening())
    with open_crew("local", Shape(1, 1, 1.0), 1, dashboard, "", tmp_path, Reporter()) as crew:
        address = crew.client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        assert crew.client.submit(os.getpid).result(timeout=30) > 0, "its own processes can"
        for other, security in ((address.replace("tls", "tcp"), None), (address, Security.temporary())):
            with pytest.raises(OSError), Client(other, security=security, timeout=3, set_as_default=False) as stranger:
                stranger.submit(Path.touch, marker).result(timeout=3)
        ports = set(listening()) - before
        assert ports and all(ip == "127.0.0.1" for ip, _ in ports), ports
    assert not marker.exists()


def test_a_bare_connection_gets_nothing(tmp_path):
    """Neither an unencrypted hello nor silence brings anything out of the scheduler's port."""
    with open_crew("local", Shape(1, 1, 1.0), 1, "off", "", tmp_path, Reporter()) as crew:
        host, port = crew.client.scheduler.address.removeprefix("tls://").split(":")
        with socket.create_connection((host, int(port)), timeout=5) as plain:
            plain.sendall(b"\x01" + bytes(31))
            try:
                assert plain.recv(4096)[:1] in (b"", b"\x15"), "a TLS alert or nothing"
            except OSError:
                pass


def test_the_key_of_a_queues_jobs_is_the_users_alone(tmp_path):
    old = os.umask(0)
    try:
        with private_folder(tmp_path) as folder:
            assert folder == tmp_path / FOLDER and stat.S_IMODE(folder.stat().st_mode) == 0o700
            (folder / "key").write_text("x")
    finally:
        os.umask(old)
    assert not folder.exists()


def test_a_running_scheduler_without_certificates_is_reported(tmp_path):
    said = Said()
    security_of("tcp://host:8786", said)
    assert len(said.warnings) == 1 and "asks nobody who they are" in said.warnings[0]
    with pytest.raises(InputError, match="needs certificates"):
        security_of("tls://host:8786", said)


def test_a_running_scheduler_with_certificates(tmp_path):
    """What docs/technician/campaign.md says: Dask's own configuration names them."""
    import dask
    from distributed import LocalCluster
    from distributed.security import Security

    made, said = Security.temporary(), Said()
    names = {"ca-file": made.tls_ca_file, "client.cert": made.tls_client_cert, "client.key": made.tls_client_key}
    with (
        LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            security=made,
            dashboard_address=None,
            processes=False,
            host="127.0.0.1",
            protocol="tls://",
        ) as cluster,
        dask.config.set({f"distributed.comm.tls.{name}": value for name, value in names.items()}),
        open_crew(cluster.scheduler_address, Shape(1, 1, 1.0), 1, "off", "", tmp_path, said) as crew,
    ):
        assert crew.client.submit(sum, (1, 2)).result(timeout=30) == 3
        assert crew.reconnect(10) and crew.client.submit(sum, (3, 4)).result(timeout=30) == 7
    assert not any("asks nobody" in text for text in said.warnings)
