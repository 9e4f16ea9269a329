"""Where a scheduler of the lab may be; pure."""

from __future__ import annotations

import ipaddress

PORT = 8786
"""dask's usual port of a scheduler."""


class AddressError(ValueError):
    """No address that the lab may use; the text says why and what is allowed."""


def scheduler_address(text: str) -> str:
    """Return the address of a scheduler as dask writes it.

    Raises:
        AddressError: It is none, or is not of this machine. Who reaches a scheduler lets its
            workers run what they like, and the lab proves nobody's name.

    Example:
        >>> scheduler_address("127.0.0.1:8786"), scheduler_address("tcp://localhost:9000")
        ('tcp://127.0.0.1:8786', 'tcp://localhost:9000')
        >>> scheduler_address("127.0.0.1")
        'tcp://127.0.0.1:8786'
    """
    host, _, port = text.removeprefix("tcp://").partition(":")
    port = port or str(PORT)
    if not host or "/" in host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise AddressError(f"{text}: allowed is HOST:PORT, for example 127.0.0.1:{PORT}")
    if not _of_this_machine(host):
        raise AddressError(
            f"{text}: allowed is only this machine (127.0.0.1): who reaches a scheduler can run "
            "any program on its workers, and the lab asks for no certificates"
        )
    return f"tcp://{host}:{port}"


def _of_this_machine(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
