"""A scheduler of dask and its workers: for one lab, or until they are ended.

One that is kept on loopback asks for no certificates, else both sides show one of the lab's
authority, by dask's TLS. Each worker is a process with one thread, which its nanny starts again
when it dies.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime, timezone
from pathlib import Path

import dask
from dask.system import CPU_COUNT
from distributed import Client, LocalCluster, Nanny, Scheduler, Security
from distributed.comm.addressing import get_address_host
from distributed.utils import get_ip
from scara_ros.shell.program_io import workspace

from farm.config import Credentials, load_farm
from farm.lab.address import TLS, is_secure
from farm.lab.results_io import LabError
from farm.lab.running_io import MOST_BYTES, differs, version_of
from farm.security.invitation_io import SecurityError, keys_folder
from farm.security.lab_authority_io import LabAuthority, has_lab, lab_authority_folder
from farm.security.membership_io import joined, shown_by

HOST = "127.0.0.1"
ANYWHERE = f"{HOST}:0"
"""For dask's own pages, which cannot be left out: loopback, on a port that is free."""
LOOK_S = 1.0
"""How often the scheduler looks whether the lab has another authority. Our choice."""
PATIENCE_S = 10.0
"""Our choice: a scheduler on this machine answers within milliseconds."""


@contextmanager
def connected(address: str, workers: int | None) -> Iterator[tuple[Client, str | None]]:
    """Connect to a scheduler, and give the version that its workers must have; None: any.

    Args:
        address: Of one that runs; empty: one is started here, and all of it ends with the block.
        workers: How many it has then; None: one for each processor.

    Raises:
        LabError: Nobody answers there, it lets this machine not in, or no worker has the version.
    """
    if not address:
        cluster = LocalCluster(
            n_workers=workers or CPU_COUNT,
            threads_per_worker=1,
            host=HOST,
            dashboard_address=ANYWHERE,
            worker_dashboard_address=ANYWHERE,
            memory_limit=0,
            silence_logs=logging.WARNING,
            # Of its own, in memory: no other account of this machine gives its workers anything.
            security=Security.temporary(),
        )
        with cluster, Client(cluster) as client:
            yield client, None
        return
    security = _security(address)
    version = version_of(workspace()) if security else None
    # A recording is a large argument, and meant to be.
    quiet = {"distributed.admin.large-graph-warning-threshold": MOST_BYTES}
    try:
        client = Client(address, timeout=PATIENCE_S, security=security)
    except OSError as error:
        raise _unreached(address) from error
    with client, dask.config.set(quiet):
        found = [each["resources"] for each in client.scheduler_info()["workers"].values()]
        if not found:
            raise LabError(f"{address} has no workers: start some with ./cell lab worker {address}")
        if version and not any(version in each for each in found):
            others = differs(version, "the workers", " and ".join(sorted(set().union(*found))))
            raise LabError(
                f"{differs(version, 'the workers', others)}, then start the workers anew"
            )
        yield client, version


def serve(port: int, host: str = "") -> None:
    """Keep a scheduler without workers until SIGINT or SIGTERM.

    Args:
        port: Where it listens.
        host: As machines of the lab reach it; empty: only this machine, without certificates.

    Raises:
        LabError: The port is taken, the certificates cannot be used, or the authority was renewed.
    """
    files = _desk((host, port)) if host else None
    try:
        asyncio.run(_serve(port, host or HOST, files))
    except OSError as error:
        raise LabError(
            f"{host or HOST}:{port} cannot be listened on: {error.strerror or error}: give another "
            "--port, or another --listen"
        ) from error


def work(address: str, workers: int | None) -> None:
    """Work for a scheduler until SIGINT or SIGTERM, or until the scheduler has gone.

    Raises:
        LabError: Nobody answers there, or it lets this machine not in.
    """
    security = _security(address)
    try:
        asyncio.run(_work(address, workers or CPU_COUNT, security))
    except (OSError, asyncio.TimeoutError) as error:
        raise _unreached(address) from error


