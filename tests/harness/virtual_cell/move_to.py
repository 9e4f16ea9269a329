"""``move_to`` in virtual time: the joint move, then the trim, as motion_server does both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.arm_kinematics import parse_elbow
from scara_control.kinematics.tool import tool_kinematics
from scara_control.motion.commands import Command
from scara_control.motion.requests import Outcome
from scara_control.motion.trim import Trim

from harness.virtual_cell.files import CellFiles
from harness.virtual_cell.schedule import Schedule

Ended = Callable[[bool, str], None]


class BeginMove(Protocol):
    """The service ``joint_pose_controller/move``."""

    def __call__(
        self,
        target: Sequence[float],
        speed_percent: float,
        ended: Callable[[Outcome], None],
        names: Sequence[str],
    ) -> None:
        """Begin a joint move."""


class MoveTo:
    """One request at a time; a newer one is refused while the older runs."""

    def __init__(
        self,
        schedule: Schedule,
        files: CellFiles,
        move: BeginMove,
        jog: Callable[[Sequence[str], Sequence[float]], None],
        clock: Callable[[], float],
    ) -> None:
        """Wire it to the pose controller (``move``) and the jog controller (``jog``)."""
        self._schedule, self._config = schedule, files.motion
        self._move, self._jog, self._clock = move, jog, clock
        self._tool = tool_kinematics(files.robot)
        self._names = [joint.name for joint in self._tool.joints]
        self._columns = [files.robot.twin_joints.index(joint) for joint in self._tool.joints]
        self.measured: JointMotion | None = None
        self._cancelled = ""
        self._paused = self._running = self._jogged = False
        self._inside = self._deadline = 0.0

    def obey(self, command: Command, reason: str) -> None:
        """Cancel by STOP and ESTOP, wait by PAUSE."""
        self._paused = command is Command.PAUSE
        if self._running and command in (Command.STOP, Command.ESTOP, Command.YIELD):
            self._cancelled = self._cancelled or f"cancelled by {command.text(reason)}"

    def begin(
        self,
        point: Sequence[float],
        speed_percent: float,
        elbow: str,
        ended: Ended,
        yaw: float | None = None,
    ) -> None:
        """Drive the tool to ``point`` [m] and ``yaw`` [rad]; ``ended`` is told how it ended."""
        if self._running or self.measured is None:
            ended(False, "an older request does not end" if self._running else "no joint states")
            return
        try:
            x, y, z = point
            answer = self._tool.inverse(x, y, z, parse_elbow(elbow), self._joints()[0], yaw)
        except ScaraControlError as error:
            ended(False, str(error))
            return
        self._running, self._cancelled, self._paused = True, "", False
        target = tuple(answer.chosen.q)

        def driven(outcome: Outcome) -> None:
            if self._cancelled or not outcome.success:
                self._end(ended, False, self._cancelled or outcome.message)
            else:
                self._begin_trim(target, tuple(point), ended)

        self._move(target, speed_percent, driven, self._names)

    def _joints(self) -> tuple[list[float], list[float]]:
        """Return position and velocity of the joints that move the tool."""
        assert self.measured is not None
        q, qdot = self.measured.q, self.measured.qdot
        return [q[k] for k in self._columns], [qdot[k] for k in self._columns]

    def _begin_trim(self, target: Sequence[float], point: Sequence[float], ended: Ended) -> None:
        self._inside, self._jogged = 0.0, False
        self._deadline = self._clock() + self._config.trim.timeout
        self._trim(Trim(self._tool, target, point, self._config), ended)

    def _trim(self, trimming: Trim, ended: Ended) -> None:
        """Go one period on with the trim; see MotionServer._trim."""
        config, period = self._config.trim, self._config.period
        step = trimming.step(*self._joints(), period)
        self._inside = 0.0 if any(step.qdot) else self._inside + period
        if self._cancelled:
            self._finish(ended, False, self._cancelled)
        elif self._inside >= config.settled:
            self._finish(ended, True, f"reached, {step.error * 1e3:.3f} mm from the point")
        elif step.error > config.range_mm * 1e-3 or self._clock() > self._deadline:
            self._finish(ended, False, f"the tool stays {step.error * 1e3:.3f} mm from the point")
        else:
            if self._paused:
                self._deadline += period
            elif self._inside == 0.0 or self._jogged:
                self._jog(self._names, step.qdot)
                self._jogged = True
            self._schedule.after(period, lambda: self._trim(trimming, ended))

    def _finish(self, ended: Ended, success: bool, message: str) -> None:
        """End the jogging before the answer."""
        if not self._jogged:
            self._end(ended, success, message)
            return
        self._jog(self._names, (0.0,) * len(self._names))
        self._schedule.after(self._config.trim.settled, lambda: self._end(ended, success, message))

    def _end(self, ended: Ended, success: bool, message: str) -> None:
        self._running = False
        ended(success, message)
