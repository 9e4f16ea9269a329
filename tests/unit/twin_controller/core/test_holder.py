"""Who holds control begins motions, everybody ends them, who stands at the robot comes first."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, ramp, shifted
from scara_ros.names import Seat
from twin_controller.core.actions import Decided, Reply, StreamReal
from twin_controller.core.control import Control
from twin_controller.core.events import AnyEvent, Operator, Tick
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode
from twin_controller.core.step import step
from twin_controller.view import decision_text, state_view

OTHER = shifted(HOME, 10.0, 5.0, 0.0)
KEEP_S = SETUP.config.control.keep_ms * 1e-3
STRANGERS = [
    {},
    {"person": "foreman"},
    {"person": "fitter", "session": "2"},
    {"person": "nobody", "unproven": "person 'nobody' is not in persons.yaml: known are fitter"},
    {"person": "fitter", "unproven": "wrong token of fitter"},
    {"local": "foreman"},
    {"person": "foreman", "local": "fitter"},
    {"session": "gateway 1", "local": "fitter"},
]
MOTIONS = [
    ("MOVE_JOINTS", {"target": OTHER}),
    ("HOME", {}),
    ("ALIGN", {}),
    ("RESUME", {}),
    ("RESET", {}),
    ("ACKNOWLEDGE", {}),
    ("SPEED", {"speed_percent": 50.0}),
]


def held(moves: bool = False) -> Pair:
    """Return an idle pair whose control fitter holds."""
    pair = idle_pair()
    assert pair.control("TAKE", "fitter", session="1", moves=moves).success
    return pair


@cache
def in_mode(mode: Mode) -> Pair:
    """Return a pair in a mode, its control held by fitter; nobody lets it go on."""
    pair = held()
    paused = Mode.TWIN_LEADS if mode is Mode.PAUSED else None
    lead = msgspec.structs.replace(pair.state.lead, mode=mode, paused=paused)
    pair.state = msgspec.structs.replace(pair.state, lead=lead)
    return pair


def answers(pair: Pair, event: AnyEvent) -> Reply:
    """Return the answer of one step to an event; the pair stays as it was."""
    _, actions = step(pair.setup, pair.state, event)
    return next(action for action in actions if isinstance(action, Reply))


@pytest.mark.parametrize("mode", list(Mode))
@pytest.mark.parametrize("command", ["STOP", "PAUSE", "ESTOP"])
@pytest.mark.parametrize("stranger", STRANGERS)
def test_ending_a_motion_never_needs_control(
    mode: Mode, command: str, stranger: dict[str, str]
) -> None:
    """Unknown persons and wrong tokens too: the answer is the holder's in every mode."""
    pair = in_mode(mode)
    by_stranger = answers(pair, Operator(pair.now, command, 99, **stranger))  # type: ignore[arg-type]
    by_holder = answers(pair, Operator(pair.now, command, 99, person="fitter", session="1"))
    assert by_stranger == by_holder
    if command != "PAUSE":
        assert by_stranger.success


@pytest.mark.parametrize(
    ("command", "mode"), [("STOP", Mode.STOPPED), ("ESTOP", Mode.ESTOP), ("PAUSE", Mode.PAUSED)]
)
def test_stop_of_a_stranger_stops_the_holders_motion(command: str, mode: Mode) -> None:
    """Accepted is not enough: both sides are told."""
    pair = held()
    pair.do("MOVE_JOINTS", 0.3, target=OTHER, person="fitter", session="1")
    pair.do(command, person="nobody", unproven="not in persons.yaml")
    assert pair.mode is mode
    assert pair.decisions()[-1].who == "nobody, not proven"


@pytest.mark.parametrize(("command", "arguments"), MOTIONS)
@pytest.mark.parametrize("stranger", STRANGERS)
def test_what_begins_a_motion_is_refused_to_others_while_control_is_held(
    command: str, arguments: dict[str, object], stranger: dict[str, str]
) -> None:
    """The refusal says who holds control, or why the person is not believed."""
    pair = in_mode(Mode.IDLE)
    asked = Operator(pair.now, command, 99, **arguments, **stranger)  # type: ignore[arg-type]
    after, actions = step(pair.setup, pair.state, asked)
    answer = next(action for action in actions if isinstance(action, Reply))
    why = stranger.get("unproven", "fitter 1 holds control")
    assert not answer.success and why in answer.message
    assert after.lead == pair.state.lead