def _security(address: str) -> Security | None:
    """Return what this machine shows at a scheduler; None: nothing is asked for on loopback.

    Raises:
        LabError: It has no certificate of a lab, or that is not good any more.
    """
    if not is_secure(address):
        return None
    keys = keys_folder(os.environ)
    try:
        invitation = joined(keys, lab=True)
        theirs = invitation and f"{TLS}{invitation.host}:{invitation.port}" == address
        if invitation is not None and (theirs or not has_lab(keys)):
            return _shows(shown_by(invitation, keys, datetime.now(timezone.utc)))
    except SecurityError as error:
        raise LabError(str(error)) from error
    # A desk that was invited to another lab is a guest there.
    if has_lab(keys):
        return _shows(_desk())
    raise LabError(
        "this machine is in no lab, and its certificate for the farm does not count here: on the "
        "desk ./cell farm invite NAME --lab, then here ./cell farm join NAME.invitation"
    )


def _desk(reached: tuple[str, int] | None = None) -> Credentials:
    """Return what the lab's desk shows; its authority is made if there is none.

    Raises:
        LabError: Its files cannot be read or written.
    """
    folder = lab_authority_folder(keys_folder(os.environ))
    try:
        authority = LabAuthority(folder, load_farm().site, datetime.now(timezone.utc))
        if reached is not None:
            authority.listened(*reached)
        return authority.desk()
    except SecurityError as error:
        raise LabError(str(error)) from error


def _shows(files: Credentials) -> Security:
    ends = ("client", "scheduler", "worker")
    return Security(
        require_encryption=True,
        tls_ca_file=files.authority,
        **{f"tls_{end}_cert": files.certificate for end in ends},
        **{f"tls_{end}_key": files.key for end in ends},
    )


def _unreached(address: str) -> LabError:
    if is_secure(address):
        return LabError(
            f"no scheduler answers at {address}, or it does not let this machine in: start it with "
            "./cell lab scheduler --listen HOST, and look there at ./cell farm certificates"
        )
    return LabError(f"no scheduler answers at {address}: start it with ./cell lab scheduler")


async def _serve(port: int, host: str, files: Credentials | None) -> None:
    ended = _ended()
    trusted = files and Path(files.authority).read_bytes()
    scheduler = Scheduler(
        host=host,
        port=port,
        protocol="tls://" if files else "tcp://",
        security=_shows(files) if files else None,
        dashboard_address=ANYWHERE,
    )
    await _start(scheduler)
    async with scheduler:
        print(
            f"lab: scheduler at {scheduler.address}\n"
            f"lab: work for it: ./cell lab worker {scheduler.address}\n"
            f"lab: use it: ./cell lab judge ... --scheduler {scheduler.address}",
            flush=True,
        )
        while not ended.is_set():
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(ended.wait(), LOOK_S)
            # TLS reads the authority once: whom it has let in stays in until the end.
            if files and Path(files.authority).read_bytes() != trusted:
                raise LabError(
                    "the lab has a new authority, and lets nobody in by the one before: start "
                    "scheduler and workers anew, members join again by their new invitations"
                )


async def _work(address: str, workers: int, security: Security | None) -> None:
    ended = _ended()
    nannies = [
        Nanny(
            address,
            nthreads=1,
            # Left out, it would be each address that this machine has.
            host=get_ip(get_address_host(address)) if security else HOST,
            security=security,
            # Jobs of this version are done here, and no others.
            resources={version_of(workspace()): 1} if security else None,
            dashboard_address=ANYWHERE,
            memory_limit=0,
            death_timeout=PATIENCE_S,
        )
        for _ in range(workers)
    ]
    try:
        await asyncio.gather(*map(_start, nannies))
        print(f"lab: {workers} workers at {address}", flush=True)
        waiting = [asyncio.ensure_future(ended.wait())]
        waiting += [asyncio.ensure_future(nanny.finished()) for nanny in nannies]
        await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        for each in waiting:
            each.cancel()
    finally:
        await asyncio.gather(*(nanny.close() for nanny in nannies))


async def _start(server: Scheduler | Nanny) -> None:
    """Start a server of dask, which hides why it cannot.

    Raises:
        OSError: It cannot listen, or not reach others.
    """
    try:
        await server
    except RuntimeError as error:
        raise OSError(str(error.__cause__ or error)) from error


def _ended() -> asyncio.Event:
    """Return what is set by SIGINT and SIGTERM; let dask tell what goes wrong, and nothing else."""
    logging.getLogger("distributed").setLevel(logging.WARNING)
    ended, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    return ended
