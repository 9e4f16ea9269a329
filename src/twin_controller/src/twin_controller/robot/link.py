"""The seam to the robot: what a protocol has to do (RobotLink), and whom it tells (RobotListener).

A protocol knows its wire and nothing else. It writes what it is asked to write, and it hands over
what it has read as a RobotSample: all joints of robot.yaml, in SI. A set point is the core's own
action, completed by the joints that the twin does not have, and behind them by the axes that the
samples tell: robot.yaml need not name each of them. Which signals make a stop, which sample
is believed and where the joints without a twin stay is decided behind the seam, once for all
protocols: see :mod:`twin_controller.robot.signals` and :mod:`twin_controller.robot.intake`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Protocol

from twin_controller.core.actions import StreamAhead, StreamReal
from twin_controller.robot_sample import AlarmStatus, ProgramStatus, RobotSample


class LinkLostError(ConnectionError):
    """A connection is of no use any longer; the text says why."""


class NotWritableError(ValueError):
    """The profile does not allow the twin controller to write there."""


REPEATED = ("busy", "late", "lost", "short")
"""Answers that were asked for again; a doubled one is only dropped."""


@dataclasses.dataclass(slots=True)
class RobotCounters:
    """What went over the link since its start; times in s.

    Of the polls, ``aimed`` were placed by the instants at which the robot renews its readings.
    Bad answers of five kinds cost no connection.
    """

    polls: int = 0
    aimed: int = 0
    samples: int = 0
    rejected: int = 0
    late: int = 0
    setpoints: int = 0
    refused: int = 0
    dropped: int = 0
    connects: int = 0
    losses: int = 0
    busy_answers: int = 0
    late_answers: int = 0
    lost_answers: int = 0
    doubled_answers: int = 0
    short_answers: int = 0
    round_trip: float = 0.0
    longest_round_trip: float = 0.0


class RobotLink(Protocol):
    """A connection to the robot that comes back by itself. Every call returns at once.

    ``set_signal``, ``pulse`` and ``write_integer`` keep their order. What waits while there is no
    connection is dropped and counted: nothing is replayed after a reconnect.
    """

    @property
    def name(self) -> str:
        """Where the robot is, for texts."""

    @property
    def counters(self) -> RobotCounters:
        """What went over the link; the listener counts samples, rejections, connects and losses."""

    def start(self) -> None:
        """Begin to connect."""

    def close(self, disarm: bool = True) -> None:
        """End the link; ``disarm`` the robot's watchdog first, so that the end is no alarm."""

    def write_setpoint(self, setpoint: StreamReal) -> None:
        """Write a set point of all joints of the robot at its time.

        It replaces the set points that wait for then or later.
        """

    def write_ahead(self, ahead: StreamAhead) -> None:
        """Write set points of all joints ahead of their time.

        Only to a robot whose samples say that it can.
        """

    def drop_setpoints(self) -> None:
        """Forget the set points that wait for their time: the robot is to stop."""

    def take_back_setpoints(self) -> None:
        """Tell the robot that none of its set points counts any longer."""

    def set_signal(self, name: str, level: bool) -> None:
        """Set one input of the robot.

        Raises:
            NotWritableError: The profile does not allow it.
        """

    def pulse(self, name: str, behind: bool = False) -> None:
        """Switch one input on and soon off; with ``behind`` not before a set point that waits.

        Raises:
            NotWritableError: The profile does not allow it.
        """

    def write_integer(self, name: str, value: int) -> None:
        """Write one whole number.

        Raises:
            NotWritableError: The profile does not allow it.
        """


class RobotListener(Protocol):
    """Whom a link tells; every call comes from the link's own threads."""

    def opened(self) -> None:
        """Hear that a connection has been made: nothing known of the robot holds any longer."""

    def sampled(self, sample: RobotSample, sent: float, received: float) -> bool:
        """Hear of one sample, with the monotonic times of its request and its answer.

        Returns:
            Whether it is believed.

        Raises:
            LinkLostError: The robot's readings have jumped. The link must begin anew.
        """

    def lost(self, reason: str) -> None:
        """Hear that a connection was lost, or that none could be made."""

    def died(self, error: BaseException) -> None:
        """Hear that an error of the link itself, or of its listener, has ended it for good."""

    def told(self, program: ProgramStatus, alarm: AlarmStatus) -> None:
        """Hear of program and alarm when they may have changed."""

    def rejected(self, reason: str) -> None:
        """Hear of an answer that was not believed, or of a write that did not go through."""

    def alive(self) -> bool:
        """Tell whether somebody still decides; if not, the robot's watchdog gets no heartbeat."""


Connect = Callable[[RobotListener], RobotLink]
"""Makes the link of a protocol that tells this listener."""
