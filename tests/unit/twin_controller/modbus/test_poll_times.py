"""PollTimes against a robot of a few lines, whose ticks the test knows."""

from __future__ import annotations

import math
import statistics
from itertools import pairwise
from random import Random
from typing import NamedTuple

import pytest
from harness.running.thorough import thorough
from twin_controller.core.sides.clock import ClockEstimate, observe
from twin_controller.estimation.rhythm import Rhythm, heard
from twin_controller.modbus.poll_times import PollTimes

POLL, DRIFT_PPM = 0.0097, 500.0
TRIP, SIGNALS, WAKE = (0.25e-3, 0.6e-3), (0.2e-3, 0.5e-3), (0.05e-3, 0.15e-3)
BASE, LEARNT = 99.123, 105.0


class Poll(NamedTuple):
    """One poll: when it was answered, how old the reading was, what the clock estimate was off."""

    at: float
    clock_ms: int
    age: float
    period: float
    offset_error: float
    aimed: bool


class Robot:
    """Renews its reading each ``tick_ms`` of a quartz that runs fast by ``ppm``.

    Its registers show a reading up to 0.1 ms late, and its stamps are off by up to ``error_ms``.
    """

    def __init__(self, tick_ms: int, ppm: float = 35.0, error_ms: int = 0) -> None:
        self.tick, self.rate, self.error = tick_ms, 1.0 + ppm * 1e-6, error_ms
        self.boot_ms, self.random, self.stamps = 5000, Random(2), {}

    def read(self, at: float) -> tuple[int, float]:
        """Return the stamp that the registers show, and when it was true."""
        count = math.floor((at - BASE) * self.rate / (self.tick * 1e-3))
        if at < self._true(count) + self._drawn(count)[0]:
            count -= 1
        return self.boot_ms + count * self.tick + self._drawn(count)[1], self._true(count)

    def _true(self, count: int) -> float:
        return BASE + count * self.tick * 1e-3 / self.rate

    def _drawn(self, count: int) -> tuple[float, int]:
        if count not in self.stamps:
            error = self.random.randint(-self.error, self.error)
            self.stamps[count] = self.random.uniform(0.0, 0.1e-3), error
        return self.stamps[count]


def polls(
    robot: Robot,
    seconds: float = 30.0,
    aimed: bool = True,
    stalls: dict[float, float] | None = None,
) -> list[Poll]:
    """Let a link ask the robot, and the core's own estimators hear the answers.

    Args:
        robot: Who is asked.
        seconds: For how long.
        aimed: By PollTimes; else at the poll period.
        stalls: From when, and for how long, the machine stands still [s].
    """
    random, times, found = Random(1), PollTimes(POLL, DRIFT_PPM), []
    now = due = 100.0
    times.begin(now)
    rhythm, clock, last = Rhythm(), ClockEstimate(), None
    waiting = sorted((stalls or {}).items())
    while now < 100.0 + seconds:
        now = max(now, times.due if aimed else due) + random.uniform(*WAKE)
        if waiting and now >= waiting[0][0]:
            now += waiting.pop(0)[1]
        sent = now + random.uniform(*SIGNALS)
        asked = sent + 0.5 * random.uniform(*TRIP)
        stamp, true = robot.read(asked)
        now = received = asked + 0.5 * random.uniform(*TRIP)
        times.polled(stamp, sent, received)
        due += POLL
        if stamp != last:
            rhythm = heard(rhythm, stamp, 0.5 * (sent + received))
            clock = observe(
                clock, stamp * 1e-3, sent, received, DRIFT_PPM, rhythm.period, 0.0, rhythm.jitter
            )
        last = stamp
        error = clock.to_local(stamp * 1e-3) - true
        found.append(Poll(received, stamp, received - true, rhythm.period, error, times.aimed))
    return found


def learnt(found: list[Poll]) -> list[Poll]:
    """Return the polls after the first seconds."""
    return [poll for poll in found if poll.at > LEARNT]


@pytest.mark.parametrize("tick_ms", [2, 4, 5, 6, 8, 9])
def test_readings_are_fresh_once_the_ticks_are_known(tick_ms: int) -> None:
    """A poll at any time finds a reading of half a period; one behind the tick saves most of it."""
    before = learnt(polls(Robot(tick_ms), aimed=False))
    after = learnt(polls(Robot(tick_ms)))
    assert statistics.mean(poll.age for poll in before) > 0.45e-3 * tick_ms + TRIP[0]
    assert statistics.median(poll.age for poll in after) < 0.9e-3, "0.4 of it is the answer's way"
    assert statistics.mean(poll.aimed for poll in after) > 0.9