def test_holder_moves_the_pair_and_is_named() -> None:
    """In the decision, in why, in the bag."""
    pair = held()
    pair.do("MOVE_JOINTS", target=OTHER, person="fitter", session="1")
    decision = pair.decisions()[-1]
    assert (decision.trigger, decision.who) == ("MOVE", "fitter 1")
    assert decision_text(decision).endswith("[by fitter 1]")


def test_program_without_a_person_moves_the_pair_while_nobody_holds_control(pair: Pair) -> None:
    """`rosservice call` as it always was."""
    pair.do("MOVE_JOINTS", target=OTHER)
    assert pair.decisions()[-1].who == "this machine"


def test_twin_that_the_holder_did_not_move_is_stopped_and_not_followed() -> None:
    """A call of move_to, an action, a topic: whoever it was, it was not the holder."""
    pair = held()
    before = len(pair.actions)
    pair.move_twin(ramp(HOME, OTHER, 2.0), run=3.0)
    assert not pair.made(StreamReal, before)
    made = [each for each in pair.decisions() if each.trigger == "TWIN_MOVED_UNASKED"]
    assert len(made) == 1, "stopped once, not at each sample"
    assert pair.mode is Mode.STOPPED and "fitter 1 holds control" in made[0].why
    assert pair.real_q == pytest.approx(HOME)


def test_twin_that_the_holder_moves_leads_as_ever() -> None:
    """A jog of the page, move_to of the holder's own program."""
    pair = held(moves=True)
    pair.move_twin(ramp(HOME, OTHER, 2.0))
    pair.until(Mode.TWIN_LEADS, 1.0)
    assert pair.decisions()[-1].who == "fitter 1"
    pair.control("KEEP", "fitter", session="1")
    pair.until(Mode.IDLE)
    assert pair.real_q == pytest.approx(OTHER, abs=1e-3), "a motion that has begun goes on"


def test_twin_that_moves_for_the_holders_own_program_leads_and_is_named_so() -> None:
    """A line in a shell beside the person's page: for as long as its motion node has said so."""
    pair = held()
    assert pair.control("LEND", local="fitter").success
    pair.move_twin(ramp(HOME, OTHER, 2.0))
    pair.until(Mode.TWIN_LEADS, 1.0)
    assert pair.decisions()[-1].who == "fitter, this machine"
    assert pair.state.lead.control.holder == Seat("fitter", "1")
    pair.until(Mode.IDLE)
    assert pair.real_q == pytest.approx(OTHER, abs=1e-3)
    # Signs of life of the page meanwhile; what moves the twin now has not been said.
    pair.control("KEEP", "fitter", session="1")
    pair.move_twin(ramp(pair.twin_q, HOME, 2.0), run=3.0)
    assert pair.mode is Mode.STOPPED
    assert pair.decisions()[-1].trigger == "TWIN_MOVED_UNASKED"


@pytest.mark.parametrize("local", ["foreman", ""])
def test_twin_that_moves_for_another_program_is_stopped(local: str) -> None:
    """A client of gateway or farm, or another person's shell, may say what it likes."""
    pair = held()
    refused = pair.control("LEND", local=local)
    assert not refused.success and "fitter 1 holds control" in refused.message
    pair.move_twin(ramp(HOME, OTHER, 2.0), run=3.0)
    assert pair.mode is Mode.STOPPED and pair.real_q == pytest.approx(HOME)


@pytest.mark.parametrize(("command", "arguments"), MOTIONS)
def test_command_of_the_holders_own_program_is_judged_as_the_holders(
    command: str, arguments: dict[str, object]
) -> None:
    """By the mode, as if nobody held control; it is not named as proven."""
    pair = held()
    by_holder = answers(
        pair,
        Operator(pair.now, command, 99, person="fitter", session="1", **arguments),  # type: ignore[arg-type]
    )
    by_shell = answers(pair, Operator(pair.now, command, 99, local="fitter", **arguments))  # type: ignore[arg-type]
    assert by_shell == by_holder


