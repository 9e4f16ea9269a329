"""What is done in a scene comes from its seed alone."""

from __future__ import annotations

import struct

from harness.storm.deeds import DEEDS
from harness.storm.names import EVERY, STRIKES
from harness.storm.scenes import KILLS, SECONDS, draw
from harness.wires.clock_step import ClockStep
from harness.wires.noise import STATE_BYTES


def test_same_seed_gives_the_same_deeds() -> None:
    """And another seed or scene gives others."""
    assert draw(3, 1) == draw(3, 1)
    assert draw(3, 1) != draw(4, 1) and draw(3, 1) != draw(3, 2)


def test_steps_are_in_order_and_within_the_scene() -> None:
    """A scene that were drawn longer than its time would run into the next."""
    for seed in range(20):
        times = [step.at for step in draw(seed, 0)]
        assert times == sorted(times) and times[0] > 0.0 and times[-1] < SECONDS + 4.0


def test_every_deed_can_be_done_and_every_one_is_drawn() -> None:
    """Names, functions and scenes fit together."""
    assert {name.text for name in EVERY} == set(DEEDS)
    drawn = {step.name for seed in range(60) for step in draw(seed, 0)}
    assert drawn == set(DEEDS) | {name.text for name in STRIKES}


def test_few_nodes_are_killed_in_a_scene() -> None:
    """The start of one takes a core for a second."""
    for seed in range(60):
        assert sum(step.name == "kill" for step in draw(seed, 0)) <= KILLS


def test_clock_step_changes_the_clock_and_nothing_else() -> None:
    """Low word first; it wraps as the robot's does."""
    words = [0] * (STATE_BYTES // 2)
    words[19], words[20] = 0xFFFF, 0x7FFF
    unit = bytes(7) + bytes((3, STATE_BYTES)) + struct.pack(">44H", *words)
    ((_, stepped),) = ClockStep(300)(unit, True)
    seen = list(struct.unpack(">44H", stepped[9:]))
    assert (seen[19], seen[20]) == (299, 0)
    seen[19], seen[20] = words[19], words[20]
    assert seen == words and stepped[:9] == unit[:9]
    assert ClockStep(300)(unit, False) == [(0.0, unit)]