@pytest.mark.parametrize("wake", [1e-5, 4e-3])
@pytest.mark.parametrize("tick_ms", [2, 4, 5, 6, 8])
def test_a_question_leaves_a_tick_that_is_late_its_fifth_of_a_millisecond(
    tick_ms: int, wake: float
) -> None:
    """On a line that takes hardly any time, from a machine that takes as long to wake each time."""
    robot, times, behind = Robot(tick_ms, ppm=0.0), PollTimes(POLL, DRIFT_PPM), []
    now = 100.0
    times.begin(now)
    while now < LEARNT + 5.0:
        now, aimed = max(now, times.due) + wake, times.aimed
        stamp, true = robot.read(now)
        if aimed and now > LEARNT:
            behind.append(now - true)
        times.polled(stamp, now, now)
    shares = statistics.quantiles(behind, n=10)
    assert 0.15e-3 < shares[2] <= shares[4] < 0.3e-3, "the clocks' drift is not known any better"


@pytest.mark.parametrize("tick_ms", [5, 6])
def test_one_question_that_was_held_up_does_not_bring_the_next_too_soon(tick_ms: int) -> None:
    """The shortest time from waking to asking counts, and is forgotten slowly."""
    robot, times, ages = Robot(tick_ms, ppm=0.0), PollTimes(POLL, DRIFT_PPM), []
    now, count = 100.0, 0
    times.begin(now)
    while now < LEARNT + 5.0:
        held_up = count % 5 == 0
        now, count = max(now, times.due) + (4e-3 if held_up else 1e-5), count + 1
        stamp, true = robot.read(now)
        if times.aimed and now > LEARNT and not held_up:
            ages.append(now - true)
        times.polled(stamp, now, now)
    assert statistics.quantiles(ages, n=10)[7] < 0.5e-3


def test_a_machine_that_stood_still_asks_as_close_to_the_ticks_as_before() -> None:
    """What a stall took is no time from being woken to asking."""
    robot, times, off = Robot(5, ppm=0.0), PollTimes(POLL, DRIFT_PPM), []
    now, count = 100.0, 0
    times.begin(now)
    while now < LEARNT + 20.0:
        now, count = max(now, times.due) + (0.2 if count % 40 == 0 else 1e-5), count + 1
        stamp, _ = robot.read(now)
        times.polled(stamp, now, now)
        if times.aimed and now > LEARNT:
            # Behind a tick or, to scan, before one.
            off.append(abs(math.remainder(times.due - BASE, 5e-3)))
    assert len(off) > 500 and max(off) < 0.5e-3


@pytest.mark.parametrize("tick_ms", [4, 9, *thorough(2, 5, 6, 8)])
def test_the_core_learns_the_same_period_and_the_same_clock(tick_ms: int) -> None:
    """Polls that always come alike would make a period look longer, and lose the clock's bound."""
    before = learnt(polls(Robot(tick_ms), 60.0, aimed=False))
    after = learnt(polls(Robot(tick_ms), 60.0))
    assert {poll.period for poll in after} == {tick_ms * 1e-3}
    error, was = (max(abs(poll.offset_error) for poll in found) for found in (after, before))
    assert error < was + 0.25e-3


@pytest.mark.parametrize("tick_ms", [2, 5, 8])
def test_polls_come_as_often_as_they_should(tick_ms: int) -> None:
    """At the period on average, four more a second to scan, and at each tick of a slow robot."""
    found = learnt(polls(Robot(tick_ms)))
    wanted = max(1.0 / POLL, 1e3 / tick_ms if tick_ms > 6 else 0.0)
    rate = (len(found) - 1) / (found[-1].at - found[0].at)
    assert wanted * 0.94 < rate < wanted + 5.0
    apart = [later.at - poll.at for poll, later in pairwise(found)]
    assert max(apart) < 2.1e-3 * tick_ms + (POLL if tick_ms <= 6 else 0.0)


@pytest.mark.parametrize(
    "robot",
    [Robot(1), Robot(10), Robot(16), Robot(8, error_ms=2)],
    ids=["each millisecond", "period of ours", "slower than ours", "rough stamps"],
)
def test_a_robot_without_a_tick_to_ask_behind_is_asked_at_our_own_pace(robot: Robot) -> None:
    """Nothing is gained there, or nothing is known: the polls are those of the grid."""
    found = polls(robot, 10.0)
    assert not any(poll.aimed for poll in found)
    assert len(found) == pytest.approx(10.0 / POLL, abs=2)


