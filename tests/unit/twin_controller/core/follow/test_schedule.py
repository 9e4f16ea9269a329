"""Set points are sent evenly spaced on the robot's own ticks, whatever the decisions' rhythm."""

from __future__ import annotations

import itertools
import random

import pytest
from twin_controller.core.follow.schedule import SendSlot, next_slots
from twin_controller.estimation.rhythm import Rhythm, heard

PREPARED_S = 0.0004


TICK, SPACING, WAY, POLL = 0.002, 0.010, 0.0001, 0.0097


def ticking(period_ms: int, errors: list[int]) -> Rhythm:
    """Return what a robot has shown that ticks so, and whose stamps are wrong by these [ms]."""
    rhythm = Rhythm()
    for k in range(300):
        stamp = 7919 * k // period_ms * period_ms + errors[k % len(errors)]
        rhythm = heard(rhythm, stamp, 7.919 * k)
    return rhythm


RHYTHM = ticking(2, [0])


def decide(
    times: list[float], drift: float = 0.0, poll: float = POLL
) -> list[tuple[float, SendSlot]]:
    """Return each slot with its decision's time; the robot ticks each 2 ms of its own clock."""
    period = TICK * (1.0 + drift)
    found: list[tuple[float, SendSlot]] = []
    for now in times:
        tick = (now - 0.0005) // period * period
        found += [
            (now, slot)
            for slot in next_slots(
                now,
                tick,
                RHYTHM.period,
                RHYTHM.jitter,
                SPACING,
                poll + 0.5 * SPACING,
                WAY,
                found[-1][1].taken_at if found else None,
            )
        ]
    return found


def polls(seconds: float, period: float = POLL) -> list[float]:
    """Return decisions ``period`` apart, each late by up to 4 ms."""
    late = random.Random(0)
    return [100.0 + period * k + late.uniform(0.0, 0.004) for k in range(round(seconds / period))]


@pytest.mark.parametrize("poll", [POLL, 0.0197])
@pytest.mark.parametrize("drift", [0.0, 35e-6, -500e-6])
def test_set_points_are_taken_evenly_although_answers_come_unevenly(
    drift: float, poll: float
) -> None:
    """None missing, none twice: over a minute of the robot's own drift, at half the answers."""
    found = decide(polls(60.0, poll), drift, poll)
    gaps = [b.taken_at - a.taken_at for (_, a), (_, b) in itertools.pairwise(found)]
    assert len(gaps) > 5900
    assert max(abs(gap - SPACING) for gap in gaps) < 0.1 * TICK
    assert (
        abs(found[-1][1].taken_at - found[0][1].taken_at - len(gaps) * SPACING * (1.0 + drift))
        < 0.6 * TICK
    )


def test_each_is_decided_in_time_and_arrives_between_two_ticks() -> None:
    """It arrives after the tick before its own, with most of the period to spare.

    The first of all too, wherever in a period it is decided.
    """
    first = [each for k in range(20) for each in decide([100.0 + 0.1e-3 * k])]
    for now, slot in decide(polls(5.0)) + first:
        assert now + PREPARED_S <= slot.send_at + 1e-9 <= now + POLL + 0.5 * SPACING + 1e-9
        early = slot.taken_at - (slot.send_at + WAY)
        assert 0.5 * TICK < early < TICK


@pytest.mark.parametrize(("jitter", "behind"), [(0.0, 0.15), (0.1, 0.3), (1.0, 0.5)])
def test_it_arrives_farther_behind_a_tick_that_is_known_roughly(
    jitter: float, behind: float
) -> None:
    """By three standard deviations, but never beyond the middle of a period [periods]."""
    slot, *_ = next_slots(100.0, 100.0, TICK, jitter * TICK, SPACING, POLL, WAY, None)
    arrives = slot.send_at + WAY
    assert arrives - (slot.taken_at - TICK) == pytest.approx(behind * TICK)


def test_an_answer_that_comes_late_leaves_its_place_empty_and_keeps_the_rhythm() -> None:
    """After 35 ms of silence they go on in their old rhythm; none is made up for."""
    found = decide(
        [100.0 + 0.0097 * k for k in range(50)]
        + [100.0 + 0.0097 * 49 + 0.035 + 0.0097 * k for k in range(50)]
    )
    gaps = [
        round((b.taken_at - a.taken_at) / SPACING, 3)
        for (_, a), (_, b) in itertools.pairwise(found)
    ]
    assert {gap for gap in gaps if gap != 1.0} <= {2.0, 3.0, 4.0}
    assert sum(gap != 1.0 for gap in gaps) == 1


def test_without_a_spacing_each_is_sent_at_once() -> None:
    """One for each new time."""
    assert next_slots(5.0, 4.9, RHYTHM.period, 0.0, None, POLL, WAY, None) == [SendSlot(5.0, 5.0)]
    assert next_slots(5.0, 4.9, RHYTHM.period, 0.0, None, POLL, WAY, 5.0) == []