def test_program_at_the_robot_leads_whoever_holds_control() -> None:
    """Whoever stands there comes first; the holder keeps control and is told."""
    pair = held()
    pair.start_program(ramp(HOME, OTHER, 1.0))
    pair.until(Mode.REAL_LEADS, 1.0)
    decision = pair.decisions()[-1]
    assert decision.who == "at the robot" and "fitter 1 keeps control" in decision.why
    assert pair.state.lead.control.holder == Seat("fitter", "1")


def test_silent_holder_loses_control_by_time_alone() -> None:
    """The page was closed, the client is gone; a decision says so."""
    pair = held()
    pair.run(KEEP_S - 0.5)
    assert pair.state.lead.control.holder == Seat("fitter", "1")
    pair.run(1.0)
    assert pair.state.lead.control == Control()
    assert pair.decisions()[-1].trigger == "CONTROL_LOST"
    pair.do("MOVE_JOINTS", target=OTHER)


def test_standstill_of_the_controller_itself_costs_nobody_control() -> None:
    """What was said meanwhile waits behind the tick that tells of it."""
    pair = held()
    pair.state, _ = step(pair.setup, pair.state, Tick(pair.now + 60.0, own_gap=60.0))
    assert pair.state.lead.control.holder == Seat("fitter", "1")


@pytest.mark.parametrize(
    ("action", "arguments", "why"),
    [
        ("TAKE", {}, "give a name of persons.yaml"),
        ("TAKE", {"person": "fitter", "unproven": "wrong token of fitter"}, "wrong token"),
        ("GRAB", {"person": "fitter"}, "allowed are TAKE, ASK, GIVE, DENY, RELEASE, KEEP"),
    ],
)
def test_control_is_for_persons_who_prove_it(
    action: str, arguments: dict[str, str], why: str
) -> None:
    """A program of this machine moves the pair while nobody holds control; it cannot hold it."""
    pair = Pair()
    answer = pair.control(action, **arguments)  # type: ignore[arg-type]
    assert not answer.success and why in answer.message
    assert pair.state.lead.control == Control()


def test_hand_over_is_in_the_decisions_by_name_and_in_the_state() -> None:
    """Told to all: who asked, who gave, who holds control now."""
    pair = held()
    assert pair.control("ASK", "foreman", session="2").success
    view = state_view(SETUP, pair.state, pair.now)
    assert (view.holder, view.asker) == ("fitter 1", "foreman 2")
    assert view.answer_left == pytest.approx(SETUP.config.control.answer_ms * 1e-3)
    assert pair.control("GIVE", "fitter", session="1").success
    view = state_view(SETUP, pair.state, pair.now)
    assert (view.holder, view.asker, view.answer_left) == ("foreman 2", "", 0.0)
    told = [(each.trigger, each.who) for each in pair.decisions()[-3:]]
    assert told == [
        ("CONTROL_TAKEN", "fitter 1"),
        ("CONTROL_ASKED", "foreman 2"),
        ("CONTROL_GIVEN", "fitter 1"),
    ]


def test_control_changes_neither_mode_nor_motion() -> None:
    """Hands change while the pair moves, and it goes on."""
    pair = held()
    pair.operate("MOVE_JOINTS", target=OTHER, person="fitter", session="1")
    pair.run(0.2)
    before = pair.mode
    pair.control("RELEASE", "fitter", session="1")
    pair.control("TAKE", "foreman")
    assert pair.mode is before is Mode.OPERATOR_LEADS


def test_buttons_are_greyed_by_the_mode_and_not_by_who_holds_control() -> None:
    """The list is one for all pages; who holds control stands beside it."""
    free: Callable[[Pair], dict[str, str]] = lambda pair: refusals(SETUP, pair.state, pair.now)  # noqa: E731
    pair = idle_pair()
    before = free(pair)
    pair.control("TAKE", "fitter", session="1")
    assert free(pair) == before


def test_decisions_are_numbered_without_a_gap() -> None:
    """Those about control are in the same row: a replay compares them all."""
    pair = held()
    pair.control("RELEASE", "fitter", session="1")
    made: list[Decided] = pair.decisions()
    assert [each.seq for each in made] == list(range(1, len(made) + 1))
