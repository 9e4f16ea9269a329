"""Judge drawn worlds on the workers of a scheduler of dask, the lab's (./cell lab scheduler).

The same jobs as here, so the same answer. What a worker was doing when it died another one does
again: dask gives it out anew.
"""

from __future__ import annotations

import ipaddress
import pickle
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError

from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.uncertainty.chances import Tried
from what_if.world_worker_io import Question, Worker

CONNECT_S = 10.0
"""A scheduler of this machine answers within this time; our choice."""


def spread_far(
    address: str,
    question: Question,
    lots: dict[int, FloatArray],
    done: dict[int, list[Tried]],
    told: Callable[[int], None],
) -> None:
    """Do jobs on all workers that have joined a scheduler.

    Args:
        address: Its HOST:PORT, of this machine.
        question: What is asked.
        lots: Rows of drawn numbers by the number of their first world.
        done: Gets what came of each lot.
        told: Is called with the number of worlds that are done, as it grows.

    Raises:
        WhatIfError: The address is wrong, nobody answers there, or the workers cannot do it.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
    except ModuleNotFoundError as error:
        raise WhatIfError("worlds: --scheduler needs dask, which ./cell setup installs") from error
    # An address as dask writes it
    host, _, port = address.removeprefix("tcp://").partition(":")
    try:
        is_here = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        is_here = False
    if not is_here or not port.isdecimal():
        raise WhatIfError(f"--scheduler {address}: allowed is 127.0.0.1:PORT, of this machine only")
    place = f"tcp://{host}:{port}"
    try:
        client = Client(place, timeout=CONNECT_S, set_as_default=False)
    except OSError as error:
        raise WhatIfError(f"worlds: no scheduler answers at {address}: {error}") from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise WhatIfError(f"worlds: {address} has no workers: ./cell lab worker {address}")
        jobs = {client.submit(judge_far, question, lot, pure=False): k for k, lot in lots.items()}
        try:
            for job in as_completed(list(jobs), loop=client.loop):
                done[jobs[job]] = job.result()
                told(sum(map(len, done.values())))
        except (KilledWorker, CancelledError) as error:
            raise WhatIfError(f"worlds: the workers at {address} have gone: {error}") from error
        except ImportError as error:
            raise WhatIfError(f"worlds: a worker at {address} has no judge: {error}") from error
        finally:
            client.cancel(list(jobs))


_lock = threading.Lock()
"""A worker may have several threads, and the engine of the dynamics serves one at a time."""
_known: list[tuple[bytes, Worker]] = []
"""The question that this process was asked last, and its cell."""


def judge_far(question: Question, rows: FloatArray) -> list[Tried]:
    """Judge a lot of worlds where a worker is."""
    with _lock:
        asked = pickle.dumps(question)
        if not _known or _known[0][0] != asked:
            while _known:
                _known.pop()[1].close()
            _known.append((asked, Worker(question)))
        return [_known[0][1].tried(row.tolist()) for row in rows]
