"""Does a wrong value get through? The links' real code against servers that lie.

Each sample is held against the truth.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

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
ACCEPTED = "samples accepted [part of all"
HEALED = 50
"""So many samples are wanted once nobody lies any more."""
SIGNALS = frozenset(("cmdenbl", "sysrdy"))


@dataclass
class Judge:
    """Holds each sample against what was true at its stamp.

    A deviation that is physically possible is no silent one.
    """

    factor: ClassVar[float]
    """The accelerations that a link takes for possible, as a multiple of the joint's own."""
    samples: int = 0
    wrong: list[str] = field(default_factory=list)
    largest: float = 0.0
    _last: float = 0.0

    def begin(self, now: float) -> float:
        """Count a sample; return how long ago the one before it came [s]."""
        self.samples += 1
        span, self._last = now - self._last if self._last else 0.0, now
        return span

    def hold(
        self, joint: Joint, span: float, at: tuple[float, float], true: tuple[float, float]
    ) -> None:
        """Compare position and speed of a joint, in border units, with what is possible.

        They can change so far in ``span`` [s]; the stamp may be off by ``STAMP_S``.
        """
        off, off_speed = (abs(a - b) for a, b in zip(at, true))
        speed = max(abs(at[1]), abs(true[1]))
        acceleration, reach = self.factor * joint.acceleration / joint.scale, span + STAMP_S
        possible = 0.5 * acceleration * reach**2 + speed * STAMP_S + 0.06
        possible_speed = acceleration * reach + 11.0
        self.largest = max(self.largest, off / possible, off_speed / possible_speed)
        if not off <= possible or not off_speed <= possible_speed:
            self.wrong.append(
                f"{joint.name} is off by {off:.3f} {joint.unit},"
                f" {off_speed:.1f} {joint.unit}/s in {span:.4f} s"
            )


class RobotJudge(Judge):
    """Judges what the Modbus link gives."""

    factor = REAL_ACCELERATION

    def take(self, sample: RobotSample, sent: float, received: float) -> None:
        """Check one sample."""
        span = self.begin(received)
        q, qdot = truth(sample.clock_ms)
        others = (
            *(sample.control_type, sample.program_speed, sample.heartbeat_echo),
            *(sample.watchdog_state, sample.override),
        )
        if (
            others != (ControlType.PROGRAM, 50, 7, WatchdogState.ARMED, 80)
            or sample.outputs != SIGNALS
        ):
            self.wrong.append(f"{others} {sorted(sample.outputs)}")
        for k, joint in enumerate(ROBOT.joints):
            at = (sample.motion.q[k] / joint.scale, sample.motion.qdot[k] / joint.scale)
            self.hold(joint, span, at, (q[k], qdot[k]))


class TwinJudge(Judge):
    """Judges what the twin controller's link gives to the core."""

    factor = TWIN_ACCELERATION

    def take(self, event: AnyEvent) -> None:
        """Check one input of the core."""
        if not isinstance(event, TwinMeasured):
            return
        span = self.begin(event.now)
        q, qdot = twin_truth(event.motion.time)
        for k, joint in enumerate(SETUP.joints):
            at = (event.motion.q[k] / joint.scale, event.motion.qdot[k] / joint.scale)
            self.hold(joint, span, at, (q[k] / joint.scale, qdot[k] / joint.scale))


def twin_lies(
    seed: int, count: int, progress: Callable[[int], None] = lambda done: None
) -> list[Row]:
    """Let a twin tell ``count`` lies to the twin controller's link; return what got through."""
    judge = TwinJudge()
    with LyingTwin(seed) as twin, TwinLink(SETUP, judge.take, lambda *_: None, twin.url):
        healed = _lied(twin, judge, count, progress, lambda: None)
    accepted = (0.4, f"{ACCEPTED} packets]", twin.sent)
    return _rows("the twin", twin.lies, count, judge, healed, accepted)


def robot_lies(
    seed: int, count: int, progress: Callable[[int], None] = lambda done: None
) -> list[Row]:
    """Let a robot tell ``count`` lies to the Modbus link; return what got through."""
    judge = RobotJudge()
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
        taken = (judge.take, lambda *_: None, None, lambda _: None)
        with ModbusLink(settings, LAYOUT, ROBOT, *taken) as link:
            healed = _lied(robot, judge, count, progress, lambda: link.failure)
    return _rows(
        "the robot",
        robot.lies,
        count,
        judge,
        healed,
        (0.1, f"true {ACCEPTED} answers]", robot.answers),
    )


def _lied(
    liar: LyingRobot | LyingTwin,
    judge: Judge,
    count: int,
    progress: Callable[[int], None],
    failure: Callable[[], object],
) -> int:
    """Let somebody tell so many lies, then the truth for a while.

    Return how many samples had been accepted when the lies ended.
    """
    while (told := sum(liar.lies.values())) < count:
        progress(told)
        time.sleep(0.5)
        assert sum(liar.lies.values()) > told and failure() is None, (
            f"the link does not come back after {told} lies: {failure()!r}"
        )
    liar.honest = True
    healed = judge.samples
    deadline = time.monotonic() + 5.0
    while judge.samples < healed + HEALED and time.monotonic() < deadline:
        time.sleep(0.02)
    return healed


def _rows(
    who: str,
    lies: Counter[str],
    count: int,
    judge: Judge,
    healed: int,
    accepted: tuple[float, str, int],
) -> list[Row]:
    """Return what got through; ``accepted``: the least share, its name, and of how many."""
    name, (least, share, answers) = f"{len(lies)} kinds of lies of {who}", accepted
    after = "samples after it tells the truth again"
    largest = judge.largest if math.isfinite(judge.largest) else 9.9
    return [
        Row(name, "lies told", float(count), float(sum(lies.values())), at_least=True),
        Row(name, "silent wrong values", 0.0, float(len(judge.wrong)), always=True),
        Row(name, share, least, judge.samples / answers, at_least=True),
        Row(name, after, float(HEALED), float(judge.samples - healed), at_least=True),
        Row(name, "largest unnoticed deviation [part of what is possible]", 1.0, largest),
    ]
