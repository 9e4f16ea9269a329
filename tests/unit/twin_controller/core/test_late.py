"""Commands take effect late and reports are old: no rule may depend on answers at once."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count, product

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, ramp, shifted
from harness.running.thorough import thorough
from twin_controller.core.actions import Command, FollowTwin, StreamAhead, StreamReal
from twin_controller.core.events import AnyEvent, RealMeasured
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.reports import agree_when_stopped
from twin_controller.core.sides.change import drop_baseline

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
FOREIGN = 17


@pytest.fixture(
    params=[
        pytest.param((0.0, 0.0), id="at once", marks=pytest.mark.thorough),
        pytest.param((0.03, 0.02), id="30 ms", marks=pytest.mark.thorough),
        pytest.param((0.08, 0.02), id="80 ms"),
    ]
)
def pair(request: pytest.FixtureRequest) -> Pair:
    """Return a connected pair, IDLE at home, with these delays of commands and reports."""
    made = Pair()
    made.command_delay, made.report_delay = request.param
    made.connect()
    return made


def modes(pair: Pair, since: int) -> list[str]:
    """Return the modes decided since the given index of decisions."""
    return [decision.mode_after for decision in pair.decisions()[since:]]


def real_leads(pair: Pair) -> None:
    """Let the real robot lead by a program."""
    pair.start_program(ramp(HOME, AWAY, 3.0), run=1.0)
    assert pair.mode == Mode.REAL_LEADS


def twin_leads(pair: Pair) -> None:
    """Let the twin lead by an announced move."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=1.0)
    assert pair.mode == Mode.TWIN_LEADS


def operator_leads(pair: Pair) -> None:
    """Let the operator lead."""
    pair.do("MOVE_JOINTS", 0.5, target=AWAY)
    assert pair.mode == Mode.OPERATOR_LEADS


@pytest.mark.parametrize("places", [0, 10], ids=["set points", "ring"])
def test_a_stream_that_begins_behind_the_robots_own_program_moves_nothing(places: int) -> None:
    """RSR1 comes right behind that program's start: it waits, and starts the stream at its end."""
    pair = Pair(places=places)
    pair.command_delay = 0.03
    pair.connect()
    since, goal = len(pair.decisions()), shifted(HOME, 5.0, -5.0)
    pair.do("MOVE_JOINTS", target=AWAY)
    pair.run_until(lambda: Command.START_STREAM in pair.performed(), 1.0)
    pair.start_program(ramp(HOME, goal, 1.0), run=2.0)
    assert pair.queued and pair.mode is Mode.REAL_LEADS
    pair.end_program()
    assert pair.streaming
    pair.run(3.0)
    assert pair.real_q == goal
    assert pair.triggers(since)[-2:] == ["REAL_TOOK_OVER", "AT_REST_STREAMED"]
    assert pair.mode is Mode.IDLE and not pair.streaming


LEADS: list[Callable[[Pair], None]] = [real_leads, twin_leads, operator_leads]


BY_WHOM = pytest.mark.parametrize(
    ("lead", "number"),
    [
        (real_leads, FOREIGN),
        (twin_leads, 0),
        (operator_leads, FOREIGN),
        *thorough((real_leads, 0), (twin_leads, FOREIGN), (operator_leads, 0)),
    ],
)


@pytest.mark.parametrize("lead", LEADS)
def test_resume_after_pause_goes_on_once(pair: Pair, lead: Callable[[Pair], None]) -> None:
    """A report from before RESUME took effect is no new hold: the pair goes on and arrives."""
    lead(pair)
    mode, since = pair.mode, len(pair.decisions())
    pair.do("PAUSE", 1.0)
    # The robot is held at once, the twin slows down on its way.
    assert pair.mode == Mode.PAUSED and pair.far() < 10.0
    here = pair.real_q
    pair.run(0.3)
    assert pair.real_q == here
    pair.do("RESUME", 1.0)
    assert modes(pair, since)[:2] == ["PAUSED", mode]
    pair.run(3.0)
    if pair.own_program:
        pair.end_program()
    pair.until(Mode.IDLE, 5.0)
    assert modes(pair, since) == ["PAUSED", mode, "IDLE"]
    assert pair.far() < 0.05


