"""The heartbeat's count, and whether the robot's echo of it is of our own writes.

The robot copies the register back. What it shows must be one of the values that were written since
the last one that it showed: a write or two may be on its way, and no echo goes back in the count.
Anything else was written by somebody else, who would keep the robot's watchdog quiet for us.
"""

from __future__ import annotations

import msgspec
from scara_config.modbus_map import ModbusMap

MOST = 32767
"""The count goes 1..32767, then from 1 again; 0 disarms the watchdog."""


class Echo(msgspec.Struct, frozen=True):
    """What the robot has shown of our heartbeat.

    Attributes:
        own: The newest of our values that it has shown; 0 before the first. It outlives a
            connection: what was on its way then may still come.
        shown: The value that it showed last on this connection; None before the first answer.
    """

    own: int = 0
    shown: int | None = None


def next_beat(count: int) -> int:
    """Return the value after ``count``."""
    return count % MOST + 1


def reconnected(echo: Echo) -> Echo:
    """Return what is known on a new connection: any value may stand in the register by now."""
    return msgspec.structs.replace(echo, shown=None)


def heard(echo: Echo, shown: int, sent: int) -> tuple[Echo, bool]:
    """Take one echo in.

    Args:
        echo: What was shown before.
        shown: The register's value.
        sent: The newest value that was written, or is being written; 0 before the first.

    Returns:
        What is known now, and whether somebody else has written the register.
    """
    ours = 0 < shown <= MOST and 0 < _ahead(echo.own, shown) <= _ahead(echo.own, sent)
    stranger = not ours and echo.shown is not None and shown != echo.shown
    return Echo(shown if ours else echo.own, shown), stranger


def stranger_text(layout: ModbusMap, shown: int) -> str:
    """Say what a foreign value in the heartbeat's register means and what to do."""
    register = layout.holding_registers["heartbeat"]
    name = register.variable.partition("@")[0] or f"register {register.address} (heartbeat)"
    return (
        f"somebody else writes {name}: {shown} is no heartbeat of this controller; "
        "let one master alone drive the robot"
    )


def _ahead(begin: int, value: int) -> int:
    """Return how many counts ``value`` is ahead of ``begin``, 0..32766."""
    return (value - begin) % MOST
