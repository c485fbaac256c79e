"""Who may talk to a campaign's scheduler: it runs what it is sent (pickles), so nobody but its own processes."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..core.errors import InputError, MissingComponentError, OutputError
from ..core.progress import Reporter

#: Folder in the campaign's workspace that the jobs of a queue start in and read their certificates from.
FOLDER = ".workers"
_PLAIN = ("tcp://", "ws://")


def own_security() -> Any:
    """A key and certificate of this campaign alone, in memory (:class:`distributed.Security`): scheduler and workers
    speak TLS and refuse whoever does not hold it.

    Raises:
        MissingComponentError: the library that makes them is not installed.
    """
    from distributed.security import Security

    try:
        return Security.temporary()
    except ImportError:
        raise MissingComponentError(
            "--scheduler: the library cryptography, which makes the certificates of the "
            "workers, is not installed; run treedgs:setupengine or make setup again."
        ) from None


def security_of(address: str, reporter: Reporter) -> Any:
    """What a running scheduler is spoken to with: certificates of Dask's own configuration for ``tls://``.

    Raises:
        InputError: ``tls://`` and no certificates are configured.
    """
    from distributed.security import Security

    security = Security()
    if address.startswith(_PLAIN):
        reporter.warn(
            f"The scheduler at {address} asks nobody who they are: whoever reaches that port can run "
            "programs as you, on every worker; start it with certificates, give tls:// "
            "(docs/technician/campaign.md)."
        )
    elif address.startswith("tls://") and not all(  # attributes that it makes from its configuration
        getattr(security, name) for name in ("tls_ca_file", "tls_client_cert")
    ):
        raise InputError(
            f"--scheduler: {address} needs certificates and Dask's configuration names none; set "
            "distributed.comm.tls.ca-file and .client.cert, .client.key (docs/technician/campaign.md)."
        )
    return security


@contextmanager
def private_folder(workspace: Path) -> Iterator[Path]:
    """A folder that only this user may enter, on the disk that the jobs of a queue share; removed with the block.

    Raises:
        OutputError: it cannot be made, or others may enter it all the same.
    """
    folder = Path(workspace).resolve() / FOLDER
    try:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(mode=0o700, parents=True)
        if os.name == "posix" and folder.stat().st_mode & 0o077:
            raise OutputError(
                f"{folder}: other users may enter it although that was taken from them, and it holds the "
                "campaign's key; choose a workspace on a disk that keeps permissions."
            )
    except OSError as problem:
        raise OutputError(f"{folder}: cannot be made ({problem.strerror}); choose another workspace.") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