@pytest.mark.parametrize(
    ("lead", "resumed_by"),
    [
        (twin_leads, "operator"),
        (operator_leads, "twin"),
        *thorough((twin_leads, "twin"), (operator_leads, "operator")),
    ],
)
def test_a_pause_on_the_twins_side_is_resumed_once(
    pair: Pair, lead: Callable[[Pair], None], resumed_by: str
) -> None:
    """On that side too; the twin still shows the foreign PAUSE when RESUME is on its way."""
    lead(pair)
    since = len(pair.decisions())
    pair.order_twin(Command.PAUSE_TWIN, FOREIGN)
    pair.run(0.5)
    assert pair.mode == Mode.PAUSED
    if resumed_by == "twin":
        pair.order_twin(Command.RESUME_TWIN, FOREIGN + 1)
    else:
        pair.do("RESUME")
    pair.until(Mode.IDLE, 8.0)
    assert len(modes(pair, since)) == 3


@BY_WHOM
def test_a_stop_on_the_twins_side_reaches_both(
    pair: Pair, lead: Callable[[Pair], None], number: int
) -> None:
    """Whatever its id, typed by hand (0) too."""
    lead(pair)
    pair.order_twin(Command.STOP_TWIN, number)
    pair.run(0.2)
    assert pair.mode == Mode.STOPPED
    here = pair.real_q
    pair.run(1.0)
    assert pair.real_q == here and pair.mode == Mode.STOPPED


@BY_WHOM
def test_an_emergency_stop_on_the_twins_side_can_be_reset(
    pair: Pair, lead: Callable[[Pair], None], number: int
) -> None:
    """It latches both; after RESET a report from before it is no new emergency stop."""
    lead(pair)
    since = len(pair.decisions())
    pair.order_twin(Command.ESTOP_TWIN, number)
    pair.run(0.5)
    assert pair.mode == Mode.ESTOP and not pair.drives
    pair.do("RESET", 1.0)
    assert modes(pair, since) == ["ESTOP", "ESTOP", "STOPPED"]
    pair.do("ALIGN")
    pair.until(Mode.IDLE)


@pytest.mark.parametrize("lead", LEADS)
def test_reset_after_an_emergency_stop_by_the_operator(
    pair: Pair, lead: Callable[[Pair], None]
) -> None:
    """Latched until RESET; then STOPPED, and nothing moves until ALIGN."""
    lead(pair)
    since = len(pair.decisions())
    pair.do("ESTOP", 0.5)
    assert pair.motion == "estopped" and not pair.drives
    here = (pair.real_q, pair.twin_q)
    pair.do("RESET", 2.0)
    assert modes(pair, since) == ["ESTOP", "ESTOP", "STOPPED"]
    assert (pair.real_q, pair.twin_q) == here
    pair.do("ALIGN")
    pair.until(Mode.IDLE)


@pytest.mark.parametrize("lead", LEADS)
def test_a_stop_ends_all_motion_and_a_new_command_leads_again(
    pair: Pair, lead: Callable[[Pair], None]
) -> None:
    """Late set points and plans move nothing after a STOP."""
    lead(pair)
    since = len(pair.decisions())
    pair.do("STOP", 0.4)
    here = (pair.real_q, pair.twin_q)
    pair.run(1.0)
    assert (pair.real_q, pair.twin_q) == here
    assert modes(pair, since) == ["STOPPED"]
    pair.do("ALIGN")
    pair.until(Mode.IDLE)
    pair.do("MOVE_JOINTS", target=HOME)
    pair.until(Mode.IDLE)
    assert pair.far() < 0.05


