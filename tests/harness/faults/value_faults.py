"""Does a wrong value get through? The links' real code against servers that lie.

Each sample is held against the truth.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from scara_config.robot import Joint
from twin_controller.core.events import AnyEvent, TwinMeasured
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.plausible import REAL_ACCELERATION, TWIN_ACCELERATION
from twin_controller.robot_sample import ControlType, RobotSample, WatchdogState
from twin_controller.twin.twin_link_io import TwinLink

from harness.faults.rows import Row
from harness.opponents.lying_robot import LAYOUT, ROBOT, LyingRobot, truth
from harness.opponents.lying_twin import LyingTwin
from harness.opponents.lying_twin import truth as twin_truth
from harness.pair import SETUP

TIMEOUT_S = 0.008
"""A small time-out makes the campaign quick: a third of the framing faults end in one."""
STAMP_S = 0.04
"""By how much a wrong stamp can be off unnoticed: EARLY and a period."""
SIGNALS = frozenset(("cmdenbl", "sysrdy"))


@dataclass
class Judge:
    """Holds each sample against what was true at its clock.

    A deviation that is physically possible is no silent one.
    """

    samples: int = 0
    wrong: list[str] = field(default_factory=list)
    unnoticed: int = 0
    largest: float = 0.0
    _last: float = 0.0

    def take(self, sample: RobotSample, sent: float, received: float) -> None:
        """Check one sample."""
        self.samples += 1
        span, self._last = received - self._last if self._last else 0.0, received
        q, qdot = truth(sample.clock_ms)
        others = (
            sample.control_type,
            sample.program_speed,
            sample.heartbeat_echo,
            sample.watchdog_state,
            sample.override,
        )
        if (
            others != (ControlType.PROGRAM, 50, 7, WatchdogState.ARMED, 80)
            or sample.outputs != SIGNALS
        ):
            self.wrong.append(f"{others} {sorted(sample.outputs)}")
        for k, joint in enumerate(ROBOT.joints):
            off = abs(sample.motion.q[k] / joint.scale - q[k])
            off_speed = abs(sample.motion.qdot[k] / joint.scale - qdot[k])
            possible, possible_speed = _possible(
                joint, span, max(abs(v) for v in (qdot[k], sample.motion.qdot[k] / joint.scale))
            )
            self.unnoticed += off > 1e-3 or off_speed > 1e-2
            self.largest = max(self.largest, off / possible, off_speed / possible_speed)
            if not off <= possible or not off_speed <= possible_speed:
                self.wrong.append(
                    f"{joint.name} is off by {off:.3f} {joint.unit},"
                    f" {off_speed:.1f} {joint.unit}/s in {span:.4f} s"
                )


def _possible(
    joint: Joint, span: float, speed: float, factor: float = REAL_ACCELERATION
) -> tuple[float, float]:
    """Return how far position and speed can change in ``span`` [s], in border units.

    The stamp may be off by ``STAMP_S``.
    """
    scale, acceleration = joint.scale, factor * joint.acceleration
    reach = span + STAMP_S
    return (
        0.5 * acceleration / scale * reach**2 + speed * STAMP_S + 0.06,
        acceleration / scale * reach + 11.0,
    )


def twin_lies(
    seed: int, count: int, progress: Callable[[int], None] = lambda done: None
) -> list[Row]:
    """Let a twin tell ``count`` lies to the twin controller's link; return what got through."""
    judge, links = TwinJudge(), 0

    def changed(side: str, up: bool, reason: str) -> None:
        nonlocal links
        links += up

    with LyingTwin(seed) as twin, TwinLink(SETUP, judge.take, changed, twin.url):
        while (told := sum(twin.lies.values())) < count:
            progress(told)
            time.sleep(0.5)
            assert sum(twin.lies.values()) > told, f"the link does not come back after {told} lies"
        twin.honest = True
        healed = judge.samples
        deadline = time.monotonic() + 5.0
        while judge.samples < healed + 50 and time.monotonic() < deadline:
            time.sleep(0.02)
    name = f"{len(twin.lies)} kinds of lies of the twin"
    return [
        Row(name, "lies told", float(count), float(sum(twin.lies.values())), at_least=True),
        Row(name, "silent wrong values", 0.0, float(len(judge.wrong)), always=True),
        Row(
            name,
            "samples accepted [part of all packets]",
            0.4,
            judge.samples / twin.sent,
            at_least=True,
        ),
        Row(
            name,
            "samples after it tells the truth again",
            50.0,
            float(judge.samples - healed),
            at_least=True,
        ),
        Row(name, "largest unnoticed deviation [part of what is possible]", 1.0, judge.largest),
    ]


