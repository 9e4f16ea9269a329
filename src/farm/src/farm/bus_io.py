"""Open the bus: no multicast, no shared memory, nothing that is stored.

The desk opens the router in its own process; everybody else on this machine is a client of it by
TCP on loopback. Other machines are clients of a second router, by TLS where both sides show
certificates (:mod:`farm.security.door_io`).
"""

from __future__ import annotations

import json
import threading
from typing import Any

import zenoh

from farm.config import Address, Outside

MOST_SESSIONS = 10_000
"""Our choice: zenoh's own limit is 1,000, which is the size of a farm on one desk."""
BATCH_BYTES = 8192
"""Our choice: a state needs 400; zenoh's 65,535 are 80 kB more for each session of a router."""
RETRY_S = 0.5
"""Our choice: how soon a desk that was not there is looked for again."""
RETRY_MS = (200, 1000)
"""Our choice: how soon a client whose line was cut tries again, first and at most [ms]. zenoh's own
1,000 to 4,000 would leave machines out for longer when the door for them is opened anew."""


class BusError(RuntimeError):
    """The bus cannot be opened; the text says why and what to do."""


def open_router(address: Address, lease_ms: float) -> zenoh.Session:
    """Open the router of this machine in this process.

    Args:
        address: Where it listens.
        lease_ms: How long a silent client counts as there [ms].

    Raises:
        BusError: The address is not of this machine, or is taken.
    """
    _check(address)
    return _listen(address.endpoint, {"connect/endpoints": []}, lease_ms)


def open_outside(address: Address, lease_ms: float, outside: Outside) -> zenoh.Session:
    """Open the router for other machines in this process, and connect it to that of this machine.

    Args:
        address: Where the router of this machine listens.
        lease_ms: How long a silent client counts as there [ms].
        outside: Where it listens, what it shows, and whom it lets do what.

    Raises:
        BusError: The address is taken, or the router of this machine is not there.
    """
    settings = {
        **outside.settings,
        "connect/endpoints": [address.endpoint],
        "connect/timeout_ms": int(RETRY_S * 1000),
        "connect/exit_on_failure": True,
    }
    return _listen(outside.endpoint, settings, lease_ms)


def _listen(endpoint: str, settings: dict[str, Any], lease_ms: float) -> zenoh.Session:
    always = {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "transport/unicast/max_sessions": MOST_SESSIONS,
        "transport/unicast/accept_pending": MOST_SESSIONS,
    }
    try:
        return zenoh.open(_config({**settings, **always}, lease_ms))
    except zenoh.ZError as error:
        raise BusError(
            f"{endpoint} cannot be listened on: does another desk run here (./cell farm "
            "cells)? Else give another port, --router-port, --listen or farm.yaml. "
            # Without the places in zenoh's source.
            f"{str(error).split(' at /')[0]}"
        ) from error


def open_client(address: Address, lease_ms: float, timeout_s: float) -> zenoh.Session:
    """Connect to the desk; later the connection heals by itself.

    Raises:
        BusError: The address is refused, or nobody answers there.
    """
    _check(address)
    settings = {
        **address.settings,
        "mode": "client",
        "listen/endpoints": [],
        "connect/endpoints": [address.endpoint],
        "connect/timeout_ms": int(timeout_s * 1000),
        "connect/exit_on_failure": True,
        "connect/retry": {
            "period_init_ms": RETRY_MS[0],
            "period_max_ms": RETRY_MS[1],
            "period_increase_factor": 2,
        },
    }
    try:
        return zenoh.open(_config(settings, lease_ms))
    except zenoh.ZError as error:
        what = "start it with ./cell farm"
        if address.settings:
            what += " --listen, or it takes this machine's certificate no more: ask for another"
        raise BusError(f"no desk answers at {address.endpoint}: {what}") from error


def wait_for_desk(
    address: Address, lease_ms: float, ended: threading.Event
) -> zenoh.Session | None:
    """Connect to the desk as soon as it is there; None: ``ended`` was set before.

    Raises:
        BusError: The address is refused.
    """
    _check(address)
    while not ended.is_set():
        try:
            return open_client(address, lease_ms, RETRY_S)
        except BusError:
            ended.wait(RETRY_S)
    return None


def _check(address: Address) -> None:
    if why := address.refusal:
        raise BusError(f"router.host = {address.host}: {why}")


def _config(settings: dict[str, Any], lease_ms: float) -> zenoh.Config:
    config = zenoh.Config()
    always = {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        # With it the wheel hangs silently at about 356 sessions.
        "transport/shared_memory/enabled": False,
        "transport/link/tx/batch_size": BATCH_BYTES,
        "transport/link/rx/buffer_size": BATCH_BYTES,
        "transport/link/tx/lease": int(lease_ms),
        "adminspace/enabled": False,
        "timestamping/enabled": False,
    }
    for key, value in {**always, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return config