def test_after_a_stall_the_newest_reading_is_asked_for_at_once() -> None:
    """It is there already; then the polls go on behind the ticks."""
    found = polls(Robot(2), 12.0, stalls={106.0: 0.05, 108.0: 0.2})
    for begin in (106.0, 108.0):
        k = next(k for k, poll in enumerate(found) if poll.at > begin + 0.03)
        assert found[k].age < 2e-3 + TRIP[1]
        assert found[k + 1].at - found[k].at < POLL + 2e-3
        later = found[k + 5 : k + 100]
        assert statistics.median(poll.age for poll in later) < 1e-3


@pytest.mark.parametrize("begin", [104.0, 104.03, 104.06])
def test_an_answer_that_was_long_on_its_way_is_followed_by_a_newer_one(begin: float) -> None:
    """The stall may come between question and answer: then the answer is old when it is read."""
    times, robot, now = PollTimes(POLL, DRIFT_PPM), Robot(2), 100.0
    times.begin(now)
    while now < begin:
        now = max(now, times.due) + 0.1e-3
        times.polled(robot.read(now + 0.1e-3)[0], now, now + 0.2e-3)
    now = times.due
    late = now + 6e-3
    times.polled(robot.read(now + 0.1e-3)[0], now, late)
    assert late - 1e-3 < times.due < late + 2.5e-3, "not at the next period's end"


def test_a_clock_that_was_set_is_learnt_anew() -> None:
    """Ticks of the old clock say nothing of the new one's."""
    robot, times, now = Robot(8), PollTimes(POLL, DRIFT_PPM), 100.0
    times.begin(now)
    aimed = []
    while now < 112.0:
        now = max(now, times.due) + 0.1e-3
        if now > 106.0:
            robot.boot_ms = 777_003
        times.polled(robot.read(now + 0.1e-3)[0], now, now + 0.2e-3)
        aimed.append((now, times.aimed))
    assert all(yes for at, yes in aimed if 105.0 < at < 106.0)
    assert not any(yes for at, yes in aimed if 106.02 < at < 107.5)
    assert all(yes for at, yes in aimed if at > 110.0)


def test_a_new_connection_begins_with_a_poll_at_once() -> None:
    """And with no word of the robot that was there before."""
    times = PollTimes(POLL, DRIFT_PPM)
    times.begin(100.0)
    for k in range(400):
        times.polled(5000 + 10 * (k // 2), 100.0 + 5e-3 * k, 100.0 + 5e-3 * k + 1e-4)
    times.begin(200.0)
    assert times.due == 200.0 and not times.aimed


def test_a_late_poll_is_counted_and_leaves_the_missed_ones_out() -> None:
    """No burst of polls makes up for those that were missed."""
    times = PollTimes(POLL, DRIFT_PPM)
    times.begin(100.0)
    assert not times.polled(None, 100.0, 100.001)
    assert times.due == pytest.approx(100.0 + POLL)
    assert times.polled(None, 100.05, 100.051)
    assert times.due == pytest.approx(100.05 + POLL)


@pytest.mark.parametrize("tick_ms", [2, 5, 7, 8, 9])
def test_only_a_poll_that_was_held_up_is_late(tick_ms: int) -> None:
    """In its turn or out of it; to wait for a tick, or to ask before one, is the plan."""
    robot, times, now, count = Robot(tick_ms), PollTimes(POLL, DRIFT_PPM), 100.0, 0
    times.begin(now)
    while now < LEARNT + 3.0:
        count += 1
        held_up = now > LEARNT and count % 7 == 0
        now = max(now, times.due) + (5.0 * POLL if held_up else 1e-5)
        assert times.polled(robot.read(now)[0], now, now + TRIP[0]) is held_up
    assert times.aimed


@pytest.mark.parametrize(
    ("trip_ms", "read"),
    [(1.0, "....."), (4.5, "....."), (4.9, "..+..+"), (7.6, "..+..+"), (30.0, "..+..+")],
)
def test_a_slow_robot_is_asked_at_once_and_for_its_signals_behind_each_third_state(
    trip_ms: float, read: str
) -> None:
    """One that is not slow is asked at our own pace, and for its signals before its state."""
    times, now, trip = PollTimes(POLL, DRIFT_PPM), 100.0, trip_ms * 1e-3
    times.begin(now)
    found = ""
    for _ in read:
        now = max(now, times.due)
        times.polled(None, now, now + trip)
        now += trip
        assert times.slow == (trip_ms > 0.5e3 * POLL)
        assert times.due == (now if times.slow else pytest.approx(now - trip + POLL))
        reads = times.reads_signals()
        found += ".+"[reads]
        now += trip if reads else 0.0
    assert found == read
