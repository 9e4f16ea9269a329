"""The checked link to a robot on Modbus TCP: the protocol's link and the shared side together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from scara_config import Robot
from scara_config.modbus_map import ModbusMap

from twin_controller.core.actions import RobotSetpoint, StreamAhead, StreamReal
from twin_controller.modbus.port_io import ModbusSettings
from twin_controller.modbus.robot_link_io import ModbusRobotLink
from twin_controller.robot.checked_link_io import (
    CheckedLink,
    OnChange,
    OnReject,
    OnSample,
    OnStatus,
)
from twin_controller.robot.link import NotWritableError, RobotListener

__all__ = ["ModbusLink", "ModbusSettings", "NotWritableError"]


class ModbusLink(CheckedLink):
    """A checked link on Modbus for whoever needs no decisions: doctor, benchmark, tests.

    Args:
        settings: Address and times.
        layout: modbus_map.yaml.
        robot: robot.yaml.
        on_sample: See :class:`CheckedLink`, as all that follow.
        on_change: See there.
        on_status: See there; without it the program and alarm blocks are not read.
        on_reject: See there.
        alive: See there.
    """

    def __init__(
        self,
        settings: ModbusSettings,
        layout: ModbusMap,
        robot: Robot,
        on_sample: OnSample,
        on_change: OnChange,
        on_status: OnStatus | None = None,
        on_reject: OnReject | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> None:
        self.settings = settings

        def connect(listener: RobotListener) -> ModbusRobotLink:
            return ModbusRobotLink(settings, layout, robot, listener, on_status is not None)

        super().__init__(robot, connect, on_sample, on_change, on_status, on_reject, alive)

    def write_now(self, positions: Sequence[float], speed_percent: float) -> None:
        """Write one set point of the twin's joints [rad or m] at once, as ``write_at``."""
        self.write_setpoint(StreamReal(RobotSetpoint(tuple(positions)), speed_percent, 0.0))

    def write_at(
        self, positions: Sequence[float], speed_percent: float, number: int, clock_ms: int
    ) -> None:
        """Write one set point ahead of its time, to a robot that takes such.

        Args:
            positions: Of the twin's joints [rad or m].
            speed_percent: Of the stream program.
            number: 1 more than that of the set point before.
            clock_ms: When it counts, on the robot's own clock.
        """
        point = RobotSetpoint(tuple(positions), number, clock_ms)
        self.write_ahead(StreamAhead((point,), number, speed_percent))