@dataclass
class TwinJudge:
    """Holds each joint state of the twin against what was true at its stamp."""

    samples: int = 0
    wrong: list[str] = field(default_factory=list)
    largest: float = 0.0
    _last: float = 0.0

    def take(self, event: AnyEvent) -> None:
        """Check one input of the core."""
        if not isinstance(event, TwinMeasured):
            return
        self.samples += 1
        span, self._last = event.now - self._last if self._last else 0.0, event.now
        for k, joint in enumerate(SETUP.joints):
            q, qdot = (row[k] for row in twin_truth(event.motion.time))
            off, off_speed = (
                abs(event.motion.q[k] - q) / joint.scale,
                abs(event.motion.qdot[k] - qdot) / joint.scale,
            )
            possible, possible_speed = _possible(
                joint,
                span,
                max(abs(qdot), abs(event.motion.qdot[k])) / joint.scale,
                TWIN_ACCELERATION,
            )
            self.largest = max(self.largest, off / possible, off_speed / possible_speed)
            if not off <= possible or not off_speed <= possible_speed:
                self.wrong.append(
                    f"{joint.name} is off by {off:.3f} {joint.unit},"
                    f" {off_speed:.1f} {joint.unit}/s in {span:.4f} s"
                )


def robot_lies(
    seed: int, count: int, progress: Callable[[int], None] = lambda done: None
) -> list[Row]:
    """Let a robot tell ``count`` lies to the Modbus link; return what got through."""
    judge, changes, rejected = Judge(), 0, 0

    def changed(up: bool, reason: str) -> None:
        nonlocal changes
        changes += 1

    def refuse(reason: str) -> None:
        nonlocal rejected
        rejected += 1

    with LyingRobot(seed) as robot:
        settings = ModbusSettings(
            "127.0.0.1",
            robot.port,
            poll_period=0.0003,
            timeout=TIMEOUT_S,
            retry_first=0.0005,
            retry_last=0.001,
            heartbeat=False,
        )
        with ModbusLink(settings, LAYOUT, ROBOT, judge.take, changed, None, refuse) as link:
            before = -1
            while (told := sum(robot.lies.values())) < count:
                assert told > before and link.failure is None, (
                    f"after {told} lies: {link.failure!r}"
                )
                before = told
                progress(told)
                time.sleep(0.5)
            robot.honest = True
            healed = judge.samples
            deadline = time.monotonic() + 5.0
            while judge.samples < healed + 50 and time.monotonic() < deadline:
                time.sleep(0.02)
        told = sum(robot.lies.values())
    name = f"{len(robot.lies)} kinds of lies of the robot"
    return [
        Row(name, "lies told", float(count), float(told), at_least=True),
        Row(name, "silent wrong values", 0.0, float(len(judge.wrong)), always=True),
        Row(
            name,
            "true samples accepted [part of all answers]",
            0.1,
            judge.samples / robot.answers,
            at_least=True,
        ),
        Row(
            name,
            "samples after it tells the truth again",
            50.0,
            float(judge.samples - healed),
            at_least=True,
        ),
        Row(
            name,
            "largest unnoticed deviation [part of what is possible]",
            1.0,
            judge.largest if math.isfinite(judge.largest) else 9.9,
        ),
    ]
