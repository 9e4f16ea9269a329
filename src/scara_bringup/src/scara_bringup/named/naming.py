"""What a name makes of a cell: its namespace, and ports that nobody uses."""

from __future__ import annotations

from collections.abc import Collection

import msgspec
from scara_ros.names import NamespaceError, cell_of, namespace_of

from scara_bringup.config import Doors, Ports

UNNAMED = cell_of("/")
DEFAULT_MASTER_PORT = 11311
LAST_PORT = 65535
SERVED_BY = {
    "modbus": "emulator",
    "gateway": "gateway",
    "panel": "operator_panel",
    "pendant": "pendant_page",
}
"""Which node listens at a port: one that is left out keeps the port of its file."""


def namespace_by_name(name: str) -> str:
    """Return the namespace of the cell ``name``.

    Raises:
        NamespaceError: It is no name, or the one of the cell without a name.
    """
    try:
        namespace = namespace_of(name)
    except NamespaceError:
        raise NamespaceError(
            f"--name {name}: allowed are letters, digits and _, a letter first, for example milk_2"
        ) from None
    if cell_of(namespace) == UNNAMED:
        raise NamespaceError(f"--name {name}: this is the cell without a name; choose another one")
    return namespace


def free_port(start: int, taken: Collection[int]) -> int:
    """Return the first port from ``start`` on that is not taken.

    Raises:
        ValueError: All are.

    Example:
        >>> free_port(9090, {9090, 9091, 9093})
        9092
    """
    for port in range(start, LAST_PORT + 1):
        if port not in taken:
            return port
    raise ValueError(f"no port from {start} to {LAST_PORT} is free")


def free_ports(
    doors: Doors, given: Ports, master: int | None, without: Collection[str], taken: Collection[int]
) -> tuple[Ports, int]:
    """Choose the ports of a cell and of its master; what the caller has given stays.

    Args:
        doors: What the files say: the search begins there.
        given: Ports that the caller wants.
        master: Port of the master that the caller wants.
        without: Nodes that are left out: a real robot's port is none of our choice.
        taken: Ports that somebody listens at.

    Returns:
        Ports of the servers, and the master's.
    """
    chosen = msgspec.structs.asdict(given)
    # What is given counts before anything is chosen, whose turn ever it is.
    used = {*taken, *(port for port in (*chosen.values(), master) if port is not None)}
    for name, node in SERVED_BY.items():
        if chosen[name] is None and node not in without:
            chosen[name] = free_port(getattr(doors, name).port, used)
            used.add(chosen[name])
    return Ports(**chosen), master or free_port(DEFAULT_MASTER_PORT, used)
