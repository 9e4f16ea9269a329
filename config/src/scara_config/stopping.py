"""What stops a robot, and what it shows of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import msgspec

from scara_config.quantities import HostName, ReactionMs

Means = Literal["hold", "cstopi", "imstp"]
"""The inputs by which a client stops a robot, in the order in which they are used."""
ALLOCATED: dict[str, tuple[Means, ...]] = {
    "full": ("hold", "cstopi", "imstp"),
    "simple": ("hold", "cstopi"),
    "none": (),
}
"""Which of them an allocation of the user operator panel has."""


def stops_command(robot: str) -> str:
    """Return what to type to try what stops a robot, by the name of its folder."""
    return f"rosrun robot_doctor doctor --robot {robot} --stops"


class Stopping(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What stops the robot, and what it shows of it.

    Attributes:
        uop: Allocation of the user operator panel. ``full``: all signals. ``simple``: no RSR starts
            the stream program, ``*IMSTP`` is tied on, SYSRDY, PROGRUN, PAUSED and HELD are not
            shown. ``none``: no input acts and no output is shown.
        tried: Of each means that was seen to stop this robot, the address at which: another address
            is another robot.
        braking_delay_ms: How long it goes on as it did, from a sample of it until it brakes: age
            and period of samples, the way of a request, its own filters and servo lag [ms].
    """

    uop: Literal["full", "simple", "none"]
    tried: dict[Means, HostName]
    braking_delay_ms: ReactionMs

    def cuts_drives(self, address: str) -> bool:
        """Whether ``*IMSTP`` was seen to stop the robot at ``address``: its drives go off by it."""
        return self.tried.get("imstp") == address

    @property
    def shows_all(self) -> bool:
        """Whether the outputs tell what its program and its drives do."""
        return self.uop == "full"

    def only_followed(self, address: str, robot: str) -> str:
        """Return why a robot is never led, and what to do; empty: it may be.

        Args:
            address: Where it is.
            robot: Its name.
        """
        if self.uop == "none":
            why = "no signal reaches the robot: allocate them on its screen I/O > UOP"
            return f"robot.yaml: stopping.uop is none: {why}"
        if self.uop == "simple":
            why = "no RSR starts its stream program: allocate all signals on its screen I/O > UOP"
            return f"robot.yaml: stopping.uop is simple: {why}"
        if address not in self.tried.values():
            why = f"stopping.tried names nothing that stopped {address}"
            how = f"try: {stops_command(robot)} (docs/operating/real_robot.md)"
            return f"robot.yaml: {why}: {how}"
        return ""

    def faults(self) -> Iterator[str]:
        """Yield the means that were tried and that the robot does not have."""
        has = ALLOCATED[self.uop]
        for means in self.tried:
            if means not in has:
                yield (
                    f"stopping.tried.{means}: uop is {self.uop}; "
                    f"it allocates {', '.join(has) or 'nothing'}"
                )