@pytest.mark.parametrize(
    ("lead", "side"),
    [
        (real_leads, "twin"),
        (twin_leads, "real"),
        (operator_leads, "twin"),
        *thorough((real_leads, "real"), (twin_leads, "twin"), (operator_leads, "real")),
    ],
)
def test_a_link_that_was_lost_comes_back_to_an_aligned_pair(
    pair: Pair, lead: Callable[[Pair], None], side: str
) -> None:
    """The twin's own motion ends, and the real robot is sent no set point."""
    lead(pair)
    pair.link(side, False)
    pair.run(0.2)
    if side == "real":
        pair.streaming = False
    before = len(pair.actions)
    pair.link(side, True)
    pair.run_until(lambda: pair.mode in (Mode.IDLE, Mode.REAL_LEADS), 8.0)
    assert not pair.made(StreamReal, before)
    if pair.own_program:
        pair.run(4.0)
        pair.end_program()
        pair.until(Mode.IDLE, 8.0)
    pair.run(1.0)
    assert pair.far() < 0.1


BEHIND_MS = ((30, 80), (60, 20), (120, 0))


@pytest.mark.parametrize(
    ("lag_ms", "after_ms"),
    [*BEHIND_MS, *thorough(*sorted({*product((30, 60, 120), (0, 20, 40, 80))} - {*BEHIND_MS}))],
)
def test_a_move_right_after_another_does_not_meet_the_end_of_the_old_stream(
    lag_ms: int, after_ms: int
) -> None:
    """The end of the old stream, still to be reported, is not taken for that of the new one."""
    pair = Pair()
    pair.command_delay = 1e-3 * lag_ms
    pair.connect()
    for step in (20.0, 40.0):
        since = len(pair.decisions())
        pair.move_twin(ramp(pair.twin_q, shifted(HOME, step), 1.0))
        pair.until(Mode.TWIN_LEADS, 1.0)
        pair.run_until(lambda: pair.mode != Mode.TWIN_LEADS, 5.0)
        assert modes(pair, since) == ["TWIN_LEADS", "IDLE"]
        pair.run(1e-3 * after_ms)
    assert pair.far() < 0.1


@pytest.mark.parametrize("lead", [real_leads, twin_leads])
def test_overtaken_reading_is_judged_and_not_followed(
    monkeypatch: pytest.MonkeyPatch, lead: Callable[[Pair], None]
) -> None:
    """A machine that is late takes many readings at once: only the newest gives set points."""
    pair = idle_pair()
    lead(pair)
    feed = pair.feed

    def late(event: AnyEvent) -> None:
        if isinstance(event, RealMeasured):
            event = msgspec.structs.replace(event, overtaken=True)
        feed(event)

    def setpoints() -> int:
        return sum(isinstance(a, StreamReal | StreamAhead | FollowTwin) for a in pair.actions)

    with monkeypatch.context() as patched:
        patched.setattr(pair, "feed", late)
        before, seen = setpoints(), pair.state.sides.real.last.time
        pair.run(0.05)
        assert setpoints() == before and pair.state.sides.real.last.time > seen
        pair.drives = False
        pair.run(0.2)
        assert pair.mode == Mode.ESTOP
    pair.drives = True


@pytest.mark.parametrize("lead", [real_leads, twin_leads])
def test_pair_goes_on_behind_overtaken_readings(
    monkeypatch: pytest.MonkeyPatch, lead: Callable[[Pair], None]
) -> None:
    """Each third reading is followed: the pair stays together."""
    pair = idle_pair()
    lead(pair)
    feed, number = pair.feed, count()

    def late(event: AnyEvent) -> None:
        if isinstance(event, RealMeasured):
            event = msgspec.structs.replace(event, overtaken=next(number) % 3 != 2)
        feed(event)

    monkeypatch.setattr(pair, "feed", late)
    pair.run(1.0)
    assert pair.mode in (Mode.REAL_LEADS, Mode.TWIN_LEADS) and pair.far() < 1.0


def test_a_silent_side_is_not_taken_for_one_that_stands() -> None:
    """A stop in a stall of the machine would end by itself, at full speed."""
    pair, replace = idle_pair(), msgspec.structs.replace
    pair.start_program(ramp(HOME, shifted(HOME, 60.0), 3.0), run=1.0)
    real = replace(pair.state.sides.real, change=drop_baseline(pair.state.sides.real.change))
    lead = replace(pair.state.lead, mode=Mode.STOPPED, since=pair.now)
    sides = replace(pair.state.sides, real=real)
    assert not agree_when_stopped(SETUP, lead, sides, pair.now + 0.4).real.change.baseline
