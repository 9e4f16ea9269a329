"""A scheduler of dask and its workers, on loopback only: for one lab, or until they are ended.

Each worker is a process with one thread, watched by another one that starts it again when it dies.
"""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager

from distributed import Client, LocalCluster, Nanny, Scheduler

from farm.lab.io.running import LabError

HOST = "127.0.0.1"
ANYWHERE = f"{HOST}:0"
"""For dask's own pages, which cannot be left out: loopback, on a port that is free."""
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
        LabError: Nobody answers there, or it has no worker.
    """
    try:
        client = Client(address, timeout=PATIENCE_S)
    except OSError as error:
        raise LabError(
            f"no scheduler answers at {address}: start it with ./cell lab scheduler"
        ) from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise LabError(f"{address} has no workers: start some with ./cell lab worker {address}")
        yield client


def serve(port: int) -> None:
    """Keep a scheduler without workers until SIGINT or SIGTERM.

    Raises:
        LabError: The port is taken.
    """
    try:
        asyncio.run(_serve(port))
    except OSError as error:
        raise LabError(
            f"{HOST}:{port} cannot be listened on: {error.strerror or error}: give another --port"
        ) from error


def work(address: str, workers: int) -> None:
    """Work for a scheduler until SIGINT or SIGTERM, or until the scheduler has gone.

    Raises:
        LabError: Nobody answers there.
    """
    try:
        asyncio.run(_work(address, workers))
    except (OSError, asyncio.TimeoutError) as error:
        raise LabError(
            f"no scheduler answers at {address}: start it with ./cell lab scheduler"
        ) from error


async def _serve(port: int) -> None:
    _quiet()
    ended = _ended()
    async with Scheduler(host=HOST, port=port, dashboard_address=ANYWHERE) as scheduler:
        print(
            f"lab: scheduler at {scheduler.address}\n"
            f"lab: work for it: ./cell lab worker {scheduler.address}\n"
            f"lab: use it: ./cell lab judge ... --scheduler {scheduler.address}",
            flush=True,
        )
        await ended.wait()


async def _work(address: str, workers: int) -> None:
    _quiet()
    ended = _ended()
    async with AsyncExitStack() as stack:
        nannies = [
            await stack.enter_async_context(
                Nanny(
                    address,
                    nthreads=1,
                    host=HOST,
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
