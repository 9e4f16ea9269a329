"""A scheduler of dask and its workers: for one lab, or until they are ended.

On loopback without certificates, else by TLS where both sides show one of the lab's authority.

Each worker is a process with one thread, watched by another one that starts it again when it dies.
"""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager, suppress

import msgspec
from distributed import Client, LocalCluster, Nanny, Scheduler
from distributed.comm.addressing import get_address_host
from distributed.core import rpc
from distributed.utils import get_ip

from farm.lab.address import is_secure
from farm.lab.io.carried.exchange import Counter, asked
from farm.lab.io.carried.parcels import FILES
from farm.lab.io.carried.store import Store
from farm.lab.io.carried.version import Version, refusal, version_of
from farm.lab.io.line.guard import LabSecurity
from farm.lab.io.line.identity import as_scheduler, identity
from farm.lab.io.running import LabError, root

HOST = "127.0.0.1"
ANYWHERE = f"{HOST}:0"
"""For dask's own pages, which cannot be left out: loopback, on a port that is free."""
LOOK_S = 1.0
"""How often the scheduler looks whether all who are connected are good. Our choice."""
PATIENCE_S = 10.0
"""Our choice: a scheduler on this machine answers within milliseconds."""


@contextmanager
def own_cluster(workers: int) -> Iterator[Client]:
    """Start a scheduler with workers on this machine; all of it ends with the block."""
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            host=HOST,
            dashboard_address=ANYWHERE,
            worker_dashboard_address=ANYWHERE,
            memory_limit=0,
            silence_logs=logging.WARNING,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


@contextmanager
def joined_cluster(address: str) -> Iterator[Client]:
    """Connect to a scheduler that runs.

    Raises:
        LabError: Nobody answers there, it lets this machine not in or has another version, or it
            has no worker.
    """
    security = _security(address)
    try:
        client = Client(address, timeout=PATIENCE_S, security=security)
    except OSError as error:
        raise _unreached(address) from error
    with client:
        if security is not None:
            _compare(asked(client, "lab_version"), "the scheduler")
        if not client.scheduler_info()["workers"]:
            raise LabError(f"{address} has no workers: start some with ./cell lab worker {address}")
        yield client


def serve(port: int, host: str = "") -> None:
    """Keep a scheduler without workers until SIGINT or SIGTERM.

    Args:
        port: Where it listens.
        host: As machines of the lab reach it; empty: only this machine, without certificates.

    Raises:
        LabError: The port is taken, or the certificates cannot be used.
    """
    security = as_scheduler(host, port) if host else None
    try:
        asyncio.run(_serve(port, host or HOST, security))
    except OSError as error:
        raise LabError(
            f"{host or HOST}:{port} cannot be listened on: {error.strerror or error}: give another "
            "--port, or another --listen"
        ) from error


def work(address: str, workers: int) -> None:
    """Work for a scheduler until SIGINT or SIGTERM, or until the scheduler has gone.

    Raises:
        LabError: Nobody answers there, or it lets this machine not in or has another version.
    """
    security = _security(address)
    try:
        asyncio.run(_work(address, workers, security))
    except (OSError, asyncio.TimeoutError) as error:
        raise _unreached(address) from error


def _security(address: str) -> LabSecurity | None:
    """Return what this machine shows at a scheduler; None: nothing is asked for on loopback.

    Raises:
        LabError: It has no certificate of a lab.
    """
    return identity(address).security() if is_secure(address) else None


def _unreached(address: str) -> LabError:
    if is_secure(address):
        return LabError(
            f"no scheduler answers at {address}, or it does not let this machine in: start it with "
            "./cell lab scheduler --listen HOST, and look there at ./cell farm certificates"
        )
    return LabError(f"no scheduler answers at {address}: start it with ./cell lab scheduler")


def _compare(there: bytes, who: str) -> None:
    """Compare the other side's version with this machine's.

    Raises:
        LabError: They differ.
    """
    why = refusal(version_of(root()), msgspec.json.decode(there, type=Version), who)
    if why:
        raise LabError(why)


async def _serve(port: int, host: str, security: LabSecurity | None) -> None:
    _quiet()
    ended = _ended()
    async with Scheduler(
        host=host,
        port=port,
        protocol="tls://" if security else "tcp://",
        security=security,
        dashboard_address=ANYWHERE,
    ) as scheduler:
        if security is not None:
            store = root() / FILES
            Counter(Store(store), version_of(root()), store).attach(scheduler)
        print(
            f"lab: scheduler at {scheduler.address}\n"
            f"lab: work for it: ./cell lab worker {scheduler.address}\n"
            f"lab: use it: ./cell lab judge ... --scheduler {scheduler.address}",
            flush=True,
        )
        while not ended.is_set():
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(ended.wait(), LOOK_S)
            for name in security.guard.expel() if security else ():
                print(f"lab: {name} is let in no more; its lines were ended", flush=True)


async def _work(address: str, workers: int, security: LabSecurity | None) -> None:
    _quiet()
    ended = _ended()
    if security is not None:
        args = security.get_connection_args("worker")
        scheduler = rpc(address, timeout=PATIENCE_S, connection_args=args)
        try:
            there = await asyncio.wait_for(scheduler.lab_version(), PATIENCE_S)
        finally:
            await scheduler.close_rpc()
        _compare(there, "the scheduler")
    # Left out, it would be each address that this machine has.
    host = get_ip(get_address_host(address)) if security else HOST
    async with AsyncExitStack() as stack:
        nannies = [
            await stack.enter_async_context(
                Nanny(
                    address,
                    nthreads=1,
                    host=host,
                    security=security,
                    dashboard_address=ANYWHERE,
                    memory_limit=0,
                    death_timeout=PATIENCE_S,
                )
            )
            for _ in range(workers)
        ]
        print(f"lab: {workers} workers at {address}", flush=True)
        waiting = [asyncio.ensure_future(ended.wait())]
        waiting += [asyncio.ensure_future(nanny.finished()) for nanny in nannies]
        await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        for each in waiting:
            each.cancel()


def _quiet() -> None:
    """Let dask tell what goes wrong, and nothing else."""
    logging.getLogger("distributed").setLevel(logging.WARNING)


def _ended() -> asyncio.Event:
    """Return what is set by SIGINT and SIGTERM."""
    ended, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    return ended
