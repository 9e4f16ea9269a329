"""Where a scheduler of the lab may be; pure."""

from __future__ import annotations

from scara_config.quantities import is_this_machine

PORT = 8786
"""dask's usual port of a scheduler."""
TLS = "tls://"
"""Begins the address of a scheduler that asks for certificates."""


class AddressError(ValueError):
    """No address that the lab may use; the text says why and what is allowed."""


def scheduler_address(text: str) -> str:
    """Return the address of a scheduler as dask writes it.

    Raises:
        AddressError: It is none, or is of another machine without TLS: who reaches such a scheduler
            can run any program on its workers.

    Example:
        >>> scheduler_address("127.0.0.1"), scheduler_address("tls://10.0.0.5:9000")
        ('tcp://127.0.0.1:8786', 'tls://10.0.0.5:9000')
    """
    host, _, port = text.removeprefix(TLS).removeprefix("tcp://").partition(":")
    port = port or str(PORT)
    if not host or "/" in host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise AddressError(f"{text}: allowed is HOST:PORT, for example 127.0.0.1:{PORT}")
    if is_secure(text):
        return f"{TLS}{host}:{port}"
    if not is_this_machine(host):
        raise AddressError(
            f"{text}: without certificates allowed is only this machine (127.0.0.1): who reaches a "
            f"scheduler can run any program on its workers. Give {TLS}{host}:{port}, where both "
            "sides show certificates (./cell farm invite NAME --lab)"
        )
    return f"tcp://{host}:{port}"


def is_secure(address: str) -> bool:
    """Return whether both sides show certificates at an address."""
    return address.startswith(TLS)


def listened(host: str) -> str:
    """Return the host where a scheduler listens for other machines.

    Raises:
        AddressError: It is no host at which others reach this one.
    """
    if not host or host in ("0.0.0.0", "*") or set(host) & set(":/ "):
        raise AddressError(
            f"--listen {host}: give the name or IPv4 address at which other machines reach this one"
        )
    return host
