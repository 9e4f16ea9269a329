"""The shared side of every link to a robot: samples are checked here, set points made whole.

This is the shell around :mod:`twin_controller.robot.intake`. It listens to the link of one protocol
and tells its owner only what is believed.
"""

from __future__ import annotations

from collections.abc import Callable

import msgspec
from scara_config import Robot
from scara_control.limits import inside
from typing_extensions import Self

from twin_controller.core.actions import RobotSetpoint, StreamAhead, StreamReal
from twin_controller.plausible import Verdict
from twin_controller.robot.intake import Intake, begin, take, whole_pose
from twin_controller.robot.link import Connect, LinkLostError, RobotCounters
from twin_controller.robot.signals import (
    DropSetpoints,
    Number,
    Pulse,
    Signal,
    StandHere,
    Step,
    TakeBack,
)
from twin_controller.robot_sample import AlarmStatus, ProgramStatus, RobotSample, SetpointError

replace = msgspec.structs.replace

OnSample = Callable[[RobotSample, float, float], None]
OnChange = Callable[[bool, str], None]
OnStatus = Callable[[ProgramStatus, AlarmStatus], None]
OnReject = Callable[[str], None]


class CheckedLink:
    """A link to a robot that hands over believed samples only; a context manager.

    All calls return at once. All callbacks come from the threads of the link.

    Args:
        robot: robot.yaml.
        connect: Makes the link of the robot's protocol.
        on_sample: Gets each believed sample with the monotonic times of its request and answer.
        on_change: Told that the link is up (with the first believed sample) or lost, and why.
        on_status: Gets program and alarm when they may have changed.
        on_reject: Told of an answer that was not believed and of a write that did not go through.
        alive: Whether the owner still decides; without it there is no heartbeat, so that the robot
            stops by itself.

    Attributes:
        failure: The error that ended the link for good.
    """

    def __init__(
        self,
        robot: Robot,
        connect: Connect,
        on_sample: OnSample,
        on_change: OnChange,
        on_status: OnStatus | None = None,
        on_reject: OnReject | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> None:
        self.failure: BaseException | None = None
        self._robot = robot
        self._on_sample, self._on_change, self._on_status = on_sample, on_change, on_status
        self._on_reject, self._alive = on_reject, alive
        self._intake = Intake()
        self._up: bool | None = None  # None until the first connection is made or has failed
        self._link = connect(self)

    def __enter__(self) -> Self:
        """Start connecting."""
        self._link.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End; see :meth:`close`."""
        self.close()

    def close(self, disarm: bool = True) -> None:
        """End the link; ``disarm`` the robot's watchdog first, so that the end is no alarm."""
        self._link.close(disarm)

    @property
    def connected(self) -> bool:
        """Good samples come."""
        return self._up is True

    @property
    def counters(self) -> RobotCounters:
        """What went over the link."""
        return self._link.counters

    # What the owner asks for

    def send(self, *sequence: Step) -> None:
        """Ask the robot for each step, in order.

        Raises:
            NotWritableError: The profile does not allow one of them.
        """
        for step in sequence:
            match step:
                case Signal():
                    self._link.set_signal(step.name, step.level)
                case Pulse():
                    self._link.pulse(step.name, behind=step.behind)
                case Number():
                    self._link.write_integer(step.name, step.value)
                case DropSetpoints():
                    self._link.drop_setpoints()
                case TakeBack():
                    self._link.take_back_setpoints()
                case StandHere():
                    # Without a reading the robot's own set point stays.
                    reading = self._intake.plausible.last
                    if reading is not None:
                        # A reading may be a little outside its range, a set point may not.
                        joints = inside(self._robot.joints, reading.motion.q)
                        q = (*joints, *self._intake.axes)
                        self._link.write_setpoint(StreamReal(RobotSetpoint(q), 1.0, 0.0))

    def write_setpoint(self, action: StreamReal) -> None:
        """Write a set point of the twin's joints at its time.

        Joints that the twin does not have stay where they were when the stream began or went on.
        """
        try:
            whole = replace(action, setpoint=self._whole(action.setpoint))
        except SetpointError as error:
            self._refuse(error)
        else:
            self._link.write_setpoint(whole)

    def write_ahead(self, action: StreamAhead) -> None:
        """Write set points of the twin's joints ahead of their time; the other joints as above."""
        try:
            whole = replace(action, points=tuple(map(self._whole, action.points)))
        except SetpointError as error:
            self._refuse(error)
        else:
            self._link.write_ahead(whole)

    def _whole(self, setpoint: RobotSetpoint) -> RobotSetpoint:
        """Return a set point for all joints of the robot."""
        return replace(setpoint, q=whole_pose(self._intake, setpoint.q, self._robot.joints))

    def _refuse(self, error: SetpointError) -> None:
        self._link.counters.refused += 1
        self.rejected(str(error))

    # What the link of the protocol tells (RobotListener)

    def opened(self) -> None:
        """Forget the readings of the connection before."""
        self._intake = begin(self._intake)

    def sampled(self, sample: RobotSample, sent: float, received: float) -> bool:
        """Hand a sample over if it can follow the one before, and say so.

        Raises:
            LinkLostError: Readings that fit each other, but not what was before: the robot jumped.
        """
        self._intake, verdict = take(self._intake, sample, received, self._robot.joints)
        if verdict in (Verdict.REFUSED, Verdict.JUMPED):
            reason = self._intake.plausible.reason
            self._link.counters.rejected += 1
            self.rejected(f"sample: {reason}")
            if verdict is Verdict.JUMPED:
                where = self._link.name
                raise LinkLostError(f"the readings of the robot at {where} jumped: {reason}")
        if verdict is not Verdict.ACCEPTED:
            return False
        self._link.counters.samples += 1
        if not self._up:
            self._up = True
            self._link.counters.connects += 1
            self._on_change(True, f"connected to {self._link.name}")
        self._on_sample(sample, sent, received)
        return True

    def lost(self, reason: str) -> None:
        """Tell the owner once."""
        self._link.counters.losses += self._up is True
        if self._up is not False:
            self._up = False
            self._on_change(False, reason)

    def died(self, error: BaseException) -> None:
        """Keep the error and tell the owner."""
        self.failure, self._up = error, False
        self._on_change(False, f"the link died: {error!r}")

    def told(self, program: ProgramStatus, alarm: AlarmStatus) -> None:
        """Hand program and alarm over."""
        if self._on_status is not None:
            self._on_status(program, alarm)

    def rejected(self, reason: str) -> None:
        """Tell the owner what was not believed or did not go through."""
        if self._on_reject is not None:
            self._on_reject(reason)

    def alive(self) -> bool:
        """Ask the owner whether it still decides."""
        return self._alive()
