"""Where the stream program gets its set points: PR[1], or the ring of set points ahead."""

from __future__ import annotations

from collections.abc import Sequence

from scara_config import Joint

from fanuc_emulator.alarms import POSITION_INVALID, RefusedError, check_ranges
from fanuc_emulator.streaming.ring import Row, SetpointRing


class StreamSource:
    """What a client has written for the stream program.

    The ring goes before PR[1] once set points were given in it.

    Args:
        joints: Of robot.yaml.
        start: What PR[1] holds after a cold start [rad or m].
        places: Of the ring; 0: there is none.

    Attributes:
        ring: Set points ahead.
        speed_percent: R[2].
        valid: PR[1] is complete; an incomplete one is not used.
    """

    def __init__(self, joints: Sequence[Joint], start: Row, places: int) -> None:
        self.ring = SetpointRing(places)
        self.speed_percent = 100
        self.valid = False
        self._joints = tuple(joints)
        self._setpoint = start
        self._checked: Row | None = None

    @property
    def setpoint(self) -> Row:
        """PR[1] [rad or m]."""
        return self._setpoint

    def write(self, positions: Sequence[float]) -> None:
        """Set PR[1]: positions in the order of robot.yaml [rad or m]."""
        self._setpoint = tuple(positions)

    def wanted(self, clock_ms: int) -> Row | None:
        """Return where the stream program is to go now [rad or m]; None: it stays.

        Args:
            clock_ms: The robot's own clock.

        Raises:
            RefusedError: A joint cannot go there, or the ring holds no positions.
        """
        if self.ring.fed:
            row = self.ring.at(clock_ms)
        else:
            row = self._setpoint if self.valid else None
        if row is not None and row is not self._checked:
            if len(row) != len(self._joints):
                why = "a set point of the ring has a time, but nobody has written its positions"
                raise RefusedError(POSITION_INVALID, why)
            check_ranges(self._joints, row)
            self._checked = row
        return row

    def check_again(self) -> None:
        """Judge PR[1] again, though it is the same: a program begins."""
        self._checked = None
