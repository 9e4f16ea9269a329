"""The fourth group: the links.

Do they answer, fast and often enough, with a clock that runs? Does a joint go where it is sent?
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from itertools import pairwise

import msgspec
from scara_config import ConfigError, Joint, Robot
from scara_config.modbus_map import ModbusMap
from twin_controller.config import TwinControllerConfig
from twin_controller.estimation.rhythm import Rhythm, heard
from twin_controller.registers import RegisterCodec
from twin_controller.robot_sample import RobotSample, SampleError

from robot_doctor.finding import Finding, Group, fine, note, wrong

RATE_TOLERANCE = 0.02
"""A clock that runs so much too fast or slow is none in ms: a quartz is a thousand times better."""
WRAP = 2**31
MOVED_LEAST, MOVED_MOST = 0.7, 1.3
STRAY = 0.3
KEEPS_UP = 0.8
"""So much of the speed that it may have is asked of a joint; our choice."""
ABSENT = 1e-3
"""An axis that is not there may read so much [deg or mm]; our choice."""


class Answer(msgspec.Struct, frozen=True):
    """One answer to the state request.

    It holds when it was asked and complete [s, local], words and signals as they came.
    """

    sent: float
    received: float
    words: tuple[int, ...]
    signals: tuple[bool, ...]


class Nudge(msgspec.Struct, frozen=True):
    """What came of sending one joint a hair away.

    How far it was sent [rad] or [m], where all joints went, and the largest speed.
    """

    joint: str
    asked: float
    moved: dict[str, float]
    speed: float


def check_answers(
    robot: Robot, layout: ModbusMap, answers: Sequence[Answer], config: TwinControllerConfig
) -> Iterator[Finding]:
    """Judge a second or two of answers of the robot.

    Args:
        robot: The profile.
        layout: Its map.
        answers: In their order.
        config: What the twin controller expects.
    """
    if len(answers) < 10:
        yield wrong(
            Group.LINKS,
            f"only {len(answers)} answers",
            "look at network and load of the robot's controller",
        )
        return
    trips = sorted((answer.received - answer.sent) * 1e3 for answer in answers)
    middle, worst = statistics.median(trips), trips[int(0.99 * (len(trips) - 1))]
    rate = (len(answers) - 1) / (answers[-1].received - answers[0].received)
    text = (
        f"round trip {middle:.2f} ms, {worst:.2f} ms at worst of 100; {rate:.0f} answers a second"
    )
    if worst > config.real.timeout_ms:
        advice = (
            f"longer than real.timeout_ms = {config.real.timeout_ms:g}: make network or robot "
            "faster, or that value larger"
        )
        yield wrong(Group.LINKS, text, advice)
    elif middle > config.real.poll_period_ms:
        yield note(
            Group.LINKS,
            text,
            f"slower than real.poll_period_ms = {config.real.poll_period_ms:g}: the pair will lag "
            "more",
        )
    else:
        yield fine(Group.LINKS, text)
    yield from _check_clock(robot, layout, answers, config)


def least_time(joint: Joint, way: float, percent: float, override: float) -> float:
    """Return how long a joint is given at least for a way [s].

    A robot runs the stream program at its override: one that has just been set to 1 % is slow.

    Args:
        joint: Of the profile.
        way: How far it goes [rad or m].
        percent: Speed that the set points come with.
        override: Of the robot [percent]; one that shows none counts as 1.
    """
    fastest = 1e-4 * percent * max(override, 1.0) * joint.velocity
    return abs(way) / (KEEPS_UP * fastest)


def check_nudge(nudge: Nudge, joints: Sequence[Joint]) -> Finding:
    """Judge where the joints went when one of them was sent a hair away."""
    joint = next(joint for joint in joints if joint.name == nudge.joint)
    asked, moved = nudge.asked / joint.scale, nudge.moved[nudge.joint] / joint.scale
    text = f"{nudge.joint}: sent {asked:+.3f} {joint.unit}, went {moved:+.3f} {joint.unit}"
    others = {
        other.name: nudge.moved[other.name] / other.scale
        for other in joints
        if other.name != nudge.joint
    }
    strays = [f"{name} {way:+.3f}" for name, way in others.items() if abs(way) > STRAY * abs(asked)]
    share = moved / asked
    if strays:
        return wrong(
            Group.LINKS,
            f"{text}, and {', '.join(strays)}",
            "axis_number in robot.yaml sends it to another axis",
        )
    # Not 0: the noise of a joint that did not move has a sign, too.
    if share < -0.1:
        return wrong(
            Group.LINKS,
            text,
            "set point and position have opposite signs: correct the scale, or the sign on the "
            "robot",
        )
    if not MOVED_LEAST <= share <= MOVED_MOST:
        return wrong(
            Group.LINKS,
            text,
            "set point and position have different units or scales, or the robot does not follow",
        )
    if nudge.speed * nudge.asked < 0.0:
        return wrong(
            Group.LINKS,
            f"{text}, its speed register says the other way",
            "correct the sign of velocity",
        )
    return fine(Group.LINKS, text)


def _check_clock(
    robot: Robot, layout: ModbusMap, answers: Sequence[Answer], config: TwinControllerConfig
) -> Iterator[Finding]:
    """Yield what the words say.

    The order of their halves, the clock, and the samples as the controller will read them.
    """
    # With its words in the wrong order a clock that goes on by 1 seems to jump by 65,536.
    other = msgspec.structs.replace(
        layout, word_order="high_first" if layout.word_order == "low_first" else "low_first"
    )
    rate, swapped = _clock_rate(robot, layout, answers), _clock_rate(robot, other, answers)
    if rate is None or abs(rate - 1.0) > RATE_TOLERANCE:
        if swapped is not None and abs(swapped - 1.0) <= RATE_TOLERANCE:
            what = (
                f"with word_order: {layout.word_order} the clock makes no sense, with "
                f"{other.word_order} it runs"
            )
            yield wrong(Group.LINKS, what, f"set word_order: {other.word_order} in modbus_map.yaml")
            return
        shown = "does not run" if not rate else f"runs {rate:.4g} ms a ms"
        advice = (
            "clock_ms is the robot's own clock in ms when the position was true; a map's scale "
            "can turn s into ms"
        )
        yield wrong(Group.LINKS, f"the robot's clock {shown}", advice)
        return
    try:
        codec = RegisterCodec(layout, robot)
        samples = [codec.decode_sample(answer.words, answer.signals) for answer in answers]
    except (SampleError, ConfigError) as error:
        yield wrong(
            Group.LINKS,
            f"an answer is not believed: {error}",
            "correct scale, unit, address or limits of what it names",
        )
        return
    yield _offset(samples, answers, rate)
    yield _period(samples, answers, config)
    named = [joint.axis_number for joint in robot.joints]
    for number, read in enumerate(samples[-1].axes, 1):
        if number not in named and abs(read) > ABSENT:
            what = f"axis {number} reads {read:g} and robot.yaml has no joint of it"
            advice = "give it one, with twin: false if it is the robot's alone"
            yield wrong(Group.LINKS, what, advice)


def _offset(samples: Sequence[RobotSample], answers: Sequence[Answer], rate: float) -> Finding:
    """Return how far the clocks are apart, and how well that is known from these answers."""
    lower = max(sample.clock_ms - answer.received * 1e3 for sample, answer in zip(samples, answers))
    upper = min(sample.clock_ms - answer.sent * 1e3 for sample, answer in zip(samples, answers))
    between = 0.5 * (lower + upper)
    known = max(abs(upper - lower) * 0.5, 0.01)
    return fine(
        Group.LINKS,
        f"its clock is {between:.1f} ms ahead of ours, known to {known:.1f} ms; rate {rate:.5f}",
    )


def _period(
    samples: Sequence[RobotSample], answers: Sequence[Answer], config: TwinControllerConfig
) -> Finding:
    """Return how often the robot renews its reading, as far as polling can see."""
    clocks = sorted({sample.clock_ms for sample in samples})
    steps = sorted(after - before for before, after in pairwise(clocks))
    if len(steps) < 5:
        return wrong(
            Group.LINKS,
            f"{len(clocks)} readings in {len(samples)} answers",
            "the robot must renew position and clock",
        )
    middle = statistics.median(steps)
    rhythm, seen = Rhythm(), None
    for sample, answer in zip(samples, answers):
        # The rhythm is told by each reading once, however often it was asked for.
        if sample.clock_ms != seen:
            rhythm = heard(rhythm, sample.clock_ms, 0.5 * (answer.sent + answer.received))
            seen = sample.clock_ms
    text = f"a new reading each {middle:g} ms or faster"
    if rhythm.known:
        period, jitter = rhythm.period * 1e3, rhythm.jitter * 1e3
        text = f"a new reading each {period:g} ms, stamped to {jitter:.1f} ms"
    if middle > 2.0 * config.real.poll_period_ms:
        return note(
            Group.LINKS,
            text,
            "the twin is led by older positions: let the robot renew them each 8 ms or faster",
        )
    return fine(Group.LINKS, text)


def _clock_rate(robot: Robot, layout: ModbusMap, answers: Sequence[Answer]) -> float | None:
    """Return how many ms the robot's clock goes in one of ours, None if it cannot be read.

    One late answer, or one late reading in it, would make the rate wrong by its delay: so the
    rate is that between the youngest readings of the first and of the last third.
    """
    codec = RegisterCodec(layout, robot)
    begun = answers[0].received
    try:
        clocks = [codec.clock_of(answer.words) for answer in answers]
    except SampleError:
        return None
    readings = [
        # The clock may begin again at 0 meanwhile.
        ((answer.received - begun) * 1e3, (clock - clocks[0]) % WRAP)
        for answer, clock in zip(answers, clocks)
    ]
    third = len(readings) // 3
    first, last = (
        max(part, key=lambda reading: reading[1] - reading[0])
        for part in (readings[:third], readings[-third:])
    )
    return (last[1] - first[1]) / (last[0] - first[0])
