"""A robot without a wire: its link writes down what it is asked, and plays the robot's samples."""

from __future__ import annotations

from typing import Any

import msgspec
from scara_config import Robot
from scara_control.joint_motion import JointMotion
from twin_controller.core.events import AnyEvent
from twin_controller.robot.link import RobotCounters, RobotListener
from twin_controller.robot.real_link_io import RealLink
from twin_controller.robot.signals import SignalTable
from twin_controller.robot_sample import ControlType, RobotSample, WatchdogState

from harness.sides import ROBOT

PERIOD_S = 0.01
STANDS = RobotSample(
    motion=JointMotion.at_rest((0.1, 0.2, -0.05, 0.3, 0.4)),
    clock_ms=0,
    control_type=ControlType.NONE,
    program_speed=50,
    override=80,
    heartbeat_echo=0,
    watchdog_state=WatchdogState.ARMED,
    outputs=frozenset(("sysrdy",)),
)


class MemoryLink:
    """The link of a protocol; ``asked`` is each call with its arguments, but for ``start``."""

    def __init__(self, listener: RobotListener) -> None:
        self.listener = listener
        self.name = "a robot in memory"
        self.counters = RobotCounters()
        self.asked: list[tuple[object, ...]] = []
        self.now = 100.0

    def __getattr__(self, name: str) -> Any:
        return lambda *arguments, **options: self.asked.append(
            (name, *arguments, *options.values())
        )

    def start(self) -> None:
        """Connect."""
        self.listener.opened()

    def show(self, *positions: float, **changes: object) -> bool:
        """Let the robot stand at these positions, and say whether it is believed."""
        self.now += PERIOD_S
        clock_ms = round(self.now * 1e3)
        still = (0.0,) * len(ROBOT.joints)
        motion = JointMotion.measured(positions or STANDS.motion.q, still, clock_ms * 1e-3)
        sample = msgspec.structs.replace(STANDS, motion=motion, clock_ms=clock_ms, **changes)
        return self.listener.sampled(sample, self.now - 0.001, self.now)


class MemoryCell:
    """The shared side on a link in memory, and all that it tells."""

    def __init__(self, table: SignalTable, has_gripper: bool = False, robot: Robot = ROBOT) -> None:
        self.events: list[AnyEvent] = []
        self.changes: list[tuple[str, bool, str]] = []
        self.words: list[tuple[str, str, int]] = []
        self.alive = True
        self.robot: MemoryLink

        def connect(listener: RobotListener) -> MemoryLink:
            self.robot = MemoryLink(listener)
            return self.robot

        self.link = RealLink(
            robot,
            has_gripper,
            connect,  # type: ignore[arg-type]
            self.events.append,
            lambda *change: self.changes.append(change),
            lambda sample, *words: self.words.append(words),
            lambda: self.alive,
            table,
        )
        self.robot.start()

    @property
    def asked(self) -> list[tuple[object, ...]]:
        """What the link was asked for so far."""
        return self.robot.asked
