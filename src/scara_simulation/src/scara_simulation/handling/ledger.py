"""What became of each part: held, placed, dropped.

Told where the parts are, it says what has happened.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, auto

import msgspec
from scara_ros.message_struct import struct_of

from scara_msgs.msg import PartEvent

UPRIGHT = 0.98
"""Cosine of the largest tilt of a part that counts as placed. Our choice: 11 deg."""


class PartView(msgspec.Struct, frozen=True):
    """One part as it is seen now.

    Attributes:
        name: Its name.
        position: Middle of its underside, x y z [m] in the world.
        upright: Cosine of its tilt.
        resting: It does not move against what it lies on.
        held: It hangs at the gripper.
        support: What it lies on; empty: nothing.
    """

    name: str
    position: tuple[float, float, float]
    upright: float
    resting: bool
    held: bool
    support: str


class Happening(struct_of(PartEvent)):  # type: ignore[misc]
    """The fields of scara_msgs/PartEvent."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)


class PartPhase(Enum):
    """What a part is doing."""

    RESTING = auto()
    HELD = auto()
    LET_GO = auto()
    FALLEN = auto()


class Ledger:
    """Memory of all parts.

    Args:
        drop: A part that is not held and gets so much lower [m] was dropped.
    """

    def __init__(self, drop: float) -> None:
        self._drop = drop
        self._known: dict[str, tuple[PartPhase, float]] = {}

    def observe(self, views: Sequence[PartView]) -> list[Happening]:
        """Take in where parts are now and return what has happened.

        Parts that are not told are as before.
        """
        found: list[Happening] = []
        for view in views:
            phase, height = self._known.get(view.name, (PartPhase.RESTING, view.position[2]))
            self._known[view.name], happened = self._judge(view, phase, height)
            if happened is not None:
                found.append(happened)
        return found

    def _judge(
        self, view: PartView, phase: PartPhase, height: float
    ) -> tuple[tuple[PartPhase, float], Happening | None]:
        """Return the part's phase and the height it may fall from, and what has happened to it."""
        z = view.position[2]
        if view.held:
            return (PartPhase.HELD, z), None
        # A fall is told once, however far it goes on.
        if phase is not PartPhase.FALLEN and z < height - self._drop:
            text = f"{view.name} was dropped: it fell by more than {self._drop * 1e3:g} mm"
            return (PartPhase.FALLEN, z), _happening(PartEvent.DROPPED, view, text)
        if view.resting and view.support:
            placed = phase in (PartPhase.HELD, PartPhase.LET_GO) and view.upright >= UPRIGHT
            text = f"{view.name} was placed on {view.support}"
            return (PartPhase.RESTING, z), _happening(
                PartEvent.PLACED, view, text
            ) if placed else None
        return (PartPhase.LET_GO if phase is PartPhase.HELD else phase, height), None


def _happening(kind: str, view: PartView, text: str) -> Happening:
    return Happening(kind, view.name, view.support, text, view.position)
