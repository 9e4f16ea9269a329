"""The real robot: the core's actions go out as signals, checked samples come in as its inputs."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections.abc import Callable

from scara_config import Robot
from scara_control.joint_motion import JointMotion
from typing_extensions import Self

from twin_controller.core.actions import Command, StreamAhead, StreamReal
from twin_controller.core.events import AnyEvent, RealAlarm
from twin_controller.core.orders.stop import GIVES_HOLD, TAKES_HOLD
from twin_controller.robot.checked_link_io import CheckedLink
from twin_controller.robot.intake import (
    HEARTBEAT_LOST,
    alarm_text,
    heartbeat_lost,
    is_faulted,
    is_paused,
    is_stopping,
    measured,
    program_text,
    stands,
)
from twin_controller.robot.link import Connect
from twin_controller.robot.signals import (
    UI_SIGNALS,
    SignalTable,
    gripper_steps,
    override_steps,
    steps,
)
from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    RobotSample,
)

_LOG = logging.getLogger("rosout.real_link")
REST = 1.0
"""A stream that ends with the controller has so long to come to rest [s]. Our choice."""
PULSES = 0.15
"""Then HOLD stays away so long first [s]: START and RSR pulses of 120 ms have ended. Our choice."""
OnData = Callable[[RobotSample, str, str, int], None]


class RealLink:
    """The link to the real robot, whatever its protocol; a context manager."""

    def __init__(
        self,
        robot: Robot,
        has_gripper: bool,
        connect: Connect,
        put: Callable[[AnyEvent], None],
        changed: Callable[[str, bool, str], None],
        on_data: OnData,
        alive: Callable[[], bool],
        table: SignalTable = UI_SIGNALS,
    ) -> None:
        """Prepare the link.

        Args:
            robot: robot.yaml.
            has_gripper: The robot has a suction gripper.
            connect: Makes the link of the robot's protocol.
            put: Takes checked inputs.
            changed: Told side, connected and why not.
            on_data: Gets each sample with program and alarm in words and the alarm's number.
            alive: Whether somebody still decides; else the robot's watchdog gets no heartbeat.
            table: What each command does on the robot's signals.
        """
        self._robot, self._has_gripper, self._table = robot, has_gripper, table
        self._alive = alive
        self._put, self._on_data = put, on_data
        self._program = self._alarm = self._program_name = ""
        self._alarm_number = 0
        self._alarm_status, self._stops = AlarmStatus(0, 0, "", "", ""), False
        # The watchdog holds the robot; something has stopped it: as of the last sample.
        self._shown = (False, False)
        # As of the last sample: START must not run a program that is not paused.
        self._paused = False
        # Our stream program runs, as of the last sample.
        self._streams = False
        # It was asked for, and no sample has shown it, or another program, since then.
        self._asked_stream = False
        # What took HOLD away last, an emergency stop before all others; None: it is there.
        self._held_by: Command | None = None
        self._before: JointMotion | None = None
        # A command is several writes: those of two threads must not mix.
        self._turn = threading.Lock()
        # Once the link ends only what stops the robot, in the end an emergency stop alone.
        self._obeyed = tuple(Command)
        # A sample was read that showed the robot stopped.
        self._rests = threading.Event()
        self._link = CheckedLink(
            robot,
            connect,
            self._sampled,
            lambda up, why: changed("real", up, why),
            self._told,
            lambda reason: _LOG.warning("real robot: %s", reason),
            alive,
        )

    def __enter__(self) -> Self:
        """Connect, again and again."""
        self._link.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """End what was started: a stream of ours first, then the robot's watchdog and the line.

        A program of the robot's own goes on. HOLD is given back to a robot that has stopped, for
        nobody else would; a paused program stays paused by it. One that was not seen to stop keeps
        it away and its watchdog armed, and an emergency stop stays. Where nobody decides any longer
        the watchdog stays armed too, and ends what runs.
        """
        with self._turn:
            # First of all: the engine still runs, and would go on to stream.
            self._obeyed = TAKES_HOLD
            if self._streams or self._asked_stream:
                self._do(Command.STOP_REAL)
        disarm = self._alive()
        if self._held_by is not None:
            time.sleep(PULSES)
            # An older sample at rest says nothing of this stop.
            self._rests.clear()
            disarm = self._rests.wait(REST)
            with self._turn:
                if disarm and self._held_by is not Command.ESTOP_REAL:
                    # The engine hears that the stream is gone, and would stop the pair for it.
                    self._obeyed = (Command.ESTOP_REAL,)
                    self._do(Command.GIVE_HOLD_BACK)
            if not disarm:
                _LOG.warning(
                    "real robot: not seen to stand; its HOLD stays away, and its watchdog armed"
                )
        self._link.close(disarm)

    @property
    def failure(self) -> BaseException | None:
        """The error that ended the link for good."""
        return self._link.failure

    @property
    def counters(self) -> dict[str, int]:
        """What went over the link, for diagnostics."""
        found = dataclasses.asdict(self._link.counters)
        return {key: value for key, value in found.items() if isinstance(value, int)}

    def stream(self, action: StreamReal) -> None:
        """Write one set point at its time."""
        with self._turn:
            if Command.START_STREAM in self._obeyed:
                self._link.write_setpoint(action)

    def stream_ahead(self, action: StreamAhead) -> None:
        """Write set points ahead of their time."""
        with self._turn:
            if Command.START_STREAM in self._obeyed:
                self._link.write_ahead(action)

    def override(self, speed_percent: float) -> None:
        """Set the override."""
        self._link.send(*override_steps(speed_percent))

    def grip(self, on: bool) -> None:
        """Switch the suction."""
        self._link.send(*gripper_steps(on))

    def perform(self, command: Command) -> None:
        """Carry out one command on the robot's signals."""
        with self._turn:
            if command in self._obeyed:
                self._do(command)

    def _do(self, command: Command) -> None:
        self._link.send(*steps(self._table, command, self._paused))
        if command in GIVES_HOLD:
            self._held_by = None
        elif command in TAKES_HOLD and self._held_by is not Command.ESTOP_REAL:
            self._held_by = command
        if command in (Command.START_STREAM, Command.CONTINUE_STREAM):
            self._asked_stream = True
        elif command in (*TAKES_HOLD, Command.END_AT_REST):
            self._asked_stream = False

    def _sampled(self, sample: RobotSample, sent: float, received: float) -> None:
        self._paused = is_paused(sample)
        # A robot that is only followed may be streamed to by another master: none of ours.
        self._streams = self._robot.lead and sample.moved_by is ControlType.STREAM
        if sample.moved_by is not ControlType.NONE:
            self._asked_stream = False
        before, self._before = self._before or sample.motion, sample.motion
        if "progrun" not in sample.outputs and stands(before, sample.motion, self._robot.joints):
            self._rests.set()
        program = self._program_name
        self._tell_alarm(self._alarm_status, heartbeat_lost(sample), is_faulted(sample))
        self._put(measured(sample, sent, received, self._robot, self._has_gripper, program))
        self._on_data(sample, self._program, self._alarm, self._alarm_number)

    def _told(self, program: ProgramStatus, alarm: AlarmStatus) -> None:
        self._program = program_text(program)
        # The blocks are read behind the sample: a program that has ended must not name the next.
        self._program_name = "" if program.state is ProgramState.ABORTED else program.name
        self._alarm_number = alarm.number if alarm.facility else 0
        self._tell_alarm(alarm, *self._shown)

    def _tell_alarm(self, alarm: AlarmStatus, lost: bool, faulted: bool) -> None:
        """Tell the core of the active alarm, or that the robot's watchdog holds it."""
        if (alarm, (lost, faulted)) == (self._alarm_status, self._shown):
            return
        self._alarm_status, self._shown = alarm, (lost, faulted)
        text = alarm_text(alarm) or (HEARTBEAT_LOST if lost else "")
        told = text, bool(text) and is_stopping(alarm, faulted)
        if told != (self._alarm, self._stops):
            self._alarm, self._stops = told
            self._put(RealAlarm(time.monotonic(), *told))
