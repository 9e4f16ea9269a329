"""One reading that is wrong lets no robot go on: a person has paused or stopped it."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, idle_pair, ramp, shifted
from twin_controller.core.actions import Action, Command
from twin_controller.core.events import AnyEvent, RealMeasured
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.repeated import Repeated, count
from twin_controller.core.setup import Setup

READINGS = 4
AWAY = shifted(HOME, 20.0, -10.0)
ONCE = pytest.mark.parametrize("readings", [1, READINGS - 1], ids=["one", "a slow robot's three"])


def misread(pair: Pair, readings: int, **fields: Any) -> None:
    """Let the next readings say something else, then half a second pass."""
    feed, left = pair.feed, [True] * readings

    def damaged(event: AnyEvent) -> list[Action]:
        if isinstance(event, RealMeasured) and left:
            left.pop()
            event = msgspec.structs.replace(event, **fields)
        return feed(event)

    pair.feed = damaged  # type: ignore[method-assign, assignment]
    pair.run(0.5)
    assert not left


@ONCE
def test_a_robot_that_was_paused_at_its_pendant_stays_paused(readings: int) -> None:
    """Until the person there lets it go on."""
    pair = idle_pair()
    pair.move_twin(ramp(HOME, AWAY, 8.0), run=1.0)
    pair.paused = True
    pair.run(0.3)
    assert pair.mode is Mode.PAUSED and pair.triggers()[-1] == "REAL_HELD"
    since, where = len(pair.actions), pair.real_q
    misread(pair, readings, paused=False)
    assert pair.mode is Mode.PAUSED and pair.real_q == where
    assert not {Command.CONTINUE_STREAM, Command.RESUME_TWIN} & set(pair.performed(since))
    pair.paused = False
    pair.run(0.3)
    assert pair.mode is Mode.TWIN_LEADS


@ONCE
@pytest.mark.parametrize("field", ["own_program", "paused"])
def test_a_twin_that_was_stopped_beside_a_robot_that_goes_on_stays_stopped(
    readings: int, field: str
) -> None:
    """Nothing stops that robot from here; its next program is followed."""
    pair = Pair(setup=Setup(msgspec.structs.replace(ROBOT, lead=False), SETUP.config))
    pair.connect()
    pair.start_program(ramp(HOME, AWAY, 30.0), run=1.0)
    pair.do("STOP", 0.5)
    misread(pair, readings, **{field: field == "paused"})
    assert pair.mode is Mode.STOPPED
    pair.end_program()
    pair.run(0.3)
    assert pair.mode is Mode.STOPPED
    pair.start_program(ramp(pair.real_q, HOME, 8.0), run=0.3)
    assert pair.mode in (Mode.ALIGNING, Mode.REAL_LEADS)


@ONCE
def test_a_program_that_a_stop_has_paused_is_not_taken_for_a_new_one(readings: int) -> None:
    """Its STOP ends no program: as delivered, CSTOPI is not set up for it."""
    pair = idle_pair()
    pair.cancels = False
    pair.start_program(ramp(HOME, AWAY, 30.0), run=1.0)
    pair.do("STOP", 1.0)
    assert pair.mode is Mode.STOPPED and pair.paused
    misread(pair, readings, paused=False)
    assert pair.mode is Mode.STOPPED
    pair.paused = False
    pair.run(0.3)
    assert pair.mode is Mode.REAL_LEADS


@pytest.mark.parametrize("writes", [True, False])
def test_readings_count_only_in_a_row(writes: bool) -> None:
    """And without end no further."""
    motion = idle_pair().state.sides.real.flags
    assert motion is not None
    runs = msgspec.structs.replace(motion, own_program=True)
    holds = msgspec.structs.replace(runs, paused=True)
    found = Repeated()
    for _ in range(READINGS - 1):
        found = count(found, runs, writes)
        assert not found.is_running and not found.is_off
    assert count(found, runs, writes).is_running
    assert count(count(found, holds, writes), runs, writes) == Repeated(0, 1)
    found = count(found, holds, writes)
    assert found == Repeated(0 if writes else 1, 0)
    settled = Repeated(READINGS, 0)
    assert count(settled, motion, writes) is settled
