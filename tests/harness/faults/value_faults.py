"""Does a wrong value get through? The links' real code against servers that lie.

Each sample is held against the truth.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from scara_config.robot import Joint
from twin_controller.core.events import AnyEvent, TwinMeasured
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.robot_sample import ControlType, RobotSample, WatchdogState
from twin_controller.twin.twin_link_io import TwinLink

from harness.faults.rows import Row
from harness.opponents.lying_robot import LAYOUT, ROBOT, LyingRobot, truth
from harness.opponents.lying_twin import LyingTwin
from harness.opponents.lying_twin import truth as twin_truth
from harness.pair import SETUP

TIMEOUT_S = 0.008
"""A small time-out makes the campaign quick: a third of the framing faults end in one."""
SLACK_S = 0.006
"""A lie passes that a drive could have made true since the sample before, and so long on top."""
ROUNDING = 1e-3
"""What text and float32 may change of the truth, in border units."""
SMALLEST_LIE = 0.4
"""A position with the other sign, as a part of a half range: the liars swing from a fifth of it."""
ACCEPTED = "samples accepted [part of all"
SHARP = "samples behind which the smallest lie is twice what is possible [part of them]"
HEALED = 50
"""So many samples are wanted once nobody lies any more."""
SIGNALS = frozenset(("cmdenbl", "sysrdy"))


@dataclass
class Judge:
    """Holds each sample against what was true at its stamp.

    Where nothing else was told at that stamp, it is the truth and nothing else. Of a lie that
    passes only as much is excused as is physically possible.
    """

    drives: ClassVar[Mapping[str, float]]
    """By unit, what no drive exceeds [unit/s^2]. Our own numbers: not those that are tested."""
    told: Mapping[float, bool]
    """Each stamp of the liar, and whether it lied about it; a stamp that is a lie is not there."""
    samples: int = 0
    sharp: int = 0
    """Samples so close behind the one before that the smallest lie is twice what is possible."""
    wrong: list[str] = field(default_factory=list)
    largest: float = 0.0
    _last: tuple[float, float] = (-math.inf, -math.inf)

    def reach(self, joints: Sequence[Joint], now: float, stamp: float) -> float:
        """Count a sample; return for how long a drive may have pushed since the one before [s]."""
        span = max(now - self._last[0], stamp - self._last[1]) + SLACK_S
        self.samples, self._last = self.samples + 1, (now, stamp)
        self.sharp += all(
            self.possible(joint, span, 0.0) < 0.5 * SMALLEST_LIE * _half(joint) for joint in joints
        )
        return span

    def possible(self, joint: Joint, reach: float, speed: float) -> float:
        """Return how far a joint can be from where it was expected, in its border unit."""
        return ROUNDING + reach * (speed + 0.5 * self.drives[joint.unit] * reach)

    def hold(
        self, joint: Joint, reach: float, at: tuple[float, float], true: tuple[float, float]
    ) -> None:
        """Compare position and speed of a joint, in border units, with what is possible.

        A drive may have pushed for ``reach`` [s]; 0 where the truth was told.
        """
        off, off_speed = (abs(a - b) for a, b in zip(at, true))
        possible = self.possible(joint, reach, max(abs(at[1]), abs(true[1])))
        possible_speed = ROUNDING + self.drives[joint.unit] * reach
        self.largest = max(self.largest, off / possible, off_speed / possible_speed)
        if not off <= possible or not off_speed <= possible_speed:
            self.wrong.append(
                f"{joint.name} is off by {off:.3f} {joint.unit},"
                f" {off_speed:.1f} {joint.unit}/s in {reach:.4f} s"
            )


class RobotJudge(Judge):
    """Judges what the Modbus link gives."""

    drives: ClassVar = {"deg": 80e3, "mm": 100e3}

    def take(self, sample: RobotSample, sent: float, received: float) -> None:
        """Check one sample."""
        span = self.reach(ROBOT.joints, received, sample.motion.time)
        reach = 0.0 if self.told.get(sample.clock_ms) is False else span
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
            self.hold(joint, reach, at, (q[k], qdot[k]))


class TwinJudge(Judge):
    """Judges what the twin controller's link gives to the core.

    Its drives push so hard that a lie about a speed passes; the truth may not be changed at all.
    """

    drives: ClassVar = {"deg": 200e3, "mm": 1000e3}

    def take(self, event: AnyEvent) -> None:
        """Check one input of the core."""
        if not isinstance(event, TwinMeasured):
            return
        span = self.reach(SETUP.joints, event.now, event.motion.time)
        reach = 0.0 if self.told.get(event.motion.time) is False else span
        q, qdot = twin_truth(event.motion.time)
        for k, joint in enumerate(SETUP.joints):
            at = (event.motion.q[k] / joint.scale, event.motion.qdot[k] / joint.scale)
            self.hold(joint, reach, at, (q[k] / joint.scale, qdot[k] / joint.scale))


def twin_lies(
    seed: int, count: int, progress: Callable[[int], None] = lambda done: None
) -> list[Row]:
    """Let a twin tell ``count`` lies to the twin controller's link; return what got through."""
    with LyingTwin(seed) as twin:
        judge = TwinJudge(twin.told)
        with TwinLink(SETUP, judge.take, lambda *_: None, twin.url):
            healed = _lied(twin, judge, count, progress, lambda: None)
    accepted = (0.4, f"{ACCEPTED} packets]", twin.sent)
    return _rows("the twin", twin.lies, count, judge, healed, accepted)


def robot_lies(
    seed: int, count: int, progress: Callable[[int], None] = lambda done: None
) -> list[Row]:
    """Let a robot tell ``count`` lies to the Modbus link; return what got through."""
    with LyingRobot(seed) as robot:
        judge = RobotJudge(robot.told)
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
        Row(name, SHARP, 0.5, judge.sharp / max(judge.samples, 1), at_least=True),
        Row(name, after, float(HEALED), float(judge.samples - healed), at_least=True),
        Row(name, "largest unnoticed deviation [part of what is possible]", 1.0, largest),
    ]


def _half(joint: Joint) -> float:
    """Return the half range that a liar swings in, in the border unit."""
    return abs(joint.upper if joint.upper > 0.0 else joint.lower) / joint.scale
