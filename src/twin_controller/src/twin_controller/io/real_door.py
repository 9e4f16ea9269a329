"""The real robot behind its Modbus link: typed actions go out, checked inputs come in."""

from __future__ import annotations

import dataclasses
import logging
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from scara_config import Robot
from scara_config.modbus_map import ModbusMap

from twin_controller.core.actions import Do
from twin_controller.core.events import AnyEvent, RealAlarm, RealMeasured
from twin_controller.core.state import Setup
from twin_controller.io.modbus.link import ModbusLink, ModbusSettings
from twin_controller.robot_sample import AlarmStatus, ControlType, ProgramStatus, RobotSample

_LOG = logging.getLogger("rosout.real_door")
OnData = Callable[[RobotSample, str, str], None]


class RealDoor:
    """The link to the real robot; a context manager."""

    def __init__(
        self,
        setup: Setup,
        robot: Robot,
        layout: ModbusMap,
        host: str,
        port: int,
        put: Callable[[AnyEvent], None],
        changed: Callable[[str, bool, str], None],
        on_data: OnData,
        alive: Callable[[], bool],
    ) -> None:
        """Prepare the link.

        Args:
            setup: Profile and numbers.
            robot: robot.yaml.
            layout: modbus_map.yaml.
            host: Of the robot.
            port: Of its Modbus server.
            put: Takes checked inputs.
            changed: Told side, connected and why not.
            on_data: Gets each sample with the robot's program and alarm in words.
            alive: Whether somebody still decides; without it the robot's watchdog gets no heartbeat.
        """
        real = setup.config.real
        self._put, self._on_data = put, on_data
        self._grips = layout.has_gripper
        self._columns = [k for k, joint in enumerate(robot.joints) if joint.twin]
        self._program = self._alarm = ""
        self._paused = False
        settings = ModbusSettings(host, port, poll_period=real.poll_period_ms * 1e-3, timeout=real.timeout_ms * 1e-3)
        self._link = ModbusLink(
            settings, layout, robot, self._sampled, lambda up, why: changed("real", up, why), self._status, self._rejected, alive
        )

    def __enter__(self) -> Self:
        """Connect, again and again."""
        self._link.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Disarm the robot's watchdog and disconnect."""
        self._link.close()

    @property
    def counters(self) -> dict[str, int]:
        """What went over the link, for diagnostics."""
        return {key: value for key, value in dataclasses.asdict(self._link.counters).items() if isinstance(value, int)}

    def stream(self, q: tuple[float, ...], speed_percent: float, at: float) -> None:
        """Write one set point, SI, at ``at`` (monotonic)."""
        self._link.write_setpoint(q, speed_percent, at)

    def override(self, speed_percent: float) -> None:
        """Set the override."""
        self._link.write_override(round(speed_percent))

    def grip(self, on: bool) -> None:
        """Switch the suction."""
        self._link.set_coil("gripper", on)

    def perform(self, do: Do) -> None:
        """Carry out one action on the robot's UI signals."""
        if do in (Do.STOP_REAL, Do.HOLD_REAL, Do.ESTOP_REAL):
            self._link.drop_setpoints()
        match do:
            case Do.STOP_REAL:
                self._link.pulse("cstopi")
                self._link.write_integer("setpoint_valid", 0)
                self._link.set_coil("hold", True)
            case Do.HOLD_REAL:
                self._link.set_coil("hold", False)
            case Do.RELEASE_REAL:
                self._link.set_coil("hold", True)
                if self._paused:
                    self._link.pulse("start")
            case Do.ESTOP_REAL:
                self._link.set_coil("imstp", False)
                self._link.pulse("cstopi")  # an alarm may only pause a program; a reset must not give it back
                self._link.write_integer("setpoint_valid", 0)
            case Do.RESET_REAL:
                self._link.set_coil("imstp", True)
                self._link.set_coil("hold", True)
                self._link.pulse("fault_reset")
            case Do.START_STREAM:
                self._link.pulse("rsr1", behind=True)  # never with an old set point

    def _sampled(self, sample: RobotSample, sent: float, received: float) -> None:
        self._paused = "paused" in sample.outputs
        self._put(
            RealMeasured(
                now=received,
                sent=sent,
                received=received,
                clock_ms=sample.clock_ms,
                q=tuple(sample.positions[k] for k in self._columns),
                qdot=tuple(sample.velocities[k] for k in self._columns),
                own_program=sample.moved_by is ControlType.PROGRAM,
                streaming=sample.moved_by is ControlType.STREAM,
                paused="paused" in sample.outputs or "held" in sample.outputs,
                drives_on="sysrdy" in sample.outputs,
                fault="fault" in sample.outputs,
                speed_percent=sample.override * sample.program_speed * 1e-2,
                override_percent=float(sample.override),
                gripper="gripper" in sample.outputs if self._grips else None,
                vacuum="vacuum" in sample.outputs,
            )
        )
        self._on_data(sample, self._program, self._alarm)

    def _status(self, program: ProgramStatus, alarm: AlarmStatus) -> None:
        self._program = f"{program.name} line {program.line} {program.state.name.lower()}" if program.name else ""
        text = ""
        if alarm.facility:
            text = f"{alarm.severity} {alarm.facility}-{alarm.number:03d} {alarm.message}"
            text = text.strip() + (f" ({alarm.cause})" if alarm.cause else "")
        if text != self._alarm:
            self._alarm = text
            self._put(RealAlarm(time.monotonic(), text))

    def _rejected(self, reason: str) -> None:
        _LOG.warning("real robot: %s", reason)
